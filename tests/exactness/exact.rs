//! The engine against the oracle: every id and every bit of t, on small scenes that provoke trouble.
//!
//! Each case makes a scene (see [`generators::Kind`]) and asks for general rays, a grid film and a scattered film of a
//! point, and the same of a direction; by pencils and by the general path; the closest hit and any hit.
//!
//! A longer run prints how many rays and coverage decisions (rays x triangles) it compared; the count is that of cases:
//!
//! ```text
//! UMBEL_EXACT_CASES=100000 cargo test --release -p umbel --test exactness -- exact:: --ignored --nocapture
//! ```
//!
//! Based on: section 5 of the design; Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990.

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators::{self, KINDS, Kind, Mesh};
use common::oracle::{self, Dyadic, OracleRay, Ties};
use common::random::Random;
use proptest::prelude::*;
use umbel::engine::{Film, GridFilm, Rays};
use umbel::glam::DVec3;
use umbel::{NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, any_hit, closest_hit};

/// What was compared.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    rays: u64,
    decisions: u64,
    hits: u64,
}

impl Tally {
    fn add(&mut self, other: Self) {
        self.rays += other.rays;
        self.decisions += other.decisions;
        self.hits += other.hits;
    }
}

/// Compares both verbs on both paths with the oracle.
pub(super) fn compare(mesh: &Mesh, rays: Rays<'_>) -> Tally {
    let ray = |i: usize| match rays {
        Rays::Pencil(pencil) => pencil.ray(i),
        Rays::General(rays) => rays[i],
    };
    let ties = match rays {
        Rays::Pencil(pencil) if matches!(pencil.origin(), Origin::Infinity(_)) => Ties::Origin,
        _ => Ties::Direction,
    };
    let expected: Vec<_> = (0..rays.len())
        .map(|i| oracle::closest(&mesh.positions, &mesh.triangles, &oracle_ray(&ray(i), ties)))
        .collect();
    let geometry = mesh.geometry();
    for path in [Path::Pencil, Path::General] {
        let options = Options { path, ..Options::default() };
        let (hits, _) = closest_hit(&geometry, rays, &options).expect("rays in range");
        let (any, _) = any_hit(&geometry, rays, &options).expect("rays in range");
        assert_eq!((hits.len(), any.len()), (expected.len(), expected.len()));
        for (i, expected) in expected.iter().enumerate() {
            let (id, t) = expected.unwrap_or((NO_TRIANGLE, f32::INFINITY));
            let found = (hits.ids()[i], hits.ts()[i].to_bits());
            assert!(
                found == (id, t.to_bits()) && any[i] == expected.is_some(),
                "ray {i} {path:?}: found {:?} {} {}, expected {expected:?}\n{:?}\n{mesh:?}\n{rays:?}",
                hits.get(i),
                hits.ts()[i],
                any[i],
                ray(i)
            );
        }
    }
    Tally {
        rays: expected.len() as u64,
        decisions: expected.len() as u64 * mesh.triangles.len() as u64,
        hits: expected.iter().flatten().count() as u64,
    }
}

fn oracle_ray(ray: &Ray, ties: Ties) -> OracleRay {
    OracleRay {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
        ties,
    }
}

/// Rays that share nothing, with intervals that end anywhere, also exactly at hits.
fn general_rays(random: &mut Random, kind: Kind, mesh: &Mesh, count: usize) -> Vec<Ray> {
    let ray = |_| {
        let origin = generators::eye(random, kind, mesh);
        let direction = generators::direction(random, kind, mesh, origin);
        let mut ray = Ray::new(origin, direction);
        // Towards a feature t = 1 is exactly, or nearly, at a hit; the oracle's rounded t is near any.
        let near = oracle::closest(&mesh.positions, &mesh.triangles, &oracle_ray(&ray, Ties::Direction));
        let near = near.map_or(0.75, |(_, t)| f64::from(t));
        match random.below(6) {
            0 => ray.t_max = 1.0,
            1 => ray.t_min = 1.0,
            2 => ray.t_max = near,
            3 => ray.t_min = near,
            4 => (ray.t_min, ray.t_max) = (near * 0.5, near * (1.0 + f64::EPSILON)),
            _ => {}
        }
        ray
    };
    (0..count).map(ray).collect()
}

