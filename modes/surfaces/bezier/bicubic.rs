//! One bicubic Bézier patch: points, tangents, and boxes around parts of it.
//!
//! p(u, v) = Σ_j Σ_i B_i(u)·B_j(v)·P_ij with B_0 = s³, B_1 = 3s²t, B_2 = 3st², B_3 = t³, s = 1 − t. For dyadic t, s is exact, and
//! B_i(1 − t) and B_{3−i}(t) are the same products in the same order. The sum is (B_0·P_0 + B_3·P_3) + (B_1·P_1 + B_2·P_2),
//! which does not change when the order of the points is reversed. So patches whose border points are equal give equal bits
//! along the border, whichever way it runs; at t = 0 and t = 1 the other products are zeros.
//!
//! A part \[a, b\] of a cubic has the control points f(a,a,a), f(a,a,b), f(a,b,b), f(b,b,b), with the blossom f: for parameters
//! t₁, t₂, t₃ the weights of P_0 .. P_3 are the coefficients of the product of (s_k + t_k·x) over k. They are not negative and sum
//! up to 1, so the part lies within the box of these points.
//!
//! Based on: Pierre Bézier, "Numerical Control: Mathematics and Applications", 1972; Lyle Ramshaw, "Blossoming: A
//! Connect-the-Dots Approach to Splines", 1987.

use fearless_simd::prelude::*;
use glam::DVec3;
use umbel_core::Domain;

use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LaneMap, Lanes, PointLanes, splat};

/// The control points P_ij at \[4·j + i\]: i goes with u, j with v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bicubic(pub(crate) [DVec3; 16]);

/// B_0 .. B_3.
#[inline(always)]
fn weights<S: Simd>(t: Lanes<S>) -> [Lanes<S>; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * (s * s) * t, 3.0 * (t * t) * s, t * t * t]
}

/// The derivatives of B_0 .. B_3.
#[inline(always)]
fn slopes<S: Simd>(t: Lanes<S>) -> [Lanes<S>; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * s - 6.0 * s * t, 6.0 * s * t - 3.0 * t * t, 3.0 * t * t]
}

/// The sum that is the same in either direction.
fn blend(w: [f64; 4], p: [DVec3; 4]) -> DVec3 {
    (p[0] * w[0] + p[3] * w[3]) + (p[1] * w[1] + p[2] * w[2])
}

/// The same of eight points at a time.
#[inline(always)]
fn blend_lanes<S: Simd>(w: [Lanes<S>; 4], [a, b, c, d]: [PointLanes<S>; 4]) -> PointLanes<S> {
    let mut sum = a;
    for (k, sum) in sum.iter_mut().enumerate() {
        *sum = (a[k] * w[0] + d[k] * w[3]) + (b[k] * w[1] + c[k] * w[2]);
    }
    sum
}

impl LaneMap for Bicubic {
    #[inline(always)]
    fn points<S: Simd>(&mut self, simd: S, parameters: [Lanes<S>; 2]) -> PointLanes<S> {
        self.frames::<S, false>(simd, parameters)[0]
    }
}

impl Bicubic {
    /// A uniform bicubic B-spline as a Bézier patch: from the control points of B-splines, in the same order.
    pub(crate) fn of_b_spline(points: &[DVec3; 16]) -> Self {
        let cubic = |[a, b, c, d]: [DVec3; 4]| {
            let (bc, cb) = ((b * 2.0 + c) / 3.0, (b + c * 2.0) / 3.0);
            [((a + b * 2.0) / 3.0 + bc) * 0.5, bc, cb, (cb + (c * 2.0 + d) / 3.0) * 0.5]
        };
        let mut bezier = *points;
        for j in 0..4 {
            let row = cubic([0, 1, 2, 3].map(|i| bezier[4 * j + i]));
            bezier[4 * j..4 * j + 4].copy_from_slice(&row);
        }
        for i in 0..4 {
            let column = cubic([0, 1, 2, 3].map(|j| bezier[4 * j + i]));
            (0..4).for_each(|j| bezier[4 * j + i] = column[j]);
        }
        Self(bezier)
    }

    /// The cubics in u at eight v.
    #[inline(always)]
    fn rows<S: Simd>(&self, simd: S, w: [Lanes<S>; 4]) -> [PointLanes<S>; 4] {
        let mut rows = [splat(simd, DVec3::ZERO); 4];
        for (i, row) in rows.iter_mut().enumerate() {
            let column = [self.0[i], self.0[4 + i], self.0[8 + i], self.0[12 + i]];
            for (k, row) in row.iter_mut().enumerate() {
                let [a, b, c, d] = [column[0][k], column[1][k], column[2][k], column[3][k]];
                *row = (w[0] * a + w[3] * d) + (w[1] * b + w[2] * c);
            }
        }
        rows
    }

    /// The points at eight parameters and, where they are asked for, the tangents ∂p/∂u and ∂p/∂v.
    #[inline(always)]
    pub(crate) fn frames<S: Simd, const TANGENTS: bool>(
        &self,
        simd: S,
        [u, v]: [Lanes<S>; 2],
    ) -> [PointLanes<S>; 3] {
        let (across, along) = (weights(u), weights(v));
        let row = self.rows(simd, along);
        let point = blend_lanes(across, row);
        if !TANGENTS {
            return [point; 3];
        }
        [point, blend_lanes(slopes(u), row), blend_lanes(across, self.rows(simd, slopes(v)))]
    }

    /// The control points of a part.
    pub(crate) fn part(&self, domain: Domain) -> Self {
        let (across, along) = (blossoms(domain.u), blossoms(domain.v));
        let mut rows = self.0;
        for j in 0..4 {
            let row = [0, 1, 2, 3].map(|i| self.0[4 * j + i]);
            (0..4).for_each(|k| rows[4 * j + k] = blend(across[k], row));
        }
        let mut part = rows;
        for i in 0..4 {
            let column = [0, 1, 2, 3].map(|j| rows[4 * j + i]);
            (0..4).for_each(|k| part[4 * k + i] = blend(along[k], column));
        }
        Self(part)
    }

    /// A box around a part, with room for the rounding of every point of it.
    pub(crate) fn extent(&self, domain: Domain) -> Extent {
        let reach = Extent::of(self.0).reach();
        let part = if domain == Domain::UNIT { *self } else { self.part(domain) };
        Extent::of(part.0).with_slack(reach)
    }
}

/// The weights of P_0 .. P_3 for each control point of the part \[a, b\].
fn blossoms([a, b]: [f64; 2]) -> [[f64; 4]; 4] {
    [[a, a, a], [a, a, b], [a, b, b], [b, b, b]].map(|t| {
        let s = t.map(|t| 1.0 - t);
        let one = t[0] * s[1] * s[2] + s[0] * t[1] * s[2] + s[0] * s[1] * t[2];
        let two = s[0] * t[1] * t[2] + t[0] * s[1] * t[2] + t[0] * t[1] * s[2];
        [s[0] * s[1] * s[2], one, two, t[0] * t[1] * t[2]]
    })
}
