//! Surfaces on demand at the extremes: what rays see of them is what the oracle sees of all their micropolygons, those close,
//! and every run ends, also where positions in f32 step by many pixels.

use std::collections::HashMap;

use common::generators::Mesh;
use umbel::engine::{Dicing, Film, GridFilm, OnDemand, Rays, closest_hit_on_demand, dice_all};
use umbel::glam::DVec3;
use umbel::scene::Creases;
use umbel::surfaces::{DisplacedMesh, Displacement, Noise, Relief, SubdivisionSurface};
use umbel::{NO_TRIANGLE, Options, Origin, Path, Pencil, Scene};

use super::table::{Row, isas};

/// What of a cube ±1 is put where.
#[derive(Clone, Copy)]
struct Place {
    offset: [f64; 3],
    scale: f64,
}

const HERE: Place = Place { offset: [0.0; 3], scale: 1.0 };

/// A cube of quads; the numbers of a shifted one are rounded to f32.
fn cage(place: Place) -> Scene {
    let at = |vertex: usize| {
        [0, 1, 2].map(|k| {
            let side = if vertex >> k & 1 == 0 { -1.0 } else { 1.0 };
            (side * place.scale + place.offset[k]) as f32
        })
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Scene {
        positions: (0..8).map(at).collect(),
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        face_corners: vec![4; 6],
        ..Scene::default()
    }
}

/// A camera at so many sizes of the cube from its middle, that looks there.
fn camera(place: Place, eye: [f64; 3], zoom: f64, [width, height]: [u32; 2]) -> Pencil {
    let eye = DVec3::from_array(eye);
    let forward = if eye == DVec3::ZERO { DVec3::NEG_Z } else { -eye.normalize() };
    let right = forward.cross(DVec3::Y).normalize();
    let half = 1.0 / (zoom * f64::from(width));
    let film = GridFilm::new(width, height, forward, right * half, right.cross(forward) * half);
    let eye = (eye * place.scale + DVec3::from_array(place.offset)).to_array().map(|x| f64::from(x as f32));
    let films = vec![Film::Grid(film.expect("a film"))];
    Pencil::new(Origin::Point(DVec3::from_array(eye)), films).expect("rays in range")
}

/// Whether every edge and its opposite cancel.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for corners in &mesh.triangles {
        let at = corners.map(|v| mesh.positions[v as usize].map(|x| (x + 0.0).to_bits()));
        for [from, to] in [[at[0], at[1]], [at[1], at[2]], [at[2], at[0]]] {
            let (ends, sign) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *edges.entry(ends).or_default() += sign;
        }
    }
    edges.values().all(|&sum| sum == 0)
}

/// Compares what the rays see of a closed surface, on every path and instruction set, with its micropolygons and the oracle.
fn compare<S: OnDemand>(row: &mut Row, surface: &S, pencil: &Pencil, shading_rate: f64) {
    let dicing = Dicing { shading_rate, ..Dicing::default() };
    let diced = dice_all(surface, pencil, &dicing).expect("triangles");
    let mesh = Mesh { positions: diced.positions().to_vec(), triangles: diced.indices().to_vec() };
    assert!(is_closed(&mesh), "open edges");
    let seen = row.compare(&mesh, Rays::Pencil(pencil), 60);
    let ways =
        isas().into_iter().map(|isa| (Path::Pencil, isa)).chain([(Path::General, umbel::engine::Isa::Auto)]);
    for (path, isa) in ways {
        let options = Options { path, isa, ..Options::default() };
        let (hits, _) = closest_hit_on_demand(surface, pencil, &dicing, &options).expect("an answer");
        for ray in 0..pencil.len() {
            let expected = seen.get(ray).map(|hit| (diced.surfaces()[hit.id.0 as usize], hit.t));
            let found = (hits.ids()[ray] != NO_TRIANGLE).then(|| (hits.ids()[ray], hits.ts()[ray]));
            if found != expected {
                row.mismatch(|| format!("on demand, {path:?} {isa:?} ray {ray}: {found:?}, {expected:?}"));
            }
        }
    }
}