/// A grid film and a scattered film of one origin at a point.
fn point_pencil(random: &mut Random, kind: Kind, mesh: &Mesh, count: usize) -> Option<Pencil> {
    let eye = generators::eye(random, kind, mesh);
    let grid = generators::film(random, kind, mesh, eye)?;
    let scattered = (0..count).map(|_| generators::direction(random, kind, mesh, eye)).collect();
    let films = vec![Film::Grid(grid), Film::Scattered(scattered)];
    Pencil::new(Origin::Point(eye), films).ok()
}

/// A grid film and a scattered film of one origin at infinity.
fn infinity_pencil(random: &mut Random, kind: Kind, mesh: &Mesh, count: usize) -> Option<Pencil> {
    let eye = generators::eye(random, kind, mesh);
    let direction = generators::direction(random, kind, mesh, eye);
    let grid = generators::starts(random, kind, mesh, direction)?;
    let step = random.pick(&[0.0, 1.0, 2.0]);
    let scattered = (0..count).map(|_| {
        // Exactly, or nearly, through a feature.
        let start = generators::feature(random, mesh) - direction * step;
        generators::on_grid(start)
    });
    let films = vec![Film::Grid(grid), Film::Scattered(scattered.collect())];
    Pencil::new(Origin::Infinity(direction), films).ok()
}

/// One scene, all kinds of rays.
fn case(seed: u64, kind: Kind) -> Tally {
    let mut random = Random(seed);
    let most = random.pick(&[1, 4, 16, 60]);
    let mesh = generators::scene(&mut random, kind, most);
    let count = if kind == Kind::Mixed { 12 } else { 40 };
    let mut tally = compare(&mesh, Rays::General(&general_rays(&mut random, kind, &mesh, count)));
    let pencils =
        [point_pencil(&mut random, kind, &mesh, count), infinity_pencil(&mut random, kind, &mesh, count)];
    for pencil in pencils.iter().flatten() {
        tally.add(compare(&mesh, Rays::Pencil(pencil)));
    }
    tally
}

/// `cases` of one kind; enough of them must have been films and hits.
fn run(kind: Kind, cases: u64) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..cases {
        tally.add(case(seed * 8 + kind as u64, kind));
    }
    assert!(tally.rays > cases * 60, "{kind:?}: {tally:?}");
    assert!(tally.hits > tally.rays / 40, "{kind:?}: {tally:?}");
    println!("{kind:?}: {tally:?}");
    tally
}

#[test]
fn lattice() {
    run(Kind::Lattice, 900);
}

#[test]
fn floats() {
    run(Kind::Floats, 500);
}

#[test]
fn mixed_magnitudes() {
    run(Kind::Mixed, 250);
}

#[test]
fn subnormal_coordinates() {
    run(Kind::Subnormal, 500);
}

#[test]
fn far_from_the_origin() {
    run(Kind::Shifted, 500);
}

#[test]
fn slivers() {
    run(Kind::Slivers, 500);
}

#[test]
fn nearly_coplanar_layers() {
    run(Kind::Layers, 500);
}

#[test]
#[ignore = "as long as UMBEL_EXACT_CASES says"]
fn long_run() {
    let cases = std::env::var("UMBEL_EXACT_CASES").map_or(7000, |n| n.parse().expect("a number"));
    let threads: Vec<_> = [0, 1]
        .map(|half| {
            std::thread::spawn(move || {
                let mut tally = Tally::default();
                for n in (half..cases).step_by(2) {
                    // Other seeds than the short runs have.
                    tally.add(case((1 << 40) + n, KINDS[(n / 2) as usize % KINDS.len()]));
                }
                tally
            })
        })
        .into_iter()
        .collect();
    let mut tally = Tally::default();
    for thread in threads {
        tally.add(thread.join().expect("no mismatch"));
    }
    println!(
        "{cases} cases: {} rays, {} coverage decisions, {} hits, no mismatch",
        tally.rays, tally.decisions, tally.hits
    );
}

fn lattice_point(n: i8) -> impl Strategy<Value = DVec3> {
    [-n..=n, -n..=n, -n..=n].prop_map(|p| DVec3::from_array(p.map(f64::from)))
}

