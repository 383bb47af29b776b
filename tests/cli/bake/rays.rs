//! The rays of `--dump-rays` against exact integers, and the values against the rays.

use common::command::Place;
use common::oracle::{self, OracleRay, Ties};
use common::place;
use common::random::Random;
use umbel::Scene;
use umbel::bake::{BakeOptions, Falloff, Reach, SampleSet, TracedRay, Weighting};
use umbel::glam::DVec3;
use umbel::{LoadOptions, load};

use super::{free_points, npy_points, run};

/// Whether any triangle is in the way of a ray, in exact arithmetic.
fn is_hit(scene: &Scene, ray: &TracedRay) -> bool {
    let [x, y, z, dx, dy, dz, t_max, _] = ray.map(f64::from);
    let ray = OracleRay { origin: [x, y, z], direction: [dx, dy, dz], t_min: 0.0, t_max, ties: Ties::Origin };
    oracle::any(&scene.positions, &scene.triangles, &ray)
}

/// Reads the rays of a file.
fn rays(place: &Place, name: &str) -> Vec<TracedRay> {
    let array = place.npy(name);
    assert_eq!(array.shape[1..], [8]);
    array.f32().as_chunks().0.to_vec()
}

#[test]
fn rays_hit_what_integers_say() {
    let place = place!();
    for (scene, vertices) in [("builtin:cornell", 40), ("builtin:umbel:1000", 30)] {
        let loaded = load(scene, LoadOptions::default()).expect("a scene");
        for more in [
            "--set shared",
            "--set interleaved --max-distance 10%",
            "--set independent --max-distance 30% --falloff linear",
            "--weighting uniform --seed 8 --max-distance 300 --falloff linear",
        ] {
            place.quiet_run(&format!("bake {scene} --vertices --rays 24 {more} --dump-rays d.npy"));
            let all = rays(&place, "d.npy");
            assert!(all.len() > 20 * vertices, "{scene} {more}: {}", all.len());
            let mut hits = 0;
            // The first rays, and some of all others.
            for (k, ray) in all.iter().enumerate().filter(|(k, _)| *k < 300 || k % 97 == 0) {
                assert_eq!(ray[7] == 1.0, is_hit(&loaded, ray), "{scene} {more}: ray {k}, {ray:?}");
                assert!(ray[7] == 0.0 || ray[7] == 1.0);
                hits += ray[7] as usize;
            }
            assert!(hits > 10, "{scene} {more}: {hits}");
        }
    }
}

/// Σ w V / Σ w of the rays, point by point: where no triangle lies beneath the horizon's rays, these are all there are.
#[test]
fn values_follow_from_rays() {
    let scene = load("builtin:umbel:1000", LoadOptions::default()).expect("a scene");
    let bounds = scene.bounds();
    let mut random = Random(7);
    let mut coordinate = |k: usize| bounds.lo[k] + (bounds.hi[k] - bounds.lo[k]) * random.signed() as f32;
    let points: Vec<_> = (0..30).map(|_| [coordinate(0), coordinate(1), coordinate(2)]).collect();
    let normal = |k: usize| DVec3::new(k as f64 - 9.5, (k % 7) as f64 - 2.5, 3.0).normalize();
    let receivers = free_points(&points.iter().enumerate().map(|(k, &p)| (p, normal(k))).collect::<Vec<_>>());
    for set in [SampleSet::Shared, SampleSet::Interleaved, SampleSet::Independent] {
        for weighting in [Weighting::Cosine, Weighting::Uniform] {
            let reach = Reach { max_distance: 2.0, falloff: Falloff::Linear, min_distance: 0.0 };
            let options = BakeOptions {
                rays: 40,
                set,
                weighting,
                reach,
                traced: true,
                bent: true,
                ..BakeOptions::default()
            };
            let found = run(&scene, &receivers, options);
            assert_eq!(found.traced.len() as u64, found.rays, "{set:?}");
            for (k, point) in points.iter().enumerate() {
                let own = found.traced.iter().filter(|ray| ray[..3] == *point);
                let n = DVec3::from_array(receivers.normals[k].map(f64::from));
                let (mut open, mut all, mut bent) = (0.0, 0.0, DVec3::ZERO);
                for ray in own {
                    let d = DVec3::new(f64::from(ray[3]), f64::from(ray[4]), f64::from(ray[5]));
                    assert!((d.length() - 1.0).abs() < 1e-6 && d.dot(n) > 0.0);
                    let is_weighted = set != SampleSet::Independent && weighting == Weighting::Cosine;
                    let weight = if is_weighted { d.dot(n) } else { 1.0 };
                    all += weight;
                    if ray[7] == 0.0 {
                        open += weight;
                        bent += d * weight;
                    }
                }
                let value = f64::from(found.values[k]);
                assert!(
                    (value - open / all).abs() < 1e-6,
                    "{set:?} {weighting:?} {k}: {value} {}",
                    open / all
                );
                let expected = bent.try_normalize().unwrap_or(n);
                let bent = DVec3::from_array(found.bent[k].map(f64::from));
                assert!((bent - expected).length() < 1e-5, "{set:?} {weighting:?} {k}: {bent} {expected}");
            }
        }
    }
}

/// Each limit is its part of the distance, over the length of the direction; parts are spread evenly over (0, 1).
#[test]
fn limits_are_in_units_of_the_direction() {
    let place = place!();
    place.put("p.npy", npy_points(&[[278.0, 548.0, 279.0, 0.0, -1.0, 0.0]]));
    for set in ["shared", "interleaved", "independent"] {
        let line = format!("bake builtin:cornell --points p.npy --rays 500 --set {set} --dump-rays d.npy");
        place.quiet_run(&line);
        assert!(rays(&place, "d.npy").iter().all(|ray| ray[6] == f32::INFINITY));
        place.quiet_run(&format!("{line} --max-distance 50"));
        let of_all = rays(&place, "d.npy");
        assert!(of_all.iter().all(|ray| (ray[6] - 50.0).abs() < 1e-4), "{set}");
        place.quiet_run(&format!("{line} --max-distance 50 --falloff linear"));
        let mut parts: Vec<f32> = rays(&place, "d.npy").iter().map(|ray| ray[6] / 50.0).collect();
        parts.sort_by(f32::total_cmp);
        for (k, part) in parts.iter().enumerate() {
            let even = (k as f32 + 0.5) / parts.len() as f32;
            assert!((part - even).abs() < 0.03 && *part > 0.0 && *part <= 1.0, "{set} {k}: {part}");
        }
    }
}
