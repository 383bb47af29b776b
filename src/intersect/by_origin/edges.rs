//! A triangle as eight receivers see it: what its edges and its distance are in any direction.
//!
//! The edge a→b has n = (A + B)×(b − a), A = a − p, for the receiver at p; its edge function is d·n.
//!
//! **Filter.** With |d_k| ≤ 1, n divided by its error E = 8u₃₂·Σ|n_k| + 24u·(|A| + |B|)·|b − a| leaves doubt within ±1 only: n, d and their
//! products and sums round five times.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997 (static
//! filters).

use fearless_simd::prelude::*;

use crate::exact::filter::Cross;
use crate::geometry::triangles::Triangle;
use crate::intersect::by_origin::{BOX_SLACK, CROSS_ERROR, EDGE_ERROR, TINY};
use crate::simd::lanes::{LaneMask, Lanes, Narrow, Points, narrow};

/// n of a triangle's edges for eight receivers: d·n is positive inside, and certain beyond ±1.
pub(crate) struct Edges<S: Simd>([[Narrow<S>; 3]; 3]);

impl<S: Simd> Edges<S> {
    /// Given the corners relative to the receivers, and those receivers from which the plane is seen with A·N < 0.
    #[inline(always)]
    pub(crate) fn new(simd: S, triangle: &Triangle, relative: &[Points<S>; 3], turned: LaneMask<S>) -> Self {
        let one = Lanes::simd_from(simd, 1.0);
        let mut edges = [[Narrow::simd_from(simd, 0.0); 3]; 3];
        for ((k, edge), (a, b)) in edges.iter_mut().enumerate().zip(triangle.edges()) {
            let (from, to) = (relative[k], relative[(k + 1) % 3]);
            let (ends, along) = (from.plus(to), b - a);
            let n = Points {
                x: ends.y * along.z - ends.z * along.y,
                y: ends.z * along.x - ends.x * along.z,
                z: ends.x * along.y - ends.y * along.x,
            };
            // The sum of the ends may cancel, their errors do not.
            let sizes = from.magnitudes().sum() + to.magnitudes().sum();
            let in_f64 = sizes * (along.abs().max_element() * CROSS_ERROR);
            let scale = one / (n.magnitudes().sum() * EDGE_ERROR + in_f64 + TINY);
            let scale = turned.select(-scale, scale);
            *edge = [narrow(n.x * scale), narrow(n.y * scale), narrow(n.z * scale)];
        }
        Self(edges)
    }

    /// The least edge function for a direction.
    #[inline(always)]
    pub(crate) fn least(&self, [x, y, z]: [f32; 3]) -> Narrow<S> {
        let [one, two, three] = self.0;
        let one = one[0] * x + one[1] * y + one[2] * z;
        let two = two[0] * x + two[1] * y + two[2] * z;
        let three = three[0] * x + three[1] * y + three[2] * z;
        one.min(two).min(three)
    }
}

/// How far a triangle's plane is from eight receivers: |A·N|, and N over the sum of its components.
pub(crate) struct Distances<S: Simd> {
    normal: [f32; 3],
    /// Bounds of |A·N| over that sum.
    bounds: [Narrow<S>; 2],
}

impl<S: Simd> Distances<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, normal: Cross, side: Lanes<S>, error: Lanes<S>) -> Self {
        let size = normal.permanent.x + normal.permanent.y + normal.permanent.z + TINY;
        let zero = Narrow::simd_from(simd, 0.0);
        let lo = narrow((side.abs() - error) * (1.0 / size));
        let hi = narrow((side.abs() + error) * (1.0 / size));
        let bounds = [
            (lo * (1.0 - BOX_SLACK) - f32::MIN_POSITIVE).max(zero),
            hi * (1.0 + BOX_SLACK) + f32::MIN_POSITIVE,
        ];
        Self { normal: (normal.value / size).as_vec3().to_array(), bounds }
    }

    /// The receivers from which the plane is nearer than a limit for certain, and those from which it is farther.
    #[inline(always)]
    pub(crate) fn compare(&self, simd: S, [x, y, z]: [f32; 3], t_max: f64) -> (u64, u64) {
        let [u, v, w] = self.normal;
        let q = (u * x + v * y + w * z).abs();
        let limit = |q: f32, slack: f64| (f64::from(q) * t_max * (1.0 + slack)) as f32;
        let slack = f64::from(BOX_SLACK);
        let least = Narrow::simd_from(simd, limit(q - BOX_SLACK, -slack));
        let most = Narrow::simd_from(simd, limit(q + BOX_SLACK, slack));
        (self.bounds[1].simd_lt(least).to_bitmask(), self.bounds[0].simd_gt(most).to_bitmask())
    }
}
