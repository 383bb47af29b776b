//! Rays of ambient occlusion: receivers at vertices, on lattices and on what coincides, along lattice directions.

use umbel::engine::{Above, Grouping, RaySample, Side};
use umbel::glam::{DMat3, DVec3};

use crate::Result;
use crate::subjects::coincident::ask::{
    hemispheres, open, open_alone, receivers_at, receivers_at_vertices, receivers_on,
};
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::{Mesh, rounded};

pub(crate) const COINCIDENCES: [Coincidence; 16] = [
    Coincidence { name: "open-rays lattice", query: |p| lattice(p, Grouping::Auto) },
    Coincidence { name: "open-rays lattice-by-origin", query: |p| lattice(p, Grouping::Origin) },
    Coincidence { name: "open-rays lattice-by-direction", query: |p| lattice(p, Grouping::Direction) },
    Coincidence { name: "open-rays at-vertices", query: |p| at_vertices(p, Grouping::Auto) },
    Coincidence { name: "open-rays at-vertices-by-origin", query: |p| at_vertices(p, Grouping::Origin) },
    Coincidence {
        name: "open-rays at-vertices-by-direction",
        query: |p| at_vertices(p, Grouping::Direction),
    },
    Coincidence { name: "open-rays at-vertices-own", query: at_vertices_alone },
    Coincidence { name: "open-rays at-block-vertices", query: at_block_vertices },
    Coincidence { name: "open-rays on-blocks", query: on_blocks },
    Coincidence { name: "open-rays room", query: room },
    Coincidence { name: "open-rays room-round-reach", query: room_with_reach },
    Coincidence {
        name: "open-rays two-sided",
        query: |p| layers(scenes::two_sided(40, p), p, Grouping::Auto),
    },
    Coincidence {
        name: "open-rays two-sided-by-origin",
        query: |p| layers(scenes::two_sided(40, p), p, Grouping::Origin),
    },
    Coincidence {
        name: "open-rays two-sided-by-direction",
        query: |p| layers(scenes::two_sided(40, p), p, Grouping::Direction),
    },
    Coincidence {
        name: "open-rays copies-4",
        query: |p| layers(scenes::copies(30, 4, p), p, Grouping::Auto),
    },
    Coincidence {
        name: "open-rays overlay-slanted",
        query: |p| layers(scenes::overlay(0.25, [30, 20], p), p, Grouping::Auto),
    },
];

/// 64 directions around +z; on a lattice they go to the corners of cubes.
fn directions(on_lattice: bool, turn: DMat3) -> Vec<RaySample> {
    let off = if on_lattice { DVec3::ZERO } else { DVec3::new(0.013, 0.027, 0.011) };
    let of = |k: u32| DVec3::new(f64::from(k % 8) - 3.5, f64::from(k / 8) - 3.5, 2.0) * 2.0 + off;
    (0..64).map(|k| RaySample::unlimited(turn * of(k))).collect()
}

/// What lies in +z, turned as rays are.
fn above(place: Place) -> Above {
    Above::Normal(rounded(place.of_rays() * DVec3::Z))
}

/// Receivers in the middle of blocks and above them, directions of the lattice.
fn lattice(place: Place, grouping: Grouping) -> Result<Query> {
    let turn = place.of_rays();
    let at =
        |k: u32| turn * DVec3::new(f64::from(k % 24) + 0.5, f64::from(k / 24) + 0.5, 0.5 + f64::from(k % 5));
    let receivers = hemispheres(receivers_at((0..576).map(at)), above(place));
    open(scenes::blocks(24).turned(place.of_mesh()), receivers, directions(true, turn), grouping)
}

/// Receivers at the vertices of waves, or a little above them.
fn on_waves(place: Place) -> (Mesh, Vec<umbel::engine::Hemisphere>) {
    let mesh = scenes::waves(60).turned(place.of_both());
    let receivers = receivers_at_vertices(&mesh, DVec3::Z * place.gap(1e-3));
    (mesh, hemispheres(receivers, above(place)))
}

fn at_vertices(place: Place, grouping: Grouping) -> Result<Query> {
    let (mesh, receivers) = on_waves(place);
    open(mesh, receivers, directions(false, place.of_both()), grouping)
}

fn at_vertices_alone(place: Place) -> Result<Query> {
    let (mesh, receivers) = on_waves(place);
    open_alone(mesh, receivers, directions(false, place.of_both()))
}

/// Receivers at the vertices of blocks, or beside them.
fn at_block_vertices(place: Place) -> Result<Query> {
    let mesh = scenes::blocks(12).turned(place.of_both());
    let receivers = hemispheres(receivers_at_vertices(&mesh, place.aside()), above(place));
    open(mesh, receivers, directions(false, place.of_both()), Grouping::Auto)
}

/// Receivers on the faces of blocks, directions of the lattice.
fn on_blocks(place: Place) -> Result<Query> {
    let mesh = scenes::blocks(12).turned(place.of_mesh());
    let receivers = hemispheres(receivers_on(&mesh, 2)?, Above::Side(Side::Front));
    open(mesh, receivers, directions(true, place.of_rays()), Grouping::Auto)
}

/// Receivers all over the floor of a room, or above it.
fn on_the_floor(place: Place) -> Vec<umbel::engine::Hemisphere> {
    let turn = place.of_rays();
    let at = |k: u32| {
        turn * (DVec3::new(f64::from(k % 64) / 8.0 - 4.0, 0.0, f64::from(k / 64) / 8.0 - 4.0) + place.aside())
    };
    let up = Above::Normal(rounded(turn * DVec3::Y));
    hemispheres(receivers_at((0..64 * 64).map(at)), up)
}

/// Directions around +y.
fn up(turn: DMat3) -> Vec<RaySample> {
    let of = |k: u32| DVec3::new(f64::from(k % 8) - 4.0, 3.0, f64::from(k / 8) - 4.0);
    (0..64).map(|k| RaySample::unlimited(turn * of(k))).collect()
}

fn room(place: Place) -> Result<Query> {
    let mesh = scenes::room().turned(place.of_both());
    open(mesh, on_the_floor(place), up(place.of_rays()), Grouping::Auto)
}

/// Rays that end where the ceiling or the table is.
fn room_with_reach(place: Place) -> Result<Query> {
    let reach = |(k, sample): (usize, RaySample)| {
        let height = if k % 2 == 0 { 1.0 } else { 3.2_f32 };
        RaySample { t_max: height / 3.0, ..sample }
    };
    let samples = up(place.of_rays()).into_iter().enumerate().map(reach).collect();
    open(scenes::room().turned(place.of_both()), on_the_floor(place), samples, Grouping::Auto)
}

/// Receivers on faces that coincide with others.
fn layers(mesh: Mesh, place: Place, grouping: Grouping) -> Result<Query> {
    let receivers = hemispheres(receivers_on(&mesh, 1)?, Above::Side(Side::Front));
    open(mesh, receivers, directions(false, place.of_both()), grouping)
}
