//! The meshes: walls, rooms, blocks, cylinders, and what lies upon itself.

use std::f64::consts::TAU;

use umbel::glam::DVec3;

use crate::subjects::coincident::Place;
use crate::subjects::mesh::Mesh;

/// A wall of two triangles across z, at a coordinate whose distances are halfway between two f32.
pub(crate) fn wall() -> Mesh {
    let at = DVec3::new(-50.0, -50.0, f64::from(-2.2_f32));
    Mesh::quad(at, [DVec3::X * 100.0, DVec3::Y * 100.0], [1; 2])
}

/// A room on round numbers with a table and a shelf.
pub(crate) fn room() -> Mesh {
    let walls =
        Mesh::cuboid(DVec3::new(-4.0, 0.0, -4.0), DVec3::new(8.0, f64::from(3.2_f32), 8.0)).reversed();
    let table = Mesh::cuboid(DVec3::new(-1.0, 0.0, -2.0), DVec3::new(2.0, 1.0, 1.0));
    let shelf = Mesh::cuboid(DVec3::new(-4.0, 0.0, 1.0), DVec3::new(0.5, 2.0, 3.0));
    walls.and(table).and(shelf)
}

/// A city of n x n columns, unit squares of whole heights, up along z. Sides of neighbours lie in one plane.
pub(crate) fn blocks(n: u32) -> Mesh {
    let column = |k: u32| {
        let (i, j) = (k % n, k / n);
        let height = 1 + (i * 7 + j * 13 + i * j) % 5;
        Mesh::cuboid(DVec3::new(f64::from(i), f64::from(j), 0.0), DVec3::new(1.0, 1.0, f64::from(height)))
    };
    (0..n * n).map(column).fold(Mesh::default(), Mesh::and)
}

/// The same, of cubes with all their faces, so that each inner face is there twice.
pub(crate) fn cubes(n: u32) -> Mesh {
    let column = |k: u32| {
        let (i, j) = (k % n, k / n);
        let height = 1 + (i * 7 + j * 13 + i * j) % 5;
        (0..height)
            .map(|h| Mesh::cuboid(DVec3::new(f64::from(i), f64::from(j), f64::from(h)), DVec3::ONE))
            .fold(Mesh::default(), Mesh::and)
    };
    (0..n * n).map(column).fold(Mesh::default(), Mesh::and)
}

/// A wavy height field over [-1, 1]².
pub(crate) fn waves(n: u32) -> Mesh {
    let mut mesh = Mesh::quad(DVec3::new(-1.0, -1.0, 0.0), [DVec3::X * 2.0, DVec3::Y * 2.0], [n; 2]);
    for p in &mut mesh.positions {
        let [x, y, _] = p.map(f64::from);
        p[2] = (0.2 * (5.1 * x).sin() * (4.3 * y).cos() + 0.02 * (37.0 * x + 41.0 * y).sin()) as f32;
    }
    mesh
}

/// Waves with two sides: each face, followed by the same face turned over.
pub(crate) fn two_sided(n: u32, place: Place) -> Mesh {
    let back = waves(n).reversed().shifted(DVec3::NEG_Z * place.gap(1e-3));
    waves(n).interleaved(back).turned(place.of_both())
}

/// Waves that were exported so many times.
pub(crate) fn copies(n: u32, count: u32, place: Place) -> Mesh {
    let copy = |k: u32| waves(n).shifted(DVec3::NEG_Z * (place.gap(1e-3) * f64::from(k)));
    (0..count).map(copy).fold(Mesh::default(), Mesh::and).turned(place.of_both())
}

/// The same slanted rectangle so many times.
pub(crate) fn same_quads(count: u32, place: Place) -> Mesh {
    let quad = |k: u32| {
        let at = DVec3::new(-6.1, -4.3, -5.0 - place.gap(1e-3) * f64::from(k));
        Mesh::quad(at, [DVec3::new(13.0, 0.0, -2.3), DVec3::new(0.0, 9.7, 1.1)], [1; 2])
    };
    (0..count).map(quad).fold(Mesh::default(), Mesh::and).turned(place.of_both())
}

/// A floor of some slope under another tessellation of it.
pub(crate) fn overlay(slope: f64, parts: [u32; 2], place: Place) -> Mesh {
    let floor = |n| {
        let (along, up) = (DVec3::X * 16.0, DVec3::new(0.0, 16.0, 16.0 * slope));
        Mesh::quad(DVec3::new(-8.0, -8.0, -8.0 * slope), [along, up], [n; 2])
    };
    let under = floor(parts[1]).shifted(DVec3::NEG_Z * place.gap(1e-3));
    floor(parts[0]).and(under).turned(place.of_both())
}

