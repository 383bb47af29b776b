//! Patches that meet give bit-equal points along their borders.

use std::collections::HashMap;

use common::random::Random;
use umbel::engine::{Detail, OnDemand};
use umbel::glam::DVec3;
use umbel::scene::Creases;
use umbel::surfaces::{DisplacedMesh, Field, SubdivisionSurface, Terrain};

use super::bounds::displacements;
use super::detail::from_eye;
use super::meshes::{cube, house, sheet, sphere, star, tangle};
use super::patches::teapot;
use super::{patches, points_for};

/// How often each side of a patch appears, as a row of points at dyadic parameters, in either direction.
fn sides<S: OnDemand>(surface: &S, patches: &[S::Object], detail: &Detail) -> HashMap<Vec<[u32; 3]>, usize> {
    // Both s and 1 − s of some depth, and the ends.
    let parameters: Vec<f64> =
        [0, 1, 3, 512, 700, 1000, 1021, 1023, 1024].map(|k| f64::from(k) / 1024.0).to_vec();
    let parameters: Vec<f64> = parameters.iter().flat_map(|&s| [s, 1.0 - s]).collect();
    let mut sides = HashMap::new();
    for patch in patches {
        for side in 0..4 {
            let at = |&s: &f64| match side {
                0 => [s, 0.0],
                1 => [1.0, s],
                2 => [s, 1.0],
                _ => [0.0, s],
            };
            let places: Vec<[f64; 2]> = parameters.iter().map(at).collect();
            let row: Vec<[u32; 3]> = points_for(surface, patch, &places, detail)
                .into_iter()
                .map(|p| p.map(f32::to_bits))
                .collect();
            // The parameters stand in pairs of s and 1 − s.
            let back: Vec<[u32; 3]> = row.chunks(2).flat_map(|pair| [pair[1], pair[0]]).collect();
            *sides.entry(row.clone().min(back)).or_insert(0) += 1;
        }
    }
    sides
}

/// All detail, and what is seen from a place where much of it is too fine.
fn details() -> [Detail; 2] {
    [Detail::all(), from_eye(DVec3::new(30.0, 20.0, 40.0))]
}

/// How many sides of some patches have no partner, whatever the detail.
fn lonely_among<S: OnDemand>(surface: &S, patches: &[S::Object]) -> usize {
    let [all, seen] = details()
        .map(|detail| sides(surface, patches, &detail).values().filter(|&&count| count == 1).count());
    assert_eq!(all, seen);
    all
}

/// How many sides have no partner.
fn lonely<S: OnDemand>(surface: &S) -> usize {
    lonely_among(surface, &patches(surface))
}

#[test]
fn the_teapot_is_closed_but_for_its_mouths() {
    // Rim, lid, the ends of the handle and of the spout: four sides each.
    assert_eq!(lonely(&teapot()), 16);
}

#[test]
fn displaced_meshes_stay_closed() {
    let mut random = Random(3);
    for displacement in displacements() {
        for scene in [cube(), sphere(9, 6), house()] {
            assert_eq!(lonely(&DisplacedMesh::new(&scene, displacement.clone())), 0, "{displacement:?}");
        }
        // A sheet of 3 x 3: 12 edges without a neighbour, two sides each.
        assert_eq!(lonely(&DisplacedMesh::new(&sheet(3, &mut random), displacement.clone())), 24);
    }
}

#[test]
fn catmull_clark_surfaces_stay_closed() {
    let mut random = Random(4);
    let creases = Creases { edges: vec![([0, 1], 10.0), ([1, 3], 2.5)], corners: vec![(6, 1.5)] };
    for displacement in displacements() {
        for scene in [cube(), house(), sphere(7, 4)] {
            assert_eq!(
                lonely(&SubdivisionSurface::new(&scene, &creases, displacement.clone())),
                0,
                "{displacement:?}"
            );
        }
        let sheet = SubdivisionSurface::new(&sheet(3, &mut random), &creases, displacement.clone());
        assert_eq!(lonely(&sheet), 12);
        for valence in 3..=12 {
            let star = SubdivisionSurface::new(
                &star(valence, &mut random),
                &Creases::default(),
                displacement.clone(),
            );
            assert_eq!(lonely(&star), 2 * valence as usize);
        }
    }
}

/// Three squares keep their common edge, four triangles their common vertex.
#[test]
fn what_is_no_manifold_does_not_come_apart() {
    for displacement in displacements() {
        let displaced = DisplacedMesh::new(&tangle(), displacement.clone());
        let subdivided = SubdivisionSurface::new(&tangle(), &Creases::default(), displacement.clone());
        let halves =
            |sides: HashMap<Vec<[u32; 3]>, usize>| sides.values().filter(|&&count| count == 3).count();
        for detail in details() {
            // Where a displacement folds everything together, more may coincide.
            assert!(halves(sides(&displaced, &patches(&displaced), &detail)) >= 2);
            assert!(halves(sides(&subdivided, &patches(&subdivided), &detail)) >= 2);
        }
    }
}

#[test]
fn the_land_is_closed_but_for_its_rim() {
    assert_eq!(lonely(&Terrain), 4 * 16);
    assert_eq!(lonely_among(&Field, &Field.roots()[..256]), 4 * 16);
}
