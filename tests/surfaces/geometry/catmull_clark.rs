//! Catmull-Clark surfaces against limit masks and against a plain refinement of the whole cage.

use common::random::Random;
use umbel::Scene;
use umbel::engine::OnDemand;
use umbel::glam::DVec3;
use umbel::scene::Creases;
use umbel::surfaces::{Displacement, SubdivisionSurface};

use super::meshes::{cube, house, sheet, star};
use super::plain::Plain;
use super::{patches, points};

fn surface(scene: &Scene, creases: &Creases) -> SubdivisionSurface {
    SubdivisionSurface::new(scene, creases, Displacement::NONE)
}

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// The quads of a scene whose faces are all quads, in order.
fn quads(scene: &Scene) -> Vec<Vec<usize>> {
    let pairs = scene.triangles.chunks(2);
    // Ear clipping begins anywhere: the fourth corner goes where the two triangles meet.
    let quad = |pair: &[[u32; 3]]| {
        let [a, b] = [pair[0], pair[1]];
        let other = b.into_iter().find(|v| !a.contains(v)).expect("a fourth corner");
        let gap = (0..3).find(|&k| b.contains(&a[k]) && b.contains(&a[(k + 1) % 3])).expect("a common edge");
        let mut round: Vec<usize> = a.iter().map(|&v| v as usize).collect();
        round.insert(gap + 1, other as usize);
        round
    };
    pairs.map(quad).collect()
}

/// The patch of a face and parameters there, in the order of corners of `round`, whichever corner the surface begins with.
fn evaluated(surface: &SubdivisionSurface, face: usize, place: [f64; 2], turn: usize) -> DVec3 {
    let patch =
        patches(surface).into_iter().find(|patch| surface.id(patch) as usize == face).expect("a patch");
    let [u, v] = place;
    let place = [[u, v], [1.0 - v, u], [1.0 - u, 1.0 - v], [v, 1.0 - u]][turn];
    wide(points(surface, &patch, &[place])[0])
}

/// How a face of the test is turned against that of the surface: by the limit of a corner of the whole.
fn compare(scene: &Scene, creases: &Creases, levels: u32, tolerance: f64) {
    let surface = surface(scene, creases);
    let mut plain = Plain::new(scene, &quads(scene), creases);
    for _ in 0..levels {
        plain = plain.refined();
    }
    let limits: Vec<Option<DVec3>> = (0..plain.points.len()).map(|vertex| plain.limit(vertex)).collect();
    let all = patches(&surface);
    for face in 0..quads(scene).len() {
        let patch = all.iter().find(|patch| surface.id(patch) as usize == face).expect("a patch");
        let ours = plain.places.iter().zip(&plain.faces).filter(|((parent, _), _)| *parent == face);
        let pairs: Vec<([f64; 2], DVec3)> = ours
            .flat_map(|((_, places), corners)| places.iter().copied().zip(corners.iter().map(|&v| limits[v])))
            .filter_map(|(place, limit)| Some((place, limit?)))
            .collect();
        // The surface may begin with another corner than the test.
        let apart = |turn: usize| {
            let turned = |[u, v]: [f64; 2]| [[u, v], [1.0 - v, u], [1.0 - u, 1.0 - v], [v, 1.0 - u]][turn];
            let places: Vec<[f64; 2]> = pairs.iter().map(|pair| turned(pair.0)).collect();
            let found = points(&surface, patch, &places);
            found.iter().zip(&pairs).map(|(p, pair)| (wide(*p) - pair.1).length()).fold(0.0, f64::max)
        };
        let least = (0..4).map(apart).fold(f64::INFINITY, f64::min);
        assert!(least < tolerance, "face {face} is {least} away");
    }
}

#[test]
fn limit_points_of_all_valences_are_those_of_the_masks() {
    let mut random = Random(1);
    for valence in 3..=12 {
        let scene = star(valence, &mut random);
        let (surface, p) = (surface(&scene, &Creases::default()), |k: u32| wide(scene.positions[k as usize]));
        let n = f64::from(valence);
        let (ends, fars) =
            (0..valence).fold((DVec3::ZERO, DVec3::ZERO), |(e, f), k| (e + p(1 + 2 * k), f + p(2 + 2 * k)));
        let mask = (p(0) * (n * n) + ends * 4.0 + fars) / (n * (n + 5.0));
        let corners = |place: [f64; 2], turn: usize| evaluated(&surface, 0, place, turn);
        let least =
            (0..4).map(|turn| (corners([0.0, 0.0], turn) - mask).length()).fold(f64::INFINITY, f64::min);
        assert!(least < 1e-6, "valence {valence}: {least}");
    }
}

