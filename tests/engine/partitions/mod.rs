//! Arbitrary rays: every partition of the general path, and the default path, give the same hits, the oracle's hits.
//!
//! Scenes and sets of rays are those that partitions find hard: triangles in many voxels, triangles that no plane divides, rays
//! that no box tells apart. The memory that is measured is fitted to a·n + b·r + c.
//!
//! The oracle takes a while, so fewer rays than this are the default:
//!
//! ```text
//! UMBEL_ORACLE_RAYS=100000 cargo test --release -p umbel --test engine -- the_oracle --nocapture
//! ```
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure", 2011.

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

mod groups;

use common::generators;
use common::generators::meshes::sphere;
use common::generators::{KINDS, Kind, Mesh};
use common::oracle;
use common::random::Random;
use umbel::engine::Partition;
use umbel::glam::DVec3;
use umbel::{Hits, NO_TRIANGLE, Options, Path, Ray, Stats, Triangles, any_hit, builtin, closest_hit};

fn by(partition: Partition) -> Options {
    Options { path: Path::General, partition, ..Options::default() }
}

/// Ids and bits of t.
fn bits(hits: &Hits) -> Vec<(u32, u32)> {
    hits.ids().iter().copied().zip(hits.ts().iter().map(|t| t.to_bits())).collect()
}

/// What the default path hits, after all partitions have hit the same; and their statistics.
fn agree(name: &str, triangles: &Triangles<'_>, rays: &[Ray]) -> (Hits, [Stats; 4]) {
    let (hits, _) = closest_hit(triangles, rays, &Options::default()).expect("in range");
    let expected = bits(&hits);
    let blocked: Vec<bool> = expected.iter().map(|&(id, _)| id != NO_TRIANGLE).collect();
    let (any, _) = any_hit(triangles, rays, &Options::default()).expect("in range");
    assert!(any == blocked, "{name}: any hit is not closest hit");
    let stats = Partition::ALL.map(|partition| {
        let (found, stats) = closest_hit(triangles, rays, &by(partition)).expect("in range");
        if let Some(ray) = bits(&found).iter().zip(&expected).position(|(a, b)| a != b) {
            let (one, other) = (found.get(ray), hits.get(ray));
            panic!("{name} {partition:?}, ray {ray}: {one:?}, default {other:?}: {:?}", rays[ray]);
        }
        let (any, _) = any_hit(triangles, rays, &by(partition)).expect("in range");
        assert!(any == blocked, "{name} {partition:?}: any hit is not closest hit");
        stats
    });
    (hits, stats)
}

fn count(hits: &Hits) -> usize {
    hits.ids().iter().filter(|&&id| id != NO_TRIANGLE).count()
}

/// The box around some positions.
fn extent(positions: &[[f32; 3]]) -> [DVec3; 2] {
    let all = || positions.iter().map(|p| generators::widen(*p));
    [all().fold(DVec3::INFINITY, DVec3::min), all().fold(DVec3::NEG_INFINITY, DVec3::max)]
}

/// A random point of twice a box, with f32 coordinates.
fn around(random: &mut Random, [lo, hi]: [DVec3; 2]) -> DVec3 {
    let p = (lo + hi) * 0.5 + random.cube() * (hi - lo);
    DVec3::from_array(p.to_array().map(|x| f64::from(x as f32)))
}

/// Rays from anywhere to anywhere.
fn random_rays(seed: u64, positions: &[[f32; 3]], rays: usize) -> Vec<Ray> {
    let (mut random, extent) = (Random(seed), extent(positions));
    (0..rays)
        .map(|_| {
            let from = around(&mut random, extent);
            Ray::new(from, around(&mut random, extent) - from)
        })
        .filter(|ray| ray.direction != DVec3::ZERO)
        .collect()
}

/// Triangles of some size around random points of the unit cube.
fn confetti(seed: u64, triangles: usize, size: DVec3) -> Mesh {
    let mut random = Random(seed);
    Mesh::of((0..triangles).map(|_| {
        let centre = random.cube();
        [0, 1, 2].map(|_| centre + random.cube() * size)
    }))
}

#[test]
fn built_in_scenes() {
    for (name, rays) in [("umbel:20000", 20_000), ("cornell", 20_000)] {
        let scene = builtin(name).expect("a built-in scene");
        let rays = random_rays(1, &scene.positions, rays);
        let (hits, [middle, given, spatial, sampled]) = agree(name, &scene.geometry().expect("valid"), &rays);
        assert!(count(&hits) > 2000, "{name}: {}", count(&hits));
        assert!(sampled.rays_sampled > 0 && middle.rays_sampled + given.rays_sampled == 0);
        assert!(spatial.references_made > 0 && middle.references_made + given.references_made == 0);
        assert!(name == "cornell" || sampled.filters_skipped > 0);
    }
}

#[test]
fn random_triangles_and_slivers() {
    let sizes = [("small", DVec3::splat(0.05)), ("slivers", DVec3::new(1.0, 1e-6, 1e-4))];
    for (name, size) in sizes {
        let mesh = confetti(2, 3000, size);
        let (hits, _) = agree(name, &mesh.geometry(), &random_rays(3, &mesh.positions, 5000));
        assert!(name == "slivers" || count(&hits) > 500, "{name}: {}", count(&hits));
    }
}

