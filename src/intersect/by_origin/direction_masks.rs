//! Which of many directions may matter, for all rays from a box at once.
//!
//! A direction meets one box from some point of another iff it meets their Minkowski difference from zero. A triangle abc is met from
//! p = c + δ, c the middle of a box, only where no edge function is negative; each differs from the one of c by 2d·(δ×(b − a)).
//!
//! The promise: *may keep what is missed, may never drop what is hit*.
//!
//! Based on: Alexander Reshetov, Alexei Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (one bound for many
//! rays).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::exact::filter::Cross;
use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangle;
use crate::intersect::by_origin::{BOX_SLACK, CROSS_ERROR, EDGE_ERROR, TINY};
use crate::intersect::directions::samples::{SAMPLES, SampleDirections};
use crate::simd::lanes::LANES;

impl SampleDirections {
    /// Those of some directions that meet a box from some point of another, given by its middle and half its sides.
    #[inline(always)]
    pub(crate) fn meeting<S: Simd>(
        &self,
        simd: S,
        (centre, own_half): (DVec3, DVec3),
        bounds: &Aabb,
        mask: u128,
    ) -> u128 {
        let (lo, hi) = bounds.corners();
        let middle = (lo + hi) * 0.5 - centre;
        let half = (hi - lo) * 0.5 + own_half;
        let half = half + (middle.abs() + half) * f64::from(BOX_SLACK) + f64::from(f32::MIN_POSITIVE);
        let (m, h) = (middle.as_vec3(), half.as_vec3());
        if m.abs().cmple(h).all() {
            return mask;
        }
        let mut met = 0;
        for block in blocks(mask) {
            let ([x, y, z], [u, v, w]) = self.eight(simd, block * LANES);
            let ahead = (x * m.x + y * m.y + z * m.z).simd_ge(-(u * h.x + v * h.y + w * h.z));
            let across_x = (y * m.z - z * m.y).abs().simd_le(v * h.z + w * h.y);
            let across_y = (z * m.x - x * m.z).abs().simd_le(w * h.x + u * h.z);
            let across_z = (x * m.y - y * m.x).abs().simd_le(u * h.y + v * h.x);
            let all = (ahead & across_x & across_y & across_z).to_bitmask();
            met |= u128::from(all) << (block * LANES);
        }
        met & mask
    }

    /// Those of some directions in which the triangle may be met from some point of a box, given by its middle and half its sides.
    #[inline(always)]
    pub(crate) fn toward<S: Simd>(
        &self,
        simd: S,
        (centre, half): (DVec3, DVec3),
        triangle: &Triangle,
        mask: u128,
    ) -> u128 {
        let corners = [triangle.a - centre, triangle.b - centre, triangle.c - centre];
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        // The plane as seen from the box: beside it, or through it.
        let side = corners[0].dot(normal.value);
        let spread = (half + corners[0].abs() * CROSS_ERROR).dot(normal.permanent);
        if side.abs() <= spread * (1.0 + 1e-6) || side.is_nan() {
            return mask;
        }
        let sign = if side > 0.0 { 1.0 } else { -1.0 };
        let (mut n, mut limit) = ([[0.0_f32; 3]; 3], [0.0_f32; 3]);
        for k in 0..3 {
            let along = corners[(k + 1) % 3] - corners[k];
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let cross = Cross::sized(from + to, from.abs() + to.abs(), along);
            let spread = Cross::of(half, along).permanent * 2.0;
            let size = cross.permanent.x + cross.permanent.y + cross.permanent.z;
            let slack = (spread.x + spread.y + spread.z) * 1.001 + size * EDGE_ERROR;
            // Scaled, so that nothing leaves the range of f32.
            let scale = sign / (slack + size + TINY);
            n[k] = (cross.value * scale).as_vec3().to_array();
            limit[k] = -(slack * scale.abs()) as f32 - BOX_SLACK;
        }
        let mut met = 0;
        for block in blocks(mask) {
            let ([x, y, z], _) = self.eight(simd, block * LANES);
            let one = (x * n[0][0] + y * n[0][1] + z * n[0][2]).simd_lt(limit[0]);
            let two = (x * n[1][0] + y * n[1][1] + z * n[1][2]).simd_lt(limit[1]);
            let three = (x * n[2][0] + y * n[2][1] + z * n[2][2]).simd_lt(limit[2]);
            met |= u128::from(!(one | two | three).to_bitmask() & 0xFF) << (block * LANES);
        }
        met & mask
    }
}

/// The blocks of eight directions that hold any of a set.
fn blocks(mask: u128) -> impl Iterator<Item = usize> {
    (0..SAMPLES / LANES).filter(move |block| mask >> (block * LANES) & 0xFF != 0)
}
