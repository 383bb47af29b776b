//! Rays of any kind and segments: along lattices, at vertices, from vertices, upon each other.

use umbel::engine::{Film, Segment};
use umbel::glam::DVec3;
use umbel::{Origin, Path, Pencil, Ray};

use crate::Result;
use crate::subjects::coincident::ask::{any_of_rays, between, closest, closest_of_rays};
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::{Mesh, exact, rounded};

pub(crate) const COINCIDENCES: [Coincidence; 16] = [
    Coincidence {
        name: "closest-hit lattice",
        query: |p| closest_of_rays(city(p), lattice(p, 40_000), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit few-on-lattice",
        query: |p| closest_of_rays(city(p), lattice(p, 1_000), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit at-vertices",
        query: |p| closest_of_rays(city(p), at_vertices(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit from-vertices",
        query: |p| closest_of_rays(city(p), from_vertices(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit wall",
        query: |p| closest_of_rays(scenes::wall().turned(p.of_mesh()), head_on(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit mirrors",
        query: |p| closest_of_rays(scenes::room().turned(p.of_mesh()), mirrored(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit cubes",
        query: |p| closest_of_rays(scenes::cubes(16).turned(p.of_mesh()), lattice(p, 40_000), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit two-sided",
        query: |p| closest_of_rays(scenes::two_sided(60, p), upon(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit copies-4",
        query: |p| closest_of_rays(scenes::copies(40, 4, p), upon(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit overlay-slanted",
        query: |p| closest_of_rays(scenes::overlay(0.25, [48, 32], p), upon(p), Path::Pencil),
    },
    Coincidence {
        name: "closest-hit one-ulp-4",
        query: |p| closest_of_rays(scenes::ulp_layers(4, p), upon(p), Path::Pencil),
    },
    Coincidence {
        name: "general lattice",
        query: |p| closest_of_rays(city(p), lattice(p, 5_000), Path::General),
    },
    Coincidence { name: "any-hit lattice", query: |p| any_of_rays(city(p), lattice(p, 40_000)) },
    Coincidence { name: "blocked lattice", query: |p| between(city(p), segments(p)) },
    Coincidence { name: "scattered sun-on-lattice", query: |p| scattered(p, true) },
    Coincidence { name: "scattered eye-on-lattice", query: |p| scattered(p, false) },
];

fn city(place: Place) -> Mesh {
    scenes::blocks(32).turned(place.of_mesh())
}

/// A ray with an f32 origin, turned as rays are.
fn ray(place: Place, origin: DVec3, direction: DVec3) -> Ray {
    let turn = place.of_rays();
    Ray::new(exact(rounded(turn * origin)), turn * direction)
}

/// Rays from points of a lattice along its directions.
fn lattice(place: Place, count: u32) -> Vec<Ray> {
    let at = |k: u32| DVec3::new(f64::from(k % 33), f64::from(k / 33 % 33), 8.0);
    let along = |k: u32| DVec3::new(f64::from(k * 7 % 5) - 2.0, f64::from(k * 11 % 5) - 2.0, -2.0);
    (0..count).map(|k| ray(place, at(k), along(k / 5))).collect()
}

/// Rays from anywhere to vertices.
fn at_vertices(place: Place) -> Vec<Ray> {
    let to = |k: u32| DVec3::new(f64::from(k % 33), f64::from(k / 33 % 33), f64::from(k % 6));
    let from = |k: u32| DVec3::new(f64::from(k * 37 % 101) * 0.317, f64::from(k * 53 % 97) * 0.331, 9.0);
    (0..20_000).map(|k| ray(place, from(k), to(k) - exact(rounded(from(k))))).collect()
}

/// Rays from vertices to all sides.
fn from_vertices(place: Place) -> Vec<Ray> {
    let from = |k: u32| DVec3::new(f64::from(k % 33), f64::from(k / 33 % 33), f64::from(1 + k % 5));
    let along = |k: u32| {
        DVec3::new(
            f64::from(k * 37 % 101) - 49.7,
            f64::from(k * 53 % 97) - 47.9,
            f64::from(k * 29 % 89) - 43.3,
        )
    };
    (0..20_000).map(|k| ray(place, from(k), along(k))).collect()
}

/// Rays straight at a wall.
fn head_on(place: Place) -> Vec<Ray> {
    let at = |k: u32| DVec3::new(f64::from(k % 200) * 0.03 - 3.0, f64::from(k / 200) * 0.03 - 3.0, 5.0);
    (0..40_000).map(|k| ray(place, at(k), DVec3::NEG_Z)).collect()
}

/// Rays that a wall of the room has mirrored.
fn mirrored(place: Place) -> Vec<Ray> {
    let at = |k: u32| DVec3::new(f64::from(k % 200) / 25.0 - 3.98, f64::from(k / 200) / 64.0 + 0.01, -4.0);
    let along = |k: u32| (at(k) - DVec3::new(0.0, 1.5, 3.0)) * DVec3::new(1.0, 1.0, -1.0);
    (0..40_000).map(|k| ray(place, at(k), along(k))).collect()
}

/// Rays down upon layers.
fn upon(place: Place) -> Vec<Ray> {
    let at = |k: u32| DVec3::new(f64::from(k % 201) * 0.00873 - 0.9, f64::from(k / 201) * 0.00871 - 0.9, 1.0);
    let along = |k: u32| DVec3::new(0.3, 0.1 + f64::from(k % 3) * 0.1, -1.0);
    (0..40_000).map(|k| ray(place, at(k), along(k))).collect()
}

/// Segments between points of a lattice.
fn segments(place: Place) -> Vec<Segment> {
    let at = |k: u32| DVec3::new(f64::from(k % 33), f64::from(k * 7 % 33), f64::from(k % 7));
    let end = |k: u32| exact(rounded(place.of_rays() * at(k)));
    let segment = |k: u32| Segment { from: end(k * 31 + 7), to: end(k * 17 + 3), receiver: None };
    (0..20_000).map(segment).filter(|segment| segment.from != segment.to).collect()
}

/// Rays from a point or from infinity through a lattice, given one by one.
fn scattered(place: Place, from_infinity: bool) -> Result<Query> {
    let (turn, eye) = (place.of_rays(), DVec3::new(16.0, 16.0, 24.0));
    let at = |k: u32| DVec3::new(f64::from(k % 96) / 3.0, f64::from(k / 96) / 3.0, 2.0);
    let (origin, places) = if from_infinity {
        let start = |k: u32| DVec3::new(f64::from(k % 96) / 4.0 + 4.0, f64::from(k / 96) / 4.0 + 4.0, 20.0);
        (Origin::Infinity(turn * DVec3::NEG_Z), (0..96 * 96).map(|k| turn * start(k)).collect())
    } else {
        (Origin::Point(turn * eye), (0..96 * 96).map(|k| turn * (at(k) - eye)).collect())
    };
    closest(city(place), Pencil::new(origin, vec![Film::Scattered(places)])?)
}
