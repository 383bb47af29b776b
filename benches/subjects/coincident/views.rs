//! Grid films: what a pinhole, a parallel view and a cube map see.

use umbel::glam::DVec3;

use crate::Result;
use crate::subjects::coincident::ask::{any, closest, cube, parallel, pinhole};
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::Mesh;

const SIZE: [u32; 2] = [640, 360];
/// Half of 60 degrees.
const HALF: f64 = 0.577_350_269;

pub(crate) const COINCIDENCES: [Coincidence; 39] = [
    Coincidence { name: "pinhole wall", query: |p| turned(scenes::wall(), p, (5.0, HALF)) },
    Coincidence { name: "pinhole room", query: |p| view(scenes::room(), p, DVec3::new(0.0, 1.6, 3.0)) },
    Coincidence {
        name: "pinhole stairs",
        query: |p| view(scenes::stairs(16), p, DVec3::new(0.0, 8.0, 24.0)),
    },
    Coincidence {
        name: "pinhole blocks",
        query: |p| view(scenes::blocks(32), p, DVec3::new(16.0, 16.0, 24.0)),
    },
    Coincidence { name: "pinhole cubes", query: |p| view(scenes::cubes(16), p, DVec3::new(8.0, 8.0, 16.0)) },
    Coincidence { name: "pinhole flange", query: |p| view(scenes::flange(), p, DVec3::Z * 6.0) },
    Coincidence { name: "pinhole fan", query: |p| view(scenes::cylinder(4000, 3.0), p, DVec3::Z * 2.0) },
    Coincidence { name: "pinhole pipe", query: |p| view(scenes::cylinder(512, 8.0), p, DVec3::NEG_Z) },
    Coincidence { name: "pinhole edge-on", query: |p| view(scenes::planes_through_origin(), p, DVec3::ZERO) },
    Coincidence { name: "pinhole crossing", query: |p| view(scenes::crossing(), p, DVec3::Z * 4.0) },
    Coincidence { name: "pinhole lattice", query: |p| lattice(p, false) },
    Coincidence {
        name: "pinhole eye-at-vertex",
        query: |p| view(scenes::blocks(16), p, DVec3::new(8.0, 8.0, 5.0)),
    },
    Coincidence {
        name: "pinhole eye-on-edge",
        query: |p| view(scenes::blocks(16), p, DVec3::new(8.0, 8.5, 5.0)),
    },
    Coincidence {
        name: "pinhole eye-in-planes",
        query: |p| view(scenes::room(), p, DVec3::new(-1.0, 1.0, 4.0)),
    },
    Coincidence {
        name: "pinhole same-quad-4",
        query: |p| layers(scenes::same_quads(4, p), p, (0.789, HALF)),
    },
    Coincidence {
        name: "pinhole same-quad-16",
        query: |p| layers(scenes::same_quads(16, p), p, (0.789, HALF)),
    },
    Coincidence { name: "pinhole two-sided", query: |p| layers(scenes::two_sided(100, p), p, (2.0, HALF)) },
    Coincidence {
        name: "pinhole two-sided-large",
        query: |p| layers(scenes::two_sided(12, p), p, (2.0, HALF)),
    },
    Coincidence { name: "pinhole copies-4", query: |p| layers(scenes::copies(60, 4, p), p, (2.0, HALF)) },
    Coincidence {
        name: "pinhole copies-4-large",
        query: |p| layers(scenes::copies(10, 4, p), p, (2.0, HALF)),
    },
    Coincidence {
        name: "pinhole overlay",
        query: |p| layers(scenes::overlay(0.0, [16, 8], p), p, (7.89, HALF)),
    },
    Coincidence {
        name: "pinhole overlay-slanted",
        query: |p| layers(scenes::overlay(0.25, [16, 8], p), p, (7.89, HALF)),
    },
    Coincidence {
        name: "pinhole overlay-thirds",
        query: |p| layers(scenes::overlay(0.3, [15, 7], p), p, (7.89, HALF)),
    },
    Coincidence {
        name: "pinhole overlay-fine",
        query: |p| layers(scenes::overlay(0.25, [96, 64], p), p, (7.89, HALF)),
    },
    Coincidence { name: "pinhole decals", query: |p| layers(scenes::decals(p), p, (3.03, HALF)) },
    Coincidence { name: "pinhole one-ulp-4", query: |p| layers(scenes::ulp_layers(4, p), p, (0.3, HALF)) },
    Coincidence { name: "pinhole one-ulp-16", query: |p| layers(scenes::ulp_layers(16, p), p, (0.3, HALF)) },
    Coincidence {
        name: "ortho wall",
        query: |p| {
            closest(
                scenes::wall().turned(p.of_mesh()),
                parallel(p.of_rays(), DVec3::new(0.0, 1.0, 5.0), 3.0, SIZE)?,
            )
        },
    },
    Coincidence {
        name: "ortho room",
        query: |p| {
            closest(
                scenes::room().turned(p.of_mesh()),
                parallel(p.of_rays(), DVec3::new(0.0, 1.0, 5.0), 5.0, SIZE)?,
            )
        },
    },
    Coincidence { name: "ortho blocks-1-pixel", query: |p| blocks(p, 1, true) },
    Coincidence { name: "ortho blocks-3-pixels", query: |p| blocks(p, 3, true) },
    Coincidence { name: "ortho blocks-8-pixels", query: |p| blocks(p, 8, true) },
    Coincidence { name: "ortho blocks-diagonals", query: |p| blocks(p, 8, false) },
    Coincidence {
        name: "ortho prism",
        query: |p| {
            closest(
                scenes::cylinder(512, 8.0).turned(p.of_mesh()),
                parallel(p.of_rays(), DVec3::Z * 2.0, 1.25, [512; 2])?,
            )
        },
    },
    Coincidence { name: "ortho lattice", query: |p| lattice(p, true) },
    Coincidence {
        name: "ortho two-sided",
        query: |p| {
            closest(
                scenes::two_sided(100, p),
                parallel(p.of_both(), DVec3::new(0.013, 0.007, 2.0), 1.1, [512; 2])?,
            )
        },
    },
    Coincidence { name: "any-hit blocks", query: any_blocks },
    Coincidence {
        name: "cube room",
        query: |p| {
            closest(scenes::room().turned(p.of_mesh()), cube(p.of_rays(), DVec3::new(0.0, 2.0, 0.0), 256)?)
        },
    },
    Coincidence {
        name: "cube two-sided",
        query: |p| closest(scenes::two_sided(60, p), cube(p.of_both(), DVec3::new(0.1, 0.2, 0.7), 192)?),
    },
];

