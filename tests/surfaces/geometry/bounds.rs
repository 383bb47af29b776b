//! Bounds never cut off a point: of any surface, over any part.

use common::random::Random;
use proptest::prelude::*;
use umbel::engine::{Aabb, Detail, Dicing, Domain, Film, GridFilm, Isa, OnDemand};
use umbel::glam::DVec3;
use umbel::scene::Creases;
use umbel::surfaces::{
    DisplacedMesh, Displacement, Field, HeightMap, Noise, Relief, SubdivisionSurface, Terrain,
};
use umbel::{Origin, Pencil};

use super::meshes::{cube, house, sheet, sphere, star, tangle};
use super::patches::teapot;
use super::{domain, holds, patches, points_for};

/// Reliefs of all kinds.
pub(crate) fn displacements() -> Vec<Displacement> {
    let mut random = Random(5);
    let heights: Vec<f32> = (0..35).map(|_| random.unit() as f32).collect();
    let relief = |relief: Relief, height: f64| Displacement { relief, height };
    vec![
        Displacement::NONE,
        relief(Relief::Map(HeightMap::new(7, &heights)), 0.4),
        relief(Relief::Map(HeightMap::new(1, &[0.25])), -0.3),
        relief(Relief::Noise(Noise::new(3.0, 9)), 0.5),
        relief(Relief::Noise(Noise { frequency: 0.4, seed: 1, octaves: 12, gain: 0.7 }), -2.0),
        relief(Relief::Noise(Noise::new(1.0, 2)), 1e30),
        relief(Relief::Noise(Noise::new(5.0, 2)), 0.0),
    ]
}

/// All detail, or that of a picture from a point up to `far` away, or from infinity.
fn some_detail(random: &mut Random, far: f64) -> Detail {
    if random.bits().is_multiple_of(3) {
        return Detail::all();
    }
    let span = 2.0_f64.powf(-12.0 + 12.0 * random.unit());
    let film = GridFilm::new(64, 36, DVec3::NEG_Z, DVec3::X * span / 64.0, DVec3::Y * span / 64.0);
    let origin = match random.bits() % 4 {
        0 => Origin::Infinity(DVec3::new(0.2, 0.3, -1.0)),
        _ => {
            let mut coordinate = || (random.unit() - 0.5) * 2.0 * far;
            Origin::Point(DVec3::new(coordinate(), coordinate(), coordinate()))
        }
    };
    let pencil = Pencil::new(origin, vec![Film::Grid(film.expect("a film"))]).expect("a pencil");
    let dicing = Dicing { shading_rate: 2.0_f64.powi(random.bits() as i32 % 6), ..Dicing::default() };
    Detail::new(&pencil, &dicing, Isa::Auto).expect("detail")
}

/// A patch's points lie within the bounds of a part, and that part's within the bounds of all.
fn check<S: OnDemand>(
    surface: &S,
    patch: &S::Object,
    part: Domain,
    (places, detail): (&[[f64; 2]], &Detail),
) {
    let bounds = surface.bounds(patch, part, detail);
    let all = surface.bounds(patch, Domain::UNIT, detail);
    let inside = |[s, t]: [f64; 2]| {
        let at = |ends: [f64; 2], t: f64| if t == 1.0 { ends[1] } else { ends[0] + (ends[1] - ends[0]) * t };
        [at(part.u, s), at(part.v, t)]
    };
    let places: Vec<[f64; 2]> = places.iter().map(|&place| inside(place)).collect();
    for (point, place) in points_for(surface, patch, &places, detail).into_iter().zip(places) {
        assert!(point.iter().all(|x| x.is_finite()), "{point:?}");
        assert!(holds(&bounds, point), "{point:?} at {place:?} is not in {bounds:?} of {part:?}");
        assert!(holds(&all, point), "{point:?} at {place:?} is not in {all:?}");
    }
}

/// Corners, borders and some places inside.
fn places(random: &mut Random) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
    for _ in 0..6 {
        let [s, t] = [random.unit(), random.unit()];
        places.extend([[s, t], [s, 0.0], [1.0, t], [0.0, s], [t, 1.0]]);
    }
    places
}

/// How far apart rays are in a box, at least.
fn spacing(bounds: &Aabb, detail: &Detail) -> f64 {
    let ends = [bounds.lo, bounds.hi].map(|end| DVec3::from_array(end.map(f64::from)));
    detail.spacing(ends)[0]
}

