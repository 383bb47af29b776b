//! The filter of the leaf of bundles: one ray against eight triangles in f32. What it lets pass is tested exactly.
//!
//! The ray's origin is moved along it to o'' near the triangles' middle: then everything is small. With T = o'' − a, P = d×E₂,
//! Q = T×E₁ (Möller and Trumbore): u = T·P, v = d·Q, w = E₁·P − u − v have one sign, or are all zero, where the ray's line meets
//! the triangle.
//!
//! Errors: o'' and a are off by less than 2⁻²² per axis together (see [`crate::culling_space`]: o' 2⁻²⁵, two roundings of t·d and
//! of the sum 3·2⁻²⁴, the corner 2⁻²⁵, the difference 2⁻²⁴), E₁ and E₂ by 2⁻²³, d by 2⁻²⁵ over lengths like |T|. With 1-norms
//! |T| and E = |E₁| + |E₂|, and |d|∞ = 1: |Δu| ≤ 2·(3·2⁻²²·|E₂| + 2⁻²³·3·|T|) + arithmetic, 8 roundings of 2·|T||E₂|·2⁻²⁴; as |T| and E are
//! at most 12 the latter is below 2⁻¹⁶·min(|T|, E). All of that is less than 2⁻¹⁸·(|T| + E) if |T| ≤ 2, as it is where a candidate
//! can lie. The same holds for v, and thrice that for w.
//!
//! Based on: Tomas Möller and Ben Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.

use fearless_simd::prelude::*;

use crate::Triangles;
use crate::culling_space::{CulledRay, CullingSpace};
use crate::gather::eight_corners;
use crate::lanes::{LANES, Narrow};

/// Error of u and v per unit of |T| + E.
const ERROR: f32 = 1.0 / (1 << 18) as f32;

/// Eight triangles in the culling space.
pub(crate) struct RunTriangles<S: Simd> {
    a: [Narrow<S>; 3],
    e1: [Narrow<S>; 3],
    e2: [Narrow<S>; 3],
    /// |E₁| + |E₂|.
    size: Narrow<S>,
    /// A point near all.
    middle: [f32; 3],
}

impl<S: Simd> RunTriangles<S> {
    /// Up to eight triangles; the last one is repeated.
    #[inline(always)]
    pub(crate) fn new(simd: S, triangles: &Triangles<'_>, space: &CullingSpace, ids: &[u32]) -> Self {
        let mut eight = [ids[ids.len() - 1]; LANES];
        eight[..ids.len()].copy_from_slice(ids);
        let corners = eight_corners(simd, triangles, &eight);
        let zero = Narrow::simd_from(simd, 0.0);
        let (mut a, mut e1, mut e2) = ([zero; 3], [zero; 3], [zero; 3]);
        let mut size = zero;
        let mut middle = [0.0; 3];
        for k in 0..3 {
            let corner = |corner: usize| Narrow::load_array_ref(simd, &corners[corner][k]);
            a[k] = space.coordinate(corner(0), k);
            e1[k] = space.coordinate(corner(1), k) - a[k];
            e2[k] = space.coordinate(corner(2), k) - a[k];
            size += e1[k].abs() + e2[k].abs();
            let sum: f32 = a[k].to_array().iter().sum();
            middle[k] = sum / LANES as f32;
        }
        Self { a, e1, e2, size, middle }
    }

    /// The triangles, as bits, that the ray's line may meet.
    #[inline(always)]
    pub(crate) fn candidates(&self, ray: &CulledRay) -> u64 {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
        let [mx, my, mz] = self.middle;
        let t = ((mx - ox) * dx + (my - oy) * dy + (mz - oz) * dz) * ray.per_length;
        let (ox, oy, oz) = (ox + t * dx, oy + t * dy, oz + t * dz);
        let ([ax, ay, az], [e1x, e1y, e1z], [e2x, e2y, e2z]) = (self.a, self.e1, self.e2);
        // T = o'' − a, P = d×E₂, Q = T×E₁.
        let (tx, ty, tz) = (-ax + ox, -ay + oy, -az + oz);
        let (px, py, pz) = (e2z * dy - e2y * dz, e2x * dz - e2z * dx, e2y * dx - e2x * dy);
        let (qx, qy, qz) = (ty * e1z - tz * e1y, tz * e1x - tx * e1z, tx * e1y - ty * e1x);
        let u = tx * px + ty * py + tz * pz;
        let v = qx * dx + qy * dy + qz * dz;
        let determinant = e1x * px + e1y * py + e1z * pz;
        let w = (determinant - u - v) * (1.0 / 3.0);
        let error = (tx.abs() + ty.abs() + tz.abs() + self.size) * ERROR;
        let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
        let meets = least.simd_ge(-error) | greatest.simd_le(error);
        // The hit lies E₂·Q/E₁·P beyond o''; the sign of E₁·P is not known, so both sides are multiplied by it.
        let ahead = ray.t_max - t;
        let beyond = (e2x * qx + e2y * qy + e2z * qz - determinant * ahead) * determinant;
        let beyond_error = (error + ahead.abs() * ERROR) * self.size * determinant.abs();
        (meets & beyond.simd_le(beyond_error)).to_bitmask()
    }
}
