//! Footprints: which rays of a film the triangles of a run may meet, and how near they come.
//!
//! Column and row of a point are (g_X − X₀g_W)·A/(step·g_W·A) and the like, see [`crate::rays::frustum`], counted from
//! the first ray of the film. The functionals err by at most s_x, s_y and s_t within a run's box. A corner is *regular*
//! where t exceeds both 2³⁰s_t and 2²⁰max(s_x, s_y): its column then errs by less than 2⁻¹⁹ + 2⁻²⁹|column|. A triangle
//! with another corner (at or behind the eye, or very near to it) may meet all rays.
//!
//! Neighbouring tiles meet the same runs, so each thread keeps the footprints of the last few runs: a run is projected
//! once for several tiles, and a tile reads the corners of those triangles only that may meet it: for sponza 46
//! thousand instead of 365 thousand, and setup gets eight at a time (35 to 31 ms on one thread).
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997.

use std::mem::size_of;

use fearless_simd::{i16x16, i32x8, prelude::*};
use glam::DVec3;

use crate::geometry::triangles::Triangles;
use crate::intersect::pencil::rect::Rect;
use crate::objects::gather::corners;
use crate::objects::runs::RUN;
use crate::rays::film::{GridFilm, Sampling};
use crate::rays::frustum::{Functional, Projection};
use crate::simd::lanes::{LANES, LaneMask, Lanes, Narrow, NarrowMask, Points, narrow, widen};

/// Runs whose footprints a thread keeps where tiles share a film: 52 KiB. A power of two.
pub(crate) const KEPT: usize = 256;

/// Columns around a triangle that count as its own: more than regular corners err by on films of up to 2⁷ columns;
/// wider ones need more, see [`Pixels::new`].
const SLACK: f64 = 1.0 / (1 << 14) as f64;

/// The greatest column or row that is kept; those of larger films are halved until they fit.
const GREATEST: u32 = 0x7FFF;

/// Rounding a key up to f32 with the error of a regular corner: 2⁻²⁴ and 2⁻²⁹.
const KEY_SLACK: f64 = 1.0 / (1 << 22) as f64;

/// Columns, rows and t of points, as functionals of A.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pixels {
    pub(crate) base: DVec3,
    perspective: bool,
    /// See [`Projection::level`].
    level: [bool; 3],
    column: Functional,
    row: Functional,
    t: Functional,
    /// What is taken off columns and rows at infinity.
    offset: [f64; 2],
    /// The last column and the last row.
    last: [f64; 2],
    slack: f32,
    /// Columns and rows are kept over two to the power of this.
    shift: u32,
    sampling: Sampling,
}

/// The footprints of a run.
#[derive(Debug, Clone)]
struct RunFootprints {
    /// The run, or `usize::MAX`.
    run: usize,
    /// First column, first row, last column, last row, triangle by triangle; empty places end before they begin.
    sides: [[i16; RUN]; 4],
    /// Upper bounds of keys.
    greatest: [f32; RUN],
    /// Triangles with irregular corners.
    irregular: u64,
}

/// The footprints of the last few runs.
#[derive(Debug)]
pub(crate) struct Footprints {
    runs: Box<[RunFootprints]>,
}

impl Footprints {
    /// Bytes of the footprints of so many runs.
    pub(crate) const fn bytes(kept: usize) -> usize {
        kept * size_of::<RunFootprints>()
    }

    /// No footprints, with room for those of some runs: a power of two.
    pub(crate) fn new(kept: usize) -> Self {
        let none =
            RunFootprints { run: usize::MAX, sides: [[0; RUN]; 4], greatest: [0.0; RUN], irregular: 0 };
        Self { runs: vec![none; kept].into_boxed_slice() }
    }

    /// The place of a run.
    #[inline(always)]
    fn place(&self, run: usize) -> usize {
        run & (self.runs.len() - 1)
    }

    /// Forgets all footprints: they are those of another film.
    pub(crate) fn forget(&mut self) {
        self.runs.iter_mut().for_each(|footprints| footprints.run = usize::MAX);
    }