/// Groups hold the bounds of their parts.
fn check_groups<S: OnDemand>(surface: &S, detail: &Detail, limit: usize) {
    let (mut open, mut parts, mut seen) = (surface.roots(), Vec::new(), 0);
    while let Some(object) = open.pop().filter(|_| seen < limit) {
        seen += 1;
        parts.clear();
        let bounds = surface.bounds(&object, Domain::UNIT, detail);
        if !surface.expand(&object, spacing(&bounds, detail), detail, &mut parts) {
            assert!(parts.is_empty());
            continue;
        }
        for part in &parts {
            let part = surface.bounds(part, Domain::UNIT, detail);
            assert!(holds(&bounds, part.lo) && holds(&bounds, part.hi), "{part:?} in {bounds:?}");
        }
        // From both ends of the list: deep and wide.
        let middle = open.len() / 2;
        open.splice(middle..middle, parts.drain(..));
    }
}

/// Checks some patches of a surface over random parts.
fn check_some<S: OnDemand>(surface: &S, random: &mut Random, count: usize) {
    check_groups(surface, &some_detail(random, 4.0), 4000);
    let patches = patches(surface);
    for _ in 0..count {
        let patch = &patches[random.bits() as usize % patches.len()];
        let (part, places) = (random_domain(random), places(random));
        check(surface, patch, part, (&places, &some_detail(random, 4.0)));
    }
}

fn random_domain(random: &mut Random) -> Domain {
    // Deep parts at the borders and corners, where patches are odd, and anywhere else.
    let levels = [random.bits() as u32 % 20, random.bits() as u32 % 20];
    let mut place = |level: u32| match random.bits() % 3 {
        0 => 0,
        1 => (1 << level) - 1,
        _ => random.bits() as u32,
    };
    domain(levels, [place(levels[0]), place(levels[1])])
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bounds_hold_teapots(seed: u64) {
        check_some(&teapot(), &mut Random(seed), 40);
    }

    #[test]
    fn bounds_hold_displaced_meshes(seed: u64) {
        let mut random = Random(seed);
        for displacement in displacements() {
            for scene in [cube(), sphere(8, 5), house(), tangle(), sheet(3, &mut random)] {
                check_some(&DisplacedMesh::new(&scene, displacement.clone()), &mut random, 10);
            }
        }
    }

    #[test]
    fn bounds_hold_catmull_clark_surfaces(seed: u64) {
        let mut random = Random(seed);
        for displacement in displacements() {
            let valence = 3 + random.bits() as u32 % 6;
            let creases = Creases {
                edges: vec![([0, 1], 10.0), ([1, 3], 2.3), ([2, 3], 0.7), ([3, 7], 1.0)],
                corners: vec![(6, 1.5), (5, 10.0)],
            };
            for scene in [cube(), house(), tangle(), sheet(3, &mut random), star(valence, &mut random)] {
                check_some(&SubdivisionSurface::new(&scene, &creases, displacement.clone()), &mut random, 6);
            }
        }
    }

    #[test]
    fn bounds_hold_terrain(seed: u64) {
        let mut random = Random(seed);
        for _ in 0..40 {
            let patch = random.bits() as u32 % 256;
            let (part, places) = (random_domain(&mut random), places(&mut random));
            check(&Terrain, &patch, part, (&places, &some_detail(&mut random, 5000.0)));
        }
    }

    #[test]
    fn bounds_hold_fields(seed: u64) {
        let mut random = Random(seed);
        // Down one way at random.
        for detail in [Detail::all(), some_detail(&mut random, 1500.0)] {
            check_groups(&Field, &detail, 300);
            let mut object = Field.roots().pop().expect("a root");
            let mut parts = Vec::new();
            loop {
                let bounds = Field.bounds(&object, Domain::UNIT, &detail);
                if !Field.expand(&object, spacing(&bounds, &detail), &detail, &mut parts) {
                    break;
                }
                for part in &parts {
                    let part = Field.bounds(part, Domain::UNIT, &detail);
                    prop_assert!(holds(&bounds, part.lo) && holds(&bounds, part.hi), "{:?} {:?}", object, part);
                }
                object = parts[random.bits() as usize % parts.len()];
                parts.clear();
            }
            let ground = Field.roots()[random.bits() as usize % 256];
            for object in [object, ground] {
                let part = random_domain(&mut random);
                check(&Field, &object, part, (&places(&mut random), &detail));
            }
        }
    }
}
