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

use crate::depth::precedes;
use crate::lanes::{LANES, Narrow, bits};
use crate::leaf::{FilmQuery, Tile};
use crate::pencil::Origin;
use crate::predicates::covers;
use crate::ray::Ray;
use crate::tile_depth::{BLOCK_SIDE, Candidate, Record, place, row_of};
use crate::window::Rect;
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
    /// The function on eight columns.
    #[inline(always)]
    fn column(self, x: Narrow<S>) -> Column<S> {
        let [c, along_x, along_y] = self.0;
        Column { start: c + along_x * x, along_y }
    }

    /// Half of its range on a block.
    #[inline(always)]
    fn half_range(self) -> Narrow<S> {
        (self.0[1].abs() + self.0[2].abs()) * HALF
    }
}

/// An affine function on eight columns: at row 0, and its step from row to row.
#[derive(Clone, Copy)]
struct Column<S: Simd> {
    start: Narrow<S>,
    along_y: Narrow<S>,
}

impl<S: Simd> Column<S> {
    #[inline(always)]
    fn at(self, y: f32) -> Narrow<S> {
        self.start + self.along_y * y
    }
}

/// A triangle on its way through the blocks of a tile.
#[derive(Clone, Copy)]
struct Primitive<S: Simd> {
    id: u32,
    /// Its lane in the setups.
    lane: usize,
    /// The record that its hits refer to.
    record: u32,
    edges: [Affine<S>; 3],
    /// The key without its c, and lower and upper c.
    slope: Affine<S>,
    bounds: [Narrow<S>; 2],
    /// An upper bound of its keys.
    greatest: f32,
}

