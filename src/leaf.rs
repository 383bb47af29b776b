//! The leaf of grid films, "DirectlyIntersect": one triangle against the rays of a tile.
//!
//! Blocks of 8x8 rays are rejected or accepted as a whole where an affine function has one sign on all of the block, and
//! dropped where the triangle lies behind everything the block has hit. What remains is evaluated ray by ray; where the
//! bound of f64 leaves doubt the exact stage decides.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (edge functions); Ned Greene,
//! "Hierarchical Polygon Tiling with Coverage Masks", 1996.

use crate::depth::{Candidate, DepthBuffer};
use crate::frustum::{Frustum, Interval, Projection};
use crate::pencil::Origin;
use crate::predicates::covers;
use crate::ray::Ray;
use crate::setup::{TriangleSetup, set_up};
use crate::triangles::{Triangle, Triangles};
use crate::window::{Rect, Window};
use crate::{Accuracy, GridFilm, Stats};

/// Rays along one side of a block.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Rays along one side of a tile: its depth buffer stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;
/// Blocks along one side of a tile.
const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;

/// Film coordinates are clamped to 2³¹ before they become columns: three roundings of numbers below 2³² err by less than
/// 2⁻¹⁸ columns.
const COLUMN_SLACK: f64 = 1.0 / (1 << 18) as f64;

/// What all tiles of one film share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilmQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) origin: Origin,
    pub(crate) film: &'a GridFilm,
    pub(crate) projection: &'a Projection,
    pub(crate) accuracy: Accuracy,
    /// Whether any hit will do.
    pub(crate) any: bool,
}

/// The rays of a rectangle of a film, with what they have hit so far.
#[derive(Debug)]
pub(crate) struct Tile<'a> {
    query: FilmQuery<'a>,
    rect: Rect,
    pub(crate) frustum: Frustum,
    /// max |X| and max |Y|.
    reach: [f64; 2],
    pub(crate) depth: DepthBuffer,
}

impl<'a> Tile<'a> {
    /// A tile of at most [`TILE_SIDE`] squared rays.
    pub(crate) fn new(query: FilmQuery<'a>, rect: Rect) -> Self {
        let film = query.film;
        let x = Interval {
            lo: film.x(rect.x0),
            hi: film.x(rect.x1 - 1),
        };
        let y = Interval {
            lo: film.y(rect.y1 - 1),
            hi: film.y(rect.y0),
        };
        let frustum = Frustum::new(query.projection, x, y, Interval { lo: 0.0, hi: 0.0 });
        let reach = [x.lo.abs().max(x.hi.abs()), y.lo.abs().max(y.hi.abs())];
        let mut depth = DepthBuffer::new((TILE_SIDE * TILE_SIDE) as usize);
        for y in 0..TILE_SIDE {
            let outside = if y < rect.height() { rect.width() } else { 0 };
            (outside..TILE_SIDE).for_each(|x| depth.exclude(place(x, y)));
        }
        depth.mark_all_stale();
        Self {
            query,
            rect,
            frustum,
            reach,
            depth,
        }
    }

    /// The greatest depth key of anything that lies no nearer than `t`.
    pub(crate) fn greatest_key(&self, t: f64) -> f64 {
        greatest_key(self.query.origin, t)
    }

    /// Tests one triangle against all rays of the tile.
    pub(crate) fn intersect(&mut self, id: u32, stats: &mut Stats) {
        let triangle = self.query.triangles.triangle(id);
        let Some(rect) = self.covered_rect(&triangle) else {
            return;
        };
        stats.triangles_set_up += 1;
        let FilmQuery { origin, film, .. } = self.query;
        let Some(setup) = set_up(origin, film, &triangle, self.reach) else {
            return;
        };
        let (first, last) = (
            (rect.x0 / BLOCK_SIDE, rect.y0 / BLOCK_SIDE),
            (rect.x1 - 1, rect.y1 - 1),
        );
        for by in first.1..=last.1 / BLOCK_SIDE {
            for bx in first.0..=last.0 / BLOCK_SIDE {
                let block = Rect {
                    x0: rect.x0.max(bx * BLOCK_SIDE),
                    y0: rect.y0.max(by * BLOCK_SIDE),
                    x1: rect.x1.min((bx + 1) * BLOCK_SIDE),
                    y1: rect.y1.min((by + 1) * BLOCK_SIDE),
                };
                self.intersect_block(
                    (by * TILE_BLOCKS + bx) as usize,
                    block,
                    id,
                    &triangle,
                    &setup,
                    stats,
                );
            }
        }
    }

    /// The rays of the tile that the triangle's projection can touch, relative to the tile; `None` for none.
    fn covered_rect(&self, triangle: &Triangle) -> Option<Rect> {
        let Triangle { a, b, c } = *triangle;
        let whole = Rect {
            x0: 0,
            y0: 0,
            x1: self.rect.width(),
            y1: self.rect.height(),
        };
        let project = |p| self.query.projection.project(p);
        let (Some(a), Some(b), Some(c)) = (project(a), project(b), project(c)) else {
            // Crosses the plane of the eye: the sides of the frustum may still tell.
            return (!self.frustum.excludes_points([a, b, c])).then_some(whole);
        };
        let least = |k: usize| a[k].lo.min(b[k].lo).min(c[k].lo);
        let greatest = |k: usize| a[k].hi.max(b[k].hi).max(c[k].hi);
        let film = self.query.film;
        let columns = |x: f64| (x.clamp(-LIMIT, LIMIT) - film.x(self.rect.x0)) / film.step();
        let rows = |y: f64| (film.y(self.rect.y0) - y.clamp(-LIMIT, LIMIT)) / film.step();
        let (x0, x1) = whole_between(columns(least(0)), columns(greatest(0)), whole.x1);
        let (y0, y1) = whole_between(rows(greatest(1)), rows(least(1)), whole.y1);
        (x0 < x1 && y0 < y1).then_some(Rect { x0, y0, x1, y1 })
    }