/// No plane divides copies: the median has to, or a step would never end.
#[test]
fn duplicates() {
    let ball = sphere(2, |_| 1.0);
    let triangles = ball.triangles.repeat(60);
    let mesh = Mesh { positions: ball.positions, triangles };
    let (hits, _) = agree("duplicates", &mesh.geometry(), &random_rays(4, &mesh.positions, 4000));
    assert!(count(&hits) > 1000);
    // Of copies the first.
    assert!(hits.ids().iter().all(|&id| id == NO_TRIANGLE || id < mesh.triangles.len() as u32 / 60));
}

/// Triangles that reach across the scene are in many voxels; the voxels' lists stay within what is promised.
#[test]
fn large_triangles_over_many_voxels() {
    let mut mesh = confetti(5, 4000, DVec3::splat(0.02));
    for triangle in 0..400 {
        let corners = confetti(100 + triangle, 1, DVec3::splat(2.0)).corners(0);
        mesh.triangle(corners);
    }
    let (hits, [middle, _, spatial, _]) =
        agree("large", &mesh.geometry(), &random_rays(6, &mesh.positions, 4000));
    assert!(count(&hits) > 1000);
    assert!(spatial.references_made > mesh.triangles.len() as u64);
    let lists = spatial.engine_bytes - middle.engine_bytes;
    println!("{lists} bytes of lists for {} triangles", mesh.triangles.len());
    assert!(lists <= 2 * 12 * 4 * mesh.triangles.len() as u64, "two threads: {lists}");
}

#[test]
fn degenerate_sets_of_rays() {
    let mesh = confetti(7, 2000, DVec3::splat(0.2));
    let geometry = mesh.geometry();
    let mut random = Random(8);
    let one = Ray::new(DVec3::new(-2.0, 0.125, 0.25), DVec3::new(1.0, 0.03125, -0.0625));
    let extent = extent(&mesh.positions);
    let parallel = |random: &mut Random| Ray { origin: around(random, extent), ..one };
    let from_point = |random: &mut Random| Ray::new(one.origin, around(random, extent) - one.origin);
    let tiny = 2_f64.powi(-160);
    let sets: [(&str, Vec<Ray>); 7] = [
        ("equal", vec![one; 3000]),
        ("parallel", (0..3000).map(|_| parallel(&mut random)).collect()),
        ("from a point", (0..3000).map(|_| from_point(&mut random)).collect()),
        ("empty", Vec::new()),
        ("alone", vec![one]),
        ("short", (0..3000).map(|_| Ray { t_max: tiny, ..parallel(&mut random) }).collect()),
        ("along an axis", (0..3000).map(|_| Ray { direction: DVec3::X, ..parallel(&mut random) }).collect()),
    ];
    for (name, rays) in sets {
        let (hits, _) = agree(name, &geometry, &rays);
        assert_eq!(hits.len(), rays.len());
        match name {
            "equal" => assert!(count(&hits) == 3000 && hits.ids().iter().all(|&id| id == hits.ids()[0])),
            "short" => assert_eq!(count(&hits), 0),
            "parallel" | "from a point" | "along an axis" => assert!(count(&hits) > 100, "{name}"),
            _ => {}
        }
        agree("no triangles", &Mesh::default().geometry(), &rays);
    }
    for t_max in [0.0, -1.0, f64::NAN] {
        let refused = closest_hit(&geometry, &[one, Ray { t_max, ..one }][..], &Options::default());
        let error = refused.expect_err("an empty interval").to_string();
        assert!(error.contains("interval") && error.contains(&t_max.to_string()), "{error}");
    }
}

/// From 10⁷ times the size of the scene away.
#[test]
fn rays_from_far_away() {
    let mesh = sphere(4, |_| 1.0);
    let mut random = Random(9);
    let rays: Vec<Ray> = (0..3000)
        .map(|_| {
            let from = random.cube().normalize() * 1e7;
            let from = DVec3::from_array(from.to_array().map(|x| f64::from(x as f32)));
            Ray::new(from, random.cube() - from)
        })
        .collect();
    let (hits, _) = agree("far", &mesh.geometry(), &rays);
    assert!(count(&hits) > 1500, "{}", count(&hits));
}

/// Scaling by a power of two changes no id, and t not at all; here also where bundles give up.
#[test]
fn tiny_and_huge_scenes() {
    let mesh = sphere(4, |_| 1.0);
    let rays = random_rays(10, &mesh.positions, 3000);
    let expected = bits(&agree("unit", &mesh.geometry(), &rays).0);
    for exponent in [-100, 100] {
        let scale = 2_f64.powi(exponent);
        let mut scaled = mesh.clone();
        scaled.positions.iter_mut().flatten().for_each(|x| *x *= scale as f32);
        let to = |ray: &Ray| Ray { origin: ray.origin * scale, direction: ray.direction * scale, ..*ray };
        let rays: Vec<Ray> = rays.iter().map(to).collect();
        let (hits, _) = agree(&format!("2^{exponent}"), &scaled.geometry(), &rays);
        let ids = bits(&hits).iter().zip(&expected).filter(|(a, b)| a == b).count();
        // Positions of 2^-100 lose bits of small coordinates, which are subnormal.
        assert!(ids * 1000 >= expected.len() * 999, "2^{exponent}: {ids} of {}", expected.len());
    }
}

