//! Culls may keep what is missed and never drop what is hit: frusta and cones against boxes that rays barely touch.
//!
//! A ray of the pencil and a dyadic t give a point o + t·d, known exactly. A box is built that holds it: just inside, on a
//! face, an edge or a corner, flat, a single point, or around the origin as well. The bound must keep that box, and its
//! lower bound of t must not exceed t. Boxes clearly outside must be dropped: a bound that keeps everything fails as well.
//!
//! Based on: section 5 of the design (culls).

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators;
use common::oracle::Dyadic;
use common::random::Random;
use proptest::prelude::*;
use umbel::engine::{Aabb, Cone, Film, Frustum, GridFilm};
use umbel::glam::DVec3;
use umbel::{Origin, Pencil, Ray};

/// The greatest f32 at most x, and the least at least x; `None` beyond the range of f32.
fn neighbours(x: &Dyadic, near: f64) -> Option<(f32, f32)> {
    let compare = |y: f32| Dyadic::from_f64(f64::from(y)).compare(x);
    let (mut lo, mut hi) = (near as f32, near as f32);
    if near.is_nan() || near.abs() >= 1e37 {
        return None;
    }
    while compare(lo).is_gt() {
        lo = lo.next_down();
    }
    while compare(hi).is_lt() {
        hi = hi.next_up();
    }
    Some((lo, hi))
}

/// A box that holds o + t·d exactly: per axis its shape (barely, touched from above, from below, around, around the
/// origin) and how far it extends beyond the point.
fn box_at(ray: &Ray, t: f64, shape: [usize; 3], extent: [f64; 3]) -> Option<Aabb> {
    let mut bounds = Aabb::EMPTY;
    for k in 0..3 {
        let (o, d) = (ray.origin[k], ray.direction[k]);
        let exact = Dyadic::from_f64(o).plus(&Dyadic::from_f64(t).times(&Dyadic::from_f64(d)));
        let (lo, hi) = neighbours(&exact, o + t * d)?;
        let (below, above) = ((f64::from(lo) - extent[k]) as f32, (f64::from(hi) + extent[k]) as f32);
        (bounds.lo[k], bounds.hi[k]) = match shape[k] {
            0 => (lo, hi),
            1 => (lo, above),
            2 => (below, hi),
            3 => (below, above),
            _ => (lo.min((o as f32).next_down()), hi.max((o as f32).next_up())),
        };
    }
    let finite = bounds.lo.iter().chain(&bounds.hi).all(|x| x.is_finite());
    finite.then_some(bounds)
}

/// A frustum over a part of a film, and a ray of that part.
fn frustum_and_ray(random: &mut Random, origin: Origin, film: GridFilm) -> Option<(Frustum, Ray)> {
    let pencil = Pencil::new(origin, vec![Film::Grid(film)]).ok()?;
    let Film::Grid(film) = &pencil.films()[0] else {
        unreachable!("a grid was given");
    };
    let mut range = |n: u32| {
        let [a, b] = [(); 2].map(|()| random.below(n as usize) as u32);
        let inner = a.min(b) + random.below((a.abs_diff(b) + 1) as usize) as u32;
        // Rays on the border are the hard ones.
        ([a.min(b), a.max(b)], random.pick(&[a, b, inner]))
    };
    let ((columns, i), (rows, j)) = (range(film.width()), range(film.height()));
    let frustum = Frustum::over_grid(origin, film, columns, rows)?;
    Some((frustum, pencil.ray((j * film.width() + i) as usize)))
}

/// Five random shapes at the given size; counts what was checked.
fn check(random: &mut Random, ray: &Ray, size: f64, enter: impl Fn(&Aabb) -> Option<f64>) -> u32 {
    let mut checked = 0;
    for _ in 0..5 {
        let t = 2_f64.powi(random.around(6) as i32) * (1 + random.below(7)) as f64;
        let shape = [(); 3].map(|()| random.below(5));
        let extent = [(); 3].map(|()| size * random.pick(&[0.0, 1e-6, 0.01, 1.0, 1e3]));
        let Some(bounds) = box_at(ray, t, shape, extent) else {
            continue;
        };
        let entered = enter(&bounds);
        assert!(entered.is_some_and(|least| least <= t), "{entered:?} for t = {t} of {ray:?} in {bounds:?}");
        checked += 1;
    }
    checked
}

/// A film of any size, place, field of view and orientation.
fn any_film(random: &mut Random, at_infinity: bool) -> (Origin, Option<GridFilm>, f64) {
    let size = 10_f64.powi(random.around(30) as i32);
    let place = size * random.pick(&[0.0, 1.0, 1e6, 1e-6]);
    let point = generators::on_grid(random.cube() * place);
    let (axis, any) = (random.pick(&DVec3::AXES), random.cube());
    let f = random.pick(&[any, axis, -axis]) * size;
    let slope = random.pick(&[1e-9, 1e-5, 0.01, 1.0, 500.0]);
    let r = f.cross(random.cube()) * slope / size;
    let u = (f / size).cross(r) * random.pick(&[1.0, 1e-3, 1e3]);
    let [w, h] = [(); 2].map(|()| random.pick(&[1, 2, 3, 8, 64, 1921]));
    let scale = 1.0 / f64::from(w.max(h));
    let (origin, base) = if at_infinity { (Origin::Infinity(f), point) } else { (Origin::Point(point), f) };
    (origin, GridFilm::new(w, h, base, r * scale, u * scale).ok(), size)
}

