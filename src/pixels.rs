//! Columns and rows: which rays of a tile a triangle may meet, and how near it comes, for eight triangles at once.
//!
//! Column and row of a point are (g_X − X₀g_W)·A/(step·g_W·A) and the like, see [`crate::frustum`], counted from the first
//! ray of the tile. The functionals err by at most s_x, s_y and s_t within a run's box. A corner is *regular* where t
//! exceeds both 2³⁰s_t and 2²⁰max(s_x, s_y): its column then errs by less than 2⁻¹⁹ + 2⁻²⁹|column|, which moves none of
//! the columns 0 to 63 by more than [`SLACK`], and none beyond ±2⁸ into them. A triangle with another corner (at or behind the eye, or very near to it) may meet
//! all rays of the tile.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997.

use fearless_simd::{i32x8, prelude::*};
use glam::DVec3;

use crate::GridFilm;
use crate::frustum::{Functional, Projection};
use crate::lanes::{LANES, LaneMask, Lanes, Narrow, Points, narrow};
use crate::tile_depth::TILE_SIDE;
use crate::window::Rect;

/// Columns around a triangle that count as its own: more than regular corners err by, and than rounding numbers below
/// 2⁷ to f32 adds.
const SLACK: f32 = 1.0 / (1 << 14) as f32;

/// Columns and rows are clamped to just outside of the tile.
const OUTSIDE: [f64; 2] = [-4.0, TILE_SIDE as f64 + 4.0];

/// Rounding a key up to f32 with the error of a regular corner: 2⁻²⁴ and 2⁻²⁹.
const KEY_SLACK: f64 = 1.0 / (1 << 22) as f64;

/// Columns, rows and t of points, as functionals of A.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixels {
    perspective: bool,
    column: Functional,
    row: Functional,
    t: Functional,
    /// What is taken off columns and rows at infinity.
    offset: [f64; 2],
    /// Rays per row, rows.
    size: [u32; 2],
}

/// Where eight triangles may meet the rays of a tile.
#[derive(Debug)]
pub(crate) struct Footprints {
    /// First column, first row, last column, last row, lane by lane.
    sides: [[i32; LANES]; 4],
    /// Upper bounds of keys.
    pub(crate) greatest: [f32; LANES],
    /// The lanes that may meet a ray.
    pub(crate) lanes: u64,
}

impl Footprints {
    /// No triangles.
    pub(crate) const EMPTY: Self = Self { sides: [[0; LANES]; 4], greatest: [0.0; LANES], lanes: 0 };

    /// The rays of one of the lanes that may meet a ray.
    #[inline(always)]
    pub(crate) fn rect(&self, lane: usize) -> Rect {
        // In range: clamped to the tile.
        let [x0, y0, x1, y1] = self.sides.each_ref().map(|side| side[lane % LANES] as u32 % TILE_SIDE);
        Rect { x0, y0, x1: x1 + 1, y1: y1 + 1 }
    }
}

impl Pixels {
    /// The columns and rows of a tile.
    pub(crate) fn new(projection: &Projection, film: &GridFilm, rect: Rect) -> Self {
        let Projection { perspective, x, y, t, .. } = *projection;
        let (x0, y0, inverse) = (film.x(rect.x0), film.y(rect.y0), 1.0 / film.step());
        // The step is a power of two, so its inverse is exact.
        let (column, row, offset) = if perspective {
            (x.minus(&t, x0), y.minus(&t, y0), [0.0; 2])
        } else {
            (x, y, [x0 * inverse, -y0 * inverse])
        };
        let (column, row) = (column.scaled(inverse), row.scaled(-inverse));
        Self { perspective, column, row, t, offset, size: [rect.width(), rect.height()] }
    }

    /// The footprints of triangles given as A, where `reach` bounds its magnitudes.
    #[inline(always)]
    pub(crate) fn around<S: Simd>(
        &self,
        simd: S,
        corners: &[Points<S>; 3],
        reach: DVec3,
        (lanes, footprints): (u64, &mut Footprints),
    ) -> u64 {
        let zero = Lanes::simd_from(simd, 0.0);
        let [least_t, error_t] = self.regular_from(reach);
        let (mut lo, mut hi) = ([zero + OUTSIDE[1]; 2], [zero + OUTSIDE[0]; 2]);
        let mut greatest = zero + f64::NEG_INFINITY;
        let mut regular = LaneMask::simd_from(simd, true);
        for corner in corners {
            let t = corner.dot(self.t.g);
            regular &= t.simd_gt(zero + least_t);
            let (mut x, mut y) = (corner.dot(self.column.g), corner.dot(self.row.g));
            if self.perspective {
                let inverse = (zero + 1.0) / t;
                (x, y) = (x * inverse, y * inverse);
                greatest = greatest.max(inverse);
            } else {
                (x, y) = (x - self.offset[0], y - self.offset[1]);
                greatest = greatest.max(error_t - t);
            }
            (lo, hi) = ([lo[0].min(x), lo[1].min(y)], [hi[0].max(x), hi[1].max(y)]);
        }
        let greatest = greatest + (greatest.abs() * KEY_SLACK + f64::from(f32::MIN_POSITIVE));
        narrow(regular.select(greatest, zero + f64::INFINITY)).store_slice(&mut footprints.greatest);

        // Irregular lanes get all rays; NaN is among them.
        let mut kept = lanes;
        for (axis, &size) in self.size.iter().enumerate() {
            let (first, last) = (zero + OUTSIDE[0], zero + OUTSIDE[1]);
            let from = narrow(regular.select(lo[axis], first).max(first).min(last)) - SLACK;
            let to = narrow(regular.select(hi[axis], last).max(first).min(last)) + SLACK;
            let zero = Narrow::simd_from(simd, 0.0);
            let from = from.ceil().max(zero);
            let to = to.floor().min(zero + (size - 1) as f32);
            kept &= from.simd_le(to).to_bitmask();
            i32x8::truncate_from(from).store_slice(&mut footprints.sides[axis]);
            i32x8::truncate_from(to).store_slice(&mut footprints.sides[axis + 2]);
        }
        footprints.lanes = kept;
        // Those that are not regular.
        !regular.to_bitmask() & kept
    }

    /// The t from which corners are regular, and the error of t.
    #[inline(always)]
    fn regular_from(&self, reach: DVec3) -> [f64; 2] {
        let [x, y, t] = [self.column, self.row, self.t].map(|functional| functional.slack_within(reach));
        let coarsest = if x > y { x } else { y };
        let scale = f64::from(1 << 20);
        if self.perspective {
            let (depth, across) = (t * f64::from(1 << 30), coarsest * scale);
            [if depth > across { depth } else { across }, t]
        } else {
            // All corners, or none.
            [if coarsest * scale < 1.0 { f64::NEG_INFINITY } else { f64::INFINITY }, t]
        }
    }
}
