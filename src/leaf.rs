//! The leaf of grid films, "DirectlyIntersect": a run of triangles against the rays of a tile.
//!
//! Three steps, each for eight triangles or eight rays at once:
//!
//! 1. drop triangles whose corners all lie outside one side of the tile's frustum;
//! 2. project the rest to columns and rows, and drop what falls between samples;
//! 3. set up the rest and evaluate them, see [`crate::blocks`].
//!
//! Triangles that pass a step wait until there are eight for the next one.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011 ("DirectlyIntersect").

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::bounds::U;
use crate::depth::DepthBuffer;
use crate::frustum::{Frustum, Interval, Projection};
use crate::lanes::{Batch, Boxes, LANES, Points, bits};
use crate::pencil::Origin;
use crate::runs::RUN;
use crate::setup::BatchSetup;
use crate::triangles::Triangles;
use crate::window::{Rect, Window};
use crate::{Aabb, Accuracy, GridFilm, Stats, TriangleId};

/// Rays along one side of a block: as many as there are lanes.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Rays along one side of a tile: its depth buffer stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;
/// Rays of a tile.
pub(crate) const TILE_RAYS: usize = (TILE_SIDE * TILE_SIDE) as usize;
/// Blocks along one side of a tile.
pub(crate) const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;

/// Film coordinates are clamped to 2³¹ before they become columns: three roundings of numbers below 2³² err by less than
/// 2⁻¹⁸ columns.
const COLUMN_SLACK: f64 = 1.0 / (1 << 18) as f64;

/// Columns and rows beyond this are as good as infinity.
const LIMIT: f64 = (1_u64 << 31) as f64;

/// What all tiles of one film share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilmQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) origin: Origin,
    pub(crate) film: &'a GridFilm,
    pub(crate) projection: &'a Projection,
    pub(crate) accuracy: Accuracy,
    pub(crate) level: Level,
    /// Whether any hit will do.
    pub(crate) any: bool,
}

/// The rays of a rectangle of a film, with what they have hit so far.
#[derive(Debug)]
pub(crate) struct Tile<'a> {
    pub(crate) query: FilmQuery<'a>,
    pub(crate) rect: Rect,
    pub(crate) frustum: Frustum,
    /// max |X| and max |Y|.
    pub(crate) reach: [f64; 2],
    pub(crate) depth: &'a mut DepthBuffer,
    /// Triangles that meet the frustum and wait for more, and max |A| of their corners.
    met: Batch,
    met_reach: DVec3,
    /// Triangles that may cover a sample and wait for more, with the columns and rows they may cover.
    pub(crate) seen: Batch,
    pub(crate) rects: [Rect; LANES],
    /// Triangles just read; setups just made.
    run: [Batch; RUN / LANES],
    pub(crate) setups: BatchSetup,
}

impl<'a> Tile<'a> {
    /// A tile of at most [`TILE_SIDE`] squared rays, with a buffer for that many.
    pub(crate) fn new(query: FilmQuery<'a>, rect: Rect, depth: &'a mut DepthBuffer) -> Self {
        let film = query.film;
        let x = Interval { lo: film.x(rect.x0), hi: film.x(rect.x1 - 1) };
        let y = Interval { lo: film.y(rect.y1 - 1), hi: film.y(rect.y0) };
        let frustum = Frustum::new(query.projection, x, y, Interval { lo: 0.0, hi: 0.0 });
        let reach = [x.lo.abs().max(x.hi.abs()), y.lo.abs().max(y.hi.abs())];
        depth.clear();
        for y in 0..TILE_SIDE {
            let outside = if y < rect.height() { rect.width() } else { 0 };
            (outside..TILE_SIDE).for_each(|x| depth.exclude(place(x, y)));
        }
        let rects = [Rect { x0: 0, y0: 0, x1: 0, y1: 0 }; LANES];
        Self {
            query,
            rect,
            frustum,
            reach,
            depth,
            met: Batch::EMPTY,
            met_reach: DVec3::ZERO,
            seen: Batch::EMPTY,
            rects,
            run: [Batch::EMPTY; RUN / LANES],
            setups: BatchSetup::EMPTY,
        }
    }

    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each.
    pub(crate) fn enter(&self, boxes: &Boxes) -> (u64, [f64; LANES]) {
        dispatch!(self.query.level, simd => self.frustum.enter_lanes(simd, boxes))
    }

    /// The greatest depth key of anything that lies no nearer than `t`.
    pub(crate) fn greatest_key(&self, t: f64) -> f64 {
        greatest_key(self.query.origin, t)
    }

    /// Tests a run of triangles within a box against all rays of the tile; some of them wait for [`Tile::flush`].
    pub(crate) fn intersect(&mut self, bounds: &Aabb, ids: impl Iterator<Item = u32>, stats: &mut Stats) {
        self.run.iter_mut().for_each(Batch::clear);
        for (place, id) in ids.enumerate() {
            self.run[place / LANES].push(id, self.query.triangles.corners(TriangleId(id)));
        }
        dispatch!(self.query.level, simd => self.meet(simd, bounds, stats));
    }

    /// Tests the triangles that wait.
    pub(crate) fn flush(&mut self, stats: &mut Stats) {
        dispatch!(self.query.level, simd => {
            self.project(simd, stats);
            self.rasterize(simd, stats);
        });
    }

