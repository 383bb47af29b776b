//! `umbel info`: what a scene has, and what the verbs would need.

use glam::DVec3;
use serde_json::{Map, Value, json};
use umbel::scene::info;
use umbel::{Error, Scene};

use crate::args::InfoArgs;
use crate::bake::vertices_forecast;
use crate::common::{Common, PathArg};
use crate::forecast::{HIT_BYTES, Rays};
use crate::memory::Room;
use crate::refusal::printable;
use crate::report::Times;
use crate::run::{load_scene, print};

/// Bytes of a pixel of a PNG, beside its hit.
const PICTURE_BYTES: u64 = 12 + 3;

/// `umbel info`.
pub(crate) fn info_scene(args: &InfoArgs, common: &Common) -> Result<(), Error> {
    let scene = load_scene(&args.scene, common, &mut Times::default())?;
    let found = info(&scene);
    let [lo, hi] = [found.bounds.lo, found.bounds.hi].map(|corner| in_frame_of_file(corner, &scene));
    let counts = [
        ("triangles", found.triangles),
        ("vertices", found.vertices),
        ("unused_vertices", found.unused_vertices),
        ("objects", found.objects),
        ("materials", found.materials),
        ("with_normals", found.with_normals),
        ("with_uvs", found.with_uvs),
        ("degenerate", found.degenerate),
        ("duplicates", found.duplicates),
        ("non_finite", found.non_finite),
    ];
    let pixels = 1280 * 720;
    let rays = Rays { pixels, rays: pixels, ray_bytes: 0, hit_bytes: HIT_BYTES };
    let picture =
        rays.bytes() + pixels * PICTURE_BYTES + rays.engine(found.triangles as u64, PathArg::Pencil);
    let memory = [("render", picture), ("bake_vertices", vertices_forecast(&scene)?)];
    let room = Room::beside(&scene);
    let memory = memory.map(|(verb, bytes)| (verb, room.with(bytes)));
    if args.json {
        let mut value = json!({ "schema": 1, "name": scene.name, "warnings": scene.warnings });
        for (name, count) in counts {
            value[name] = json!(count);
        }
        value["memory"] = Map::from_iter(memory.map(|(name, bytes)| (name.to_owned(), json!(bytes)))).into();
        value["offset"] = json!(scene.offset.to_array());
        value["bounds"] = if found.bounds.is_empty() { json!(null) } else { json!({ "lo": lo, "hi": hi }) };
        return print(&format!("{value:#}\n"));
    }
    let mut text = format!("{}\n", printable(&scene.name));
    for (name, count) in counts {
        text += &format!("  {:16} {count}\n", name.replace('_', " "));
    }
    if !found.bounds.is_empty() {
        let shown = |corner: &[Value; 3]| format!("[{}, {}, {}]", corner[0], corner[1], corner[2]);
        text += &format!("  bounds           {} to {}\n", shown(&lo), shown(&hi));
    }
    if scene.offset != DVec3::ZERO {
        text += &format!("  offset           {:?}\n", scene.offset.to_array());
    }
    let forecast =
        memory.map(|(name, bytes)| format!("{} {:.1} MB", name.replace('_', " --"), bytes as f64 / 1e6));
    text += &format!("  memory           {} for the whole process\n", forecast.join(", "));
    print(&text)
}

/// A place in the frame of the scene's file. Near the origin the number is that in f32, with its digits.
fn in_frame_of_file(place: [f32; 3], scene: &Scene) -> [Value; 3] {
    let offset = scene.offset.to_array();
    [0, 1, 2].map(|k| match offset[k] == 0.0 {
        true => json!(place[k]),
        false => json!(offset[k] + f64::from(place[k])),
    })
}