impl Tile<'_> {
    /// Tests one triangle, set up in a lane, against a rectangle of rays.
    #[inline(always)]
    pub(crate) fn rasterize<S: Simd>(
        &mut self,
        simd: S,
        (id, lane): (u32, usize),
        rect: Rect,
        greatest: f32,
        stats: &mut Stats,
    ) {
        let primitive = self.primitive(simd, (id, lane), greatest);
        let (bx0, bx1) = (rect.x0 / BLOCK_SIDE, (rect.x1 - 1) / BLOCK_SIDE);
        let (by0, by1) = (rect.y0 / BLOCK_SIDE, (rect.y1 - 1) / BLOCK_SIDE);
        let few = bx1 - bx0 < FEW_BLOCKS && by1 - by0 < FEW_BLOCKS;
        let mut hit = false;
        for by in by0..=by1 {
            let rows = rect.y0.max(by * BLOCK_SIDE)..rect.y1.min((by + 1) * BLOCK_SIDE);
            let (mut met, mut inside) = ((2_u64 << bx1) - (1 << bx0), 0);
            if few {
                for bx in bx0..=bx1 {
                    let hidden = self.work.depth.hides_in_block(bx, by, primitive.greatest);
                    met &= !(u64::from(hidden) << bx);
                }
            } else {
                (met, inside) = self.classify(simd, &primitive, by, met);
            }
            for bx in bits(met) {
                // In range: eight blocks.
                let block = (bx as u32, rows.clone());
                hit |= self.intersect_block(simd, &primitive, block, inside >> bx & 1 == 1, stats);
            }
        }
        if hit {
            let [c, x, y, error] = self.work.setups.key.each_ref().map(|part| part[lane % LANES]);
            // Rounded up.
            let error = (error * (1.0 + f64::from(f32::EPSILON))) as f32;
            self.work.depth.record(Record { key: [c, x, y], error, id });
        }
    }

    /// Reads a lane of the setups.
    #[inline(always)]
    fn primitive<S: Simd>(&mut self, simd: S, (id, lane): (u32, usize), greatest: f32) -> Primitive<S> {
        let lane = lane % LANES;
        let record = self.work.depth.next_record();
        let setups = &self.work.setups;
        let edge =
            |k: usize| Affine(setups.edges[k].each_ref().map(|part| Narrow::simd_from(simd, part[lane])));
        let [lo, hi, x, y] = setups.bounds.each_ref().map(|part| Narrow::simd_from(simd, part[lane]));
        let slope = Affine([Narrow::simd_from(simd, 0.0), x, y]);
        Primitive { id, lane, record, edges: [edge(0), edge(1), edge(2)], slope, bounds: [lo, hi], greatest }
    }

    /// Of some blocks of a row of blocks: those that the triangle may meet, and those on which all rays are inside.
    #[inline(always)]
    fn classify<S: Simd>(&self, simd: S, primitive: &Primitive<S>, by: u32, blocks: u64) -> (u64, u64) {
        let x = Narrow::load_array(simd, MIDDLES);
        let y = (by * BLOCK_SIDE) as f32 + HALF;
        let certain = Narrow::simd_from(simd, CERTAIN_ON_BLOCK);
        let (mut met, mut inside) = (blocks, blocks);
        for edge in primitive.edges {
            let (middle, range) = (edge.column(x).at(y), edge.half_range());
            met &= !(middle + range).simd_lt(-certain).to_bitmask();
            inside &= (middle - range).simd_gt(certain).to_bitmask();
        }
        let slope = primitive.slope;
        let greatest = slope.column(x).at(y) + slope.half_range() + primitive.bounds[1];
        let greatest = greatest.min(Narrow::simd_from(simd, primitive.greatest));
        met &= !greatest.simd_lt(self.work.depth.far(simd, by)).to_bitmask();
        (met, inside & met)
    }

    /// Tests one triangle against some rows of rays of a block; tells whether any of them hit it.
    #[inline(always)]
    fn intersect_block<S: Simd>(
        &mut self,
        simd: S,
        primitive: &Primitive<S>,
        (bx, rows): (u32, Range<u32>),
        inside: bool,
        stats: &mut Stats,
    ) -> bool {
        let FilmQuery { origin, accuracy, any, .. } = self.query;
        let zero = Narrow::simd_from(simd, 0.0);
        let doubt = zero + if accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        let x = Narrow::load_array(simd, COLUMNS) + (bx * BLOCK_SIDE) as f32;
        let [one, two, three] = primitive.edges;
        let [one, two, three, slope] =
            [one.column(x), two.column(x), three.column(x), primitive.slope.column(x)];
        stats.samples_tested += u64::from(rows.end - rows.start) * LANES as u64;
        let block = row_of(bx, rows.start) / LANES;
        let (mut hit, mut decided) = (0, false);
        for j in rows {
            let (y, row) = (j as f32, row_of(bx, j));
            // Depth: not behind what the ray has hit, and certainly before it.
            let key = slope.at(y);
            let [lo, hi] = [key + primitive.bounds[0], key + primitive.bounds[1]];
            let mut kept = hi.simd_ge(self.work.depth.lo(simd, row));
            let mut sure = lo.simd_gt(self.work.depth.hi(simd, row));
            if matches!(origin, Origin::Infinity(_)) {
                // Rays start at their start points.
                (kept, sure) = (kept & lo.simd_le(zero), sure & hi.simd_lt(zero));
            }
            // Edges: not outside for certain, and inside for certain.
            if !inside {
                let least = one.at(y).min(two.at(y)).min(three.at(y));
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
                self.work.depth.keep(simd, row, sure, bounds, primitive.record);
                hit |= certain << (j % BLOCK_SIDE * BLOCK_SIDE);
            }
            if kept != certain {
                let (lo, hi) = (lo.to_array(), hi.to_array());
                for lane in bits(kept & !certain) {
                    let candidate = Candidate { lo: lo[lane], hi: hi[lane], record: primitive.record };
                    // In range: fewer than eight columns.
                    let ray = (bx * BLOCK_SIDE + lane as u32, j);
                    decided |= self.decide((primitive.id, primitive.lane), candidate, ray, stats);
                }
            }
        }
        self.work.depth.cover(block, hit);
        hit != 0 || decided
    }

    /// Decides one ray exactly: coverage, then the order. Tells whether it hit the triangle.
    #[inline(never)]
    fn decide(
        &mut self,
        (id, lane): (u32, usize),
        candidate: Candidate,
        (i, j): (u32, u32),
        stats: &mut Stats,
    ) -> bool {
        let FilmQuery { origin, film, accuracy, any, triangles, .. } = self.query;
        if i >= self.rect.width() || j >= self.rect.height() {
            return false;
        }
        let ray = || -> Ray { origin.ray(film.at(self.rect.x0 + i, self.rect.y0 + j)) };
        let exact = accuracy == Accuracy::Exact;
        if exact {
            let triangle = triangles.triangle(id);
            if !covers(&ray(), &triangle, origin.ties(), &mut stats.ambiguous_coverage) {
                return false;
            }
        }
        let place = place(i, j);
        if any {
            let settled = Candidate { lo: f32::INFINITY, hi: f32::INFINITY, ..candidate };
            self.work.depth.put(place, settled);
            return true;
        }
        let nearer = match self.work.depth.nearest(place) {
            None => true,
            Some((nearest, _)) if candidate.lo > nearest.hi => true,
            Some((nearest, _)) if candidate.hi < nearest.lo => false,
            Some((_, other)) if exact => precedes(&ray(), id, other, triangles, &mut stats.ambiguous_order),
            Some((nearest, other)) => {
                let [c, x, y, _] = self.work.setups.key.each_ref().map(|part| part[lane]);
                let key = c + x * f64::from(i) + y * f64::from(j);
                let nearest = self.work.depth.key(nearest.record, i, j);
                key > nearest || (key == nearest && id < other)
            }
        };
        if nearer {
            self.work.depth.put(place, candidate);
        }
        nearer
    }
}
