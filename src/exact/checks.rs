//! Numbers and orders of the exact stage against plain integers of 128 bits, and how long its questions take.

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;

use crate::exact::distance::{Distance, compare};
use crate::exact::filter::Sign;
use crate::exact::integer::{I192, Number, Triple, difference, short_points, small, wide};
use crate::exact::planes::Order;
use crate::exact::predicates::{covers_unfiltered, orientation};
use crate::exact::wide::{Scaled, Wide};
use crate::geometry::aabb::U;
use crate::geometry::ray::{Ray, Ties};
use crate::geometry::triangles::Triangle;
use crate::stats::Stats;

/// An interpreter takes its time.
const ROUNDS: usize = if cfg!(miri) { 20 } else { 20_000 };

/// Whole numbers up to ±`most`, the same on every machine.
struct Whole(u64);

impl Whole {
    fn next(&mut self, most: i64) -> i64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        // In range: most is far below 2⁶³.
        (self.0 % (2 * most as u64 + 1)) as i64 - most
    }

    fn point(&mut self, most: i64) -> DVec3 {
        DVec3::from_array([0; 3].map(|_: i32| self.next(most) as f64))
    }
}

/// x·(y×z) in i128.
fn determinant([x, y, z]: [DVec3; 3]) -> i128 {
    let [x, y, z] = [x, y, z].map(|v| v.to_array().map(|x| x as i128));
    let minor = |i: usize, j: usize| y[i] * z[j] - y[j] * z[i];
    x[0] * minor(1, 2) + x[1] * minor(2, 0) + x[2] * minor(0, 1)
}

fn sign(x: i128) -> Sign {
    Sign::of_order(x.cmp(&0))
}

/// Two triple products of differences, as a number of one kind has them.
fn triples<N: Number>([a, b, c, d, e, f, g, h]: &[[N; 3]; 8]) -> [N::Triple; 2] {
    [[a, b, c, d], [e, f, g, h]]
        .map(|[a, b, c, d]| N::triple(&difference(a, d), &difference(b, d), &difference(c, d)))
}

#[test]
fn every_kind_of_number_is_exact() {
    let mut whole = Whole(7);
    for round in 0..ROUNDS {
        // Short ones, and such whose products of two determinants are below 2¹²⁶.
        let most = if round % 2 == 0 { 12 } else { 200_000 };
        let mut points = || [0; 4].map(|_: i32| whole.point(most));
        let (one, other) = (points(), points());
        let exact = |[a, b, c, d]: [DVec3; 4]| determinant([a - d, b - d, c - d]);
        let (x, y) = (exact(one), exact(other));
        assert_eq!(orientation(one[0], one[1], one[2], one[3]), sign(x));
        // One grid for all.
        let [a, b, c, d] = one;
        let [e, f, g, h] = other;
        let all = [a, b, c, d, e, f, g, h];
        let ((small_all, small_unit), (wide_all, wide_unit)) = (small(&all).expect("few bits"), wide(&all));
        let [small_one, small_other] = triples(&small_all);
        let [wide_one, wide_other] = triples(&wide_all);
        assert_eq!([small_one.sign(), small_other.sign()], [sign(x), sign(y)]);
        assert_eq!([wide_one.sign(), wide_other.sign()], [sign(x), sign(y)]);
        if let Some(points) = short_points(&all) {
            let [one, other] = triples(&points);
            assert_eq!([one, other], [x as f64, y as f64]);
            assert_eq!(f64::compare_products(&one, &one, &other, &other), x.abs().cmp(&y.abs()));
            let difference = f64::difference_of_products(&one, &one, &other, &other).value;
            assert_eq!(difference, (x * x - y * y) as f64);
        }
        let order = x.abs().cmp(&y.abs());
        assert_eq!(I192::compare_products(&small_one, &small_one, &small_other, &small_other), order);
        assert_eq!(Wide::compare_products(&wide_one, &wide_one, &wide_other, &wide_other), order);
        let expected = (x * x - y * y) as f64;
        // A product of two triple products is made of six numbers.
        let near = |found: Scaled, unit: i32| {
            let found = found.value * 2.0_f64.powi(found.exponent + 6 * unit);
            (found - expected).abs() <= expected.abs() * (8.0 * U)
        };
        let of_small = I192::difference_of_products(&small_one, &small_one, &small_other, &small_other);
        let of_wide = Wide::difference_of_products(&wide_one, &wide_one, &wide_other, &wide_other);
        assert!(near(of_small, small_unit) && near(of_wide, wide_unit));
    }
}