/// A smooth surface and a rough one at some places, from beside, from within and from afar.
fn row(name: &'static str, places: &[Place]) {
    let mut row = Row::new(name);
    for &place in places {
        let scene = cage(place);
        let noise = Noise { octaves: 2, ..Noise::new(1.5 / place.scale, 3) };
        let rough = Displacement { relief: Relief::Noise(noise), height: 0.1 * place.scale };
        let smooth = SubdivisionSurface::new(&scene, &Creases::default(), Displacement::NONE);
        let rough = DisplacedMesh::new(&scene, rough);
        for (eye, zoom) in [([3.0, 2.0, 4.0], 2.0), ([0.0; 3], 0.8), ([300.0, 200.0, 400.0], 200.0)] {
            let pencil = camera(place, eye, zoom, [40, 30]);
            compare(&mut row, &smooth, &pencil, 0.5);
            compare(&mut row, &rough, &pencil, 0.5);
        }
    }
    row.finish();
}

#[test]
fn far_from_the_origin() {
    let at = |offset: [f64; 3]| Place { offset, ..HERE };
    row("Reyes: cages of 2 at 1e3 to 1e5", &[at([1e3; 3]), at([-1e4, 1e4, 1e3]), at([1e5; 3])]);
    row("Reyes: cages of 2 at 1e6", &[at([1e6; 3]), at([1e6, 0.0, 0.0]), at([0.0, -1e6, 1e3])]);
    row("Reyes: cages of 2 at 1e7", &[at([1e7; 3]), at([0.0, 0.0, 1e7]), at([1e7, 1e7, 0.0])]);
    let far = |x: f64| Place { offset: [x; 3], scale: x * 1e-7 };
    row("Reyes: cages of 100 at 1e9", &[far(1e9), Place { offset: [1e9, 0.0, 0.0], scale: 100.0 }]);
}

#[test]
fn tiny_and_huge() {
    let of = |scale: f64| Place { scale, ..HERE };
    row("Reyes: cages of 1e-37 to 1e-20", &[of(1e-37), of(1e-30), of(1e-20)]);
    row("Reyes: cages of 1e20 to 1e35", &[of(1e20), of(1e30), of(1e35)]);
    // Even the smallest numbers are too coarse for the pixels.
    row("Reyes: cages of subnormal numbers", &[of(1e-43), of(3e-42)]);
}

#[test]
fn the_finest_and_the_coarsest() {
    let mut row = Row::new("Reyes: micropolygons of 1/64 to 4096 pixels");
    let smooth = SubdivisionSurface::new(&cage(HERE), &Creases::default(), Displacement::NONE);
    for (rate, size) in [(1.0 / 64.0, [12, 9]), (64.0, [64, 48]), (4096.0, [64, 48])] {
        compare(&mut row, &smooth, &camera(HERE, [3.0, 2.0, 4.0], 2.0, size), rate);
    }
    row.finish();
}

/// Pixels so narrow and so far away that f64 cannot place a point on the film: the exact stage decides.
#[test]
fn through_a_telescope() {
    let mut row = Row::new("Reyes: cages of 2 from 1e9 away, pixels of 1e-11 radians");
    let smooth = SubdivisionSurface::new(&cage(HERE), &Creases::default(), Displacement::NONE);
    for at in [[1e9, 1e9, 1e9], [0.0, 3e8, 1e9]] {
        compare(&mut row, &smooth, &camera(HERE, at, 1e9, [64, 48]), 0.5);
    }
    row.finish();
}

/// A cage without extent is a point: there is nothing to see, and that is found at once.
#[test]
fn of_one_point() {
    for offset in [[0.0; 3], [1e6; 3], [1e30; 3]] {
        let scene = cage(Place { offset, scale: 0.0 });
        let smooth = SubdivisionSurface::new(&scene, &Creases::default(), Displacement::NONE);
        let pencil = camera(Place { offset, scale: offset[0].max(1.0) }, [3.0, 2.0, 4.0], 2.0, [64, 48]);
        let (hits, stats) = closest_hit_on_demand(&smooth, &pencil, &Dicing::default(), &Options::default())
            .expect("an answer");
        assert!(hits.ids().iter().all(|&id| id == NO_TRIANGLE));
        assert!(stats.surfaces_split < 1000, "{stats:?}");
    }
}