    /// Whether the footprints of a run are kept.
    #[inline(always)]
    pub(crate) fn hold(&self, run: usize) -> bool {
        self.runs[self.place(run)].run == run
    }

    /// Projects the triangles of a run, given their ids and how many there are; `reach` bounds |a − base| of their
    /// corners.
    #[inline(always)]
    pub(crate) fn project<S: Simd>(
        &mut self,
        simd: S,
        pixels: &Pixels,
        triangles: &Triangles<'_>,
        (run, (ids, count)): (usize, ([u32; RUN], usize)),
        reach: DVec3,
    ) {
        let place = self.place(run);
        let entry = &mut self.runs[place];
        let [low, high] = entry.greatest.as_chunks_mut::<LANES>().0 else { return };
        let ([one, other], _) = ids.as_chunks() else { return };
        let lanes = (1 << count) - 1;
        let corners = [corners(simd, triangles, one), corners(simd, triangles, other)];
        let (one, one_irregular) = pixels.around(simd, (&corners[0], lanes & 0xFF), reach, low);
        let (other, other_irregular) = pixels.around(simd, (&corners[1], lanes >> LANES), reach, high);
        for (sides, (one, other)) in entry.sides.iter_mut().zip(one.into_iter().zip(other)) {
            let both: i16x16<S> = one.narrow(other);
            both.store_slice(sides);
        }
        entry.irregular = one_irregular | other_irregular << LANES;
        entry.run = run;
    }

    /// The triangles of a run, as bits, that may meet a tile.
    #[inline(always)]
    pub(crate) fn meeting<S: Simd>(&self, simd: S, pixels: &Pixels, run: usize, tile: Rect) -> u64 {
        let [x0, y0, x1, y1] = &self.runs[self.place(run)].sides;
        let (x0, x1) = (i16x16::load_array_ref(simd, x0), i16x16::load_array_ref(simd, x1));
        let (y0, y1) = (i16x16::load_array_ref(simd, y0), i16x16::load_array_ref(simd, y1));
        // In range: at most GREATEST.
        let [first_x, first_y, last_x, last_y] =
            [tile.x0, tile.y0, tile.x1 - 1, tile.y1 - 1].map(|x| (x >> pixels.shift) as i16);
        let across = x0.simd_le(last_x) & x1.simd_ge(first_x);
        let along = y0.simd_le(last_y) & y1.simd_ge(first_y);
        (across & along).to_bitmask()
    }

    /// The rays of a tile, counted from its first one, that a triangle may meet, and an upper bound of its keys. It
    /// must meet the tile.
    #[inline(always)]
    pub(crate) fn within(&self, pixels: &Pixels, (run, lane): (usize, usize), tile: Rect) -> (Rect, f32) {
        let RunFootprints { sides, greatest, .. } = &self.runs[self.place(run)];
        let lane = lane % RUN;
        // In range: footprints that meet a tile are not negative.
        let [x0, y0, x1, y1] = sides.each_ref().map(|side| (side[lane] as u32) << pixels.shift);
        let end = 1 << pixels.shift;
        let rect = Rect {
            x0: x0.max(tile.x0) - tile.x0,
            y0: y0.max(tile.y0) - tile.y0,
            x1: (x1 + end).min(tile.x1) - tile.x0,
            y1: (y1 + end).min(tile.y1) - tile.y0,
        };
        (rect, greatest[lane])
    }

    /// The triangles of a run, as bits, with irregular corners.
    #[inline(always)]
    pub(crate) fn irregular(&self, run: usize) -> u64 {
        self.runs[self.place(run)].irregular
    }
}

impl Pixels {
    /// The columns and rows of a film.
    pub(crate) fn new(projection: &Projection, film: &GridFilm, sampling: Sampling) -> Self {
        Self::counted_from(projection, film, [0, 0], sampling)
    }

