//! Ambient occlusion from outside: against formulas, against exact integers, and as files of the command.
//!
//! The scenes of the formulas are planes so large that their edges do not count, and a sphere on one of them.
//!
//! Based on: sections 5 (AO), 6 and 7 (`bake`) of the design.

mod formulas;
#[cfg(feature = "gltf")]
mod gltf;
mod interrupted;
mod layers;
mod maps;
mod occluders;
mod outputs;
mod points;
mod rays;
mod refusals;
mod sets;
mod texels;
mod vertices;

use common::command::Place;
use umbel::bake::{Bake, BakeOptions, BakeReceivers, Baked};
use umbel::engine::{Above, Hemisphere, Receiver};
use umbel::glam::DVec3;
use umbel::{Frame, NO_TRIANGLE, Options, Scene, TriangleId};

/// A floor of 20 x 20 at y = 0 that faces up, in four triangles around a fifth vertex.
const FLOOR: &str = "\
v -10 0 10
v 10 0 10
v 10 0 -10
v -10 0 -10
v 1 0 2
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
";

/// A ceiling above it at y = 1 that faces up too: rays from below meet it from behind.
const CEILING: &str = "\
v -1000 1 1000
v 1000 1 1000
v 1000 1 -1000
v -1000 1 -1000
f 1 2 3 4
";

/// A cube from −1 to 1 whose faces point outward.
const CUBE: &str = "\
v -1 -1 -1
v 1 -1 -1
v -1 1 -1
v 1 1 -1
v -1 -1 1
v 1 -1 1
v -1 1 1
v 1 1 1
f 1 3 4 2
f 5 6 8 7
f 1 2 6 5
f 3 7 8 4
f 1 5 7 3
f 2 4 8 6
";

/// A scene of quads, each in two triangles.
fn quads(quads: &[[[f32; 3]; 4]]) -> Scene {
    let positions = quads.iter().flatten().copied().collect();
    let triangles =
        (0..quads.len() as u32).flat_map(|k| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + 4 * k)));
    Scene { positions, triangles: triangles.collect(), ..Scene::default() }
}

/// Points with unit normals that lie on no triangle.
fn free_points(points: &[([f32; 3], DVec3)]) -> BakeReceivers {
    let mut receivers = BakeReceivers::default();
    for (index, &(point, normal)) in (0..).zip(points) {
        let normal = normal.to_array().map(|x| x as f32);
        let receiver = Receiver { point, triangle: TriangleId(NO_TRIANGLE) };
        receivers.push(Hemisphere { receiver, above: Above::Normal(normal) }, normal, index);
    }
    receivers
}

/// Bakes receivers of a scene.
fn run(scene: &Scene, receivers: &BakeReceivers, options: BakeOptions) -> Baked {
    let triangles = scene.geometry().expect("a valid scene");
    let bake = Bake::new(options).expect("valid options");
    bake.run(&triangles, receivers, &mut Frame::new(), &Options::default()).expect("in range")
}

/// The bytes of an NPY file of version 1.0.
fn npy(dtype: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let length = u16::try_from(header.len()).expect("a short header").to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

/// Rows of points as an NPY file of f4.
fn npy_points(rows: &[[f32; 6]]) -> Vec<u8> {
    let data: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    npy("<f4", &format!("{}, 6", rows.len()), &data)
}

/// Runs a bake with the most memory with which it takes its receivers in pieces. How much that is depends on what the program itself
/// takes: the limit comes down from the forecast of a run without one.
fn in_pieces(place: &Place, line: &str) {
    place.quiet_run(&format!("{line} --report r.json"));
    let forecast = place.json("r.json")["forecast_bytes"].as_u64().expect("a number");
    for part in 1..40 {
        let limit = forecast - part * forecast / 100;
        let run = place.run(&format!("{line} --report r.json --max-memory {limit}"));
        assert_eq!(run.code, Some(0), "umbel {line} --max-memory {limit}: {}", run.stderr);
        let report = place.json("r.json");
        let number = |name: &str| report["bake"][name].as_u64().expect("a number");
        if number("receivers") > number("receivers_at_once") {
            return;
        }
    }
    panic!("umbel {line}: never in pieces");
}
