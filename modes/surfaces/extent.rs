//! Boxes in f64, and their rounding outward to the f32 boxes of the engine.
//!
//! A point p that a surface computes in f64 becomes the nearest f32. Rounding is monotone, so p ≥ lo gives f32(p) ≥ f32↓(lo): a
//! box that holds the point before it is rounded holds it afterwards. What f32 cannot hold is brought back to ±[`f32::MAX`], the
//! point as well as the box.

use glam::DVec3;
use umbel_core::Aabb;

/// The unit roundoff of f64.
const U: f64 = f64::EPSILON / 2.0;

/// The slack of a box for points that are sums of up to some dozen products of weights below 1 and numbers below M: each product
/// and each sum errs by at most U·M, so 2⁹·U·M covers 2⁸ of them in the point, and as many in the box.
const SUM_SLACK: f64 = 512.0 * U;

/// More than rounding to f32 takes off: 2⁻²⁴ of a number, or half of the least one.
const F32_SLACK: f64 = 1.0 / (1 << 23) as f64;

/// A box: lo ≤ x ≤ hi. Empty where lo > hi.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub(crate) lo: DVec3,
    pub(crate) hi: DVec3,
}

impl Extent {
    /// The box that holds nothing.
    pub(crate) const EMPTY: Self = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY };

    /// The smallest box around points.
    pub(crate) fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, p| all.union(Self { lo: p, hi: p }))
    }

    /// The smallest box around both.
    pub(crate) fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The box of all sums of a point of one and a point of the other.
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { lo: self.lo + other.lo, hi: self.hi + other.hi }
    }

    /// The box of all cross products of a vector of one and a vector of the other.
    pub(crate) fn cross(self, other: Self) -> Self {
        let product = |i: usize, j: usize| {
            let ends = [
                self.lo[i] * other.lo[j],
                self.lo[i] * other.hi[j],
                self.hi[i] * other.lo[j],
                self.hi[i] * other.hi[j],
            ];
            (
                ends.into_iter().fold(f64::INFINITY, f64::min),
                ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let component = |i: usize, j: usize| {
            let ((lo, hi), (other_lo, other_hi)) = (product(i, j), product(j, i));
            (lo - other_hi, hi - other_lo)
        };
        let [x, y, z] = [component(1, 2), component(2, 0), component(0, 1)];
        Self { lo: DVec3::new(x.0, y.0, z.0), hi: DVec3::new(x.1, y.1, z.1) }
    }

    /// The greatest size of a coordinate.
    pub(crate) fn reach(&self) -> f64 {
        self.lo.abs().max(self.hi.abs()).max_element()
    }

    /// The box with room on all sides.
    pub(crate) fn grown(self, by: f64) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }
    }

    /// The box with room for the rounding of sums and products of numbers up to `reach`.
    pub(crate) fn with_slack(self, reach: f64) -> Self {
        self.grown(reach * SUM_SLACK)
    }

    /// A box of f32 numbers around it, the smallest but for two units in the last place.
    pub(crate) fn outward(self) -> Aabb {
        let slack = |x: f64| x.abs().min(f64::from(f32::MAX)) * F32_SLACK + f64::from(f32::from_bits(1));
        let (lo, hi) = (self.lo.to_array(), self.hi.to_array());
        Aabb { lo: lo.map(|x| to_f32(x - slack(x))), hi: hi.map(|x| to_f32(x + slack(x))) }
    }
}

/// The nearest f32; numbers beyond its range become its ends, and −0 becomes 0, so that equal points are equal bits.
fn to_f32(x: f64) -> f32 {
    let near = x as f32;
    let near = if near > f32::MAX { f32::MAX } else { near };
    (if near < f32::MIN { f32::MIN } else { near }) + 0.0
}

/// A point as the engine takes it.
pub(crate) fn rounded(point: DVec3) -> [f32; 3] {
    point.to_array().map(to_f32)
}

/// An f32 point in f64, exactly.
pub(crate) fn widened(point: [f32; 3]) -> DVec3 {
    DVec3::from_array(point.map(f64::from))
}
