//! What a grid film decides once for many rays, against the oracle ray by ray: the relation of two triangles on a tile, copies that are
//! left out, edge functions on lattices, planes seen edge-on.
//!
//! Scenes are a few large triangles, so that blocks of rays have one relation; films are larger than a tile.

use common::generators::Mesh;
use umbel::engine::{Film, GridFilm, Rays, Side};
use umbel::glam::{DMat3, DVec3};
use umbel::{Origin, Pencil, TriangleId};

use crate::exact::compare;

/// The two triangles of a parallelogram.
fn quad(at: DVec3, u: DVec3, v: DVec3) -> [[DVec3; 3]; 2] {
    [[at, at + u, at + u + v], [at, at + u + v, at + v]]
}

/// A parallelogram in n x n parts.
fn parts(at: DVec3, u: DVec3, v: DVec3, n: u32) -> Vec<[DVec3; 3]> {
    let side = 1.0 / f64::from(n);
    (0..n * n)
        .flat_map(|k| {
            let [i, j] = [k % n, k / n].map(|k| f64::from(k) * side);
            quad(at + u * i + v * j, u * side, v * side)
        })
        .collect()
}

/// Views of a mesh along −z: from eyes with few bits and with many, and from infinity.
fn see(mesh: &Mesh, turn: DMat3) {
    let [right, up] = [turn * DVec3::X, turn * DVec3::Y].map(|v| v / 48.0);
    for eye in [DVec3::ZERO, DVec3::new(0.1, 0.2, 0.3), DVec3::new(1e-9, 3e-7, 1.0 / 3.0)] {
        let film = GridFilm::new(80, 70, turn * DVec3::NEG_Z, right, up).expect("a film");
        let pencil = Pencil::new(Origin::Point(turn * eye), vec![Film::Grid(film)]).expect("in range");
        compare(mesh, Rays::Pencil(&pencil));
    }
    for middle in [DVec3::Z, DVec3::new(0.1, 0.2, 0.3)] {
        let film = GridFilm::new(80, 70, turn * middle, right * 4.0, up * 4.0).expect("a film");
        let origin = Origin::Infinity(turn * DVec3::NEG_Z);
        compare(mesh, Rays::Pencil(&Pencil::new(origin, vec![Film::Grid(film)]).expect("in range")));
    }
}

/// As it is, and turned so that what coincided is off by roundings.
fn see_turned(triangles: &[[DVec3; 3]]) {
    let axis = DVec3::new(1.0, 2.0_f64.sqrt(), 3.0_f64.sqrt()).normalize();
    for turn in [DMat3::IDENTITY, DMat3::from_axis_angle(axis, 0.7)] {
        see(&Mesh::of(triangles.iter().map(|corners| corners.map(|p| turn * p))), turn);
    }
}

#[test]
fn layers_with_other_tessellations() {
    for slope in [0.0, 0.25, 0.3] {
        let (at, u, v) = (DVec3::new(-8.0, -8.0, -4.0), DVec3::X * 16.0, DVec3::new(0.0, 16.0, 16.0 * slope));
        see_turned(&[parts(at, u, v, 3), parts(at, u, v, 2)].concat());
        see_turned(&[parts(at, u, v, 2), parts(at, u, v, 3)].concat());
    }
}

#[test]
fn layers_one_step_apart() {
    let layer = |k: u32| {
        let z = -f64::from(f32::from_bits(5.3_f32.to_bits() + (k * 7 % 4)));
        quad(DVec3::new(-8.0, -8.0, z), DVec3::X * 16.0, DVec3::Y * 16.0)
    };
    see_turned(&(0..4).flat_map(layer).collect::<Vec<_>>());
}

#[test]
fn planes_that_cross() {
    let plane = |k: u32| {
        let slope = f64::from(k) - 1.5;
        let at = DVec3::new(-8.0, -8.0, -8.0 - slope);
        quad(at, DVec3::new(16.0, 0.0, 2.0 * slope), DVec3::new(0.0, 16.0, slope))
    };
    see_turned(&(0..4).flat_map(plane).collect::<Vec<_>>());
}

/// Copies, with corners in another order and turned over, between which other faces lie.
#[test]
fn copies_in_any_order() {
    let face = |k: u32| {
        let at = DVec3::new(-6.1, -4.3 + 0.3 * f64::from(k % 2), -5.0);
        quad(at, DVec3::new(13.0, 0.0, -2.3), DVec3::new(0.0, 9.7, 1.1))
    };
    let turned = |[a, b, c]: [DVec3; 3], k: u32| match k % 3 {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, b, a],
    };
    let triangles = (0..6).flat_map(|k| face(k).map(|corners| turned(corners, k)));
    see_turned(&triangles.collect::<Vec<_>>());
}

/// Vertices, edges and diagonals at the centres of pixels, with others in between.
#[test]
fn lattices() {
    let at = DVec3::new(-1.0, -1.0, -1.0);
    let (u, v) = (DVec3::X * 2.0, DVec3::Y * 2.0);
    see_turned(&[parts(at, u, v, 8), parts(at * 1.5, u * 1.5, v * 1.5, 6)].concat());
}

/// Walls across axes through the eye, and along the rays.
#[test]
fn walls_edge_on() {
    let wall = |x: f64| quad(DVec3::new(x, -4.0, -6.0), DVec3::Y * 8.0, DVec3::Z * 8.0);
    let floor = |y: f64| quad(DVec3::new(-4.0, y, -6.0), DVec3::X * 8.0, DVec3::Z * 8.0);
    let faces = [wall(0.0), floor(0.0), wall(0.25), floor(-0.5), wall(f64::from(0.1_f32))];
    let back = quad(DVec3::new(-4.0, -4.0, -6.0), DVec3::X * 8.0, DVec3::Y * 8.0);
    see_turned(&faces.into_iter().chain([back]).flatten().collect::<Vec<_>>());
}

/// Directions that no ray may have: told without a panic, and as the oracle has it where they are numbers.
#[test]
fn sides_toward_any_direction() {
    let corners = [DVec3::ZERO, DVec3::new(1.0, 0.0, 1e-30_f32.into()), DVec3::new(0.0, 1.0, 0.25)];
    let mesh = Mesh::of([corners]);
    let triangles = mesh.geometry();
    let seen = [0, 1, 2].map(|k| DVec3::from_array(mesh.positions[k].map(f64::from)));
    for size in [5e-324, 1e-300, 1e-100, 1.0, 1e100, 1e300, f64::MAX] {
        for direction in
            [DVec3::Z, DVec3::new(0.3, -0.7, 0.1), DVec3::new(-0.5, 1.0, 0.25), DVec3::new(0.0, 1.0, 0.25)]
        {
            let direction = direction * size;
            let expected = match common::sides::facing(seen, direction) {
                1 => Some(Side::Front),
                -1 => Some(Side::Back),
                _ => None,
            };
            assert_eq!(triangles.side_toward(TriangleId(0), direction), expected, "{direction}");
        }
    }
    let mixed = DVec3::new(1e300, 1e-300, -5e-324);
    for direction in [DVec3::NAN, DVec3::INFINITY, DVec3::ZERO, DVec3::new(f64::NAN, 1.0, 1.0)] {
        assert_eq!(triangles.side_toward(TriangleId(0), direction), None);
    }
    assert_eq!(triangles.side_toward(TriangleId(0), mixed), Some(Side::Back));
}
