//! The last step of the leaf: a triangle that was set up against the rays of a tile, block by block (8x8 rays), row by row.
//!
//! Triangles that meet few blocks go straight to the rows. For others a row of eight blocks is looked at together: blocks
//! on which an edge function is negative are dropped, so are those where the triangle lies behind all that they have hit,
//! and where all edge functions are positive they are not evaluated again. Where the bound of f32 leaves doubt about a
//! ray, the exact stage decides: it asks f64 first.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (edge functions); Ned Greene,
//! "Hierarchical Polygon Tiling with Coverage Masks", 1996.

use std::ops::Range;

use fearless_simd::prelude::*;

use crate::lanes::{LANES, Lanes, Narrow, bits};
use crate::leaf::{FilmQuery, Tile};
use crate::pencil::Origin;
use crate::predicates::covers;
use crate::ray::Ray;
use crate::tile_depth::{BLOCK_SIDE, KEY_ERROR, TileCandidate, place, row_of};
use crate::{Accuracy, Stats};

/// Triangles over at most this many columns or rows of blocks go straight to the rows. Not tuned; it changes time only.
const FEW_BLOCKS: u32 = 2;

/// 0 to 7.
const COLUMNS: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
/// The middle columns of the blocks, and half of their width.
const MIDDLES: [f32; LANES] = [3.5, 11.5, 19.5, 27.5, 35.5, 43.5, 51.5, 59.5];
const HALF: f32 = 3.5;

/// Edge functions are certain beyond ±1. Their range over a block adds a few roundings of at most a fifth of that each.
const CERTAIN_ON_BLOCK: f32 = 2.0;

/// c, x and y of an affine function, eight times each.
#[derive(Clone, Copy)]
struct Affine<S: Simd>([Narrow<S>; 3]);

impl<S: Simd> Affine<S> {
    #[inline(always)]
    fn at(self, x: Narrow<S>, y: f32) -> Narrow<S> {
        let [c, along_x, along_y] = self.0;
        (c + along_x * x) + along_y * y
    }

    /// Half of its range on a block.
    #[inline(always)]
    fn half_range(self) -> Narrow<S> {
        (self.0[1].abs() + self.0[2].abs()) * HALF
    }
}

/// A triangle on its way through the blocks of a tile.
#[derive(Clone, Copy)]
struct Primitive<S: Simd> {
    lane: usize,
    edges: [Affine<S>; 3],
    /// The key without its c, and lower and upper c.
    slope: Affine<S>,
    bounds: [Narrow<S>; 2],
    /// An upper bound of its keys.
    greatest: f32,
}

