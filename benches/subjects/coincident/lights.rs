//! Points that a light sees or does not see: suns along axes, lights in planes, on edges and at vertices.

use umbel::Origin;
use umbel::glam::DVec3;

use crate::Result;
use crate::subjects::coincident::ask::{receivers_at, receivers_at_vertices, receivers_on, shadowed};
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::Mesh;

const LAMP: DVec3 = DVec3::new(0.4, 0.7, 1.5);

pub(crate) const COINCIDENCES: [Coincidence; 14] = [
    Coincidence {
        name: "light receivers-at-vertices",
        query: |p| at_vertices(p, Origin::Point(DVec3::new(16.0, 16.0, 30.0))),
    },
    Coincidence {
        name: "light in-planes",
        query: |p| on_blocks(p, Origin::Point(DVec3::new(16.0, 16.0, 6.0))),
    },
    Coincidence {
        name: "light at-vertex",
        query: |p| on_blocks(p, Origin::Point(DVec3::new(16.0, 16.0, 5.0))),
    },
    Coincidence {
        name: "light on-edge",
        query: |p| on_blocks(p, Origin::Point(DVec3::new(16.0, 16.5, 3.0))),
    },
    Coincidence {
        name: "light above-lattice",
        query: |p| above_lattice(p, Origin::Point(DVec3::new(16.0, 16.0, 24.0))),
    },
    Coincidence { name: "light room", query: room },
    Coincidence {
        name: "light two-sided",
        query: |p| layers(scenes::two_sided(60, p), p, Origin::Point(LAMP)),
    },
    Coincidence {
        name: "light copies-4",
        query: |p| layers(scenes::copies(40, 4, p), p, Origin::Point(LAMP)),
    },
    Coincidence {
        name: "light overlay-slanted",
        query: |p| layers(scenes::overlay(0.25, [48, 32], p), p, Origin::Point(LAMP * 4.0)),
    },
    Coincidence {
        name: "sun receivers-at-vertices",
        query: |p| at_vertices(p, Origin::Infinity(DVec3::NEG_Z)),
    },
    Coincidence { name: "sun along-axis", query: |p| on_blocks(p, Origin::Infinity(DVec3::NEG_Z)) },
    Coincidence { name: "sun along-diagonal", query: |p| on_blocks(p, Origin::Infinity(DVec3::NEG_ONE)) },
    Coincidence { name: "sun above-lattice", query: |p| above_lattice(p, Origin::Infinity(DVec3::NEG_Z)) },
    Coincidence {
        name: "sun two-sided",
        query: |p| layers(scenes::two_sided(60, p), p, Origin::Infinity(DVec3::new(0.3, 0.2, -1.0))),
    },
];

/// A light, turned as rays are.
fn turned(place: Place, light: Origin) -> Origin {
    match light {
        Origin::Point(p) => Origin::Point(place.of_rays() * p),
        Origin::Infinity(d) => Origin::Infinity(place.of_rays() * d),
    }
}

/// Receivers at the vertices of a city, or beside them.
fn at_vertices(place: Place, light: Origin) -> Result<Query> {
    let mesh = scenes::blocks(32).turned(place.of_both());
    let receivers = receivers_at_vertices(&mesh, place.aside());
    shadowed(mesh, turned(place, light), receivers)
}

/// Receivers on the faces of a city.
fn on_blocks(place: Place, light: Origin) -> Result<Query> {
    let mesh = scenes::blocks(32).turned(place.of_mesh());
    let receivers = receivers_on(&mesh, 2)?;
    shadowed(mesh, turned(place, light), receivers)
}

/// Receivers on a lattice, some of them inside of blocks.
fn above_lattice(place: Place, light: Origin) -> Result<Query> {
    let at = |k: u32| place.of_rays() * DVec3::new(f64::from(k % 128) / 4.0, f64::from(k / 128) / 4.0, 2.0);
    let receivers = receivers_at((0..128 * 128).map(at));
    shadowed(scenes::blocks(32).turned(place.of_mesh()), turned(place, light), receivers)
}

/// A lamp straight above the table, and receivers all over the room.
fn room(place: Place) -> Result<Query> {
    let mesh = scenes::room().turned(place.of_mesh());
    let receivers = receivers_on(&mesh, 800)?;
    shadowed(mesh, turned(place, Origin::Point(DVec3::new(0.0, 3.0, -2.0))), receivers)
}

/// Receivers on faces that coincide with others.
fn layers(mesh: Mesh, place: Place, light: Origin) -> Result<Query> {
    let receivers = receivers_on(&mesh, 2)?;
    shadowed(mesh, turned(place, light), receivers)
}
