//! The distance of a hit, t = (A·N)/(d·N), as a fraction: bounds in f64, and exact where they leave doubt.
//!
//! - **Rounding.** The nearest f32 is in doubt where a midpoint m of two f32 lies between the bounds. The sign of A·N − m·(d·N) decides.
//! - **Order.** The sign of N₁·D₂ − N₂·D₁ for D > 0. Triangles with the same corners, in whatever order, lie in one plane: t is the same
//!   along every ray.
//! - **Planes across an axis.** Where all corners have the same coordinate a_k, N has no other component than N_k, and
//!   t = (a_k − o_k)/d_k: walls, floors and lids of rooms, machines and block worlds. Rounding is the sign of
//!   (a_k − o_k) − m·d_k, a sum of four f64, and the order along a ray that of the coordinates.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997; Steven Fortune and Christopher Van Wyk, "Static Analysis Yields Efficient Exact Integer Arithmetic for
//! Computational Geometry", 1996.

use std::cmp::Ordering;

use crate::exact::expansion::{Expansion, two_product, two_sum};
use crate::exact::filter::{Approx, Cross, Sign};
use crate::exact::integer::{Number, Triple, difference, short_direction, short_points, small, wide};
use crate::exact::wide::{Wide, parts};
use crate::geometry::aabb::U;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangle;
use crate::stats::Stats;

/// The hit distance t = (A·N)/(d·N) as a fraction with a positive denominator. The ray must cover the triangle.
pub(crate) struct Distance<'a> {
    ray: &'a Ray,
    triangle: &'a Triangle,
    numerator: Approx,
    denominator: Approx,
    /// The signs of A·N and d·N, where certain.
    signs: [Option<Sign>; 2],
}

/// t exactly: numerator over denominator, both with the same sign.
#[expect(
    clippy::large_enum_variant,
    reason = "a box would allocate where nothing else does; these live for one comparison"
)]
enum Fraction {
    /// Both are f64.
    Short(f64, f64),
    /// Integers, times a power of two.
    Long(Wide, Wide, i32),
}

impl<'a> Distance<'a> {
    /// Prepares the distance along a ray that covers the triangle.
    pub(crate) fn new(ray: &'a Ray, triangle: &'a Triangle) -> Self {
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        let (numerator, denominator) = (normal.dot(triangle.a - ray.origin), normal.dot(ray.direction));
        // t > 0, so both have the same sign, and the magnitudes are what matters.
        let absolute = |x: Approx| Approx { value: x.value.abs(), error: x.error };
        let signs = [numerator.sign(), denominator.sign()];
        Self { ray, triangle, numerator: absolute(numerator), denominator: absolute(denominator), signs }
    }

    /// The same for a ray that may not cover the triangle: `None` where its plane certainly does not lie ahead.
    #[inline]
    pub(crate) fn ahead(ray: &'a Ray, triangle: &'a Triangle) -> Option<Self> {
        let distance = Self::new(ray, triangle);
        let Self { signs, numerator, .. } = distance;
        // Where every product is zero nothing was rounded: the origin lies in the plane. Common where rays leave walls along an
        // axis.
        let within = numerator.is_zero();
        let behind = signs[0].is_some() && signs[0] == signs[1].map(Sign::negated);
        (!within && !behind).then_some(distance)
    }