    /// Columns and rows of a film, counted from one of them on.
    pub(crate) fn counted_from(
        projection: &Projection,
        film: &GridFilm,
        first: [u32; 2],
        sampling: Sampling,
    ) -> Self {
        let Projection { base, perspective, level, x, y, t } = *projection;
        let (x0, y0, inverse) = (film.x(first[0]), film.y(first[1]), 1.0 / film.step());
        // The step is a power of two, so its inverse is exact.
        let (column, row, offset) = if perspective {
            (x.minus(&t, x0), y.minus(&t, y0), [0.0; 2])
        } else {
            (x, y, [x0 * inverse, -y0 * inverse])
        };
        let longest = film.width().max(film.height());
        // Rounding to f32 and irregularity: 2⁻²⁴ and 2⁻²⁹ of the greatest column.
        let slack = SLACK + f64::from(longest) / f64::from(1 << 23);
        Self {
            base,
            perspective,
            level,
            column: column.scaled(inverse),
            row: row.scaled(-inverse),
            t,
            offset,
            last: [film.width(), film.height()].map(|size| f64::from(size - 1)),
            slack: slack as f32,
            shift: (0..32).find(|shift| (longest - 1) >> shift <= GREATEST).unwrap_or(0),
            sampling,
        }
    }

    /// First column, first row, last column and last row of eight triangles, upper bounds of their keys, and, as bits,
    /// those with irregular corners.
    #[inline(always)]
    fn around<S: Simd>(
        &self,
        simd: S,
        (corners, lanes): (&[Points<S>; 3], u64),
        reach: DVec3,
        greatest_keys: &mut [f32; LANES],
    ) -> ([i32x8<S>; 4], u64) {
        let base = Points::splat(simd, self.base);
        let zero = Lanes::simd_from(simd, 0.0);
        let [least_t, error_t] = self.regular_from(reach);
        let infinite = zero + f64::INFINITY;
        let (mut lo, mut hi, mut greatest) = ([infinite; 2], [-infinite; 2], -infinite);
        let mut regular = LaneMask::simd_from(simd, true);
        let mut seen = [[zero; 2]; 3];
        for (corner, seen) in corners.iter().zip(&mut seen) {
            let corner = corner.minus(base);
            let ([x, y], key, in_front) = self.place(simd, corner, least_t);
            regular &= in_front;
            greatest = greatest.max(if self.perspective { key } else { key + error_t });
            (lo, hi) = ([lo[0].min(x), lo[1].min(y)], [hi[0].max(x), hi[1].max(y)]);
            *seen = [x, y];
        }
        let greatest = greatest + (greatest.abs() * KEY_SLACK + f64::from(f32::MIN_POSITIVE));
        narrow(regular.select(greatest, infinite)).store_slice(greatest_keys);

        // Irregular lanes get all rays; NaN is among them.
        let mut kept = lanes & !self.edge_on(simd, corners);
        let mut sides = [Narrow::simd_from(simd, 0.0); 4];
        for axis in 0..2 {
            let (from, to) = self.whole_between(simd, axis, [lo[axis], hi[axis]], regular);
            kept &= from.simd_le(to).to_bitmask();
            (sides[axis], sides[axis + 2]) = (from, to);
        }
        // Triangles around one ray alone: half of them miss it. Columns and rows err by less than the slack, and differ from
        // the ray's by less than two, so edge functions err by less than eight times the slack.
        let [x0, y0, x1, y1] = sides;
        let grid = if self.sampling == Sampling::Grid { lanes } else { 0 };
        let single = (x0.simd_eq(x1) & y0.simd_eq(y1)).to_bitmask() & regular.to_bitmask() & grid;
        if single & kept != 0 {
            kept &= !(single & misses(seen, [widen(x0), widen(y0)], 8.0 * f64::from(self.slack)));
        }
        // What is not kept ends before any tile.
        let nowhere = Narrow::simd_from(simd, -1.0);
        sides[2] = NarrowMask::from_bitmask(simd, kept).select(sides[2], nowhere);
        let halved = 1.0 / (1_u32 << self.shift) as f32;
        let mut whole = [i32x8::simd_from(simd, 0); 4];
        for (whole, side) in whole.iter_mut().zip(sides) {
            *whole = i32x8::truncate_from((side * halved).floor());
        }
        (whole, !regular.to_bitmask() & kept)
    }

