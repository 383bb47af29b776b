//! Depth maps in place of rays: against the same directions decided exactly, and against formulas.
//!
//! A sphere of radius 1 that stands on a plane hides (1/l)³ of the hemisphere of a point, l the distance of its centre, weighted
//! with the cosine. A convex solid hides nothing of itself, a closed room everything.
//!
//! Based on: John Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", 1982.

use common::generators::meshes::{cube, sphere};
use umbel::bake::{Bake, BakeOptions, BakeReceivers, DepthMaps, Reach, SampleSet};
use umbel::engine::{Aabb, Grouping, Isa};
use umbel::glam::DVec3;
use umbel::{Error, Frame, Options, Scene};

use super::{free_points, run};

/// Maps of N x N texels for a scene.
fn maps(scene: &Scene, size: u32) -> BakeOptions {
    BakeOptions { depth_maps: Some(DepthMaps { size, bounds: scene.bounds() }), ..BakeOptions::default() }
}

/// A sphere on a floor of 8 x 8.
fn sphere_on_floor() -> Scene {
    let mesh = sphere(5, |_| 1.0);
    let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| [p[0], p[1] + 1.0, p[2]]).collect();
    let first = positions.len() as u32;
    positions.extend([[-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, -4.0]]);
    let floor = [[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|corner| corner + first));
    Scene { positions, triangles: [mesh.triangles, floor.to_vec()].concat(), ..Scene::default() }
}

/// Points of its floor, and how far they are from where the sphere stands.
fn floor_points() -> (Vec<f64>, BakeReceivers) {
    let distances: Vec<f64> = (0..400).map(|k| 0.3 + 0.005 * f64::from(k)).collect();
    let at = |(k, &x): (usize, &f64)| {
        let (sin, cos) = (2.4 * k as f64).sin_cos();
        ([(x * cos) as f32, 0.0, (x * sin) as f32], DVec3::Y)
    };
    let points: Vec<_> = distances.iter().enumerate().map(at).collect();
    (distances, free_points(&points))
}

fn rmse(found: &[f32], expected: impl Iterator<Item = f64>) -> f64 {
    let squares = found.iter().zip(expected).map(|(&found, expected)| (f64::from(found) - expected).powi(2));
    (squares.sum::<f64>() / found.len() as f64).sqrt()
}

/// The error goes to 0 with the texels, about as the part of them that shadows end in, to the power of 1/2 or more.
#[test]
fn errors_below_a_sphere_vanish() {
    let (scene, (distances, points)) = (sphere_on_floor(), floor_points());
    let exact = run(&scene, &points, BakeOptions::default()).values;
    let errors = [64, 256, 1024].map(|size| {
        let found = run(&scene, &points, maps(&scene, size)).values;
        rmse(&found, exact.iter().map(|&value| f64::from(value)))
    });
    assert!(errors[0] < 0.04 && errors[1] < 0.6 * errors[0] && errors[2] < 0.6 * errors[1], "{errors:?}");
    let many = BakeOptions { rays: 1024, ..maps(&scene, 512) };
    let formula = distances.iter().map(|x| 1.0 - (x * x + 1.0).powf(-1.5));
    let error = rmse(&run(&scene, &points, many).values, formula);
    assert!(error < 0.006, "{error}");
}

/// No plane, no edge and no curve that turns away darkens itself, however coarse the maps. (Rays below the plane of a vertex's own
/// triangle, though above the horizon of its normal, are occluded in any case.)
#[test]
fn convex_solids_are_open() {
    for mesh in [cube(1), cube(7), sphere(3, |_| 1.0)] {
        let scene = Scene { positions: mesh.positions, triangles: mesh.triangles, ..Scene::default() };
        let receivers = scene.vertex_receivers().expect("a valid scene").range(0..scene.positions.len());
        let exact = run(&scene, &receivers, BakeOptions::default()).values;
        for size in [1, 5, 64, 300] {
            let found = run(&scene, &receivers, maps(&scene, size)).values;
            let error = rmse(&found, exact.iter().map(|&value| f64::from(value)));
            assert!(error < 1e-6, "{size}: {error}");
        }
    }
}

