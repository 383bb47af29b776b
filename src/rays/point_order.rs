//! The order of receivers in space: along Lebesgue's (Morton's) curve.
//!
//! Cells lie over what a sample of the receivers covers; what lies outside counts for the cells at the border.
//!
//! For one light alone this order is worse than the light's own, see [`crate::intersect::irregular::order`]: exact shadows took 1.1 (chess) to
//! 1.65 (sponza) times as long. It is found once for all directions.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966.

use fearless_simd::{prelude::*, u32x8};

use crate::geometry::aabb::Aabb;
use crate::objects::gather;
use crate::objects::morton::{OnCurve, spread};
use crate::rays::hemisphere::Hemisphere;
use crate::simd::lanes::{LANES, Narrow};

/// Receivers that are looked at to find what they cover.
const SAMPLED: usize = 4096;

/// Cubic cells over receivers. f32 is fine enough.
pub(crate) struct PointGrid<'a> {
    hemispheres: &'a [Hemisphere],
    lo: [f32; 3],
    cells_per_unit: f32,
}

impl<'a> PointGrid<'a> {
    /// 256 fine cells along the longest side.
    pub(crate) fn over(hemispheres: &'a [Hemisphere]) -> Self {
        let sampled = hemispheres.iter().step_by((hemispheres.len() / SAMPLED).max(1));
        let bounds = Aabb::of_points(sampled.map(|hemisphere| hemisphere.receiver.point));
        let longest = bounds.extent()[bounds.longest_axis()];
        let cells_per_unit = if longest > 0.0 { 256.0 / longest } else { 0.0 };
        Self { hemispheres, lo: bounds.lo, cells_per_unit: cells_per_unit as f32 }
    }
}

impl OnCurve for PointGrid<'_> {
    /// A packet.
    const FEW: usize = LANES;

    #[inline(always)]
    fn places<S: Simd>(&self, simd: S, first: u32) -> [u32; LANES] {
        let first = first as usize;
        let eight = &self.hemispheres[first..self.hemispheres.len().min(first + LANES)];
        let mut points = [[0.0; 3]; LANES];
        for (lane, point) in points.iter_mut().enumerate() {
            *point = eight[lane.min(eight.len() - 1)].receiver.point;
        }
        let mut place = u32x8::simd_from(simd, 0);
        for (k, x) in gather::transposed_points(simd, &points).into_iter().enumerate() {
            let cell = (x - self.lo[k]) * self.cells_per_unit;
            let cell = cell.max(0.0).min(Narrow::simd_from(simd, 255.0));
            place |= spread(u32x8::truncate_from(cell) & 0xFF) << (2 - k as u32);
        }
        place.to_array()
    }
}