    /// The triangles, as bits, that lie across an axis and are seen edge-on for that: through the origin, or parallel to all rays. Nothing
    /// hits them. Common where a light or an eye is in the plane of a wall, and among the walls of a plan.
    #[inline(always)]
    fn edge_on<S: Simd>(&self, simd: S, [a, b, c]: &[Points<S>; 3]) -> u64 {
        let mut edge_on = 0;
        let axes = [(a.x, b.x, c.x, 0), (a.y, b.y, c.y, 1), (a.z, b.z, c.z, 2)];
        for (a, b, c, axis) in axes {
            if self.perspective {
                let origin = Lanes::simd_from(simd, self.base[axis]);
                edge_on |= (a.simd_eq(origin) & b.simd_eq(origin) & c.simd_eq(origin)).to_bitmask();
            } else if self.level[axis] {
                edge_on |= (a.simd_eq(b) & b.simd_eq(c)).to_bitmask();
            }
        }
        edge_on
    }

    /// Columns and rows, and keys, of eight points given from the base, and which of them are regular: see
    /// [`Pixels::regular_from`].
    #[inline(always)]
    pub(crate) fn place<S: Simd>(
        &self,
        simd: S,
        point: Points<S>,
        least_t: f64,
    ) -> ([Lanes<S>; 2], Lanes<S>, LaneMask<S>) {
        let t = point.dot(self.t.g);
        let regular = t.simd_gt(Lanes::simd_from(simd, least_t));
        let (x, y) = (point.dot(self.column.g), point.dot(self.row.g));
        if self.perspective {
            let inverse = Lanes::simd_from(simd, 1.0) / t;
            ([x * inverse, y * inverse], inverse, regular)
        } else {
            ([x - self.offset[0], y - self.offset[1]], -t, regular)
        }
    }

    /// The first and the last column (axis 0) or row between bounds; all of them where corners are irregular.
    #[inline(always)]
    fn whole_between<S: Simd>(
        &self,
        simd: S,
        axis: usize,
        [lo, hi]: [Lanes<S>; 2],
        regular: LaneMask<S>,
    ) -> (Narrow<S>, Narrow<S>) {
        let (first, last) = (Lanes::simd_from(simd, -4.0), Lanes::simd_from(simd, self.last[axis] + 4.0));
        let from = narrow(regular.select(lo, first).max(first).min(last)) - self.slack;
        let to = narrow(regular.select(hi, last).max(first).min(last)) + self.slack;
        // Rays lie at whole columns, or between them.
        let (from, to) = match self.sampling {
            Sampling::Grid => (from.ceil(), to.floor()),
            Sampling::Scattered => (from.floor(), to.ceil()),
        };
        (from.max(0.0), to.min(self.last[axis] as f32))
    }

    /// The t from which corners are regular, and the error of t.
    #[inline(always)]
    pub(crate) fn regular_from(&self, reach: DVec3) -> [f64; 2] {
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

/// The triangles, as bits, that a point lies outside of: some edge function is negative and some positive, by more than
/// their error.
#[inline(always)]
fn misses<S: Simd>(corners: [[Lanes<S>; 2]; 3], [x, y]: [Lanes<S>; 2], error: f64) -> u64 {
    let [a, b, c] = corners;
    let (ax, ay, bx, by, cx, cy) = (a[0] - x, a[1] - y, b[0] - x, b[1] - y, c[0] - x, c[1] - y);
    let (ab, bc, ca) = (ax * by - ay * bx, bx * cy - by * cx, cx * ay - cy * ax);
    let (least, greatest) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
    least.simd_lt(-error).to_bitmask() & greatest.simd_gt(error).to_bitmask()
}
