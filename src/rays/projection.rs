//! Where rays pierce a plane of coordinates.
//!
//! Rays from a point o pierce a face of a cube around o: with k the axis of the face and w = ±A_k, what lies at o + A,
//! w > 0, is seen at (A_i, A_j)/w. Parallel rays pierce the plane of the coordinates i and j, where k is the axis of
//! the largest component of D: what lies at p is seen at (p_i, p_j) − p_k·(D_i, D_j)/D_k.
//!
//! Eight at a time, in f64 where places count and in f32 where they only order: one by one took 330 instructions for
//! each receiver of a light, a third of a query.
//!
//! Based on: Ned Greene, "Environment Mapping and Other Applications of World Projections", 1986 (cube maps).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::exact::filter::Approx;
use crate::geometry::aabb::U;
use crate::rays::origin::Origin;

/// A place in the plane is a quotient of differences, or a difference less a product with a quotient: at most four
/// roundings. As many again pay for adding the errors up.
const PLACE_SLACK: f64 = 8.0 * U;

/// The plane that rays pierce.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) origin: Origin,
    /// k.
    axis: usize,
    /// Whether w = −A_k.
    negative: bool,
}

impl Plane {
    /// The plane that the ray through a sample pierces.
    pub(crate) fn of(origin: Origin, sample: DVec3) -> Self {
        let direction = match origin {
            Origin::Point(_) => sample,
            Origin::Infinity(direction) => direction,
        };
        let axis = largest_axis(direction);
        Self { origin, axis, negative: direction[axis] < 0.0 }
    }

    /// The plane with a number, see [`Plane::face`].
    pub(crate) fn numbered(origin: Origin, face: usize) -> Self {
        Self { origin, axis: face / 2, negative: face % 2 == 1 }
    }

    /// The number of the plane among those of one origin.
    pub(crate) fn face(&self) -> u64 {
        2 * self.axis as u64 + u64::from(self.negative)
    }

    /// The axis k, pointing to where rays go, and the two that span the plane.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let ahead = DVec3::AXES[self.axis];
        let [right, up] = [1, 2].map(|k| DVec3::AXES[(self.axis + k) % 3]);
        [if self.negative { -ahead } else { ahead }, right, up]
    }

    /// w of a vector from the origin.
    pub(crate) fn ahead(&self, v: DVec3) -> f64 {
        if self.negative { -v[self.axis] } else { v[self.axis] }
    }

    /// What is seen at a place: the direction with w = 1, or the point with coordinate ±p_k = `depth` on a parallel ray.
    pub(crate) fn seen_at(&self, [x, y]: [f64; 2], depth: f64) -> DVec3 {
        let [ahead, right, up] = self.axes();
        let forward = match self.origin {
            Origin::Point(_) => ahead,
            Origin::Infinity(d) => {
                let aside = right * d.dot(right) + up * d.dot(up);
                ahead * depth + aside * (depth / d.dot(ahead))
            }
        };
        forward + right * x + up * y
    }

    /// Where a vector is seen: from the origin, or from zero for parallel rays. For a point as origin, w > 0.
    pub(crate) fn place(&self, v: DVec3) -> [Approx; 2] {
        let k = self.axis;
        [(k + 1) % 3, (k + 2) % 3].map(|i| match self.origin {
            Origin::Point(_) => {
                let value = v[i] / self.ahead(v);
                Approx { value, error: value.abs() * PLACE_SLACK }
            }
            Origin::Infinity(d) => {
                // |D_i/D_k| ≤ 1.
                let value = v[i] - v[k] * (d[i] / d[k]);
                Approx { value, error: (v[i].abs() + v[k].abs()) * PLACE_SLACK }
            }
        })
    }
}

/// The axis of the largest component.
fn largest_axis(v: DVec3) -> usize {
    let [x, y, z] = v.abs().to_array();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}

/// Eight points as an origin sees them.
pub(crate) struct EightSeen<F> {
    /// Where on the plane.
    pub(crate) at: [F; 2],
    /// 1/w from a point; the coordinate ±p_k along parallel rays.
    pub(crate) depth: F,
    /// The number of the plane, see [`Plane::face`].
    pub(crate) face: F,
}

impl<F> EightSeen<F> {
    /// Vectors from a point, on the faces of a cube around it.
    #[inline(always)]
    pub(crate) fn on_cube<S: Simd>(simd: S, [x, y, z]: [F; 3]) -> Self
    where
        F: SimdFloat<S, Element: FromF64>,
    {
        let zero = splat(simd, 0.0);
        let (size_x, size_y, size_z) = (x.abs(), y.abs(), z.abs());
        // As in `Plane::of`: of equal components the first one counts.
        let is_x = size_x.simd_ge(size_y) & size_x.simd_ge(size_z);
        let is_y = size_y.simd_ge(size_z);
        let ahead = is_x.select(x, is_y.select(y, z));
        let right = is_x.select(y, is_y.select(z, x));
        let up = is_x.select(z, is_y.select(x, y));
        let depth = splat::<S, F>(simd, 1.0) / ahead.abs();
        // What lies at the point is seen anywhere.
        let seen = ahead.abs().simd_gt(zero);
        let at = [seen.select(right * depth, zero), seen.select(up * depth, zero)];
        let face = is_x.select(zero, is_y.select(splat(simd, 2.0), splat(simd, 4.0)));
        let face = face + ahead.simd_lt(zero).select(splat(simd, 1.0), zero);
        Self { at, depth, face }
    }

    /// Points, along parallel rays.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(simd: S, points: [F; 3], direction: DVec3) -> Self
    where
        F: SimdFloat<S, Element: FromF64>,
    {
        let plane = Plane::of(Origin::Infinity(direction), direction);
        let (k, ahead) = (plane.axis, plane.ahead(direction));
        let [i, j] = [1, 2].map(|next| (k + next) % 3);
        let depth = points[k] * splat::<S, F>(simd, if plane.negative { -1.0 } else { 1.0 });
        let right = points[i] - depth * splat::<S, F>(simd, direction[i] / ahead);
        let up = points[j] - depth * splat::<S, F>(simd, direction[j] / ahead);
        Self { at: [right, up], depth, face: splat(simd, plane.face() as f64) }
    }
}

/// A number in all lanes. No closure: that would lose the instruction set.
#[inline(always)]
fn splat<S: Simd, F: SimdFloat<S, Element: FromF64>>(simd: S, number: f64) -> F {
    F::splat(simd, FromF64::of(number))
}

/// Numbers of lanes, from f64.
pub(crate) trait FromF64 {
    /// The nearest one.
    fn of(number: f64) -> Self;
}

impl FromF64 for f64 {
    #[inline(always)]
    fn of(number: f64) -> Self {
        number
    }
}

impl FromF64 for f32 {
    #[inline(always)]
    fn of(number: f64) -> Self {
        number as Self
    }
}