impl Tile<'_> {
    /// Tests one triangle against the rays.
    #[inline(always)]
    pub(crate) fn rasterize<S: Simd>(&mut self, simd: S, lane: usize, stats: &mut Stats) {
        let primitive = self.primitive(simd, lane);
        let rect = self.footprints.rect(lane);
        let (bx, by) = (
            rect.x0 / BLOCK_SIDE..(rect.x1 - 1) / BLOCK_SIDE + 1,
            rect.y0 / BLOCK_SIDE..(rect.y1 - 1) / BLOCK_SIDE + 1,
        );
        let few = bx.end - bx.start <= FEW_BLOCKS && by.end - by.start <= FEW_BLOCKS;
        for by in by {
            let rows = rect.y0.max(by * BLOCK_SIDE)..rect.y1.min((by + 1) * BLOCK_SIDE);
            let mut met = (1_u64 << bx.end) - (1 << bx.start);
            let mut inside = 0;
            if few {
                for bx in bx.clone() {
                    let hidden = self.depth.hides_in_block(bx, by, primitive.greatest);
                    met &= !(u64::from(hidden) << bx);
                }
            } else {
                (met, inside) = self.classify(simd, &primitive, by, met);
            }
            for bx in bits(met) {
                // In range: eight blocks.
                let block = (bx as u32, rows.clone());
                self.intersect_block(simd, &primitive, block, inside >> bx & 1 == 1, stats);
            }
        }
    }

    /// Reads a lane of the setups.
    #[inline(always)]
    fn primitive<S: Simd>(&self, simd: S, lane: usize) -> Primitive<S> {
        let lane = lane % LANES;
        let setups = &self.setups;
        let edge =
            |k: usize| Affine(setups.edges[k].each_ref().map(|part| Narrow::simd_from(simd, part[lane])));
        let [lo, hi, x, y] = setups.bounds.each_ref().map(|part| Narrow::simd_from(simd, part[lane]));
        Primitive {
            lane,
            edges: [edge(0), edge(1), edge(2)],
            slope: Affine([Narrow::simd_from(simd, 0.0), x, y]),
            bounds: [lo, hi],
            greatest: self.footprints.greatest[lane],
        }
    }

    /// Of some blocks of a row of blocks: those that the triangle may meet, and those on which all rays are inside.
    #[inline(always)]
    fn classify<S: Simd>(&self, simd: S, primitive: &Primitive<S>, by: u32, blocks: u64) -> (u64, u64) {
        let x = Narrow::load_array(simd, MIDDLES);
        let y = (by * BLOCK_SIDE) as f32 + HALF;
        let certain = Narrow::simd_from(simd, CERTAIN_ON_BLOCK);
        let (mut met, mut inside) = (blocks, blocks);
        for edge in primitive.edges {
            let (middle, range) = (edge.at(x, y), edge.half_range());
            met &= !(middle + range).simd_lt(-certain).to_bitmask();
            inside &= (middle - range).simd_gt(certain).to_bitmask();
        }
        let slope = primitive.slope;
        let greatest = slope.at(x, y) + slope.half_range() + primitive.bounds[1];
        let greatest = greatest.min(Narrow::simd_from(simd, primitive.greatest));
        met &= !greatest.simd_lt(self.depth.far(simd, by)).to_bitmask();
        (met, inside & met)
    }

    /// Tests one triangle against some rows of rays of a block.
    #[inline(always)]
    fn intersect_block<S: Simd>(
        &mut self,
        simd: S,
        primitive: &Primitive<S>,
        (bx, rows): (u32, Range<u32>),
        inside: bool,
        stats: &mut Stats,
    ) {
        let FilmQuery { origin, accuracy, any, .. } = self.query;
        let zero = Narrow::simd_from(simd, 0.0);
        let doubt = zero + if accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        let x = Narrow::load_array(simd, COLUMNS) + (bx * BLOCK_SIDE) as f32;
        stats.samples_tested += u64::from(rows.end - rows.start) * LANES as u64;
        for j in rows {
            let (y, row) = (j as f32, row_of(bx, j));
            // Depth: not behind what the ray has hit, and certainly before it.
            let slope = primitive.slope.at(x, y);
            let [lo, hi] = [slope + primitive.bounds[0], slope + primitive.bounds[1]];
            let mut kept = hi.simd_ge(self.depth.lo(simd, row));
            let mut sure = lo.simd_gt(self.depth.hi(simd, row));
            if matches!(origin, Origin::Infinity(_)) {
                // Rays start at their start points.
                (kept, sure) = (kept & lo.simd_le(zero), sure & hi.simd_lt(zero));
            }
            // Edges: not outside for certain, and inside for certain.
            if !inside {
                let [one, two, three] = primitive.edges;
                let least = one.at(x, y).min(two.at(x, y)).min(three.at(x, y));
                (kept, sure) = (kept & least.simd_ge(-doubt), sure & least.simd_gt(doubt));
            }
            let kept = kept.to_bitmask();
            if kept == 0 {
                continue;
            }
            // What is certain is kept as it is; the rest goes to the exact stage.
            let certain = sure.to_bitmask();
            if certain != 0 {
                let bounds = if any { [zero + f32::INFINITY; 2] } else { [lo, hi] };
                let keys = self.keys(simd, primitive.lane, bx, y);
                self.depth.keep(simd, row, sure, bounds, self.batch.ids[primitive.lane], keys);
            }
            if kept != certain {
                let keys = self.keys(simd, primitive.lane, bx, y).to_array();
                let (lo, hi) = (lo.to_array(), hi.to_array());
                for lane in bits(kept & !certain) {
                    let id = self.batch.ids[primitive.lane];
                    let candidate = TileCandidate { id, lo: lo[lane], hi: hi[lane], key: keys[lane] };
                    // In range: fewer than eight columns.
                    self.decide(candidate, (bx * BLOCK_SIDE + lane as u32, j), stats);
                }
            }
        }
    }

    /// The keys of a row in f64; NaN where they err too much.
    #[inline(always)]
    fn keys<S: Simd>(&self, simd: S, lane: usize, bx: u32, y: f32) -> Lanes<S> {
        let [c, along_x, along_y, error] = self.setups.key.each_ref().map(|part| part[lane]);
        let x = Lanes::load_array(simd, COLUMNS.map(f64::from)) + f64::from(bx * BLOCK_SIDE);
        let keys = (x * along_x + c) + along_y * f64::from(y);
        let precise = (keys.abs() * KEY_ERROR).simd_ge(Lanes::simd_from(simd, error));
        precise.select(keys, Lanes::simd_from(simd, f64::NAN))
    }

    /// Decides one ray exactly: coverage, then the order.
    #[inline(never)]
    fn decide(&mut self, candidate: TileCandidate, (i, j): (u32, u32), stats: &mut Stats) {
        let FilmQuery { origin, film, accuracy, any, triangles, .. } = self.query;
        if i >= self.rect.width() || j >= self.rect.height() {
            return;
        }
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