/// The room with rectangles in the planes of a wall and of the floor.
pub(crate) fn decals(place: Place) -> Mesh {
    let gap = place.gap(1e-3);
    let decal = |k: u32| {
        let x = -3.0 + 0.75 * f64::from(k);
        let (wall, floor) = (DVec3::new(x, 0.5, gap - 4.0), DVec3::new(x, gap, 0.5));
        Mesh::quad(wall, [DVec3::X * 0.5, DVec3::Y * 2.0], [1; 2]).and(Mesh::quad(
            floor,
            [DVec3::Z * 2.0, DVec3::X * 0.5],
            [1; 2],
        ))
    };
    (0..8).map(decal).fold(room(), Mesh::and).turned(place.of_both())
}

/// Layers across z that are one step of f32 apart.
pub(crate) fn ulp_layers(count: u32, place: Place) -> Mesh {
    let layer = |k: u32| {
        let far = match place {
            Place::Apart => 5.3 + 1e-3 * f64::from(k),
            _ => f64::from(f32::from_bits(5.3_f32.to_bits() + k)),
        };
        Mesh::quad(DVec3::new(-8.0, -8.0, -far), [DVec3::X * 16.0, DVec3::Y * 16.0], [2; 2])
    };
    (0..count).map(layer).fold(Mesh::default(), Mesh::and).turned(place.of_both())
}

/// A lid of n slivers around the z-axis at z = 0, and the mantle of a cylinder below it.
pub(crate) fn cylinder(n: u32, length: f64) -> Mesh {
    let rim = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(n);
        DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    let round = |z: f64| (0..n).map(move |k| (rim(k) - DVec3::Z * z).as_vec3().to_array());
    let positions = std::iter::once([0.0; 3]).chain(round(0.0)).chain(round(length)).collect();
    let side = |k: u32| {
        let next = (k + 1) % n;
        [[0, 1 + k, 1 + next], [1 + k, 1 + n + k, 1 + n + next], [1 + k, 1 + n + next, 1 + next]]
    };
    Mesh { positions, triangles: (0..n).flat_map(side).collect() }
}

/// A machine part, symmetric in x and in y: a plate, a pipe upon it, and four bolts.
pub(crate) fn flange() -> Mesh {
    let bolt = |k: u32| {
        let [x, y] = [k % 2, k / 2].map(|side| 3.0 * f64::from(side) - 1.5);
        let mut bolt = cylinder(24, 1.0);
        for p in &mut bolt.positions {
            *p = [0.25 * p[0] + x as f32, 0.25 * p[1] + y as f32, p[2] + 0.5];
        }
        bolt
    };
    let plate = Mesh::cuboid(DVec3::new(-2.0, -2.0, -0.5), DVec3::new(4.0, 4.0, 0.5));
    let pipe = cylinder(128, 2.0).shifted(DVec3::Z * 2.0);
    (0..4).map(bolt).fold(plate.and(pipe), Mesh::and)
}

/// Stairs of unit steps, rising along y.
pub(crate) fn stairs(n: u32) -> Mesh {
    let step = |k: u32| {
        let at = DVec3::new(-4.0, f64::from(k), f64::from(k));
        Mesh::quad(at, [DVec3::X * 8.0, DVec3::Z], [1; 2]).and(Mesh::quad(
            at + DVec3::Z,
            [DVec3::X * 8.0, DVec3::Y],
            [1; 2],
        ))
    };
    (0..n).map(step).fold(Mesh::default(), Mesh::and)
}

/// Planes through the origin, in front of a wall at z = −9.
pub(crate) fn planes_through_origin() -> Mesh {
    let plane = |k: u32| {
        let x = f64::from(k) - 32.0;
        Mesh::quad(DVec3::new(x, -8.0, -8.0), [DVec3::new(-x / 2.0, 0.0, 4.0), DVec3::Y * 16.0], [1, 4])
    };
    let wall = Mesh::quad(DVec3::splat(-9.0), [DVec3::X * 18.0, DVec3::Y * 18.0], [8; 2]);
    (0..64).map(plane).fold(wall, Mesh::and)
}

/// Slanted planes that all cross in x = 0, z = −8.
pub(crate) fn crossing() -> Mesh {
    let plane = |k: u32| {
        let slope = f64::from(k) - 7.5;
        let at = DVec3::new(-8.0, -8.0, -8.0 - slope);
        Mesh::quad(at, [DVec3::new(16.0, 0.0, 2.0 * slope), DVec3::Y * 16.0], [1; 2])
    };
    (0..16).map(plane).fold(Mesh::default(), Mesh::and)
}

/// A flat square with n x n vertices at the centres of as many pixels, seen in [-1, 1]².
pub(crate) fn lattice(n: u32, z: f64) -> Mesh {
    let margin = 1.0 / f64::from(n);
    let (from, side) = (-1.0 - margin, 2.0 + 2.0 * margin);
    Mesh::quad(DVec3::new(from, from, z), [DVec3::X * side, DVec3::Y * side], [n + 1; 2])
}
