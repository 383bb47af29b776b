//! What stands in `builtin:field`: blades of grass, and heads of umbels.
//!
//! A blade is a quadratic curve with the points B_0, B_1, B_2 and a width that shrinks to 0 at the tip: p(u, v) = b(v) +
//! (2u − 1)·(1 − v²)·s with half of the width in s. The head of an umbel is a dome over a disc: (a, b) = (2u − 1, 2v − 1) goes to
//! (a·√(1 − b²/2), b·√(1 − a²/2)), at the height 1 − (a² + b²)/2.
//!
//! Based on: William Reeves and Ricki Blau, "Approximate and Probabilistic Algorithms for Shading and Rendering Structured Particle
//! Systems", 1985.

use fearless_simd::prelude::*;
use glam::DVec3;
use umbel_core::Domain;

use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LaneMap, Lanes, PointLanes, splat};

/// A blade: points of its curve, and half of its width.
pub(crate) struct Blade {
    pub(crate) spine: [DVec3; 3],
    pub(crate) half_width: DVec3,
}

impl Blade {
    /// The curve at v.
    fn curve(&self, v: f64) -> DVec3 {
        let s = 1.0 - v;
        self.spine[0] * (s * s) + self.spine[1] * (2.0 * s * v) + self.spine[2] * (v * v)
    }

    /// A box around a part: around the points of its curve, and of what lies beside.
    pub(crate) fn extent(&self, Domain { u, v }: Domain) -> Extent {
        let [a, b] = v;
        let (s, t) = (1.0 - a, 1.0 - b);
        let middle = self.spine[0] * (s * t) + self.spine[1] * (a * t + b * s) + self.spine[2] * (a * b);
        let curve = Extent::of([self.curve(a), middle, self.curve(b)]);
        let ends = u.map(|u| 2.0 * u - 1.0);
        let beside = ends.iter().flat_map(|end| v.map(|v| self.half_width * (end * (1.0 - v * v))));
        let all = curve.plus(Extent::of(beside));
        all.with_slack(all.reach())
    }
}

impl LaneMap for Blade {
    #[inline(always)]
    fn points<S: Simd>(&mut self, simd: S, [u, v]: [Lanes<S>; 2]) -> PointLanes<S> {
        let (s, beside) = (1.0 - v, (2.0 * u - 1.0) * (1.0 - v * v));
        let (near, middle, far) = (s * s, 2.0 * s * v, v * v);
        let mut points = splat(simd, DVec3::ZERO);
        for (k, points) in points.iter_mut().enumerate() {
            let [a, b, c] = self.spine.map(|point| point[k]);
            *points = near * a + middle * b + far * c + beside * self.half_width[k];
        }
        points
    }
}

/// A point of a head.
pub(crate) fn on_head((middle, radius): (DVec3, f64), [u, v]: [f64; 2]) -> DVec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let up = 0.35 * (1.0 - (a * a + b * b) * 0.5);
    let disc = DVec3::new(a * (1.0 - b * b * 0.5).sqrt(), up, -b * (1.0 - a * a * 0.5).sqrt());
    middle + disc * radius
}

/// A box around a part of a head.
pub(crate) fn head_extent((middle, radius): (DVec3, f64), domain: Domain) -> Extent {
    let [a, b] = [domain.u, domain.v].map(|t| t.map(|t| 2.0 * t - 1.0));
    let squares = |[lo, hi]: [f64; 2]| {
        let least = if lo <= 0.0 && hi >= 0.0 { 0.0 } else { (lo * lo).min(hi * hi) };
        [least, (lo * lo).max(hi * hi)]
    };
    let (aa, bb) = (squares(a), squares(b));
    let across = |[lo, hi]: [f64; 2], other: [f64; 2]| {
        let roots = other.map(|square| (1.0 - square * 0.5).sqrt());
        let ends = [lo * roots[0], lo * roots[1], hi * roots[0], hi * roots[1]];
        [ends.into_iter().fold(f64::INFINITY, f64::min), ends.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    };
    let (x, z) = (across(a, bb), across(b, aa));
    let up = |k: usize| 0.35 * (1.0 - (aa[k] + bb[k]) * 0.5);
    let disc =
        Extent { lo: DVec3::new(x[0], up(1), -z[1]) * radius, hi: DVec3::new(x[1], up(0), -z[0]) * radius };
    let all = disc.plus(Extent { lo: middle, hi: middle });
    all.with_slack(all.reach())
}
