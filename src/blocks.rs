//! The last step of the leaf: triangles that were set up against the rays of a tile, block by block (8x8 rays), row by row.
//!
//! A large part of a block is rejected or accepted as a whole where an edge function has one sign on all of it; a block is
//! dropped where the triangle lies behind all that it has hit. Small parts go straight to the rows. Where the bound of f64
//! leaves doubt about a ray, the exact stage decides.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (edge functions); Ned Greene,
//! "Hierarchical Polygon Tiling with Coverage Masks", 1996.

use fearless_simd::prelude::*;

use crate::depth::Candidate;
use crate::lanes::{LANES, LaneMask, Lanes, bits};
use crate::leaf::{BLOCK_SIDE, FilmQuery, TILE_BLOCKS, Tile, place};
use crate::pencil::Origin;
use crate::predicates::covers;
use crate::ray::Ray;
use crate::setup::{Affine, TriangleSetup, set_up};
use crate::window::Rect;
use crate::{Accuracy, Stats};

/// Parts of blocks with at most this many rows go straight to the rows. Not tuned; it changes time only.
const FEW_ROWS: u32 = 4;

/// 0 to 7.
const COLUMNS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// A triangle on its way through the blocks of a tile.
#[derive(Clone, Copy)]
struct Primitive<'a> {
    id: u32,
    setup: &'a TriangleSetup,
    /// An upper bound of its keys.
    greatest: f64,
}

/// Eight columns of a block: xX of the edges and of the key, and what is shared by all rows.
struct Columns<S: Simd> {
    edges: [Lanes<S>; 3],
    key: Lanes<S>,
    /// The columns that are meant, as bits.
    meant: u64,
    /// Whether all rays are known to be inside.
    inside: bool,
}

