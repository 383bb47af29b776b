//! Ambient occlusion of the vertices of a scene, as a PLY file that any mesh viewer shows in gray.
//!
//! `cargo run --release --example bake_vertices [SCENE]` writes `bake_vertices.ply`; occluders count up to a fifth of the
//! scene's diagonal, less the farther away they are.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::path::Path;

use umbel::bake::{Bake, BakeOptions, Falloff, Occluders, Reach};
use umbel::files::write_ply_mesh;
use umbel::glam::DVec3;
use umbel::{Error, Frame, LoadOptions, Options, load};

fn main() -> Result<(), Error> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "builtin:umbel:20000".to_owned());
    let scene = load(&name, LoadOptions::default())?;
    let bounds = scene.bounds();
    let [lo, hi] = [bounds.lo, bounds.hi].map(|p| DVec3::from_array(p.map(f64::from)));

    // The scene occludes itself, and stands on a ground.
    let mut occluders = Occluders::new(&scene);
    occluders.add_ground(DVec3::Y)?;
    let triangles = occluders.geometry()?;

    let reach = Reach { max_distance: 0.2 * (hi - lo).length(), falloff: Falloff::Linear, min_distance: 0.0 };
    let bake = Bake::new(BakeOptions { rays: 64, reach, ..BakeOptions::default() })?;
    let count = scene.positions.len();
    let receivers = scene.vertex_receivers()?.range(0..count);
    let found = bake.run(&triangles, &receivers, &mut Frame::new(), &Options::default())?;

    // Vertices that no triangle uses have no value.
    let mut values = vec![f32::NAN; count];
    receivers.indices.iter().zip(&found.values).for_each(|(&vertex, &value)| values[vertex as usize] = value);
    let mean = found.values.iter().sum::<f32>() / found.values.len().max(1) as f32;
    println!("{} vertices, {} rays, mean openness {mean:.3}", receivers.len(), found.rays);
    let mesh = (scene.positions.as_slice(), scene.triangles.as_slice(), scene.offset);
    write_ply_mesh(Path::new("bake_vertices.ply"), mesh, "openness", &values)
}