    /// 1. What may meet the frustum waits in `met`.
    #[inline(always)]
    fn meet<S: Simd>(&mut self, simd: S, bounds: &Aabb, stats: &mut Stats) {
        let base = self.query.projection.base;
        let (lo, hi) = bounds.corners();
        let reach = (lo - base).abs().max((hi - base).abs()) * (1.0 + 4.0 * U);
        self.met_reach = self.met_reach.max(reach);
        for batch in 0..self.run.len() {
            let corners = relative(simd, &self.run[batch], base);
            let kept = self.run[batch].lanes() & !self.frustum.excluded(simd, &corners, reach);
            for lane in bits(kept) {
                self.met.push_lane(&self.run[batch], lane);
                if self.met.is_full() {
                    self.project(simd, stats);
                    self.met_reach = reach;
                }
            }
        }
    }

    /// 2. What may cover a sample waits in `seen`, with the columns and rows it may cover.
    #[inline(always)]
    fn project<S: Simd>(&mut self, simd: S, stats: &mut Stats) {
        let corners = relative(simd, &self.met, self.query.projection.base);
        let (around, crossing) = self.query.projection.project_lanes(simd, &corners, self.met_reach);
        let film = self.query.film;
        // The step is a power of two, so its inverse is exact.
        let (x0, y0, step) = (film.x(self.rect.x0), film.y(self.rect.y0), 1.0 / film.step());
        let x_lo = ((around[0].max(-LIMIT).min(LIMIT) - x0) * step).to_array();
        let x_hi = ((around[1].max(-LIMIT).min(LIMIT) - x0) * step).to_array();
        let y_lo = ((-around[3].max(-LIMIT).min(LIMIT) + y0) * step).to_array();
        let y_hi = ((-around[2].max(-LIMIT).min(LIMIT) + y0) * step).to_array();
        let (width, height) = (self.rect.width(), self.rect.height());
        for lane in 0..self.met.len {
            let rect = if crossing >> lane & 1 == 1 {
                Rect { x0: 0, y0: 0, x1: width, y1: height }
            } else {
                let (x0, x1) = whole_between(x_lo[lane], x_hi[lane], width);
                let (y0, y1) = whole_between(y_lo[lane], y_hi[lane], height);
                Rect { x0, y0, x1, y1 }
            };
            if rect.x0 < rect.x1 && rect.y0 < rect.y1 {
                self.rects[self.seen.len] = rect;
                self.seen.push_lane(&self.met, lane);
                if self.seen.is_full() {
                    self.rasterize(simd, stats);
                }
            }
        }
        self.met.clear();
    }

    /// Writes what the rays have hit.
    pub(crate) fn write(&self, window: &mut Window<'_>) {
        dispatch!(self.query.level, simd => self.write_lanes(simd, window));
    }

    #[inline(always)]
    fn write_lanes<S: Simd>(&self, simd: S, window: &mut Window<'_>) {
        let FilmQuery { origin, film, triangles, .. } = self.query;
        for (j, (ids, ts)) in (0..).zip(&mut window.rows) {
            for i in (0..self.rect.width()).step_by(BLOCK_SIDE as usize) {
                let columns = i as usize..(i + BLOCK_SIDE).min(self.rect.width()) as usize;
                let mut row = (&mut ids[columns.clone()], &mut ts[columns]);
                self.depth.write(simd, place(i, j), &mut row, origin, triangles, |k| {
                    // In range: fewer than eight columns.
                    origin.ray(film.at(self.rect.x0 + i + k as u32, self.rect.y0 + j))
                });
            }
        }
    }
}

/// The corners of a batch, from the base of the film's coordinates.
#[inline(always)]
fn relative<S: Simd>(simd: S, batch: &Batch, base: DVec3) -> [Points<S>; 3] {
    let base = Points::splat(simd, base);
    let [a, b, c] = &batch.corners;
    [Points::load(simd, a).minus(base), Points::load(simd, b).minus(base), Points::load(simd, c).minus(base)]
}

/// The place of a ray in the depth buffer of a tile: block by block, row by row within a block.
pub(crate) fn place(x: u32, y: u32) -> usize {
    let block = (y / BLOCK_SIDE) * TILE_BLOCKS + x / BLOCK_SIDE;
    (block * BLOCK_SIDE * BLOCK_SIDE + y % BLOCK_SIDE * BLOCK_SIDE + x % BLOCK_SIDE) as usize
}

/// The greatest depth key of anything that lies no nearer than `t` ≥ 0 on a pencil's rays.
pub(crate) fn greatest_key(origin: Origin, t: f64) -> f64 {
    match origin {
        Origin::Infinity(_) => -t,
        Origin::Point(_) if t > 0.0 => (1.0 / t) * (1.0 + f64::EPSILON),
        Origin::Point(_) => f64::INFINITY,
    }
}

/// The whole numbers in [lo, hi] and [0, count), as a half-open range. NaN keeps everything.
fn whole_between(lo: f64, hi: f64, count: u32) -> (u32, u32) {
    let lo = (lo - COLUMN_SLACK).ceil();
    let hi = (hi + COLUMN_SLACK).floor() + 1.0;
    let bound = |x: f64| {
        if x <= 0.0 {
            0
        } else if x < f64::from(count) {
            x as u32
        } else {
            count
        }
    };
    (if lo.is_nan() { 0 } else { bound(lo) }, if hi.is_nan() { count } else { bound(hi) })
}