    /// Tests one triangle against the rays of a part of a block.
    fn intersect_block(
        &mut self,
        block: usize,
        rect: Rect,
        id: u32,
        triangle: &Triangle,
        setup: &TriangleSetup,
        stats: &mut Stats,
    ) {
        // Classify the block by the values at its middle and how far they can vary.
        let film = self.query.film;
        let (x0, x1) = (
            film.x(self.rect.x0 + rect.x0),
            film.x(self.rect.x0 + rect.x1 - 1),
        );
        let (y0, y1) = (
            film.y(self.rect.y0 + rect.y0),
            film.y(self.rect.y0 + rect.y1 - 1),
        );
        let (x, y, rx, ry) = (
            (x0 + x1) * 0.5,
            (y0 + y1) * 0.5,
            (x1 - x0) * 0.5,
            (y0 - y1) * 0.5,
        );
        let mut inside = true;
        for edge in &setup.edges {
            let (value, range) = (edge.at(x, y), edge.x.abs() * rx + edge.y.abs() * ry);
            // The range is formed with three roundings; the error holds four of the full size.
            if value + range < -2.0 * edge.error {
                return;
            }
            inside &= value - range > 2.0 * edge.error;
        }
        let key = &setup.key;
        let greatest = key.at(x, y) + key.x.abs() * rx + key.y.abs() * ry + 2.0 * key.error;
        if self.depth.hides_in_block(block, greatest) {
            return;
        }
        for j in rect.y0..rect.y1 {
            for i in rect.x0..rect.x1 {
                self.intersect_ray(i, j, inside, id, triangle, setup, stats);
            }
        }
    }

    /// Tests one triangle against one ray; `inside` where its edges are known to be.
    #[expect(
        clippy::too_many_arguments,
        reason = "the innermost step: everything is in registers"
    )]
    fn intersect_ray(
        &mut self,
        i: u32,
        j: u32,
        inside: bool,
        id: u32,
        triangle: &Triangle,
        setup: &TriangleSetup,
        stats: &mut Stats,
    ) {
        let index = place(i, j);
        let FilmQuery {
            origin,
            film,
            accuracy,
            any,
            triangles,
            ..
        } = self.query;
        let (i, j) = (self.rect.x0 + i, self.rect.y0 + j);
        let (x, y) = (film.x(i), film.y(j));
        stats.samples_tested += 1;

        // Edges: outside for certain, inside for certain, or in doubt.
        let mut certain = true;
        if !inside {
            for (edge, &zero_is_inside) in setup.edges.iter().zip(&setup.zero_is_inside) {
                let value = edge.at(x, y);
                if accuracy == Accuracy::Fast {
                    if !(value > 0.0 || (value == 0.0 && zero_is_inside)) {
                        return;
                    }
                } else if value < -edge.error {
                    return;
                } else {
                    certain &= value > edge.error;
                }
            }
        }

        // Depth: drop what lies behind before any exact work; at infinity a ray starts at its start point.
        let key = setup.key.at(x, y);
        let candidate = Candidate {
            id,
            key,
            error: setup.key.error,
        };
        if self.depth.is_behind(index, &candidate) {
            return;
        }
        if matches!(origin, Origin::Infinity(_)) {
            if key - candidate.error > 0.0 || (accuracy == Accuracy::Fast && key >= 0.0) {
                return;
            }
            certain &= key + candidate.error < 0.0;
        }
        let ray = || -> Ray { origin.ray(film.at(i, j)) };
        if !certain
            && accuracy == Accuracy::Exact
            && !covers(
                &ray(),
                triangle,
                origin.ties(),
                &mut stats.ambiguous_coverage,
            )
        {
            return;
        }
        if any {
            self.depth.settle(index, id);
        } else {
            let exact: Option<&dyn Fn() -> Ray> = if accuracy == Accuracy::Exact {
                Some(&ray)
            } else {
                None
            };
            self.depth.offer(
                index,
                candidate,
                triangles,
                exact,
                &mut stats.ambiguous_order,
            );
        }
    }

    /// Writes what the rays have hit.
    pub(crate) fn write(&self, window: &mut Window<'_>) {
        let FilmQuery {
            origin,
            film,
            triangles,
            ..
        } = self.query;
        for (j, (ids, ts)) in (0..).zip(&mut window.rows) {
            for i in (0..self.rect.width()).step_by(BLOCK_SIDE as usize) {
                let columns = i as usize..(i + BLOCK_SIDE).min(self.rect.width()) as usize;
                let mut row = (&mut ids[columns.clone()], &mut ts[columns]);
                self.depth
                    .write(place(i, j), &mut row, origin, triangles, |k| {
                        // In range: fewer than eight columns.
                        origin.ray(film.at(self.rect.x0 + i + k as u32, self.rect.y0 + j))
                    });
            }
        }
    }
}

/// Columns and rows beyond this are as good as infinity.
const LIMIT: f64 = (1_u64 << 31) as f64;

/// The place of a ray in the depth buffer of a tile: block by block, row by row within a block.
fn place(x: u32, y: u32) -> usize {
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
    (
        if lo.is_nan() { 0 } else { bound(lo) },
        if hi.is_nan() { count } else { bound(hi) },
    )
}