/// Light leaks into a closed room right at its edges and corners only, but for a grazing ray, whose bias is large and weight small.
#[test]
fn closed_rooms_are_dark() {
    let mesh = cube(8);
    let inwards = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let scene = Scene { positions: mesh.positions, triangles: inwards, ..Scene::default() };
    let vertices = scene.positions.clone();
    let receivers = scene.vertex_receivers().expect("a valid scene").range(0..vertices.len());
    let Aabb { lo, hi } = scene.bounds();
    for size in [128, 512] {
        let found = run(&scene, &receivers, maps(&scene, size)).values;
        let mut worst = [0.0_f32; 4];
        for (vertex, value) in vertices.iter().zip(found) {
            let at_sides = (0..3).filter(|&k| vertex[k] == lo[k] || vertex[k] == hi[k]).count();
            worst[at_sides] = worst[at_sides].max(value);
        }
        let [_, sides, edges, corners] = worst;
        assert!(sides < 0.01 && edges < 0.12 && corners < 0.12, "{size}: {worst:?}");
    }
}

/// Neither threads nor instructions nor pieces nor the path change a bit; nor does the scale of the scene.
#[test]
fn values_depend_on_their_receivers_alone() {
    let (scene, (_, points)) = (sphere_on_floor(), floor_points());
    let triangles = scene.geometry().expect("a valid scene");
    for set in [SampleSet::Shared, SampleSet::Interleaved] {
        let options = BakeOptions { rays: 20, set, bent: true, ..maps(&scene, 96) };
        let bake = Bake::new(options).expect("valid options");
        let all = bake.run(&triangles, &points, &mut Frame::new(), &Options::default()).expect("in range");
        let sse2 = Options { isa: Isa::Sse2, path: umbel::Path::General, ..Options::default() };
        let sse2 = if sse2.isa.resolve().is_ok() { sse2 } else { Options::default() };
        let pool = rayon_pool(1);
        let single = pool.install(|| bake.run(&triangles, &points, &mut Frame::new(), &sse2));
        let single = single.expect("in range");
        assert_eq!((&single.values, &single.bent), (&all.values, &all.bent));
        let mut some = BakeReceivers::default();
        for k in (0..points.len()).step_by(7) {
            some.push(points.hemispheres[k], points.normals[k], points.indices[k]);
        }
        let part =
            bake.run(&triangles, &some, &mut Frame::new(), &Options::default()).expect("in range").values;
        assert!(part.iter().zip(all.values.iter().step_by(7)).all(|(one, other)| one == other));
    }
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

#[test]
fn scales_do_not_matter() {
    let (scene, (_, points)) = (sphere_on_floor(), floor_points());
    let expected = run(&scene, &points, maps(&scene, 64)).values;
    for exponent in [-100, 60] {
        let scale = libm::exp2f(exponent as f32);
        let scaled = |p: [f32; 3]| p.map(|x| x * scale);
        let larger =
            Scene { positions: scene.positions.iter().map(|&p| scaled(p)).collect(), ..scene.clone() };
        let mut receivers = points.clone();
        receivers.hemispheres.iter_mut().for_each(|one| one.receiver.point = scaled(one.receiver.point));
        assert_eq!(run(&larger, &receivers, maps(&larger, 64)).values, expected, "2^{exponent}");
    }
}

#[test]
fn what_maps_cannot_do_is_refused() {
    let scene = sphere_on_floor();
    let sizes = [0, 8193].map(|size| maps(&scene, size));
    let others = [
        BakeOptions { set: SampleSet::Independent, ..maps(&scene, 64) },
        BakeOptions { reach: Reach { max_distance: 1.0, ..Reach::default() }, ..maps(&scene, 64) },
        BakeOptions { back_faces: false, ..maps(&scene, 64) },
        BakeOptions { grouping: Grouping::Origin, ..maps(&scene, 64) },
    ];
    for options in sizes.into_iter().chain(others) {
        assert!(matches!(Bake::new(options), Err(Error::Usage(_))), "{options:?}");
    }
    let triangles = scene.geometry().expect("a valid scene");
    let outside = free_points(&[([0.0, 0.0, 2.0], DVec3::Y), ([0.0, 9.0, 0.0], DVec3::Y)]);
    let bake = Bake::new(maps(&scene, 64)).expect("valid options");
    let found = bake.run(&triangles, &outside, &mut Frame::new(), &Options::default());
    assert!(
        matches!(&found, Err(Error::Argument(what)) if what.to_string().contains("receiver 1 at 0, 9, 0")),
        "{found:?}"
    );
    // Nothing to occlude, nobody to ask.
    let empty = Scene::default();
    assert!(run(&empty, &free_points(&[]), maps(&empty, 64)).values.is_empty());
}
