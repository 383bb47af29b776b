//! Eight boxes side by side: a node of the runs, or of the tree of bundles.

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::simd::lanes::{LANES, Points};

/// Eight boxes, coordinate by coordinate. Places that hold none hold the empty box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Boxes {
    pub(crate) lo: [[f32; LANES]; 3],
    pub(crate) hi: [[f32; LANES]; 3],
}

impl Boxes {
    /// No boxes.
    pub(crate) const EMPTY: Self =
        Self { lo: [[f32::INFINITY; LANES]; 3], hi: [[f32::NEG_INFINITY; LANES]; 3] };

    /// Puts a box into a lane.
    pub(crate) fn set(&mut self, lane: usize, bounds: &Aabb) {
        for k in 0..3 {
            (self.lo[k][lane], self.hi[k][lane]) = (bounds.lo[k], bounds.hi[k]);
        }
    }

    /// The box of a lane.
    pub(crate) fn get(&self, lane: usize) -> Aabb {
        Aabb { lo: [0, 1, 2].map(|k| self.lo[k][lane]), hi: [0, 1, 2].map(|k| self.hi[k][lane]) }
    }

    /// The centre of the box of a lane.
    pub(crate) fn centre(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|k| (self.lo[k][lane] + self.hi[k][lane]) * 0.5)
    }

    /// lo and hi of all lanes, from a base. Empty lanes are infinite.
    #[inline(always)]
    pub(crate) fn corners<S: Simd>(&self, simd: S, base: DVec3) -> [Points<S>; 2] {
        let base = Points::splat(simd, base);
        [Points::widen(simd, &self.lo).minus(base), Points::widen(simd, &self.hi).minus(base)]
    }
}