    /// Bounds of t, rounded outward. The upper one may be infinite.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        let (n, d) = (self.numerator, self.denominator);
        // A sum or difference and a quotient: three roundings, 4u.
        let slack = 4.0 * U;
        let least = (n.value - n.error) / (d.value + d.error) * (1.0 - slack);
        let greatest = (n.value + n.error) / (d.value - d.error) * (1.0 + slack);
        let least = if least > 0.0 { least } else { 0.0 };
        (least, if greatest >= least { greatest } else { f64::INFINITY })
    }

    /// The axis that the triangle's plane lies across, if all corners have the same coordinate.
    fn axis(&self) -> Option<usize> {
        across(self.triangle)
    }

    /// t exactly.
    fn exact(&self) -> Fraction {
        fn on_grid<N: Number<Triple: Into<Wide>>>(points: &[[N; 3]; 4], d: &[N; 3]) -> [Wide; 2] {
            let [a, b, c, o] = points;
            fraction([a, b, c], o, d).map(Into::into)
        }
        let (Triangle { a, b, c }, directions) = (*self.triangle, [self.ray.direction]);
        let points = [a, b, c, self.ray.origin];
        if let (Some([a, b, c, o]), Some(d)) = (short_points(&points), short_direction(directions[0])) {
            let [numerator, denominator] = fraction([&a, &b, &c], &o, &d);
            return Fraction::Short(numerator, denominator);
        }
        let ([numerator, denominator], of_points, of_direction) = match (small(&points), small(&directions)) {
            (Some((points, of_points)), Some(([d], of_direction))) => {
                (on_grid(&points, &d), of_points, of_direction)
            }
            _ => {
                let ((points, of_points), ([d], of_direction)) = (wide(&points), wide(&directions));
                (on_grid(&points, &d), of_points, of_direction)
            }
        };
        Fraction::Long(numerator, denominator, of_points - of_direction)
    }

    /// The sign of t − x for finite x ≥ 0, decided exactly.
    pub(crate) fn compare_to(&self, x: f64, stats: &mut Stats) -> Sign {
        let (least, greatest) = self.bounds();
        if greatest < x {
            return Sign::Negative;
        }
        if least > x {
            return Sign::Positive;
        }
        stats.ambiguous_limit += 1;
        match self.axis() {
            Some(axis) => self.compare_along(axis, x),
            None => self.exact().compare_to(x),
        }
    }

    /// The sign of t − x where t = (a_k − o_k)/d_k: of |a_k − o_k| − x|d_k|.
    fn compare_along(&self, axis: usize, x: f64) -> Sign {
        let (far, far_tail) = two_sum(self.triangle.a[axis], -self.ray.origin[axis]);
        let (far, far_tail) = if far < 0.0 { (-far, -far_tail) } else { (far, far_tail) };
        let (near, near_tail) = two_product(x, self.ray.direction[axis].abs());
        if far_tail == 0.0 && near_tail == 0.0 {
            return Sign::of(far - near);
        }
        Expansion::of(far).plus(far_tail).plus(-near).plus(-near_tail).sign()
    }

    /// t rounded to the nearest f32, ties to even, at least 2⁻¹⁴⁹ and at most `f32::MAX`.
    pub(crate) fn rounded(&self, stats: &mut Stats) -> f32 {
        let (least, greatest) = self.bounds();
        let (mut low, mut high) = (saturate(least), saturate(greatest));
        if low == high {
            return low;
        }
        stats.ambiguous_distance += 1;
        let axis = self.axis();
        let fraction = if axis.is_none() { Some(self.exact()) } else { None };
        let compare_to = |x: f64| match (axis, &fraction) {
            (Some(axis), _) => self.compare_along(axis, x),
            (None, Some(fraction)) => fraction.compare_to(x),
            (None, None) => Sign::Zero,
        };
        // The f32 of a non-negative number grow with their bits: bisect until no rounding boundary lies between.
        while low != high {
            let middle = f32::from_bits(low.to_bits() + (high.to_bits() - low.to_bits()) / 2);
            let above = f32::from_bits(middle.to_bits() + 1);
            let boundary = (f64::from(middle) + f64::from(above)) * 0.5;
            let up = match compare_to(boundary) {
                Sign::Negative => false,
                Sign::Positive => true,
                Sign::Zero => middle.to_bits() % 2 == 1,
            };
            if up {
                low = above;
            } else {
                high = middle;
            }
        }
        low
    }
}

impl Fraction {
    /// The sign of t − x for finite x ≥ 0: of |N|·2^e − x·|D|.
    fn compare_to(&self, x: f64) -> Sign {
        let (numerator, denominator, exponent) = match self {
            Self::Short(n, d) => return Sign::of_order(f64::compare_products(n, &1.0, d, &x)),
            Self::Long(numerator, denominator, exponent) => (numerator, denominator, exponent),
        };
        let Some((mantissa, of_x)) = parts(x) else { return Sign::Positive };
        let product = denominator.times(&Wide::of_limbs([mantissa]));
        let shift = of_x - exponent;
        // In range: at most 2048 bits.
        let lengths = [numerator.bits() as i32, product.bits() as i32 + shift];
        Sign::of_order(lengths[0].cmp(&lengths[1]).then_with(|| {
            // Both are as long as the longer one of the two.
            if shift < 0 {
                numerator.shifted(shift.unsigned_abs()).compare_sizes(&product)
            } else {
                numerator.compare_sizes(&product.shifted(shift.unsigned_abs()))
            }
        }))
    }
}

