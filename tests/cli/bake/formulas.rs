//! Openness by formula: walls, corners, ceilings, a sphere on a plane; falloff, weights, bent normals.
//!
//! An infinite wall of height h at the distance x hides (1 − x/√(x² + h²))/2 of the cosine-weighted hemisphere and atan(h/x)/π of
//! the uniform one. A sphere of radius R that stands on the plane hides (R/l)³ of the former, l the distance of its centre. A
//! ceiling at height h, with c = h/D for the greatest distance D, leaves open c² (cosine) and c (uniform); with linear falloff
//! 1 − (1 − c)² and c − c ln c.
//!
//! Based on: John Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", 1982.

use std::f64::consts::PI;

use common::generators;
use umbel::Scene;
use umbel::bake::{BakeOptions, Falloff, Polarity, Reach, SampleSet, Weighting};
use umbel::glam::DVec3;

use super::{free_points, quads, run};

const SETS: [SampleSet; 3] = [SampleSet::Shared, SampleSet::Interleaved, SampleSet::Independent];
const WEIGHTINGS: [Weighting; 2] = [Weighting::Cosine, Weighting::Uniform];
/// As good as infinite.
const FAR: f32 = 1e5;

/// 2048 rays: what a set misses of an area with a smooth outline is far below 1/√2048 = 0.022.
const RAYS: u32 = 2048;
const BOUND: f64 = 0.006;

/// Compares the value of a point on the plane y = 0 with a formula, for all sets and weightings.
fn compare(scene: &Scene, point: [f32; 3], reach: Reach, expected: [f64; 2]) {
    for set in SETS {
        for (weighting, expected) in WEIGHTINGS.into_iter().zip(expected) {
            for seed in 0..3 {
                let options =
                    BakeOptions { rays: RAYS, set, weighting, reach, seed, ..BakeOptions::default() };
                let got = f64::from(run(scene, &free_points(&[(point, DVec3::Y)]), options).values[0]);
                let what = format!("{point:?} {set:?} {weighting:?} {reach:?} {seed}: {got} for {expected}");
                assert!((got - expected).abs() < BOUND, "{what}");
            }
        }
    }
}

/// A wall at x = 0 up to a height, without ends.
fn wall(height: f32) -> Scene {
    quads(&[[[0.0, 0.0, -FAR], [0.0, 0.0, FAR], [0.0, height, FAR], [0.0, height, -FAR]]])
}

#[test]
fn the_foot_of_a_wall() {
    for (x, h) in [(1e-4, 1.0), (0.5, 1.0), (1.0, 1.0), (2.0, 0.5), (1.0, FAR)] {
        let (far, height) = (f64::from(x), f64::from(h));
        let cosine = 1.0 - 0.5 * (1.0 - far / far.hypot(height));
        let uniform = 1.0 - (height / far).atan() / PI;
        compare(&wall(h), [x, 0.0, 0.3], Reach::default(), [cosine, uniform]);
    }
}

#[test]
fn the_inside_edge_of_two_walls() {
    let other = [[-FAR, 0.0, 0.0], [FAR, 0.0, 0.0], [FAR, FAR, 0.0], [-FAR, FAR, 0.0]];
    let one = [[0.0, 0.0, -FAR], [0.0, 0.0, FAR], [0.0, FAR, FAR], [0.0, FAR, -FAR]];
    compare(&quads(&[one, other]), [1e-4, 0.0, 1e-4], Reach::default(), [0.25; 2]);
}

#[test]
fn a_sphere_on_a_plane() {
    let mesh = generators::meshes::sphere(5, |_| 1.0);
    let raised = mesh.positions.iter().map(|p| [p[0], p[1] + 1.0, p[2]]).collect();
    let scene = Scene { positions: raised, triangles: mesh.triangles, ..Scene::default() };
    for distance in [0.5_f32, 1.0, 2.0] {
        let l = f64::from(distance).hypot(1.0);
        // The visible cone of half angle asin(1/l) covers 1 − √(1 − 1/l²) of the uniform hemisphere.
        let uniform = (1.0 - 1.0 / (l * l)).sqrt();
        compare(&scene, [distance, 0.0, 0.0], Reach::default(), [1.0 - 1.0 / (l * l * l), uniform]);
    }
}

