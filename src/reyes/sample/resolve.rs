//! What eight rays see of the micropolygons that they hit: distances, parameters and normals.
//!
//! With A = a − o and so on, N = (b − a)×(c − a), t = (A·N)/(d·N); the weights of the corners are those of
//! [`crate::objects::barycentric`], and (u, v) is the weighted sum of the corners'. The normal is N/|N|: for f32
//! corners |N|² lies within the range of f64. One fixed sequence of operations, the same on every path and machine.
//! Where the error of t leaves doubt about the nearest f32, the exact stage rounds.
//!
//! Based on: August Ferdinand Möbius, "Der barycentrische Calcul", 1827; Jonathan Shewchuk, "Adaptive Precision
//! Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997 (static filters).

use fearless_simd::prelude::*;

use crate::exact::filter::TRIPLE_PRODUCT_ERROR;
use crate::exact::predicates::Distance;
use crate::geometry::aabb::U;
use crate::geometry::ray::Ray;
use crate::objects::gather::transposed_points;
use crate::reyes::sample::micropolygon::triangle_of;
use crate::simd::lanes::{LANES, LaneMask, Lanes, Points, bits, narrow, widen};

/// Distances between these are neither subnormal nor saturated.
const PLAIN_T: [f32; 2] = [1e-30, 1e30];
/// A sum or difference and a quotient: three roundings, 4u.
const QUOTIENT_SLACK: f64 = 4.0 * U;

/// What eight rays see.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resolved {
    pub(crate) ts: [f32; LANES],
    pub(crate) uvs: [[f32; LANES]; 2],
    pub(crate) normals: [[f32; LANES]; 3],
}

/// What eight rays have hit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// Corner by corner.
    pub(crate) corners: [[[f32; 3]; LANES]; 3],
    /// u and v of each corner.
    pub(crate) parameters: [[[f64; LANES]; 2]; 3],
}

impl Seen {
    /// Nothing.
    pub(crate) const NOTHING: Self =
        Self { corners: [[[0.0; 3]; LANES]; 3], parameters: [[[0.0; LANES]; 2]; 3] };

    /// Puts a triangle into a lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, corners: [[f32; 3]; 3], parameters: [[f64; 2]; 3]) {
        let stored = self.corners.iter_mut().zip(&mut self.parameters);
        for ((stored_corner, stored_uv), (corner, uv)) in stored.zip(corners.into_iter().zip(parameters)) {
            stored_corner[lane] = corner;
            stored_uv.iter_mut().zip(uv).for_each(|(stored, parameter)| stored[lane] = parameter);
        }
    }

    /// What the rays of some lanes, with origins and directions, see of their triangles, which they hit. `ray` makes
    /// the ray of a lane.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(
        &self,
        simd: S,
        [origin, direction]: [Points<S>; 2],
        lanes: u64,
        ray: impl Fn(usize) -> Ray,
    ) -> Resolved {
        let mut corners = [origin; 3];
        for (corner, read) in corners.iter_mut().zip(&self.corners) {
            let [x, y, z] = transposed_points(simd, read);
            *corner = Points { x: widen(x), y: widen(y), z: widen(z) };
        }
        let [a, b, c] = corners;
        let sides = [b.minus(a), c.minus(b), a.minus(c)];
        let from = [a.minus(origin), b.minus(origin), c.minus(origin)];
        let (normal, permanent) = cross(sides[0], c.minus(a));

        let (ts, doubtful) = distances([normal, permanent], from[0], direction);
        let mut resolved =
            Resolved { ts, uvs: self.uvs(simd, from, sides, direction), normals: [[0.0; LANES]; 3] };
        for lane in bits(doubtful & lanes) {
            let triangle = triangle_of(&[0, 1, 2].map(|corner: usize| self.corners[corner][lane]));
            resolved.ts[lane] = Distance::new(&ray(lane), &triangle).rounded();
        }

        let length = normal.dot_lanes(normal).sqrt();
        let unit = [normal.x / length, normal.y / length, normal.z / length];
        for (stored, part) in resolved.normals.iter_mut().zip(unit) {
            narrow(part).store_slice(stored);
        }
        resolved
    }

    /// (u, v) of the rays, given the corners from the origin and the sides.
    #[inline(always)]
    fn uvs<S: Simd>(
        &self,
        simd: S,
        [a, b, c]: [Points<S>; 3],
        [ab, bc, ca]: [Points<S>; 3],
        direction: Points<S>,
    ) -> [[f32; LANES]; 2] {
        let zero = Lanes::simd_from(simd, 0.0);
        let mut weights = [
            cross(b, bc).0.dot_lanes(direction),
            cross(c, ca).0.dot_lanes(direction),
            cross(a, ab).0.dot_lanes(direction),
        ];
        let positive = (weights[0] + weights[1] + weights[2]).simd_gt(zero);
        for weight in &mut weights {
            // Rounding can leave a weight on the wrong side of zero: it lies on the edge.
            let size = positive.select(*weight, -*weight);
            *weight = size.max(zero);
        }
        let sum = weights[0] + weights[1] + weights[2];
        let some = sum.simd_gt(zero);
        for weight in &mut weights {
            *weight = some.select(*weight / sum, zero + 1.0 / 3.0);
        }
        let mut uvs = [[0.0; LANES]; 2];
        for (axis, uv) in uvs.iter_mut().enumerate() {
            let [at_a, at_b, at_c] =
                [0, 1, 2].map(|corner: usize| Lanes::load_array_ref(simd, &self.parameters[corner][axis]));
            narrow(weights[0] * at_a + weights[1] * at_b + weights[2] * at_c).store_slice(uv);
        }
        uvs
    }
}

/// y×z, and per component the sum of the magnitudes of its two products.
#[inline(always)]
fn cross<S: Simd>(y: Points<S>, z: Points<S>) -> (Points<S>, Points<S>) {
    let (plus, minus) = (
        Points { x: y.y * z.z, y: y.z * z.x, z: y.x * z.y },
        Points { x: y.z * z.y, y: y.x * z.z, z: y.y * z.x },
    );
    (plus.minus(minus), plus.magnitudes().plus(minus.magnitudes()))
}

/// Distances rounded to the nearest f32, and the lanes, as bits, where that is in doubt.
#[inline(always)]
fn distances<S: Simd>(
    [normal, permanent]: [Points<S>; 2],
    a: Points<S>,
    direction: Points<S>,
) -> ([f32; LANES], u64) {
    let numerator = normal.dot_lanes(a).abs();
    let numerator_error = permanent.dot_lanes(a.magnitudes()) * TRIPLE_PRODUCT_ERROR;
    let denominator = normal.dot_lanes(direction).abs();
    let denominator_error = permanent.dot_lanes(direction.magnitudes()) * TRIPLE_PRODUCT_ERROR;
    let least = (numerator - numerator_error) / (denominator + denominator_error) * (1.0 - QUOTIENT_SLACK);
    let greatest = (numerator + numerator_error) / (denominator - denominator_error) * (1.0 + QUOTIENT_SLACK);
    // Rounding to f32 is monotonic, so equal ends leave no doubt. NaN is in doubt.
    let (lo, hi) = (narrow(least), narrow(greatest));
    let certain: LaneMask<S> = denominator.simd_gt(denominator_error);
    let plain = lo.simd_eq(hi) & lo.simd_gt(PLAIN_T[0]) & lo.simd_lt(PLAIN_T[1]);
    (lo.to_array(), !(certain.to_bitmask() & plain.to_bitmask()) & 0xFF)
}