/// A·N and d·N on a grid.
fn fraction<N: Number>([a, b, c]: [&[N; 3]; 3], o: &[N; 3], d: &[N; 3]) -> [N::Triple; 2] {
    let (ab, ac) = (difference(b, a), difference(c, a));
    [N::triple(&difference(a, o), &ab, &ac), N::triple(d, &ab, &ac)]
}

/// The axis that a triangle's plane lies across, if all corners have the same coordinate. The triangle has an area.
pub(crate) fn across(&Triangle { a, b, c }: &Triangle) -> Option<usize> {
    (0..3).find(|&k| a[k] == b[k] && b[k] == c[k])
}

/// Whether two triangles have the same corners, in whatever order: such triangles have the same hits.
pub(crate) fn same_corners(one: &Triangle, other: &Triangle) -> bool {
    let Triangle { a, b, c } = *one;
    let others = [other.a, other.b, other.c];
    // Hits have areas, so three corners that are among three others are all of them.
    [a, b, c].iter().all(|corner| others.contains(corner))
}

/// The sign of t − s for the distances of two triangles along a ray that covers both, decided exactly. What is evident comes first: this is
/// asked where bounds overlap, and mostly because the triangles coincide.
pub(crate) fn compare(ray: &Ray, one: &Triangle, other: &Triangle, stats: &mut Stats) -> Sign {
    if same_corners(one, other) {
        return Sign::Zero;
    }
    if let Some(axis) = across(one)
        && across(other) == Some(axis)
    {
        let order = Sign::of(one.a[axis] - other.a[axis]);
        return if ray.direction[axis] < 0.0 { order.negated() } else { order };
    }
    let (t, s) = (Distance::new(ray, one), Distance::new(ray, other));
    let filtered = t.numerator.times(s.denominator).minus(s.numerator.times(t.denominator));
    filtered.sign().unwrap_or_else(|| {
        stats.ambiguous_order += 1;
        compare_exactly(ray, one, other)
    })
}

/// The same without the filter.
#[inline(never)]
fn compare_exactly(ray: &Ray, one: &Triangle, other: &Triangle) -> Sign {
    fn on_grid<N: Number>(points: &[[N; 3]; 7], d: &[N; 3]) -> Ordering {
        let [a, b, c, other_a, other_b, other_c, o] = points;
        let [n, d_n] = fraction([a, b, c], o, d);
        let [other_n, other_d] = fraction([other_a, other_b, other_c], o, d);
        N::Triple::compare_products(&n, &other_d, &other_n, &d_n)
    }
    let points = [one.a, one.b, one.c, other.a, other.b, other.c, ray.origin];
    if let (Some(points), Some(d)) = (short_points(&points), short_direction(ray.direction)) {
        return Sign::of_order(on_grid(&points, &d));
    }
    Sign::of_order(match (small(&points), small(&[ray.direction])) {
        (Some((points, _)), Some(([d], _))) => on_grid(&points, &d),
        _ => on_grid(&wide(&points).0, &wide(&[ray.direction]).0[0]),
    })
}

/// x to the nearest f32 in [2⁻¹⁴⁹, `f32::MAX`].
pub(crate) fn saturate(x: f64) -> f32 {
    let smallest = f32::from_bits(1);
    let rounded = x as f32;
    if rounded >= f32::MAX {
        f32::MAX
    } else if rounded >= smallest {
        rounded
    } else {
        smallest
    }
}

/// Whether the ray meets the triangle within its open interval. The ray must cover the triangle.
pub(crate) fn within_interval(ray: &Ray, distance: &Distance<'_>, stats: &mut Stats) -> bool {
    let after = ray.t_min == 0.0 || distance.compare_to(ray.t_min, stats) == Sign::Positive;
    after && (ray.t_max == f64::INFINITY || distance.compare_to(ray.t_max, stats) == Sign::Negative)
}
