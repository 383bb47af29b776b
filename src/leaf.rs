//! The leaf of grid films, "DirectlyIntersect": a run of triangles against the rays of a tile.
//!
//! Three steps, for eight triangles at once:
//!
//! 1. project the corners to columns and rows, and drop what falls between or beside the rays, see [`crate::pixels`];
//! 2. drop what is hidden from all blocks that it meets;
//! 3. set up the rest, see [`crate::setup`], and evaluate them, see [`crate::blocks`].
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011 ("DirectlyIntersect").

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::bounds::U;
use crate::frustum::{Frustum, Interval, Projection};
use crate::lanes::{Batch, Boxes, LANES, Points, bits};
use crate::pencil::Origin;
use crate::pixels::{Footprints, Pixels};
use crate::setup::{Setups, TileRays, set_up};
use crate::tile_depth::{BLOCK_SIDE, TileDepth, row_of};
use crate::triangles::Triangles;
use crate::window::{Rect, Window};
use crate::{Aabb, Accuracy, GridFilm, Stats, TriangleId};

/// What all tiles of one film share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilmQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) origin: Origin,
    pub(crate) film: &'a GridFilm,
    pub(crate) projection: &'a Projection,
    /// The box of all triangles.
    pub(crate) bounds: Aabb,
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
    /// Cleared before the first triangle.
    pub(crate) depth: &'a mut TileDepth,
    touched: bool,
    frustum: Frustum,
    limits: [f64; 6],
    pixels: Pixels,
    rays: TileRays,
    /// Eight triangles, where they meet the tile, and their setup.
    pub(crate) batch: Batch,
    pub(crate) footprints: Footprints,
    pub(crate) setups: Setups,
}

impl<'a> Tile<'a> {
    /// A tile of at most [`crate::tile_depth::TILE_SIDE`] squared rays, with a buffer for that many.
    pub(crate) fn new(query: FilmQuery<'a>, rect: Rect, depth: &'a mut TileDepth) -> Self {
        let FilmQuery { film, origin, projection, .. } = query;
        let x = Interval { lo: film.x(rect.x0), hi: film.x(rect.x1 - 1) };
        let y = Interval { lo: film.y(rect.y1 - 1), hi: film.y(rect.y0) };
        let [_, right, up] = film.span();
        let span = [film.at(rect.x0, rect.y0), right * film.step(), -up * film.step()];
        let frustum = Frustum::new(projection, x, y, Interval { lo: 0.0, hi: 0.0 });
        Self {
            query,
            rect,
            depth,
            touched: false,
            frustum,
            limits: frustum.limits(reach_of(&query.bounds, projection.base)),
            pixels: Pixels::new(projection, film, rect),
            rays: TileRays { origin, span },
            batch: Batch::EMPTY,
            footprints: Footprints::EMPTY,
            setups: Setups::EMPTY,
        }
    }

    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each.
    pub(crate) fn enter(&mut self, boxes: &Boxes) -> (u64, [f64; LANES]) {
        dispatch!(self.query.level, simd => {
            if self.touched {
                self.depth.refresh(simd);
            }
            self.frustum.enter_lanes(simd, boxes, &self.limits)
        })
    }

    /// Whether what lies no nearer than `t` is hidden from all rays.
    pub(crate) fn hides(&self, t: f64) -> bool {
        self.touched && self.depth.hides(greatest_key(self.query.origin, t))
    }

    /// Tests a run of triangles within a box against all rays.
    pub(crate) fn intersect(&mut self, bounds: &Aabb, ids: impl Iterator<Item = u32>, stats: &mut Stats) {
        if !self.touched {
            self.depth.clear(self.rect.width(), self.rect.height());
            self.touched = true;
        }
        // Two bases at infinity: the film's for columns, the tile's for setup.
        let reaches = [reach_of(bounds, self.query.projection.base), reach_of(bounds, self.rays.base())];
        let triangles = self.query.triangles;
        let mut ids = ids.peekable();
        while ids.peek().is_some() {
            self.batch.clear();
            ids.by_ref().take(LANES).for_each(|id| self.batch.push(id, triangles.corners(TriangleId(id))));
            dispatch!(self.query.level, simd => self.intersect_batch(simd, reaches, stats));
        }
    }

    /// Tests eight triangles.
    #[inline(always)]
    fn intersect_batch<S: Simd>(&mut self, simd: S, reaches: [DVec3; 2], stats: &mut Stats) {
        // 1. Which rays may each of them meet?
        let base = Points::splat(simd, self.query.projection.base);
        let [a, b, c] = self.batch.points(simd);
        let corners = [a.minus(base), b.minus(base), c.minus(base)];
        let around = (self.batch.lanes(), &mut self.footprints);
        let irregular = self.pixels.around(simd, &corners, reaches[0], around);
        let mut lanes = self.footprints.lanes;
        if irregular != 0 {
            lanes &= !(irregular & self.frustum.excluded(simd, &corners, reaches[0]));
        }
        // 2. Which of them are hidden?
        for lane in bits(lanes) {
            let hidden = self.depth.hides_in_rect(self.footprints.rect(lane), self.footprints.greatest[lane]);
            lanes &= !(u64::from(hidden) << lane);
        }
        // 3. The rest.
        if lanes != 0 {
            stats.triangles_set_up += u64::from(lanes.count_ones());
            set_up(simd, &self.rays, &self.batch, lanes, reaches[1], &mut self.setups);
            for lane in bits(self.setups.lanes) {
                self.rasterize(simd, lane, stats);
            }
        }
    }

    /// Writes what the rays have hit.
    pub(crate) fn write(&self, window: &mut Window<'_>) {
        if self.touched {
            dispatch!(self.query.level, simd => self.write_lanes(simd, window));
        } else {
            window.miss();
        }
    }

    #[inline(always)]
    fn write_lanes<S: Simd>(&self, simd: S, window: &mut Window<'_>) {
        let FilmQuery { origin, film, triangles, .. } = self.query;
        for (j, (ids, ts)) in (0..).zip(&mut window.rows) {
            for i in (0..self.rect.width()).step_by(BLOCK_SIDE as usize) {
                let columns = i as usize..(i + BLOCK_SIDE).min(self.rect.width()) as usize;
                let mut row = (&mut ids[columns.clone()], &mut ts[columns]);
                self.depth.write(simd, row_of(i / BLOCK_SIDE, j), &mut row, origin, triangles, |k| {
                    // In range: fewer than eight columns.
                    origin.ray(film.at(self.rect.x0 + i + k as u32, self.rect.y0 + j))
                });
            }
        }
    }
}

/// A bound of |x − base| within a box.
fn reach_of(bounds: &Aabb, base: DVec3) -> DVec3 {
    let (lo, hi) = bounds.corners();
    (lo - base).abs().max((hi - base).abs()) * (1.0 + 4.0 * U)
}

/// The greatest depth key of anything that lies no nearer than `t` ≥ 0 on a pencil's rays.
pub(crate) fn greatest_key(origin: Origin, t: f64) -> f64 {
    match origin {
        Origin::Infinity(_) => -t,
        Origin::Point(_) if t > 0.0 => (1.0 / t) * (1.0 + f64::EPSILON),
        Origin::Point(_) => f64::INFINITY,
    }
}
