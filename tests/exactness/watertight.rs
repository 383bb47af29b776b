//! Closed meshes do not leak: a ray at every vertex, edge midpoint and centroid, from many origins, and none escapes.
//!
//! The meshes are closed as point sets: the two triangles of each edge have bit-equal ends. Rays are aimed in f64, so that
//! many pass exactly, and all pass nearly, through an edge or a vertex. Parity says more: a ray from inside crosses the
//! surface an odd number of times, one from outside an even number, and a planar grid is met exactly once.
//!
//! The default run casts about 20 million rays; 0.8 million of them are aimed, which is the costly kind. A longer run takes
//! that many times as many origins; with `UMBEL_SCENES` set to a directory of OBJ files, the closed ones among them are
//! tested as well:
//!
//! ```text
//! UMBEL_WATERTIGHT_TIMES=20 cargo test --release -p umbel --test exactness -- watertight:: --nocapture
//! UMBEL_SCENES=DIRECTORY cargo test --release -p umbel --test exactness -- watertight:: --ignored --nocapture
//! ```
//!
//! Based on: Sven Woop, Carsten Benthin, Ingo Wald, "Watertight Ray/Triangle Intersection", 2013 (the question).

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use std::f64::consts::PI;

use common::generators::meshes::{cube, is_closed, sphere, star, torus};
use common::generators::{Mesh, widen};
use common::random::Random;
use umbel::engine::{Film, GridFilm, Rays};
use umbel::glam::DVec3;
use umbel::{Options, Origin, Path, Pencil, Ray, any_hit, closest_hit};

/// Every vertex, edge midpoint (rounded) and centroid (rounded).
fn targets(mesh: &Mesh) -> Vec<DVec3> {
    let mut targets: Vec<DVec3> = mesh.positions.iter().map(|&p| widen(p)).collect();
    for id in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(id);
        let [u, v, w] = mesh.triangles[id];
        // The edges of a closed mesh come twice.
        let edges = [(u, v, a, b), (v, w, b, c), (w, u, c, a)];
        let midpoints = edges.iter().filter(|(u, v, ..)| u < v);
        targets.extend(midpoints.map(|(_, _, a, b)| (*a + *b) * 0.5));
        targets.push((a + b + c) / 3.0);
    }
    targets
}

/// Counts of a run.
#[derive(Debug, Default)]
struct Tally {
    rays: u64,
    leaks: u64,
}

/// Casts a scattered pencil, by pencils or as general rays, and counts what escapes.
fn cast(mesh: &Mesh, eye: DVec3, targets: &[DVec3], general: bool, tally: &mut Tally) {
    let directions = targets.iter().map(|&p| p - eye).filter(|d| *d != DVec3::ZERO);
    let missed = if general {
        let rays: Vec<Ray> = directions.map(|d| Ray::new(eye, d)).collect();
        misses(mesh, Rays::General(&rays), tally)
    } else {
        let film = Film::Scattered(directions.collect());
        let pencil = Pencil::new(Origin::Point(eye), vec![film]).expect("rays in range");
        misses(mesh, Rays::Pencil(&pencil), tally)
    };
    assert_eq!(missed, 0, "from {eye:?}, general: {general}");
}

/// How many rays hit nothing.
fn misses(mesh: &Mesh, rays: Rays<'_>, tally: &mut Tally) -> u64 {
    let (hits, _) = closest_hit(&mesh.geometry(), rays, &Options::default()).expect("in range");
    let missed = (0..hits.len()).filter(|&ray| hits.get(ray).is_none());
    let missed = missed.count() as u64;
    tally.rays += rays.len() as u64;
    tally.leaks += missed;
    missed
}

