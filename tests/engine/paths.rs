//! One answer, whatever the path: pencils and the general path, closest and any hit, 1, 2 and 7 threads, all lenses.
//!
//! Also scenes whose answer is a formula (a box around the eye, a plane, a sphere), scenes in which nothing can be hit, and
//! the claim that a pencil's bounds replace a hundred times as many tests of single rays.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011; analytic scenes as in Matt Pharr, Wenzel Jakob, Greg Humphreys, "Physically Based Rendering", 2023.

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators::Mesh;
use common::generators::meshes::{cube, sphere};
use umbel::builtin::builtin_view;
use umbel::engine::Film;
use umbel::engine::GridFilm;
use umbel::engine::Rays;
use umbel::glam::DVec3;
use umbel::{
    Camera, Hits, Lens, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Scene, Stats, Triangles, any_hit,
    builtin, closest_hit,
};

const LENSES: [Lens; 5] = [
    Lens::Pinhole { fov: 50.0 },
    Lens::Ortho { height: 3.0 },
    Lens::Cube,
    Lens::Equirect,
    Lens::Fisheye { fov: 200.0 },
];

fn options(path: Path) -> Options {
    Options { path, ..Options::default() }
}

/// Ids and bits of t.
fn bits(hits: &Hits) -> Vec<(u32, u32)> {
    let ts = hits.ts().iter().map(|t| t.to_bits());
    hits.ids().iter().copied().zip(ts).collect()
}

/// Checks that both paths and both verbs agree, and returns the hits with the statistics of both paths.
fn agree(triangles: &Triangles<'_>, pencil: &Pencil) -> (Hits, [Stats; 2]) {
    let (hits, stats) = closest_hit(triangles, pencil, &options(Path::Pencil)).expect("in range");
    let (general, general_stats) = closest_hit(triangles, pencil, &options(Path::General)).expect("in range");
    let differing = bits(&hits).iter().zip(bits(&general)).position(|(a, b)| *a != b);
    if let Some(ray) = differing {
        let (one, other) = (hits.get(ray), general.get(ray));
        panic!("ray {ray}: {one:?}, general {other:?}: {:?}", pencil.ray(ray));
    }
    for path in [Path::Pencil, Path::General] {
        let (any, _) = any_hit(triangles, pencil, &options(path)).expect("in range");
        let expected = (0..hits.len()).map(|ray| hits.get(ray).is_some());
        assert!(expected.eq(any), "any hit is not closest hit: {path:?}");
    }
    (hits, [stats, general_stats])
}

/// The curated view of a built-in scene, at the height of its lens.
fn camera(scene: &str, lens: Lens, width: u32, height: u32) -> Camera {
    let view = builtin_view(scene).expect("a built-in scene");
    let [eye, target, up] = [view.eye, view.target, view.up].map(DVec3::from_array);
    let lens = match lens {
        Lens::Ortho { .. } => Lens::Ortho { height: (eye - target).length() * 0.7 },
        lens => lens,
    };
    Camera { eye, target, up, lens, width, height }
}

fn pencil_of(scene: &str, lens: Lens, width: u32, height: u32) -> Pencil {
    let shot = camera(scene, lens, width, height).shot();
    shot.expect("a valid camera").pencil
}

fn geometry(scene: &Scene) -> Triangles<'_> {
    scene.geometry().expect("a valid scene")
}

const SCENES: [&str; 2] = ["umbel:20000", "cornell"];

#[test]
fn paths_agree_through_all_lenses() {
    for name in SCENES {
        let scene = builtin(name).expect("a built-in scene");
        for lens in LENSES {
            let mut hit = 0;
            for (width, height) in [(1, 1), (65, 63), (300, 2)] {
                let pencil = pencil_of(name, lens, width, height);
                let (hits, _) = agree(&geometry(&scene), &pencil);
                hit += (0..hits.len()).filter(|&ray| hits.get(ray).is_some()).count();
            }
            assert!(hit > 30, "{name} {lens:?}: {hit} hits");
        }
        for lens in [LENSES[0], LENSES[1], LENSES[3]] {
            agree(&geometry(&scene), &pencil_of(name, lens, 4096, 2));
        }
    }
}