fn lattice_mesh() -> impl Strategy<Value = Mesh> {
    let corner = || lattice_point(2);
    prop::collection::vec([corner(), corner(), corner()], 1..12).prop_map(Mesh::of)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1500,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// As the loops above, but what fails is made small.
    #[test]
    fn small_lattices(
        mesh in lattice_mesh(),
        eye in lattice_point(3),
        spread in prop::collection::vec(lattice_point(3), 1..20),
        span in [lattice_point(2), lattice_point(2), lattice_point(2)],
        size in [1..10_u32, 1..10_u32],
        end in prop::option::of(1..5_u8),
    ) {
        let spread: Vec<DVec3> = spread.into_iter().filter(|d| *d != DVec3::ZERO).collect();
        let mut rays: Vec<Ray> = spread.iter().map(|&d| Ray::new(eye, d)).collect();
        if let (Some(end), Some(ray)) = (end, rays.first_mut()) {
            ray.t_max = f64::from(end) * 0.5;
        }
        compare(&mesh, Rays::General(&rays));
        let [f, r, u] = span;
        let grid = Film::Grid(GridFilm::new(size[0], size[1], f, r, u).expect("finite vectors"));
        for (origin, samples) in [
            (Origin::Point(eye), spread.clone()),
            (Origin::Infinity(spread.first().copied().unwrap_or(DVec3::X)), spread),
        ] {
            let scattered = Pencil::new(origin, vec![Film::Scattered(samples)]).expect("small integers");
            compare(&mesh, Rays::Pencil(&scattered));
            if let Ok(pencil) = Pencil::new(origin, vec![grid.clone()]) {
                compare(&mesh, Rays::Pencil(&pencil));
            }
        }
    }
}

/// The rays of a film are F + X·R + Y·U exactly, and F, R, U are near what was asked for.
#[test]
fn rays_of_films_are_exact() {
    let mut random = Random(11);
    for round in 0..400 {
        let kind = KINDS[round % KINDS.len()];
        let mesh = generators::scene(&mut random, kind, 3);
        let eye = generators::eye(&mut random, kind, &mesh);
        let Some(film) = generators::film(&mut random, kind, &mesh, eye) else {
            continue;
        };
        let (w, h, span) = (film.width(), film.height(), film.span());
        let Ok(pencil) = Pencil::new(Origin::Point(eye), vec![Film::Grid(film)]) else {
            continue;
        };
        for i in 0..pencil.len() {
            let number = |n: i64| Dyadic::from_i64(n);
            let (column, row) = (i as i64 % i64::from(w), i as i64 / i64::from(w));
            let x = number(2 * column + 1 - i64::from(w));
            let y = number(i64::from(h) - 1 - 2 * row);
            let exact = [0, 1, 2].map(|k| {
                let [f, r, u] = span.map(|v| Dyadic::from_f64(v[k]));
                f.plus(&x.times(&r)).plus(&y.times(&u)).exact_f64()
            });
            assert_eq!(pencil.ray(i), Ray::new(eye, DVec3::from_array(exact)));
        }
    }
}

/// An eye so near a triangle's plane that f64 cannot tell the side, a film of one column or row, and something nearer that
/// comes later: the depth bounds must not take the doubtful hit for a certain one.
#[test]
fn a_doubtful_hit_hides_nothing() {
    let eye = DVec3::new(0.0, 2_f64.powi(-60), 0.0);
    let d = DVec3::new(1.0, 1.0 - 2_f64.powi(-50), 0.0);
    let plane = [DVec3::new(-4.0, -4.0, -3.0), DVec3::new(5.0, 5.0, -3.0), DVec3::new(0.0, 0.0, 7.0)];
    let nearer = |x: f64| [[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 0.0, 1.0]].map(DVec3::from_array);
    for (w, h) in [(1, 1), (1, 3), (3, 1), (2, 2)] {
        for first in [true, false] {
            let far = (0..300).map(|k| nearer(2.0 + f64::from(k)));
            let near = (0..300).map(|k| nearer(1e-4 + 1e-7 * f64::from(k)));
            let mut mesh = Mesh::of(std::iter::once(plane).chain(far).chain(near));
            if !first {
                mesh.triangles.reverse();
            }
            let film = GridFilm::new(w, h, d, DVec3::Z * 1e-3, DVec3::new(0.0, 1e-3, 0.0));
            let film = Film::Grid(film.expect("a valid film"));
            let pencil = Pencil::new(Origin::Point(eye), vec![film]).expect("in range");
            compare(&mesh, Rays::Pencil(&pencil));
        }
    }
}
