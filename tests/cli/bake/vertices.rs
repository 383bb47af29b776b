//! Vertices through the command: exact 1 and 0, owners, normals, unused vertices.

use common::command::Place;
use common::place;

use super::{CUBE, FLOOR};

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("cube.obj", CUBE);
    place
}

/// The values of a bake of all vertices.
fn bake(place: &Place, line: &str) -> Vec<f32> {
    place.quiet_run(&format!("bake {line} --vertices -o a.npy"));
    place.npy("a.npy").f32()
}

const SETS: [&str; 3] = ["shared", "interleaved", "independent"];

#[test]
fn an_open_plane_is_one() {
    let place = place();
    for set in SETS {
        for weighting in ["cosine", "uniform"] {
            let line = format!("floor.obj --set {set} --weighting {weighting} --rays 200");
            assert_eq!(bake(&place, &line), [1.0; 5], "{line}");
            assert_eq!(bake(&place, &format!("{line} --polarity occlusion")), [0.0; 5], "{line}");
        }
    }
}

/// From outside a cube is convex: nothing occludes. From inside there is no way out.
#[test]
fn a_cube_from_outside_and_inside() {
    let place = place();
    let inward: String = CUBE
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    place.put("inward.obj", inward);
    for set in SETS {
        for weighting in ["cosine", "uniform"] {
            let with = format!("--set {set} --weighting {weighting} --rays 100");
            assert_eq!(bake(&place, &format!("cube.obj {with}")), [1.0; 8], "{with}");
            assert_eq!(bake(&place, &format!("inward.obj {with}")), [0.0; 8], "{with}");
        }
    }
    // Nearby nothing is hit but the neighbouring walls; as far as 300 % everything is.
    let near = bake(&place, "inward.obj --max-distance 0.05%");
    assert!(near.iter().all(|&value| value > 0.2 && value < 0.5), "a corner sees a quarter: {near:?}");
    assert_eq!(bake(&place, "inward.obj --max-distance 300%"), [0.0; 8]);
}

/// At the inside edge of two walls a vertex sees half of its hemisphere, whichever wall owns it.
#[test]
fn the_inside_edge_of_two_planes() {
    let place = place();
    place.put(
        "edge.obj",
        "v -900 0 0\nv 0 0 0\nv 900 0 0\nv 0 0 900\nv 0 900 0\nf 1 4 2\nf 2 4 3\nf 1 2 5\nf 2 3 5\n",
    );
    let value = bake(&place, "edge.obj --rays 4000")[1];
    assert!((value - 0.5).abs() < 0.01, "{value}");
}

/// The owner is the triangle with the largest angle, never one without area; a vertex of none has no value.
#[test]
fn owners_and_vertices_without() {
    let place = place();
    // Vertex 1: a needle that faces down, a wide triangle that faces up, and one without area. Below there is a floor.
    place.put(
        "owners.obj",
        "v 0 1 0\nv 9 1 0.1\nv 9 1 0\nv 1 1 -1\nv -1 1 -1\nv 5 5 5\nv 0 1 1\n\
         v -900 0 900\nv 900 0 900\nv 0 0 -900\n\
         f 1 7 7\nf 1 3 2\nf 1 4 5\nf 8 9 10\n",
    );
    let values = bake(&place, "owners.obj");
    assert_eq!(values.len(), 10);
    assert_eq!(values[0], 1.0, "the wide triangle faces up");
    assert!(values[5].is_nan() && values[6].is_nan(), "{values:?}");
    assert!(values[7..].iter().all(|&value| value > 0.95), "the floor is mostly open: {values:?}");
    place.quiet_run("bake owners.obj --vertices --bent b.npy");
    let bent = place.npy("b.npy");
    assert_eq!(bent.shape, [10, 3]);
    let bent = bent.f32();
    assert!(bent[15..21].iter().all(|x| x.is_nan()));
    assert!(bent[1] > 0.99, "up: {:?}", &bent[..3]);
}

/// The normals of the file weigh the rays and say which side is out.
#[test]
fn normals_of_the_file() {
    let place = place();
    let wall = "v 0 0 -900\nv 0 0 900\nv 0 900 900\nv 0 900 -900\nv 0.5 0 0\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
    let with = |normal: &str| format!("{wall}vn {normal}\nf 5//1 6//1 7//1\n");
    let mut values = Vec::new();
    for (name, normal) in [("up", "0 1 0"), ("leaning", "3 4 0"), ("down", "0 -2 0"), ("zero", "0 0 0")] {
        place.put(&format!("{name}.obj"), with(normal));
        values.push(bake(&place, &format!("{name}.obj --rays 1000"))[4]);
    }
    let [up, leaning, down, zero] = values[..] else { panic!("four values") };
    // The wall hides half of the upper hemisphere, and none of the lower one.
    assert!((up - 0.5).abs() < 0.02, "{up}");
    assert!(leaning > up + 0.15 && leaning < 0.95, "{leaning}");
    assert_eq!(down, 1.0, "the back of the triangle is out");
    assert_eq!(zero, up, "no normal is as none");
}

/// Faces within 30 degrees are smooth, others are not: a tetrahedral roof keeps the normals of its faces.
#[test]
fn smooth_and_sharp() {
    let place = place();
    // Two faces along the z axis, each so much steeper than level; the bent normal of the ridge is its normal.
    for (height, smooth) in [(0.2, true), (1.0, false)] {
        place.put(
            "roof.obj",
            format!("v 0 {height} 0\nv 0 {height} -4\nv -1 0 -2\nv 1 0 -2\nf 2 3 1\nf 1 4 2\n"),
        );
        place.quiet_run("bake roof.obj --vertices --bent b.npy --rays 4000 --set independent");
        let bent = place.npy("b.npy").f32();
        assert_eq!(bent[0].abs() < 0.05, smooth, "{height}: {bent:?}");
    }
}

#[test]
fn a_scene_without_triangles() {
    let place = place();
    place.put("points.obj", "v 1 2 3\nv 4 5 6\n");
    let run = place.run("bake points.obj --vertices -o a.npy --bent b.npy --dump-rays d.npy");
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(place.npy("a.npy").f32().iter().all(|value| value.is_nan()));
    assert_eq!(place.npy("b.npy").shape, [2, 3]);
    assert_eq!(place.npy("d.npy").shape, [0, 8]);
}