/// What an oracle hits along general rays.
fn expected(mesh: &Mesh, ray: &Ray) -> (u32, u32) {
    let ray = oracle::OracleRay {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
        ties: oracle::Ties::Direction,
    };
    let hit = oracle::closest(&mesh.positions, &mesh.triangles, &ray);
    let (id, t) = hit.unwrap_or((NO_TRIANGLE, f32::INFINITY));
    (id, t.to_bits())
}

/// Random rays of all kinds of scenes, as many at once as bundles need, against exact arithmetic.
#[test]
fn the_oracle_hits_the_same() {
    const AT_ONCE: usize = 2000;
    let wanted = std::env::var("UMBEL_ORACLE_RAYS").map_or(28_000, |n| n.parse().expect("a number"));
    let (mut compared, mut hit) = (0, 0);
    for seed in 0.. {
        if compared >= wanted {
            break;
        }
        let kind: Kind = KINDS[seed as usize % KINDS.len()];
        let mut random = Random(0x9a71 + seed);
        let mesh = generators::scene(&mut random, kind, 30);
        let rays: Vec<Ray> = (0..AT_ONCE)
            .map(|_| {
                let eye = generators::eye(&mut random, kind, &mesh);
                Ray::new(eye, generators::direction(&mut random, kind, &mesh, eye))
            })
            .collect();
        let found = bits(&agree(&format!("{kind:?}"), &mesh.geometry(), &rays).0);
        for (ray, found) in rays.iter().zip(found) {
            assert_eq!(found, expected(&mesh, ray), "{kind:?} {seed}: {ray:?}");
            hit += usize::from(found.0 != NO_TRIANGLE);
        }
        compared += rays.len();
    }
    println!("{compared} rays, {hit} hit");
    assert!(hit * 20 > compared);
}

/// The least squares of y ≈ a·n + b·r + c where every n goes with every r, so that either slope is found by itself.
fn fit(points: &[[f64; 3]]) -> [f64; 3] {
    let mean = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64);
    let slope = |k: usize| {
        let sum =
            |other: usize| points.iter().map(|p| (p[k] - mean[k]) * (p[other] - mean[other])).sum::<f64>();
        sum(2) / sum(k)
    };
    let [a, b] = [slope(0), slope(1)];
    [a, b, mean[2] - a * mean[0] - b * mean[1]]
}

/// Engine bytes with n and r doubled twice each: the fit, and how far the worst measurement is from it.
#[test]
fn memory_is_linear_in_triangles_and_rays() {
    let default = [("default".to_owned(), Options::default())];
    let partitions = Partition::ALL.map(|partition| (format!("{partition:?}"), by(partition)));
    for (name, options) in default.into_iter().chain(partitions) {
        let mut points = Vec::new();
        for n in [4000, 8000, 16_000] {
            let scene = builtin(&format!("umbel:{n}")).expect("a built-in scene");
            for r in [4000, 8000, 16_000] {
                let rays = random_rays(11, &scene.positions, r);
                let geometry = scene.geometry().expect("valid");
                let (_, stats) = closest_hit(&geometry, &rays[..], &options).expect("in range");
                points.push([geometry.len() as f64, rays.len() as f64, stats.engine_bytes as f64]);
            }
        }
        let [a, b, c] = fit(&points);
        let worst = points.iter().map(|[n, r, y]| y / (a * n + b * r + c)).fold(0.0, f64::max);
        println!(
            "{name}: {a:.1} bytes per triangle, {b:.1} per ray, {c:.0} more; at most {worst:.2} times that"
        );
        assert!(a < 200.0 && b < 150.0 && worst < 1.5, "{name}: {a} {b} {worst}");
    }
}

/// A step works on fewer rays and objects than the one above it, so that most of what is touched fits into a cache.
#[test]
fn working_sets_shrink() {
    let scene = builtin("umbel:20000").expect("a built-in scene");
    let rays = random_rays(12, &scene.positions, 20_000);
    let (_, all) = agree("locality", &scene.geometry().expect("valid"), &rays);
    for (partition, stats) in Partition::ALL.into_iter().zip(all) {
        let bytes = [stats.bytes_within_32k, stats.bytes_within_1m, stats.bytes_beyond_1m];
        let total: u64 = bytes.iter().sum();
        let parts = bytes.map(|bytes| 100.0 * bytes as f64 / total as f64);
        println!(
            "{partition:?}: {} MB touched, {parts:.1?} % in steps to 32 KiB, to 1 MiB, beyond",
            total >> 20
        );
        assert!(parts[2] < 50.0);
    }
}
