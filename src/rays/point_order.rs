//! The order of receivers in space: along Lebesgue's (Morton's) curve.
//!
//! Cells lie over what a sample of the receivers covers; what lies outside counts for the cells at the border.
//!
//! For one light alone this order is worse than the light's own, see [`crate::intersect::irregular::order`]: exact
//! shadows took 1.1 (chess) to 1.65 (sponza) times as long. It is found once for all directions.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966.

use fearless_simd::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::objects::gather;
use crate::objects::morton::{Cells, OnCurve};
use crate::rays::hemisphere::Hemisphere;
use crate::simd::lanes::LANES;

/// Receivers that are looked at to find what they cover.
const SAMPLED: usize = 4096;

/// Receivers in cubic cells.
pub(crate) struct PointGrid<'a> {
    hemispheres: &'a [Hemisphere],
    cells: Cells,
}

impl<'a> PointGrid<'a> {
    /// Cells over what a sample of them covers.
    pub(crate) fn over(hemispheres: &'a [Hemisphere]) -> Self {
        let sampled = hemispheres.iter().step_by((hemispheres.len() / SAMPLED).max(1));
        let bounds = Aabb::of_points(sampled.map(|hemisphere| hemisphere.receiver.point));
        Self { hemispheres, cells: Cells::over(&bounds) }
    }
}

impl OnCurve for PointGrid<'_> {
    /// A packet.
    const FEW: usize = LANES;

    #[inline(always)]
    fn places<S: Simd>(&self, simd: S, first: u32) -> [u32; LANES] {
        let first = first as usize;
        let eight = &self.hemispheres[first..self.hemispheres.len().min(first + LANES)];
        let points = gather::points_by_lane(simd, eight.len(), |lane| eight[lane].receiver.point);
        self.cells.places(simd, points)
    }
}