#[test]
fn threads_change_nothing() {
    for name in SCENES {
        let scene = builtin(name).expect("a built-in scene");
        for lens in LENSES {
            let pencil = pencil_of(name, lens, 130, 97);
            for path in [Path::Pencil, Path::General] {
                let run = |threads: usize| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                    let ask = || closest_hit(&geometry(&scene), &pencil, &options(path));
                    bits(&pool.expect("a pool").install(ask).expect("in range").0)
                };
                let one = run(1);
                assert!(one.iter().any(|&(id, _)| id != NO_TRIANGLE));
                for threads in [2, 7] {
                    assert!(run(threads) == one, "{name} {lens:?} {path:?} {threads} threads");
                }
            }
        }
    }
}

#[test]
fn a_pencil_needs_few_bound_tests() {
    let scene = builtin("umbel:100000").expect("a built-in scene");
    let pencil = pencil_of("umbel", Lens::Pinhole { fov: 34.0 }, 640, 400);
    let (_, [pencils, general]) = agree(&geometry(&scene), &pencil);
    let bounds = pencils.frustum_tests + pencils.box_tests;
    println!("{bounds} bound tests by pencils, {} by rays", general.box_tests);
    assert!(bounds > 0 && bounds * 100 < general.box_tests);
}

/// Cameras at a point with every lens; parallel rays over three times `size`.
fn pencils_at(eye: DVec3, target: DVec3, size: f64) -> Vec<Pencil> {
    let pencil = |lens| {
        let lens = match lens {
            Lens::Ortho { height } => Lens::Ortho { height: height * size },
            lens => lens,
        };
        let camera = Camera { eye, target, up: DVec3::Y, lens, width: 33, height: 17 };
        camera.shot().expect("a valid camera").pencil
    };
    LENSES.into_iter().map(pencil).collect()
}

#[test]
fn nothing_is_hit_where_nothing_can_be() {
    let p = DVec3::new;
    let through_eye = [p(-1.0, -1.0, 0.0), p(2.0, -1.0, 0.0), p(-1.0, 2.0, 0.0)];
    let behind = [p(-9.0, -9.0, 5.0), p(9.0, -9.0, 5.0), p(0.0, 9.0, 5.0)];
    let flat = [p(-1.0, 0.0, -3.0), p(0.0, 0.0, -3.0), p(1.0, 0.0, -3.0)];
    let point = [p(0.0, 0.0, -2.0); 3];
    let edge_on = [p(0.0, -1.0, -3.0), p(0.0, 1.0, -3.0), p(0.0, 0.0, -9.0)];
    let empty = Mesh::default();
    for (n, mesh) in [
        empty,
        Mesh::of([through_eye]),
        Mesh::of([flat, point]),
        Mesh::of([edge_on]),
        Mesh::of(vec![through_eye; 300]),
    ]
    .iter()
    .enumerate()
    {
        for (k, pencil) in pencils_at(DVec3::ZERO, DVec3::NEG_Z, 1.0).iter().enumerate() {
            let (hits, _) = agree(&mesh.geometry(), pencil);
            // The film of the ortho camera is as wide as the triangles, and their rays are not the eye's.
            let may_hit = LENSES[k] == Lens::Ortho { height: 3.0 } && n == 3;
            assert!(may_hit || hits.ids().iter().all(|&id| id == NO_TRIANGLE), "{n} {k}");
        }
    }
    let pencils = pencils_at(DVec3::ZERO, DVec3::NEG_Z, 1.0);
    for pencil in &pencils[..2] {
        let (hits, _) = agree(&Mesh::of([behind]).geometry(), pencil);
        assert!(hits.ids().iter().all(|&id| id == NO_TRIANGLE));
    }
    // Six faces see it.
    let (hits, _) = agree(&Mesh::of([behind]).geometry(), &pencils[2]);
    assert!(hits.ids().contains(&0));
}

#[test]
fn no_rays_and_no_triangles() {
    let mesh = cube(1);
    let film = Film::Scattered(Vec::new());
    let pencil = Pencil::new(Origin::Point(DVec3::ZERO), vec![film]).expect("no rays");
    let none = Pencil::new(Origin::Point(DVec3::ZERO), Vec::new()).expect("no films");
    for pencil in [&pencil, &none] {
        let (hits, _) = agree(&mesh.geometry(), pencil);
        assert!(hits.is_empty());
    }
    let rays: &[Ray] = &[];
    let (hits, _) = closest_hit(&mesh.geometry(), rays, &Options::default()).expect("no rays");
    assert!(hits.is_empty() && Rays::General(rays).is_empty());
}