#[test]
fn surfaces_are_those_of_a_plain_refinement() {
    let mut random = Random(2);
    compare(&cube(), &Creases::default(), 4, 1e-6);
    compare(&sheet(4, &mut random), &Creases::default(), 3, 1e-6);
    for valence in [3, 5, 6, 9] {
        compare(&star(valence, &mut random), &Creases::default(), 3, 1e-6);
    }
}

#[test]
fn creases_and_corners_are_those_of_a_plain_refinement() {
    let mut random = Random(6);
    let endless = Creases {
        edges: vec![([0, 1], 10.0), ([1, 3], 10.0), ([3, 2], 10.0), ([2, 0], 10.0)],
        corners: vec![(6, 10.0)],
    };
    compare(&cube(), &endless, 4, 1e-6);
    // Sharpness that fades, whole and in part, and a crease of three edges at a vertex.
    let fading = Creases {
        edges: vec![
            ([0, 1], 2.0),
            ([1, 3], 1.5),
            ([3, 2], 0.4),
            ([5, 7], 10.0),
            ([7, 3], 10.0),
            ([7, 6], 1.25),
        ],
        corners: vec![(4, 1.5)],
    };
    compare(&cube(), &fading, 4, 1e-6);
    // Vertices 6 .. 18 of a sheet of 4 lie inside.
    let inside = Creases {
        edges: vec![([5, 6], 10.0), ([6, 7], 10.0), ([7, 12], 3.0), ([12, 17], 2.6)],
        corners: vec![],
    };
    compare(&sheet(4, &mut random), &inside, 4, 1e-6);
}

/// A crease that ends in a smooth vertex has no mask: there refinement itself is the measure, nearer with each step.
#[test]
fn creases_that_end_converge() {
    let creases = Creases { edges: vec![([0, 1], 10.0)], corners: vec![] };
    let mut plain = Plain::new(&cube(), &quads(&cube()), &creases);
    let surface = surface(&cube(), &creases);
    let ends: Vec<DVec3> = patches(&surface)
        .iter()
        .flat_map(|patch| points(&surface, patch, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
        .map(wide)
        .collect();
    let mut last = f64::INFINITY;
    for _ in 0..6 {
        plain = plain.refined();
        let near = |vertex: usize| {
            ends.iter().map(|p| (*p - plain.points[vertex]).length()).fold(f64::INFINITY, f64::min)
        };
        // The two ends of the crease.
        let apart = near(0).max(near(1));
        assert!(apart < last / 2.0, "{apart} after {last}");
        last = apart;
    }
    assert!(last < 2e-3, "{last}");
}

/// Triangles, quads and pentagons: each limit vertex of a plain refinement is a point of the surface.
#[test]
fn faces_that_are_no_quads_are_refined_first() {
    let scene = house();
    let faces = [
        vec![0, 1, 2, 3],
        vec![1, 0, 4, 8, 5],
        vec![3, 2, 6, 9, 7],
        vec![0, 3, 7, 4],
        vec![2, 1, 5, 6],
        vec![4, 7, 9],
        vec![4, 9, 8],
        vec![5, 8, 9, 6],
    ];
    let mut plain = Plain::new(&scene, &faces, &Creases::default());
    for _ in 0..3 {
        plain = plain.refined();
    }
    let surface = surface(&scene, &Creases::default());
    let places: Vec<[f64; 2]> = (0..25).map(|k| [f64::from(k % 5) / 4.0, f64::from(k / 5) / 4.0]).collect();
    let found: Vec<DVec3> =
        patches(&surface).iter().flat_map(|patch| points(&surface, patch, &places)).map(wide).collect();
    for vertex in 0..plain.points.len() {
        let limit = plain.limit(vertex).expect("no crease");
        let least = found.iter().map(|p| (*p - limit).length()).fold(f64::INFINITY, f64::min);
        assert!(least < 1e-6, "vertex {vertex} is {least} away");
    }
}
