//! Axis-aligned boxes.
//!
//! A box is the closed set lo ≤ x ≤ hi. A cull by a box may keep what is missed and never drops what is hit: see
//! [`crate::intersect::general::slab`] for one ray.

use glam::DVec3;

/// The unit roundoff of f64: one correctly rounded operation errs by at most this factor.
pub(crate) const U: f64 = f64::EPSILON / 2.0;

/// An axis-aligned box: the closed set `lo ≤ x ≤ hi`. Empty when `lo > hi`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// The least coordinates.
    pub lo: [f32; 3],
    /// The greatest coordinates.
    pub hi: [f32; 3],
}

impl Aabb {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3] };

    /// The smallest box around points.
    #[must_use]
    pub fn of_points(points: impl IntoIterator<Item = [f32; 3]>) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds = bounds.union(Self { lo: p, hi: p });
        }
        bounds
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        let mut bounds = self;
        for k in 0..3 {
            bounds.lo[k] = if other.lo[k] < self.lo[k] { other.lo[k] } else { self.lo[k] };
            bounds.hi[k] = if other.hi[k] > self.hi[k] { other.hi[k] } else { self.hi[k] };
        }
        bounds
    }

    /// What both hold.
    pub(crate) fn common(self, other: Self) -> Self {
        let mut bounds = self;
        for k in 0..3 {
            bounds.lo[k] = if other.lo[k] > self.lo[k] { other.lo[k] } else { self.lo[k] };
            bounds.hi[k] = if other.hi[k] < self.hi[k] { other.hi[k] } else { self.hi[k] };
        }
        bounds
    }

    /// Whether the box holds nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|k| self.lo[k] > self.hi[k])
    }

    /// hi − lo per axis, in f64 (f32 could overflow).
    #[must_use]
    pub fn extent(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| f64::from(self.hi[k]) - f64::from(self.lo[k]))
    }

    /// (lo + hi)/2 per axis, in f64.
    #[must_use]
    pub fn centre(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| (f64::from(self.lo[k]) + f64::from(self.hi[k])) * 0.5)
    }

    /// The axis of the longest side: 0, 1 or 2.
    #[must_use]
    pub fn longest_axis(&self) -> usize {
        let [x, y, z] = self.extent();
        if x >= y && x >= z {
            0
        } else if y >= z {
            1
        } else {
            2
        }
    }

    /// lo and hi in f64, exactly.
    pub(crate) fn corners(&self) -> (DVec3, DVec3) {
        (widen(self.lo), widen(self.hi))
    }

    /// A bound of |x − base| within the box: one rounding, and the bound's own.
    pub(crate) fn reach(&self, base: DVec3) -> DVec3 {
        let (lo, hi) = self.corners();
        (lo - base).abs().max((hi - base).abs()) * (1.0 + 4.0 * U)
    }
}

/// An f32 point in f64, exactly.
pub(crate) fn widen(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}