/// t of the box [-s, s]^3 is the least of (±s - o)/d over the axes.
#[test]
fn the_walls_of_a_box() {
    for (n, s) in [(1, 1.0), (7, 1.0), (4, 2_f32.powi(60)), (4, 2_f32.powi(-90))] {
        let mut mesh = cube(n);
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= s);
        let s = f64::from(s);
        let eye = DVec3::new(0.25, -0.5, 0.125) * s;
        for pencil in pencils_at(eye, eye + DVec3::new(0.3, 0.2, -1.0) * s, s) {
            let (hits, _) = agree(&mesh.geometry(), &pencil);
            let is_point = matches!(pencil.origin(), Origin::Point(_));
            for ray in 0..pencil.len() {
                let Ray { origin, direction, .. } = pencil.ray(ray);
                // Parallel rays start on a film that may be wider than the box.
                if origin.abs().max_element() >= s {
                    assert!(!is_point);
                    continue;
                }
                let t = (0..3).map(|k| (s.copysign(direction[k]) - origin[k]) / direction[k]);
                let expected = t.filter(|t| t.is_finite()).fold(f64::INFINITY, f64::min);
                let hit = hits.get(ray).expect("a wall");
                // Two roundings in f64, one to f32.
                let error = (f64::from(hit.t) - expected).abs();
                assert!(error <= expected * 0.501 * f64::from(f32::EPSILON), "{hit:?} {expected}");
            }
        }
    }
}

/// Looking along -z at the plane z = -3, t is the depth: exactly 3 everywhere.
#[test]
fn a_plane_across_the_view() {
    let p = |x: f64, y: f64| DVec3::new(x, y, -3.0);
    let [a, b, c, d] = [p(-1e3, -1e3), p(1e3, -1e3), p(1e3, 1e3), p(-1e3, 1e3)];
    let mesh = Mesh::of([[a, b, c], [a, c, d]]);
    for fov in [0.001, 30.0, 90.0, 179.0] {
        let camera = Camera {
            eye: DVec3::ZERO,
            target: DVec3::NEG_Z,
            up: DVec3::Y,
            lens: Lens::Pinhole { fov },
            width: 101,
            height: 101,
        };
        let pencil = camera.shot().expect("a valid camera").pencil;
        let (hits, _) = agree(&mesh.geometry(), &pencil);
        for (ray, &t) in hits.ts().iter().enumerate() {
            let d = pencil.ray(ray).direction;
            assert_eq!(d.z, -1.0);
            assert_eq!(t, if d.abs().max_element() * 3.0 < 1e3 { 3.0 } else { t });
        }
        assert!(hits.ids().contains(&0) && hits.ids().contains(&1));
    }
    let film = GridFilm::new(40, 40, DVec3::Z * 5.0, DVec3::X, DVec3::Y).expect("a valid film");
    let pencil = Pencil::new(Origin::Infinity(DVec3::NEG_Z * 0.5), vec![Film::Grid(film)]);
    let (hits, _) = agree(&mesh.geometry(), &pencil.expect("in range"));
    assert!(hits.ts().iter().all(|&t| t == 16.0));
}

/// Distances to a sphere of triangles lie between those of its nearest face's plane and of its vertices.
#[test]
fn the_depth_of_a_sphere() {
    let mesh = sphere(5, |_| 1.0);
    let distance = |id: usize| {
        let [a, b, c] = mesh.corners(id);
        a.dot((b - a).cross(c - a).normalize()).abs()
    };
    let least = (0..mesh.triangles.len()).map(distance).fold(1.0, f64::min);
    assert!(least > 0.998);
    for pencil in pencils_at(DVec3::ZERO, DVec3::new(1.0, 0.5, 0.25), 1.0) {
        if matches!(pencil.origin(), Origin::Infinity(_)) {
            continue;
        }
        let (hits, _) = agree(&mesh.geometry(), &pencil);
        for ray in 0..pencil.len() {
            let hit = hits.get(ray).expect("the sphere is closed");
            let r = f64::from(hit.t) * pencil.ray(ray).direction.length();
            assert!(r > least - 1e-6 && r < 1.0 + 1e-6, "{r}");
        }
    }
}