/// A mesh head-on from a distance.
fn turned(mesh: Mesh, place: Place, (z, half): (f64, f64)) -> Result<Query> {
    closest(mesh.turned(place.of_mesh()), pinhole(place.of_rays(), DVec3::new(0.0, 1.0, z), half, SIZE)?)
}

/// A mesh from an eye, 90 degrees high.
fn view(mesh: Mesh, place: Place, eye: DVec3) -> Result<Query> {
    closest(mesh.turned(place.of_mesh()), pinhole(place.of_rays(), eye, 1.0, [512; 2])?)
}

/// A mesh that coincides with itself, from an eye that coincides with nothing.
fn layers(mesh: Mesh, place: Place, (z, half): (f64, f64)) -> Result<Query> {
    closest(mesh, pinhole(place.of_both(), DVec3::new(0.123, 0.0456, z), half, SIZE)?)
}

/// Blocks of so many pixels, whose corners or diagonals are at the centres of pixels.
fn blocks(place: Place, pixels: u32, at_corners: bool) -> Result<Query> {
    const N: u32 = 32;
    let shift = if at_corners { 0.5 / f64::from(pixels) } else { 0.0 };
    let middle = f64::from(N) / 2.0 + shift;
    let film =
        parallel(place.of_rays(), DVec3::new(middle, middle, 20.0), f64::from(N) / 2.0, [N * pixels; 2])?;
    closest(scenes::blocks(N).turned(place.of_mesh()), film)
}

fn any_blocks(place: Place) -> Result<Query> {
    let film = parallel(place.of_rays(), DVec3::new(16.125, 16.125, 20.0), 16.0, [128; 2])?;
    any(scenes::blocks(32).turned(place.of_mesh()), film)
}

/// A flat grid with a vertex at the centre of each pixel.
fn lattice(place: Place, is_parallel: bool) -> Result<Query> {
    const N: u32 = 128;
    let (turn, mesh) = (place.of_rays(), place.of_mesh());
    if is_parallel {
        closest(scenes::lattice(N, 0.0).turned(mesh), parallel(turn, DVec3::Z, 1.0, [N; 2])?)
    } else {
        closest(scenes::lattice(N, -1.0).turned(mesh), pinhole(turn, DVec3::ZERO, 1.0, [N; 2])?)
    }
}
