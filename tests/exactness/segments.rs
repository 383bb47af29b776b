//! Segments against exact arithmetic: is the light seen from the point?
//!
//! `sides::segment_blocked` follows the words of the design in the oracle's integers and shares nothing with the engine.
//! Lights and points lie anywhere, and exactly on vertices, edges and planes of the scene.
//!
//! The longer run takes that many times as many scenes:
//!
//! ```text
//! UMBEL_SEGMENTS_TIMES=50 cargo test --release -p umbel --test exactness -- segments:: --nocapture
//! ```
//!
//! Based on: section 5 of the design, "Shadows".

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators;
use common::generators::meshes::{cube, is_closed, sphere, star, torus};
use common::generators::{KINDS, Kind, Mesh, widen};
use common::random::Random;
use common::sides;
use umbel::engine::Segment;
use umbel::engine::Side;
use umbel::engine::blocked;
use umbel::glam::DVec3;
use umbel::{Options, TriangleId};

/// How many times as much as usual.
fn times() -> usize {
    std::env::var("UMBEL_SEGMENTS_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// The engine's answer.
fn ask(mesh: &Mesh, segments: &[Segment]) -> Vec<bool> {
    let (answers, _) = blocked(&mesh.geometry(), segments, &Options::default()).expect("in range");
    assert_eq!(answers.len(), segments.len());
    answers
}

/// Compares with exact arithmetic; how many are blocked.
fn compare(mesh: &Mesh, segments: &[Segment]) -> usize {
    let answers = ask(mesh, segments);
    for (segment, &answer) in segments.iter().zip(&answers) {
        let Segment { from, to, receiver } = *segment;
        let triangles = (0..mesh.triangles.len()).map(|id| mesh.corners(id));
        let expected = sides::segment_blocked(triangles, receiver.map(|id| id.0), [from, to]);
        assert_eq!(answer, expected, "{segment:?}\n{mesh:?}");
    }
    answers.into_iter().filter(|&b| b).count()
}

/// An end: a feature of the scene, exactly where f64 allows it, or anywhere.
fn end(random: &mut Random, kind: Kind, mesh: &Mesh) -> DVec3 {
    match random.below(4) {
        0 | 1 => generators::on_grid(generators::feature(random, mesh)),
        _ => generators::eye(random, kind, mesh),
    }
}

/// Segments between ends of all kinds; some points name the triangle that they lie on, or any other.
fn random_segments(random: &mut Random, kind: Kind, mesh: &Mesh, count: usize) -> Vec<Segment> {
    let segment = |_| {
        let id = random.below(mesh.triangles.len());
        let from = end(random, kind, mesh);
        let (to, receiver) = match random.below(3) {
            0 => {
                let [a, b, c] = mesh.corners(id);
                (generators::on_grid(random.pick(&[a, (a + b) * 0.5, (a + b + c) / 3.0])), Some(id as u32))
            }
            1 => (end(random, kind, mesh), Some(id as u32)),
            _ => (end(random, kind, mesh), None),
        };
        Segment { from, to, receiver: receiver.map(TriangleId) }
    };
    (0..count).map(segment).collect()
}

fn run(kind: Kind, scenes: usize) {
    let mut random = Random(kind as u64);
    let (mut total, mut count) = (0, 0);
    for _ in 0..scenes * times() {
        let most = random.pick(&[1, 4, 16, 60]);
        let mesh = generators::scene(&mut random, kind, most);
        let segments = random_segments(&mut random, kind, &mesh, 60);
        count += compare(&mesh, &segments);
        total += segments.len();
    }
    println!("{kind:?}: {total} segments, {count} blocked, no mismatch");
    assert!(count * 50 > total, "{kind:?}: {count} of {total}");
}

#[test]
fn lattices() {
    run(Kind::Lattice, 1000);
}

#[test]
fn mixed_scales() {
    run(Kind::Mixed, 150);
}

#[test]
fn other_scenes() {
    for kind in KINDS {
        if kind != Kind::Lattice && kind != Kind::Mixed {
            run(kind, 300);
        }
    }
}

/// Hundreds of triangles, so that the recursion culls and splits.
#[test]
fn large_scenes() {
    let mut random = Random(11);
    let mut count = 0;
    for round in 0..30 * times() {
        let kind = KINDS[round % KINDS.len()];
        let mesh = generators::scene(&mut random, kind, 600);
        let segments = random_segments(&mut random, kind, &mesh, if kind == Kind::Mixed { 10 } else { 60 });
        count += compare(&mesh, &segments);
    }
    assert!(count > 100, "{count}");
}

/// The ends swap without changing the answer where nothing is in doubt; the receiver never blocks.
#[test]
fn a_receiver_does_not_block() {
    let wall = [[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]].map(DVec3::from_array);
    let mesh = Mesh::of([wall, wall.map(|p| p + DVec3::Z * 2.0)]);
    let segment = |from: DVec3, to: DVec3, receiver: Option<u32>| {
        let segment = Segment { from, to, receiver: receiver.map(TriangleId) };
        assert_eq!(compare(&mesh, &[segment]) > 0, ask(&mesh, &[segment])[0]);
        ask(&mesh, &[segment])[0]
    };
    let (below, above) = (DVec3::Z * -1.0, DVec3::Z);
    assert!(segment(below, above, None) && segment(above, below, None));
    assert!(!segment(below, above, Some(0)) && segment(below, above, Some(1)));
    // Through both walls: one receiver leaves the other.
    let far = DVec3::Z * 3.0;
    assert!(segment(below, far, Some(0)) && segment(below, far, Some(1)));
    // Ends exactly on the plane, inside, on an edge, on a vertex.
    for on in [DVec3::ZERO, DVec3::new(1.0, -1.0, 0.0), wall[0], wall[1]] {
        for other in [below, above, DVec3::ZERO, DVec3::new(0.5, 0.5, 0.0)] {
            assert!(!segment(on, other, None) && !segment(other, on, None));
        }
    }
}

/// Nothing beyond an end blocks, however near: one ulp past the point or before the light.
#[test]
fn nothing_beyond_the_ends_blocks() {
    let mut random = Random(12);
    for exponent in (-30..=30).step_by(3) {
        let scale = 10_f64.powi(exponent);
        for _ in 0..60 * times() {
            let ends = [(); 2].map(|()| (random.cube() * scale).to_array().map(|x| x as f32));
            let axis = random.below(3);
            let side = |k: usize| ends[k][axis] < ends[1 - k][axis];
            // A wall across the axis, k ulp outward (or inward) of an end.
            let wall = |end: usize, outward: bool| {
                let x = ends[end][axis];
                let x = if side(end) == outward { x.next_down() } else { x.next_up() };
                let corner = |s: f64, t: f64| {
                    let mut p = DVec3::ZERO;
                    p[axis] = f64::from(x);
                    p[(axis + 1) % 3] = s * scale;
                    p[(axis + 2) % 3] = t * scale;
                    p
                };
                [corner(-9.0, -9.0), corner(9.0, -9.0), corner(0.0, 9.0)]
            };
            let segment = Segment { from: widen(ends[0]), to: widen(ends[1]), receiver: None };
            let outside = Mesh::of([wall(0, true), wall(1, true)]);
            assert_eq!(compare(&outside, &[segment]), 0, "{segment:?}");
            for end in [0, 1] {
                assert_eq!(compare(&Mesh::of([wall(end, false)]), &[segment]), 1, "{segment:?}");
            }
        }
    }
}

/// Every way out of a closed mesh is blocked, in both directions: also through vertices and edges.
#[test]
fn closed_meshes_block() {
    let mut random = Random(13);
    let mut total = 0;
    let meshes =
        [cube(1), cube(8), sphere(3, |_| 1.0), sphere(5, |_| 1.0), star(2, 5), star(4, 2), torus(32, 8)];
    for mesh in meshes {
        assert!(is_closed(&mesh));
        let inside = if mesh.positions.len() == 256 { DVec3::X } else { DVec3::ZERO };
        let mut segments = Vec::new();
        for id in (0..mesh.triangles.len()).cycle().take(4000 * times()) {
            let [a, b, c] = mesh.corners(id);
            let flat = random.pick(&[DVec3::ONE, DVec3::X, DVec3::Y]);
            let from = inside + random.cube() * flat * random.pick(&[0.0, 1e-9, 0.1]);
            // Twice as far as a vertex, an edge or a centroid: exact from the origin.
            let target = random.pick(&[a, b, (a + b) * 0.5, (b + c) * 0.5, (a + b + c) / 3.0]);
            let to = from + (target - from) * 16.0;
            segments.push(Segment { from, to, receiver: None });
            segments.push(Segment { from: to, to: from, receiver: None });
        }
        assert!(ask(&mesh, &segments).iter().all(|&b| b), "{} triangles", mesh.triangles.len());
        compare(&mesh, &segments[..200]);
        total += segments.len();
    }
    println!("closed meshes: {total} segments, none gets out");
}

/// A light exactly on a surface, an edge, a vertex: it does not shadow itself, and the other surfaces do.
#[test]
fn lights_on_surfaces() {
    let mut random = Random(14);
    for mesh in [cube(4), sphere(2, |_| 1.0)] {
        let mut segments = Vec::new();
        for _ in 0..600 * times() {
            let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()));
            let light = random.pick(&[a, (a + b) * 0.5, (b + c) * 0.5, a * 0.5 + b * 0.25 + c * 0.25]);
            let other = mesh.corners(random.below(mesh.triangles.len()));
            let (near, far) = (random.cube() * 0.5, random.cube() * 4.0);
            let to = random.pick(&[other[0], (other[1] + other[2]) * 0.5, near, far]);
            segments.push(Segment { from: light, to, receiver: None });
        }
        let count = compare(&mesh, &segments);
        assert!(count > 50 && count < segments.len() - 50, "{count}");
    }
}

/// The side of a plane that a light lies on: that of the oracle, also for points exactly in the plane.
#[test]
fn sides_of_points() {
    let mut random = Random(15);
    for kind in KINDS {
        let mut count = [0; 3];
        for _ in 0..40 * times() {
            let mesh = generators::scene(&mut random, kind, 20);
            let geometry = mesh.geometry();
            for _ in 0..40 {
                let id = random.below(mesh.triangles.len());
                let point = end(&mut random, kind, &mesh);
                let (side, expected) = match sides::side(mesh.corners(id), point) {
                    1 => (0, Some(Side::Front)),
                    -1 => (1, Some(Side::Back)),
                    _ => (2, None),
                };
                count[side] += 1;
                let got = geometry.side_of(TriangleId(id as u32), point);
                assert_eq!(got, expected, "{point:?} {:?}", mesh.corners(id));
            }
        }
        assert!(count.iter().all(|&n| n > 5), "{kind:?}: {count:?}");
    }
}