impl Tile<'_> {
    /// Sets up the triangles that wait and tests them against the rays.
    #[inline(always)]
    pub(crate) fn rasterize<S: Simd>(&mut self, simd: S, stats: &mut Stats) {
        let FilmQuery { origin, film, .. } = self.query;
        stats.triangles_set_up += self.seen.len as u64;
        set_up(simd, origin, film, &self.seen, self.reach, &mut self.setups);
        for lane in bits(self.setups.lanes) {
            let setup = self.setups.lane(lane);
            let rect = self.rects[lane];
            let greatest = self.bounds_of(&setup.key, rect)[1] + 2.0 * setup.key.error;
            let primitive = Primitive { id: self.seen.ids[lane], setup: &setup, greatest };
            for by in rect.y0 / BLOCK_SIDE..=(rect.y1 - 1) / BLOCK_SIDE {
                for bx in rect.x0 / BLOCK_SIDE..=(rect.x1 - 1) / BLOCK_SIDE {
                    let block = (by * TILE_BLOCKS + bx) as usize;
                    if self.depth.hides_in_block(block, greatest) {
                        continue;
                    }
                    let part = Rect {
                        x0: rect.x0.max(bx * BLOCK_SIDE),
                        y0: rect.y0.max(by * BLOCK_SIDE),
                        x1: rect.x1.min((bx + 1) * BLOCK_SIDE),
                        y1: rect.y1.min((by + 1) * BLOCK_SIDE),
                    };
                    self.intersect_block(simd, block, part, primitive, stats);
                }
            }
        }
        self.seen.clear();
    }

    /// The least and the greatest value of an affine function on the rays of a rectangle, within twice its error.
    #[inline(always)]
    fn bounds_of(&self, v: &Affine, rect: Rect) -> [f64; 2] {
        let film = self.query.film;
        let (x0, x1) = (film.x(self.rect.x0 + rect.x0), film.x(self.rect.x0 + rect.x1 - 1));
        let (y0, y1) = (film.y(self.rect.y0 + rect.y0), film.y(self.rect.y0 + rect.y1 - 1));
        // The range is formed with three roundings; the error holds six of the full size.
        let middle = v.at((x0 + x1) * 0.5, (y0 + y1) * 0.5);
        let range = v.x.abs() * ((x1 - x0) * 0.5) + v.y.abs() * ((y0 - y1) * 0.5);
        [middle - range, middle + range]
    }

    /// Tests one triangle against the rays of a part of a block.
    #[inline(always)]
    fn intersect_block<S: Simd>(
        &mut self,
        simd: S,
        block: usize,
        part: Rect,
        primitive: Primitive<'_>,
        stats: &mut Stats,
    ) {
        let setup = primitive.setup;
        let mut inside = false;
        if part.height() > FEW_ROWS {
            inside = true;
            for edge in &setup.edges {
                let [least, greatest] = self.bounds_of(edge, part);
                if greatest < -2.0 * edge.error {
                    return;
                }
                inside &= least > 2.0 * edge.error;
            }
            let greatest = self.bounds_of(&setup.key, part)[1] + 2.0 * setup.key.error;
            if self.depth.hides_in_block(block, greatest.min(primitive.greatest)) {
                return;
            }
        }
        let film = self.query.film;
        let first = part.x0 / BLOCK_SIDE * BLOCK_SIDE;
        let x = Lanes::load_array(simd, COLUMNS) * film.step() + film.x(self.rect.x0 + first);
        let columns = Columns {
            edges: [x * setup.edges[0].x, x * setup.edges[1].x, x * setup.edges[2].x],
            key: x * setup.key.x,
            meant: (1_u64 << (part.x1 - first)) - (1 << (part.x0 - first)),
            inside,
        };
        stats.samples_tested += u64::from(part.width() * part.height());
        let mut changed = false;
        for row in part.y0..part.y1 {
            changed |= self.intersect_row(simd, (first, row), &columns, primitive, stats);
        }
        if changed {
            self.depth.mark_stale(block);
        }
    }

    /// Tests one triangle against eight rays of a row, and tells whether any of them hit it for certain.
    #[inline(always)]
    fn intersect_row<S: Simd>(
        &mut self,
        simd: S,
        (first, row): (u32, u32),
        columns: &Columns<S>,
        Primitive { id, setup, .. }: Primitive<'_>,
        stats: &mut Stats,
    ) -> bool {
        let FilmQuery { origin, film, accuracy, any, .. } = self.query;
        let zero = Lanes::simd_from(simd, 0.0);
        let y = film.y(self.rect.y0 + row);

        // Depth: not behind what the ray has hit, and certainly before it.
        let key = columns.key + (setup.key.c + setup.key.y * y);
        let (lo, hi) = (key - setup.key.error, key + setup.key.error);
        let base = place(first, row);
        let [near_lo, near_hi] = self.depth.keys(simd, base);
        let (mut kept, mut sure) = (hi.simd_ge(near_lo), lo.simd_gt(near_hi));
        if matches!(origin, Origin::Infinity(_)) {
            // Rays start at their start points.
            let ahead = if accuracy == Accuracy::Exact { lo.simd_le(zero) } else { key.simd_lt(zero) };
            (kept, sure) = (kept & ahead, sure & hi.simd_lt(zero));
        }

        // Edges: not outside for certain, and inside for certain.
        if !columns.inside {
            for k in 0..3 {
                let edge = &setup.edges[k];
                let value = columns.edges[k] + (edge.c + edge.y * y);
                if accuracy == Accuracy::Exact {
                    kept &= value.simd_ge(zero - edge.error);
                    sure &= value.simd_gt(zero + edge.error);
                } else if setup.zero_is_inside[k] {
                    kept &= value.simd_ge(zero);
                } else {
                    kept &= value.simd_gt(zero);
                }
            }
        }

        // What is certain is kept as it is; the rest goes to the exact stage.
        let kept = kept.to_bitmask() & columns.meant;
        if kept == 0 {
            return false;
        }
        let sure = sure.to_bitmask() & kept;
        if sure != 0 {
            let mask = LaneMask::from_bitmask(simd, sure);
            let (lo, hi) = if any { (zero + f64::INFINITY, zero + f64::INFINITY) } else { (lo, hi) };
            self.depth.keep(base, [mask.select(lo, near_lo), mask.select(hi, near_hi)], sure, id);
        }
        if kept != sure {
            let (lo, hi) = (lo.to_array(), hi.to_array());
            for lane in bits(kept & !sure) {
                let candidate = Candidate { id, lo: lo[lane], hi: hi[lane] };
                // In range: fewer than eight columns.
                self.decide(candidate, (first + lane as u32, row), stats);
            }
        }
        sure != 0
    }

    /// Decides one ray exactly: coverage, then the order.
    #[inline(never)]
    fn decide(&mut self, candidate: Candidate, (i, j): (u32, u32), stats: &mut Stats) {
        let FilmQuery { origin, film, accuracy, any, triangles, .. } = self.query;
        let ray = || -> Ray { origin.ray(film.at(self.rect.x0 + i, self.rect.y0 + j)) };
        let exact: Option<&dyn Fn() -> Ray> = if accuracy == Accuracy::Exact { Some(&ray) } else { None };
        if exact.is_some() {
            let triangle = triangles.triangle(candidate.id);
            if !covers(&ray(), &triangle, origin.ties(), &mut stats.ambiguous_coverage) {
                return;
            }
        }
        if any {
            self.depth.settle(place(i, j), candidate.id);
        } else {
            self.depth.offer(place(i, j), candidate, triangles, exact, &mut stats.ambiguous_order);
        }
    }
}