#[test]
fn a_ceiling_up_to_a_distance() {
    let ceiling = quads(&[[[-FAR, 1.0, -FAR], [FAR, 1.0, -FAR], [FAR, 1.0, FAR], [-FAR, 1.0, FAR]]]);
    for max_distance in [1.25, 2.0, 10.0] {
        let c: f64 = 1.0 / max_distance;
        let point = [3.0, 0.0, -1.0];
        compare(
            &ceiling,
            point,
            Reach { max_distance, falloff: Falloff::None, min_distance: 0.0 },
            [c * c, c],
        );
        let falling = [1.0 - (1.0 - c) * (1.0 - c), c - c * c.ln()];
        compare(
            &ceiling,
            point,
            Reach { max_distance, falloff: Falloff::Linear, min_distance: 0.0 },
            falling,
        );
    }
    // Nothing is as near as that.
    for falloff in [Falloff::None, Falloff::Linear] {
        let reach = Reach { max_distance: 0.999, falloff, min_distance: 0.0 };
        let found =
            run(&ceiling, &free_points(&[([0.0; 3], DVec3::Y)]), BakeOptions { reach, ..Default::default() });
        assert_eq!(found.values, [1.0]);
    }
}

#[test]
fn polarity_is_one_minus_the_other() {
    let points = free_points(&[([0.5, 0.0, 0.3], DVec3::Y), ([1.0, 0.0, 0.3], DVec3::Y)]);
    for set in SETS {
        let options = BakeOptions { set, ..BakeOptions::default() };
        let open = run(&wall(1.0), &points, options).values;
        let dark = run(&wall(1.0), &points, BakeOptions { polarity: Polarity::Occlusion, ..options }).values;
        for (open, dark) in open.iter().zip(&dark) {
            assert!((open + dark - 1.0).abs() < 1e-6 && *open < 1.0 && *dark < 0.5, "{open} {dark}");
        }
    }
}

/// At the foot of an endless wall the mean cosine-weighted open direction is (2, π, 0) away from it.
#[test]
fn bent_normals_lean_away_from_a_wall() {
    let points = free_points(&[([1e-4, 0.0, 0.3], DVec3::Y)]);
    for (weighting, up) in [(Weighting::Cosine, PI / 2.0), (Weighting::Uniform, 1.0)] {
        let expected = DVec3::new(1.0, up, 0.0).normalize();
        for set in SETS {
            let options = BakeOptions { rays: RAYS, set, weighting, bent: true, ..BakeOptions::default() };
            let found = run(&wall(FAR), &points, options);
            let bent = DVec3::from_array(found.bent[0].map(f64::from));
            assert!((bent.length() - 1.0).abs() < 1e-6, "{bent}");
            assert!(
                bent.dot(expected) > 1.0_f64.to_radians().cos(),
                "{set:?} {weighting:?}: {bent} for {expected}"
            );
        }
    }
}

/// Where nothing is open, the bent normal is the normal; where all is, it is near it.
#[test]
fn bent_normals_without_and_with_all_openness() {
    let normal = DVec3::new(0.6, 0.8, 0.0);
    let lid = quads(&[[[-FAR, 1.0, -FAR], [FAR, 1.0, -FAR], [FAR, 1.0, FAR], [-FAR, 1.0, FAR]]]);
    let ground = quads(&[[[-FAR, -1.0, -FAR], [FAR, -1.0, -FAR], [FAR, -1.0, FAR], [-FAR, -1.0, FAR]]]);
    let both = Scene {
        positions: [lid.positions, ground.positions].concat(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        ..Scene::default()
    };
    for set in SETS {
        let options = BakeOptions { set, bent: true, rays: 256, ..BakeOptions::default() };
        let closed = run(&both, &free_points(&[([0.0; 3], normal)]), options);
        assert_eq!((closed.values[0], closed.bent[0]), (0.0, [0.6, 0.8, 0.0]), "{set:?}");
        let open = run(&Scene::default(), &free_points(&[([0.0; 3], normal)]), options);
        let bent = DVec3::from_array(open.bent[0].map(f64::from));
        assert!(open.values[0] == 1.0 && bent.dot(normal) > 2.0_f64.to_radians().cos(), "{set:?} {bent}");
    }
}