/// How many times as many origins as usual.
fn times() -> u32 {
    std::env::var("UMBEL_WATERTIGHT_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// All targets from `pencils` origins as pencils, and from `general` origins as general rays. Origins are inside.
fn none_escapes(mesh: &Mesh, inside: impl Fn(&mut Random) -> DVec3, [pencils, general]: [u32; 2]) {
    assert!(is_closed(mesh));
    let targets = targets(mesh);
    let (mut random, mut tally) = (Random(7), Tally::default());
    let [pencils, general] = [pencils * times(), general * times()];
    for round in 0..pencils + general {
        let eye = match round {
            0 => inside(&mut Random(0)),
            // Also with coordinates of f32.
            r if r % 2 == 1 => widen(inside(&mut random).to_array().map(|x| x as f32)),
            _ => inside(&mut random),
        };
        cast(mesh, eye, &targets, round >= pencils, &mut tally);
    }
    println!("{} triangles: {tally:?}", mesh.triangles.len());
}

/// A point in the ball of radius 0.3, sometimes its centre, or on a plane or an axis through it.
fn near_centre(random: &mut Random) -> DVec3 {
    let flat = random.pick(&[DVec3::ONE, DVec3::ONE, DVec3::new(1.0, 1.0, 0.0), DVec3::X]);
    random.cube() * flat * random.pick(&[0.0, 1e-9, 0.01, 0.17])
}

#[test]
fn a_sphere_does_not_leak() {
    none_escapes(&sphere(6, |_| 1.0), near_centre, [3, 0]);
    none_escapes(&sphere(3, |_| 1.0), near_centre, [20, 10]);
}

#[test]
fn star_shapes_do_not_leak() {
    for seed in 0..8 {
        none_escapes(&star(3, seed), near_centre, [8, 3]);
    }
    none_escapes(&star(5, 9), near_centre, [2, 0]);
}

#[test]
fn a_cube_does_not_leak() {
    let inside = |random: &mut Random| match random.below(3) {
        // Lattice origins: rays along edges of the squares, and exactly through vertices.
        0 => random.lattice(7) * 0.125,
        _ => random.cube() * 0.99,
    };
    none_escapes(&cube(1), inside, [500, 250]);
    none_escapes(&cube(16), inside, [7, 2]);
}

#[test]
fn a_torus_does_not_leak() {
    let inside = |random: &mut Random| {
        let angle = random.signed() * PI;
        // The tube's polygon holds the circle of radius 0.4 cos(pi/24); leave room for the chords along it.
        DVec3::new(angle.cos(), 0.0, angle.sin()) + random.cube() * 0.15
    };
    none_escapes(&torus(64, 24), inside, [8, 2]);
}

/// How many triangles each ray crosses: one query per triangle.
fn crossings(mesh: &Mesh, rays: Rays<'_>) -> Vec<u32> {
    let mut counts = vec![0; rays.len()];
    for path in [Path::Pencil, Path::General] {
        let options = Options { path, ..Options::default() };
        let mut found = vec![0; rays.len()];
        for id in 0..mesh.triangles.len() {
            let single = Mesh::of([mesh.corners(id)]);
            let (any, _) = any_hit(&single.geometry(), rays, &options).expect("in range");
            found.iter_mut().zip(any).for_each(|(n, hit)| *n += u32::from(hit));
        }
        assert!(path == Path::Pencil || found == counts, "the paths differ");
        counts = found;
    }
    counts
}

/// Rays through every feature of a mesh, of an eye and of parallel rays that start on a plane outside.
fn pencils_through(mesh: &Mesh, eye: DVec3, direction: DVec3) -> [Pencil; 2] {
    let targets = targets(mesh);
    let directions = targets.iter().map(|&p| p - eye).collect();
    // Where it is exact the ray passes through the feature; elsewhere it is another ray.
    let starts = targets.iter().map(|&p| p - direction * 8.0).collect();
    [(Origin::Point(eye), directions), (Origin::Infinity(direction), starts)]
        .map(|(origin, samples)| Pencil::new(origin, vec![Film::Scattered(samples)]).expect("in range"))
}

#[test]
fn crossings_are_even_outside_and_odd_inside() {
    let mut random = Random(5);
    let mut crossed = 0;
    for mesh in [cube(2), sphere(2, |_| 1.0), star(2, 1), torus(12, 8)] {
        assert!(is_closed(&mesh));
        let inside = if mesh.triangles.len() == 192 { DVec3::X } else { DVec3::ZERO };
        let lattice = random.lattice(2) + DVec3::new(0.0, 0.0, 8.0);
        for (eye, d) in [(lattice, DVec3::Z), (random.cube() + DVec3::X * 5.0, random.cube())] {
            for pencil in &pencils_through(&mesh, eye, d) {
                let counts = crossings(&mesh, Rays::Pencil(pencil));
                assert!(counts.iter().all(|n| n % 2 == 0), "{counts:?}");
                crossed += counts.iter().filter(|&&n| n > 0).count();
            }
        }
        for eye in [inside, inside + random.cube() * 0.1] {
            let [pencil, _] = pencils_through(&mesh, eye, DVec3::Z);
            let counts = crossings(&mesh, Rays::Pencil(&pencil));
            assert!(counts.iter().all(|n| n % 2 == 1), "{counts:?}");
        }
    }
    assert!(crossed > 1000, "{crossed}");
}

/// A jittered grid over [-1, 1]^2 in the plane z = 0; its interior vertices come first among the targets of `interior`.
fn plane(n: usize, seed: u64) -> (Mesh, Vec<DVec3>) {
    let mut random = Random(seed);
    let (mut mesh, mut interior) = (Mesh::default(), Vec::new());
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let edge = |k: usize| k == 0 || k == n;
        let jitter = |random: &mut Random, k: usize| {
            let place = k as f64 + if edge(k) { 0.0 } else { 0.3 * random.signed() };
            2.0 * place / n as f64 - 1.0
        };
        let (x, y) = (jitter(&mut random, i), jitter(&mut random, j));
        let v = mesh.vertex(DVec3::new(x, y, 0.0));
        if !edge(i) && !edge(j) {
            interior.push(widen(mesh.positions[v as usize]));
        }
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        let flip = random.once_in(2);
        mesh.triangles.extend(if flip { [[a, b, d], [b, c, d]] } else { [[a, b, c], [c, a, d]] });
    }
    (mesh, interior)
}

#[test]
fn a_planar_grid_is_met_exactly_once() {
    for seed in 0..4 {
        let (mesh, mut points) = plane(16, seed);
        let middles: Vec<_> = points.windows(2).map(|p| (p[0] + p[1]) * 0.5).collect();
        points.extend(middles);
        let mut random = Random(seed);
        let (eye, d) = (random.cube() + DVec3::Z * 3.0, random.pick(&[DVec3::NEG_Z, DVec3::Z]));
        let directions = points.iter().map(|&p| p - eye).collect();
        let starts = points.iter().map(|&p| p - d * 2.0).collect();
        for (origin, samples) in [(Origin::Point(eye), directions), (Origin::Infinity(d), starts)] {
            let pencil = Pencil::new(origin, vec![Film::Scattered(samples)]).expect("in range");
            let counts = crossings(&mesh, Rays::Pencil(&pencil));
            assert!(counts.iter().all(|&n| n == 1), "{counts:?}");
            // The same triangle, whatever its id.
            let mut reversed = mesh.clone();
            reversed.triangles.reverse();
            let last = mesh.triangles.len() as u32 - 1;
            let ask = |mesh: &Mesh| closest_hit(&mesh.geometry(), &pencil, &Options::default());
            let [(one, _), (other, _)] = [ask(&mesh), ask(&reversed)].map(|r| r.expect("in range"));
            assert!(one.ids().iter().zip(other.ids()).all(|(a, b)| *a == last - b));
            assert_eq!(one.ts(), other.ts());
        }
    }
}

/// Six films around an eye inside: every pixel hits, those on the edges and corners of faces too.
#[test]
fn cube_maps_of_closed_rooms_are_full() {
    let mut tally = Tally::default();
    for mesh in [sphere(5, |_| 1.0), star(4, 3), cube(8)] {
        for (n, step) in [(512, 512.0), (511, 510.0), (33, 32.0)] {
            // With step n - 1 the outermost rays lie exactly on the edges of the cube.
            let film = |k: usize| {
                let (m, s) = (DVec3::AXES[k % 3], if k < 3 { 1.0 } else { -1.0 });
                let [r, u] = [DVec3::AXES[(k + 1) % 3], DVec3::AXES[(k + 2) % 3]];
                let film = GridFilm::new(n, n, m * s, r / step, u / step);
                Film::Grid(film.expect("a valid film"))
            };
            for eye in [DVec3::ZERO, DVec3::new(0.125, 0.0, -0.25)] {
                let pencil = Pencil::new(Origin::Point(eye), (0..6).map(film).collect());
                let pencil = pencil.expect("rays in range");
                assert_eq!(misses(&mesh, Rays::Pencil(&pencil), &mut tally), 0);
            }
        }
    }
    println!("cube maps: {tally:?}");
}

/// A mesh of an OBJ file of the shared scenes.
fn load(path: &std::path::Path) -> Mesh {
    let name = path.to_str().expect("a plain path");
    let scene = umbel::load(name, umbel::LoadOptions::default()).expect("a readable scene");
    Mesh { positions: scene.positions, triangles: scene.triangles }
}

/// From points inside of a closed scene every ray hits something.
#[test]
#[ignore = "needs UMBEL_SCENES"]
fn closed_scenes_do_not_leak() {
    let directory = std::env::var("UMBEL_SCENES").expect("UMBEL_SCENES names a directory");
    let entries = std::fs::read_dir(directory).expect("a directory");
    let mut paths: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    for path in paths {
        if path.extension().is_none_or(|e| e != "obj") {
            continue;
        }
        let mesh = load(&path);
        let closed = is_closed(&mesh);
        println!("{}: {} triangles, closed: {closed}", path.display(), mesh.triangles.len());
        if !closed {
            continue;
        }
        let (targets, mut tally) = (targets(&mesh), Tally::default());
        for eye in inner_points(&mesh) {
            cast(&mesh, eye, &targets, false, &mut tally);
        }
        println!("{tally:?}");
    }
}

/// Points from which +X crosses the surface an odd number of times: inside, whatever the orientation.
fn inner_points(mesh: &Mesh) -> Vec<DVec3> {
    let mut random = Random(3);
    let bounds = umbel::engine::Aabb::of_points(mesh.positions.iter().copied());
    let (centre, extent) = (DVec3::from_array(bounds.centre()), DVec3::from_array(bounds.extent()));
    let points: Vec<DVec3> = (0..400).map(|_| centre + random.cube() * extent * 0.5).collect();
    let mut rays: Vec<Ray> = points.iter().map(|&p| Ray::new(p, DVec3::X)).collect();
    let mut crossed = vec![0_u32; rays.len()];
    loop {
        // Step from hit to hit. Hits at one distance count once: a point misjudged that way is seen to leak, not hidden.
        let (hits, _) = closest_hit(&mesh.geometry(), &rays[..], &Options::default()).expect("ok");
        let mut any = false;
        for (k, ray) in rays.iter_mut().enumerate() {
            if let Some(hit) = hits.get(k) {
                crossed[k] += 1;
                ray.t_min = f64::from(hit.t) * (1.0 + 1e-6);
                any = true;
            }
        }
        if !any {
            break;
        }
    }
    let inside = points.iter().zip(crossed).filter(|(_, n)| n % 2 == 1);
    inside.map(|(p, _)| *p).take(3 * times() as usize).collect()
}
