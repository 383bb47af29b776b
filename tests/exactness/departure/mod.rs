//! Leaving a surface: every sentence that `src/objects/offset.rs` promises, with sides decided in the oracle's integers.
//!
//! The start point lies on the plane or on the side asked for, at most 4 steps from the rounded inset point. From there
//! neither the triangle, nor one in its plane, nor anything behind the plane is hit, down to grazing angles of 1e-7; the
//! answer is the oracle's. Closed rooms do not leak, and convex solids do not see themselves.
//!
//! The longer run takes that many times as many departures:
//!
//! ```text
//! UMBEL_DEPARTURE_TIMES=50 cargo test --release -p umbel --test exactness -- departure:: --nocapture
//! ```
//!
//! Based on: section 5 of the design, "Leaving a surface".

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

mod start;

use common::generators;
use common::generators::meshes::{cube, is_closed, sphere, star, torus};
use common::generators::{KINDS, Kind, Mesh, widen};
use common::oracle::{self, OracleRay, Ties};
use common::random::Random;
use common::sides;
use start::{check_point, mix, weights};
use umbel::engine::Side;
use umbel::glam::DVec3;
use umbel::{Hits, NO_TRIANGLE, Options, Ray, TriangleId, closest_hit};

/// How many times as much as usual.
fn times() -> usize {
    std::env::var("UMBEL_DEPARTURE_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// A direction at an angle of 1e-7 to 1 from the triangle's plane, to any side.
fn grazing(random: &mut Random, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let scale = |v: DVec3| if v == DVec3::ZERO { DVec3::X } else { v / v.abs().max_element() };
    let (x, y) = (scale(b - a), scale(c - a));
    let normal = scale(x.cross(y));
    let tangent = scale(x * random.signed() + y * random.signed());
    let angle = random.pick(&[1e-7, 1e-6, 1e-4, 1e-2, 1.0]) * random.pick(&[1.0, -1.0]);
    match random.below(5) {
        0 => random.pick(&DVec3::AXES) * random.pick(&[1.0, -1.0]),
        1 => random.cube(),
        _ => tangent + normal * angle,
    }
}

/// A ray that left triangle `from`.
struct Departure {
    from: u32,
    ray: Ray,
}

/// Leaves triangle `id` along `d`: the side is exact, and the start is that of `leave`. `None` in the plane.
fn depart(mesh: &Mesh, id: u32, weights: [f64; 3], d: DVec3) -> Option<Departure> {
    let geometry = mesh.geometry();
    let expected = match sides::facing(mesh.corners(id as usize), d) {
        1 => Some(Side::Front),
        -1 => Some(Side::Back),
        _ => None,
    };
    assert_eq!(geometry.side_toward(TriangleId(id), d), expected, "{:?} {d:?}", mesh.corners(id as usize));
    let ray = geometry.ray_from(TriangleId(id), weights, d);
    assert_eq!(ray.is_some(), expected.is_some());
    let p = check_point(mesh, id, weights, expected?);
    assert_eq!(ray, Some(Ray::new(p, d)));
    ray.map(|ray| Departure { from: id, ray })
}

/// Casts the rays. None hits its own triangle, its plane, or what is behind it. Some are compared with the oracle.
fn cast(mesh: &Mesh, departures: &[Departure], compared: usize) -> Hits {
    let rays: Vec<Ray> = departures.iter().map(|d| d.ray).collect();
    let (hits, _) = closest_hit(&mesh.geometry(), &rays[..], &Options::default()).expect("in range");
    for (i, Departure { from, ray }) in departures.iter().enumerate() {
        if i < compared {
            let oracle_ray = OracleRay {
                origin: ray.origin.to_array(),
                direction: ray.direction.to_array(),
                t_min: 0.0,
                t_max: f64::INFINITY,
                ties: Ties::Direction,
            };
            let expected = oracle::closest(&mesh.positions, &mesh.triangles, &oracle_ray);
            let (id, t) = expected.unwrap_or((NO_TRIANGLE, f32::INFINITY));
            assert_eq!((hits.ids()[i], hits.ts()[i].to_bits()), (id, t.to_bits()), "{ray:?}");
        }
        if let Some(hit) = hits.get(i) {
            assert_ne!(hit.id.0, *from, "{ray:?} hits what it left");
            let plane = mesh.corners(*from as usize);
            let side = sides::facing(plane, ray.direction);
            let other = mesh.corners(hit.id.0 as usize);
            let before = other.iter().any(|&p| sides::side(plane, p) == side);
            assert!(before, "{ray:?} left {plane:?} and hits {other:?} behind it");
        }
    }
    hits
}

/// `count` departures from random triangles of a mesh.
fn departures(random: &mut Random, mesh: &Mesh, count: usize) -> Vec<Departure> {
    let leave = |_| {
        let id = random.below(mesh.triangles.len());
        let (weights, d) = (weights(random), grazing(random, mesh.corners(id)));
        depart(mesh, id as u32, weights, d)
    };
    (0..count).filter_map(leave).collect()
}

#[test]
fn what_lies_behind_is_never_hit() {
    let mut random = Random(1);
    for kind in KINDS {
        let (mut left, mut hit) = (0, 0);
        for _ in 0..60 * times() {
            let mesh = generators::scene(&mut random, kind, 30);
            let departures = departures(&mut random, &mesh, 60);
            let hits = cast(&mesh, &departures, if kind == Kind::Mixed { 5 } else { 60 });
            left += departures.len();
            hit += hits.ids().iter().filter(|&&id| id != NO_TRIANGLE).count();
        }
        println!("{kind:?}: {left} departures, {hit} hits");
        assert!(left > 1000 && hit > 100, "{kind:?}: {left} {hit}");
    }
}

#[test]
fn all_scales() {
    let mut random = Random(2);
    for exponent in -30..=30 {
        for kind in [Kind::Lattice, Kind::Floats, Kind::Slivers] {
            let mut mesh = generators::scene(&mut random, kind, 20);
            let scale = 10_f64.powi(exponent);
            let scaled = |x: f32| (f64::from(x) * scale) as f32;
            mesh.positions.iter_mut().for_each(|p| *p = p.map(scaled));
            let departures = departures(&mut random, &mesh, 60 * times());
            cast(&mesh, &departures, 20);
        }
    }
}

/// Aspect 1e6, and far worse: corners on one line but for the last bit.
#[test]
fn thin_triangles() {
    let mut random = Random(3);
    for thickness in [1e-3, 1e-6, 1e-7] {
        for _ in 0..300 * times() {
            let [a, b, off] = [random.cube(), random.cube(), random.cube()];
            let mesh = Mesh::of([[a, b, a + (b - a) * random.signed() + off * thickness]]);
            departures(&mut random, &mesh, 10);
        }
    }
    // Differences of such corners are no f64: the normal must come from something better.
    for _ in 0..300 * times() {
        let b = random.lattice(9);
        let tiny = random.cube() * random.pick(&[1e-12, 1e-20, 1e-30]);
        let mesh = Mesh::of([[tiny, b, b * random.pick(&[2.0, -1.0, 0.5])]]);
        departures(&mut random, &mesh, 10);
    }
}

/// A few units in the last place of each other, next to the end of f32, and among the subnormal numbers.
#[test]
fn ends_of_the_range() {
    let mut random = Random(4);
    let large = |random: &mut Random| {
        let mut x = f32::MAX;
        for _ in 0..random.below(random.0 as usize % 12 + 1) {
            x = x.next_down();
        }
        f64::from(x) * if random.once_in(9) { -1.0 } else { 1.0 }
    };
    let tiny = |random: &mut Random| f64::from(f32::from_bits(1)) * random.around(40);
    for round in 0..4000 * times() {
        let corners = [(); 3].map(|()| {
            let mut coordinate = || if round % 4 == 0 { tiny(&mut random) } else { large(&mut random) };
            DVec3::new(coordinate(), coordinate(), coordinate())
        });
        departures(&mut random, &Mesh::of([corners]), 6);
    }
}

/// Planes through the origin: all coordinates of the point cancel, so that their own ulp is far below the error of f64.
#[test]
fn points_near_the_origin() {
    let mut random = Random(5);
    for _ in 0..3000 * times() {
        let (a, b) = (random.lattice(7), random.lattice(7));
        let mesh = Mesh::of([[a, b, -(a * random.pick(&[1.0, 2.0, 0.5]) + b)]]);
        let [a, b, c] = mesh.corners(0);
        // The weights of the origin.
        let area = |a: DVec3, b: DVec3| a.cross(b).length();
        let sum = area(a, b) + area(b, c) + area(c, a);
        if sum == 0.0 {
            continue;
        }
        let weights = [area(b, c) / sum, area(c, a) / sum, area(a, b) / sum];
        for side in [Side::Front, Side::Back] {
            check_point(&mesh, 0, weights, side);
            check_point(&mesh, 0, [1.0 / 3.0; 3], side);
        }
    }
}

/// Rays into a closed room always hit; of a convex one, rays outward never do.
fn room(mesh: &Mesh, convex: bool, inner: f64) {
    assert!(is_closed(mesh));
    let mut random = Random(6);
    let mut all = Vec::new();
    for id in (0..mesh.triangles.len()).cycle().take(3000 * times()) {
        let [a, b, c] = mesh.corners(id);
        // Meshes of the generators wind either way.
        let out = (b - a).cross(c - a);
        let mut d = grazing(&mut random, [a, b, c]);
        let mut weights = weights(&mut random);
        weights = weights.map(|w| w * (1.0 - inner) + inner / 3.0);
        if random.once_in(3) {
            d = -out / out.abs().max_element() * random.pick(&[1.0, -1.0]) + random.cube() * 0.1;
        }
        all.extend(depart(mesh, id as u32, weights, d));
    }
    let hits = cast(mesh, &all, 100);
    let mut counts = [0; 2];
    for (i, departure) in all.iter().enumerate() {
        let corners = mesh.corners(departure.from as usize);
        let front_is_out = sides::side(corners, interior(mesh, corners)) < 0;
        let outward = (sides::facing(corners, departure.ray.direction) > 0) == front_is_out;
        counts[usize::from(outward)] += 1;
        let hit = hits.get(i).is_some();
        assert!(hit || outward, "a leak: {:?} from {corners:?}", departure.ray);
        assert!(!hit || !outward || !convex, "{:?} from {corners:?}", departure.ray);
    }
    println!("room of {} triangles: {} inward, {} outward", mesh.triangles.len(), counts[0], counts[1]);
    assert!(counts.iter().all(|&n| n > 500));
}

/// A point inside, on the inner side of a triangle: the centre, or that of the tube of the torus.
fn interior(mesh: &Mesh, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let ring = mesh.positions.iter().all(|p| widen(*p).length() > 0.55);
    let middle = (a + b + c) * (1.0 / 3.0);
    let flat = DVec3::new(middle.x, 0.0, middle.z);
    if ring && mesh.positions.len() == 256 { flat.normalize() } else { DVec3::ZERO }
}

/// Whether no vertex is outside of any triangle's plane.
fn is_convex(mesh: &Mesh) -> bool {
    (0..mesh.triangles.len()).all(|id| {
        let corners = mesh.corners(id);
        let inner = sides::side(corners, DVec3::ZERO);
        mesh.positions.iter().all(|&p| sides::side(corners, widen(p)) != -inner)
    })
}

#[test]
fn convex_rooms() {
    for mesh in [cube(1), cube(4), cube(7), sphere(1, |_| 1.0), sphere(2, |_| 1.0)] {
        // A seventh of 2 is no f32, but each wall is a plane all the same.
        assert!(is_convex(&mesh));
        room(&mesh, true, 0.0);
    }
}

/// Away from its edges, where a rounded point could lie behind the neighbour.
#[test]
fn other_closed_rooms() {
    for mesh in [sphere(5, |_| 1.0), star(2, 3), torus(32, 8)] {
        room(&mesh, false, 1e-3);
    }
}

/// A floor of many triangles in one plane, tilted or not: rays from it meet nothing, whatever the angle.
#[test]
fn coplanar_neighbours() {
    let mut random = Random(7);
    for round in 0..40 {
        // Lattice vectors keep the plane exact.
        let [o, x, y] = if round % 2 == 0 {
            [DVec3::Y * random.around(5), DVec3::X, DVec3::Z]
        } else {
            [random.lattice(9), random.lattice(5), random.lattice(5)]
        };
        if x.cross(y) == DVec3::ZERO {
            continue;
        }
        let at = |i: i32, j: i32| o + x * f64::from(i) + y * f64::from(j);
        let square = |k: i32| {
            let (i, j) = (k / 5 - 2, k % 5 - 2);
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j + 1), at(i + 1, j), at(i, j + 1)]]
        };
        let mesh = Mesh::of((0..25).flat_map(square));
        let all = departures(&mut random, &mesh, 100 * times());
        let hits = cast(&mesh, &all, 10);
        assert!(hits.ids().iter().all(|&id| id == NO_TRIANGLE));
    }
}