#[test]
fn frusta_keep_what_their_rays_touch() {
    let mut random = Random(1);
    let mut checked = [0, 0];
    for round in 0..60_000 {
        let at_infinity = round % 2;
        let (origin, film, size) = any_film(&mut random, at_infinity == 1);
        let Some((frustum, ray)) = film.and_then(|film| frustum_and_ray(&mut random, origin, film)) else {
            continue;
        };
        checked[at_infinity] += check(&mut random, &ray, size, |b| frustum.enter(b));
    }
    println!("boxes kept: {checked:?}");
    assert!(checked.iter().all(|&n| n > 60_000), "{checked:?}");
}

#[test]
fn cones_keep_what_their_rays_touch() {
    let mut random = Random(2);
    let mut checked = 0;
    for _ in 0..40_000 {
        let size = 10_f64.powi(random.around(30) as i32);
        let apex = random.cube() * size * random.pick(&[0.0, 1.0, 1e6, 1e-6]);
        let apex = generators::on_grid(apex);
        let middle = random.cube();
        let spread = random.pick(&[0.0, 1e-12, 1e-6, 0.1, 1.0, 10.0]);
        let directions: Vec<DVec3> = (0..=random.below(9))
            .map(|_| (middle + random.cube() * spread) * size * random.pick(&[1.0, 1e-3, 7.0]))
            .collect();
        let cone = Cone::around(apex, &directions);
        let ray = Ray::new(apex, random.pick(&directions));
        checked += check(&mut random, &ray, size, |b| cone.enter(b));
    }
    println!("boxes kept: {checked}");
    assert!(checked > 120_000, "{checked}");
}

/// A small box around a point.
fn small_box(p: DVec3, radius: f64) -> Aabb {
    Aabb { lo: p.to_array().map(|x| (x - radius) as f32), hi: p.to_array().map(|x| (x + radius) as f32) }
}

#[test]
fn frusta_drop_what_lies_clearly_outside() {
    let mut random = Random(3);
    for _ in 0..5000 {
        let (eye, f) = (random.cube() * 10.0, random.cube() + DVec3::splat(2.0));
        let r = f.cross(random.cube() + DVec3::X * 3.0).normalize() * 0.01;
        let u = r.cross(f).normalize() * 0.01;
        let film = GridFilm::new(64, 64, f, r, u).expect("a valid film");
        for origin in [Origin::Point(eye), Origin::Infinity(f)] {
            let frustum = Frustum::over_grid(origin, &film, [16, 31], [32, 47]);
            let frustum = frustum.expect("the film spans a volume");
            // Pixels 16..=31 have X in [-31, -1], pixels 32..=47 have Y in [-31, -1].
            let at = |x: f64, y: f64, t: f64| match origin {
                Origin::Point(eye) => eye + (f + r * x + u * y) * t,
                Origin::Infinity(d) => f + r * x + u * y + d * t,
            };
            let t = 0.5 + random.signed().abs() * 4.0;
            let radius = 1e-3 * t;
            let inside = small_box(at(-16.0, -16.0, t), radius);
            assert!(frustum.enter(&inside).is_some_and(|e| e <= t && e > t * 0.9));
            for (x, y, t) in
                [(3.0, -16.0, t), (-35.0, -16.0, t), (-16.0, 3.0, t), (-16.0, -35.0, t), (-16.0, -16.0, -t)]
            {
                let bounds = small_box(at(x, y, t), radius);
                assert_eq!(frustum.enter(&bounds), None, "{origin:?} {x} {y} {t}");
            }
        }
    }
}

#[test]
fn cones_drop_what_lies_clearly_outside() {
    let mut random = Random(4);
    for _ in 0..5000 {
        let (apex, axis) = (random.cube() * 10.0, random.cube().normalize());
        let directions: Vec<DVec3> =
            (0..20).map(|_| (axis + random.cube() * 0.1) * random.pick(&[1.0, 2.0])).collect();
        let cone = Cone::around(apex, &directions);
        let inside = small_box(apex + axis * 5.0, 0.01);
        assert!(cone.enter(&inside).is_some_and(|t| t > 2.0 && t < 5.0));
        let across = axis.cross(random.cube()).normalize();
        // Ten degrees at most are inside; these are 45, 90 and 180.
        for d in [axis + across, across, -axis] {
            assert_eq!(cone.enter(&small_box(apex + d * 5.0, 0.01)), None);
        }
    }
}

fn lattice_point(n: i8) -> impl Strategy<Value = DVec3> {
    [-n..=n, -n..=n, -n..=n].prop_map(|p| DVec3::from_array(p.map(f64::from)))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 20_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Small integers: the boxes are touched exactly, at faces, edges and corners.
    #[test]
    fn lattice_boxes_are_kept(
        start in lattice_point(4),
        span in [lattice_point(3), lattice_point(3), lattice_point(3)],
        size in [1..6_u32, 1..6_u32],
        seed: u64,
        at_infinity: bool,
    ) {
        let [f, r, u] = span;
        let mut random = Random(seed);
        let (origin, base) = if at_infinity {
            (Origin::Infinity(f), start)
        } else {
            (Origin::Point(start), f)
        };
        let film = GridFilm::new(size[0], size[1], base, r, u).expect("small integers");
        if let Some((frustum, ray)) = frustum_and_ray(&mut random, origin, film) {
            check(&mut random, &ray, 1.0, |b| frustum.enter(b));
        }
        let directions: Vec<DVec3> = span.into_iter().filter(|d| *d != DVec3::ZERO).collect();
        if !directions.is_empty() {
            let cone = Cone::around(start, &directions);
            let ray = Ray::new(start, random.pick(&directions));
            check(&mut random, &ray, 1.0, |b| cone.enter(b));
        }
    }
}
