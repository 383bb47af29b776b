//! Places across a direction, and the grid of cells that divides them.
//!
//! Places are (x_i + x_k·s_i, x_j + x_k·s_j) with k the axis of the largest component of the direction d and s = −(d_i, d_j)/d_k; t = ±x_k
//! grows along the rays. All count from the middle of the scene, in f32; what is made of them is rounded outward by [`SLACK`] of the
//! scene's size.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005.

use fearless_simd::{prelude::*, u32x8};
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::intersect::directions::cell_leaf::axis_of;
use crate::rays::origin::Origin;
use crate::rays::projection::Plane;
use crate::simd::lanes::{LANES, Narrow};

/// Places and t err by less than this part of the scene's size: a few roundings in f32.
const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Packets per cell; fewer, but not below the second number, where there are more triangles than the third for a cell.
const PER_CELL: f32 = 32.0;
const FEWEST: f32 = 4.0;
const TRIANGLES_PER_CELL: f32 = 128.0;
/// The most cells along a side.
const MOST_CELLS: f32 = 512.0;

/// A direction across which places are measured, in f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Across {
    /// k, i and j.
    axes: [usize; 3],
    slopes: [f32; 2],
    /// The sign of d_k.
    turn: f32,
    pub(crate) middle: [f32; 3],
    /// What is added on both sides of places, and of t.
    pub(crate) slack: f32,
}

impl Across {
    pub(crate) fn new(direction: DVec3, bounds: &Aabb) -> Self {
        let plane = Plane::of(Origin::Infinity(direction), direction);
        let [ahead, right, up] = plane.axes();
        let axes = [ahead, right, up].map(axis_of);
        let [k, i, j] = axes;
        let middle = bounds.centre().map(|x| x as f32);
        let [x, y, z] = bounds.extent();
        // Numbers below the range of f32 count as well.
        let slack = x.max(y).max(z) as f32 * SLACK + f32::MIN_POSITIVE;
        let turn = if direction[k] < 0.0 { -1.0 } else { 1.0 };
        let slopes = [i, j].map(|across| (-direction[across] / direction[k]) as f32);
        Self { axes, slopes, turn, middle, slack }
    }

    /// Places and t of points, given coordinate by coordinate.
    #[inline(always)]
    pub(crate) fn see<S: Simd>(&self, points: [Narrow<S>; 3]) -> [Narrow<S>; 3] {
        let [k, i, j] = self.axes;
        let depth = points[k] - self.middle[k];
        let u = (points[i] - self.middle[i]) + depth * self.slopes[0];
        let v = (points[j] - self.middle[j]) + depth * self.slopes[1];
        [u, v, depth * self.turn]
    }
}

/// The grid over what the packets cover.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    lo: [f32; 2],
    per_unit: [f32; 2],
    pub(crate) cells: [usize; 2],
}

impl Grid {
    /// Cells over a rectangle for some packets, and some triangles at most.
    pub(crate) fn over([u0, v0, u1, v1]: [f32; 4], packets: usize, triangles: usize) -> Self {
        let (width, height) = ((u1 - u0).max(f32::MIN_POSITIVE), (v1 - v0).max(f32::MIN_POSITIVE));
        let (packets, triangles) = (packets as f32, triangles as f32);
        let cells = (packets / PER_CELL).max((packets / FEWEST).min(triangles / TRIANGLES_PER_CELL)).max(1.0);
        let across = (cells * width / height).sqrt().clamp(1.0, MOST_CELLS).min(cells);
        let along = (cells / across).clamp(1.0, MOST_CELLS);
        // In range: at most MOST_CELLS.
        let cells = [across as usize, along as usize];
        let per_unit = [cells[0] as f32 / width, cells[1] as f32 / height];
        Self { lo: [u0, v0], per_unit: per_unit.map(|x| if x.is_finite() { x } else { 0.0 }), cells }
    }

    /// The cells at eight places on an axis.
    #[inline(always)]
    pub(crate) fn cells_at<S: Simd>(&self, simd: S, places: Narrow<S>, axis: usize) -> [u32; LANES] {
        // In range: at most MOST_CELLS.
        let last = Narrow::simd_from(simd, (self.cells[axis] - 1) as f32);
        let cell = ((places - self.lo[axis]) * self.per_unit[axis]).max(0.0).min(last);
        u32x8::truncate_from(cell).to_array()
    }

    /// The cells that a rectangle covers: first and last column and row.
    #[inline(always)]
    pub(crate) fn covered(&self, sides: &[f32; 4]) -> [u16; 4] {
        // In range: at most MOST_CELLS.
        let last = self.cells.map(|cells| cells as u16 - 1);
        // The conversion saturates.
        let cell = |x: f32, axis: usize| (((x - self.lo[axis]) * self.per_unit[axis]) as u16).min(last[axis]);
        [cell(sides[0], 0), cell(sides[1], 1), cell(sides[2], 0), cell(sides[3], 1)]
    }
}

/// Calls a function with each cell of some columns and rows.
#[inline(always)]
pub(crate) fn each_cell(grid: &Grid, cells: [u16; 4], mut visit: impl FnMut(usize)) {
    let [x0, y0, x1, y1] = cells.map(usize::from);
    for y in y0..=y1 {
        for x in x0..=x1 {
            visit(y * grid.cells[0] + x);
        }
    }
}