/// Weights lie in [0, 1], their sum within 2 ulp of 1, and they give the point of the ray.
#[test]
fn barycentrics() {
    let mut random = Random(8);
    let (mut hit, mut placed) = (0, 0);
    for round in 0..350 * times() {
        let kind = KINDS[round % KINDS.len()];
        let mesh = generators::scene(&mut random, kind, 10);
        let rays: Vec<Ray> = (0..60)
            .map(|_| {
                let eye = generators::eye(&mut random, kind, &mesh);
                Ray::new(eye, generators::direction(&mut random, kind, &mesh, eye))
            })
            .collect();
        let geometry = mesh.geometry();
        let (hits, _) = closest_hit(&geometry, &rays[..], &Options::default()).expect("in range");
        for (i, ray) in rays.iter().enumerate() {
            let Some(found) = hits.get(i) else { continue };
            hit += 1;
            let weights = geometry.barycentrics(found.id, ray);
            assert!(weights.iter().all(|w| (0.0..=1.0).contains(w)), "{weights:?}");
            let sum = weights[0] + weights[1] + weights[2];
            assert!((sum - 1.0).abs() <= 2.0 * f64::EPSILON, "{weights:?}");
            let corners = mesh.corners(found.id.0 as usize);
            let p = mix(corners, weights);
            let q = ray.origin + ray.direction * f64::from(found.t);
            let size = ray.origin.abs().max_element() + p.abs().max_element() + q.abs().max_element();
            // Rays in the plane, but for rounding, have no certain point.
            let normal = geometry.normal(found.id);
            let steep = normal.dot(ray.direction).abs() > 1e-2 * ray.direction.length();
            let certain = steep && matches!(kind, Kind::Floats | Kind::Lattice);
            assert!(!certain || (p - q).length() <= 1e-5 * size, "{kind:?} {p:?} {q:?}");
            placed += usize::from(certain);
        }
    }
    println!("{hit} hits, {placed} places compared");
    assert!(hit > 2000 && placed > 500, "{hit} {placed}");
}
