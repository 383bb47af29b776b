//! The order of two planes along all rays of a pencil, as one affine function: decided exactly but for its last rounding, once for a pair.
//!
//! From a point o, t_i = N_i/(d·n_i) with N_i = (a_i − o)·n_i. So t₁ < t₂ iff d·M has the sign of −N₁N₂, where M = N₁n₂ − N₂n₁ does
//! not depend on the ray. Along parallel rays from p, with D_i = d·n_i and any point b on the film, N₁D₂ − N₂D₁ =
//! (N₁(b)D₂ − N₂(b)D₁) − (p − b)·(n₁D₂ − n₂D₁) has the sign of −D₁D₂ iff t₁ < t₂. Both are affine on the film, and
//! zero iff the planes are one.
//!
//! Where planes nearly coincide, everything cancels in M, and nothing is left of it in f64. So its parts are made as integers
//! and rounded at the end, each by a unit of 2⁻⁵² of itself. After that d·M is as good as any sum of three products: in doubt only very near
//! to where the planes cross.
//!
//! Based on: Steven Fortune and Christopher Van Wyk, "Static Analysis Yields Efficient Exact Integer Arithmetic for Computational
//! Geometry", 1996.

use glam::DVec3;

use crate::exact::filter::Sign;
use crate::exact::integer::{Number, Triple, difference, short_direction, short_points, small, wide};
use crate::exact::wide::Scaled;
use crate::geometry::aabb::U;
use crate::geometry::triangles::Triangle;

/// Parts err by 8u, a difference of points by u, products and sums by 4u; the bound by as much again.
const ERROR: f64 = 32.0 * U;

/// Parts that differ by more than 2^this are left to the exact stage, so that nothing underflows.
const RANGE: i32 = 500;

/// Where one plane lies to another along the rays of a pencil that hit both: the function c + (d − b)·m of a ray's direction or start
/// point d, positive where the first is nearer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Order {
    base: DVec3,
    constant: f64,
    slope: DVec3,
}

impl Order {
    /// That of planes that are one.
    pub(crate) const ZERO: Self = Self { base: DVec3::ZERO, constant: 0.0, slope: DVec3::ZERO };

    /// That of two triangles for rays from a point, or `None` where it is left open.
    pub(crate) fn from_point(o: DVec3, one: &Triangle, other: &Triangle) -> Option<Self> {
        fn on_grid<N: Number>([a, b, c, other_a, other_b, other_c, o]: &[[N; 3]; 7]) -> ([Scaled; 3], Sign) {
            let (n, other_n) = (normal([a, b, c]), normal([other_a, other_b, other_c]));
            let [d, other_d] = [([a, b, c], o), ([other_a, other_b, other_c], o)]
                .map(|([a, b, c], o)| N::triple(&difference(a, o), &difference(b, a), &difference(c, a)));
            let part = |k: usize| N::Triple::difference_of_products(&d, &other_n[k], &other_d, &n[k]);
            ([part(0), part(1), part(2)], d.sign().times(other_d.sign()))
        }
        let points = [one.a, one.b, one.c, other.a, other.b, other.c, o];
        let (slope, sign) = if let Some(points) = short_points(&points) {
            on_grid(&points)
        } else {
            small(&points).map_or_else(|| on_grid(&wide(&points).0), |(points, _)| on_grid(&points))
        };
        let [x, y, z] = slope;
        Self::new(DVec3::ZERO, [Scaled::ZERO, x, y, z], sign)
    }

    /// That of two triangles for rays along a direction, whose start points lie near to a point.
    pub(crate) fn along(direction: DVec3, near: DVec3, one: &Triangle, other: &Triangle) -> Option<Self> {
        fn on_grid<N: Number>(points: &[[N; 3]; 7], d: &[N; 3]) -> ([Scaled; 4], Sign) {
            let [a, b, c, other_a, other_b, other_c, base] = points;
            let faces = [[a, b, c], [other_a, other_b, other_c]];
            let [n, other_n] = faces.map(normal);
            let [above, other_above] =
                faces.map(|[a, b, c]| N::triple(&difference(a, base), &difference(b, a), &difference(c, a)));
            let [along, other_along] =
                faces.map(|[a, b, c]| N::triple(d, &difference(b, a), &difference(c, a)));
            let product = N::Triple::difference_of_products;
            let part = |k: usize| product(&other_n[k], &along, &n[k], &other_along);
            let constant = product(&above, &other_along, &other_above, &along);
            ([constant, part(0), part(1), part(2)], along.sign().times(other_along.sign()))
        }
        // Few bits, so that it fits the grid of the corners.
        let base = near.as_vec3().as_dvec3();
        let points = [one.a, one.b, one.c, other.a, other.b, other.c, base];
        let (short, short_d) = (short_points(&points), short_direction(direction));
        let ((mut parts, sign), unit) = if let (Some(points), Some(d)) = (short, short_d) {
            (on_grid(&points, &d), 0)
        } else if let (Some((points, unit)), Some(([d], _))) = (small(&points), small(&[direction])) {
            (on_grid(&points, &d), unit)
        } else {
            let (points, unit) = wide(&points);
            (on_grid(&points, &wide(&[direction]).0[0]), unit)
        };
        // It is made of one difference of points more than the others.
        parts[0].exponent += unit;
        Self::new(base, parts, sign)
    }

    /// From parts that stand for the function times −`sign`.
    fn new(base: DVec3, parts: [Scaled; 4], sign: Sign) -> Option<Self> {
        let nonzero = || parts.iter().filter(|part| part.value != 0.0).map(Scaled::magnitude);
        let (Some(least), Some(greatest)) = (nonzero().min(), nonzero().max()) else {
            return Some(Self::ZERO);
        };
        if greatest - least > RANGE || sign == Sign::Zero {
            return None;
        }
        let [constant, x, y, z] = parts.map(|part| {
            let value = part.times_power(-greatest);
            if sign == Sign::Positive { -value } else { value }
        });
        Some(Self { base, constant, slope: DVec3::new(x, y, z) })
    }

    /// The function's sign at a direction or start point, or `None` where it is in doubt.
    #[inline]
    pub(crate) fn at(&self, ray: DVec3) -> Option<Sign> {
        let terms = (ray - self.base) * self.slope;
        let value = self.constant + (terms.x + terms.y + terms.z);
        let sizes = terms.abs();
        let error = ERROR * (self.constant.abs() + (sizes.x + sizes.y + sizes.z));
        if value > error {
            Some(Sign::Positive)
        } else if value < -error {
            Some(Sign::Negative)
        } else {
            None
        }
    }

    /// Whether the planes are one.
    pub(crate) fn is_zero(&self) -> bool {
        self.constant == 0.0 && self.slope == DVec3::ZERO
    }
}

/// (b − a)×(c − a).
fn normal<N: Number>([a, b, c]: [&[N; 3]; 3]) -> [N::Triple; 3] {
    let (ab, ac) = (difference(b, a), difference(c, a));
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| N::minor(&ab[i], &ac[j], &ab[j], &ac[i]))
}