/// A triangle far ahead of the origin around the direction −z, with corners of so many bits.
fn ahead(whole: &mut Whole, most: i64) -> Triangle {
    let centre = DVec3::NEG_Z * (most as f64 * 4.0);
    let mut corner = |x: f64, y: f64| centre + whole.point(most / 4) + DVec3::new(x, y, 0.0) * most as f64;
    Triangle { a: corner(-2.0, -2.0), b: corner(2.0, -2.0), c: corner(0.0, 2.0) }
}

#[test]
fn functions_of_planes_have_the_order_of_rays() {
    let (mut whole, mut stats, mut told, mut asked) = (Whole(5), Stats::default(), 0, 0);
    for round in 0..ROUNDS {
        let most = [8, 1 << 20, 1 << 40][round % 3];
        let one = ahead(&mut whole, most);
        // Another one, or one in nearly the same plane.
        let other = match round % 4 {
            0 => ahead(&mut whole, most),
            _ => Triangle { b: one.b + (one.b - one.a), c: one.c + whole.point(1), ..one },
        };
        let ray = Ray::new(whole.point(2), DVec3::NEG_Z * most as f64 + whole.point(most / 8));
        let along = Ray { origin: whole.point(most / 8), direction: DVec3::NEG_Z, ..ray };
        let orders = [
            (ray, Ties::Direction, Order::from_point(ray.origin, &one, &other), ray.direction),
            (along, Ties::Origin, Order::along(along.direction, DVec3::ONE, &one, &other), along.origin),
        ];
        for (ray, ties, order, at) in orders {
            if ![one, other].iter().all(|triangle| covers_unfiltered(&ray, triangle, ties)) {
                continue;
            }
            let exact = compare(&ray, &one, &other, &mut stats);
            asked += 1;
            let Some(order) = order else { continue };
            if order.is_zero() {
                assert_eq!(exact, Sign::Zero);
                told += 1;
            } else if let Some(sign) = order.at(at) {
                assert_eq!(sign, exact.negated(), "{one:?} {other:?} {ray:?}");
                told += 1;
            }
        }
    }
    assert!(asked > ROUNDS / 4 && told * 10 > asked * 9, "{told} of {asked} were told");
}

/// Nanoseconds of a question, in the mean over so many.
fn time<T>(questions: &[T], ask: impl Fn(&T) -> bool) -> f64 {
    let least = (0..20).map(|_| {
        let start = Instant::now();
        let count = questions.iter().filter(|question| ask(black_box(question))).count();
        black_box(count);
        start.elapsed().as_secs_f64()
    });
    least.fold(f64::MAX, f64::min) * 1e9 / questions.len() as f64
}

/// `cargo test --release -p umbel-core --lib exact::checks::questions_are_quick -- --ignored --nocapture`
#[test]
#[ignore = "times need a quiet machine"]
#[expect(clippy::print_stdout, reason = "the times are the result")]
fn questions_are_quick() {
    let mut whole = Whole(3);
    for (name, most) in [("15 bits", 1 << 11), ("24 bits", 1 << 22), ("40 bits", 1 << 40)] {
        // Points in the plane, and a second triangle in it.
        let cases: Vec<(Triangle, DVec3, Triangle, Ray)> = (0..4096)
            .map(|_| {
                let one = ahead(&mut whole, most);
                let [u, v] = [one.b - one.a, one.c - one.a];
                let other = Triangle { a: one.a - u, b: one.b + v, c: one.c };
                (one, one.a + u - v, other, Ray::new(DVec3::ZERO, DVec3::NEG_Z))
            })
            .collect();
        let third = time(&cases, |(one, p, ..)| orientation(one.a, one.b, one.c, *p) == Sign::Zero);
        let sixth = time(&cases, |(one, _, other, ray)| {
            compare(ray, one, other, &mut Stats::default()) == Sign::Zero
        });
        let midpoint = time(&cases, |(one, .., ray)| {
            let distance = Distance::new(ray, one);
            distance.compare_to(distance.bounds().0, &mut Stats::default()) == Sign::Positive
        });
        let function = time(&cases, |(one, _, other, ray)| {
            Order::from_point(ray.origin, one, other).is_some_and(|order| order.is_zero())
        });
        println!(
            "{name}: degree 3 {third:.0} ns, degree 6 {sixth:.0} ns, a distance against a number {midpoint:.0} ns, the function of a pair {function:.0} ns"
        );
    }
}
