//! The leaf of receivers: a triangle that was set up against the points of a tile, which may lie anywhere on it.
//!
//! The points are sorted by blocks, and within a block by cells of 2x2 columns and rows, row by row. So the points of a block
//! follow each other, and those in any part of a row of its cells; a triangle is tested with eight of them at a time,
//! through the same edge functions as pixels, at their own columns and rows. Rounding those to f32 adds to the bounds, see [`crate::setup`]. A triangle blocks a point
//! where it covers it and lies nearer to the light: its depth key is greater than the point's. Where f32 leaves doubt, the
//! exact stage decides at once: that happens at edges, and wherever a surface is as far as the point.
//!
//! A point that is in shadow is done: its key becomes +∞. So what lies behind all points of a block that are left is hidden
//! from them.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005.

use std::ops::Range;

use fearless_simd::{prelude::*, u32x8};

use crate::hierarchical_z::{BLOCK_SIDE, HierarchicalZ, TILE_BLOCKS, TILE_SIDE};
use crate::lanes::{LANES, Lanes, Narrow, bits, narrow};
use crate::leaf::{LeafDepth, Tile};
use crate::setup::Setups;
use crate::shadow::{Receiver, blocks};
use crate::sightings::Sightings;
use crate::window::Rect;
use crate::{Accuracy, Stats};

/// The most points of a tile.
pub(crate) const CLUSTER: usize = 4096;
/// Columns and rows of a cell.
const CELL_SIDE: u32 = 2;
/// Cells along one side of a tile, and of a block.
const CELLS: usize = (TILE_SIDE / CELL_SIDE) as usize;
const BLOCK_CELLS: usize = (BLOCK_SIDE / CELL_SIDE) as usize;
/// Where cells begin, and where the last one ends.
const FIRSTS: usize = CELLS * CELLS + 1;

/// In a rectangle of more cells, bounds of cells tell hardly more than those of blocks.
const FEW_CELLS: usize = 9;

/// Bounds of blocks are brought up to date once this part of the points has been found in shadow since.
const REFRESH: usize = 8;

/// Rounding a key to f32, with its own error of a few roundings of f64.
const KEY_SLACK: f32 = 1.0 / (1 << 22) as f32;
/// Keys beyond this are as good as infinite.
const KEY_LIMIT: f64 = 1e37;

/// What makes columns, rows and keys of places and depths: (x − offset)·factor for each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ToTile {
    pub(crate) at: [[f64; 2]; 2],
    pub(crate) depth: [f64; 2],
}

/// The receivers of a tile.
#[derive(Debug)]
pub(crate) struct Cells<'a> {
    receivers: &'a [Receiver],
    /// Columns and rows.
    at: [[f32; CLUSTER]; 2],
    /// Bounds of the keys: +∞ for points in shadow, and where there is no point.
    lo: [f32; CLUSTER],
    hi: [f32; CLUSTER],
    /// The receiver of each point, and the triangle that it lies on.
    ids: [u32; CLUSTER],
    owners: [u32; CLUSTER],
    count: usize,
    /// Where each cell begins; one more ends the last.
    first: [u16; FIRSTS],
    blocks: HierarchicalZ,
    /// Per cell, a lower bound of its points' keys.
    far: [f32; CELLS * CELLS],
    /// Points that were found in shadow since the blocks were brought up to date.
    settled: usize,
}

impl<'a> Cells<'a> {
    /// No receivers.
    pub(crate) fn new() -> Self {
        Self {
            receivers: &[],
            at: [[0.0; CLUSTER]; 2],
            lo: [f32::INFINITY; CLUSTER],
            hi: [f32::INFINITY; CLUSTER],
            ids: [0; CLUSTER],
            owners: [0; CLUSTER],
            count: 0,
            first: [0; FIRSTS],
            blocks: HierarchicalZ::new(),
            far: [f32::NEG_INFINITY; CELLS * CELLS],
            settled: 0,
        }
    }

    /// Takes receivers as a light sees them, in place of those before. A counting sort.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        simd: S,
        (receivers, ids): (&'a [Receiver], &[u32]),
        seen: &Sightings,
        to_tile: &ToTile,
    ) {
        (self.receivers, self.count) = (receivers, seen.count);
        self.first.fill(0);
        let mut cells = [0_u32; CLUSTER];
        for first in (0..seen.count).step_by(LANES) {
            let eight = cells_of(simd, seen, first, to_tile);
            eight.store_slice(&mut cells[first..first + LANES]);
            for &cell in &cells[first..seen.count.min(first + LANES)] {
                self.first[cell as usize % (CELLS * CELLS) + 1] += 1;
            }
        }
        let mut sum = 0;
        for first in &mut self.first {
            sum += *first;
            *first = sum;
        }
        let mut next = self.first;
        for first in (0..seen.count).step_by(LANES) {
            let [x, y] = places_of(simd, seen, first, to_tile);
            let (lo, hi) = keys_of(simd, seen, first, to_tile);
            let (x, y, lo, hi) = (x.to_array(), y.to_array(), lo.to_array(), hi.to_array());
            for lane in 0..LANES.min(seen.count - first) {
                let next = &mut next[cells[first + lane] as usize % (CELLS * CELLS)];
                let index = usize::from(*next) % CLUSTER;
                *next += 1;
                (self.at[0][index], self.at[1][index]) = (x[lane], y[lane]);
                (self.lo[index], self.hi[index]) = (lo[lane], hi[lane]);
                let id = ids[usize::from(seen.places[first + lane])];
                (self.ids[index], self.owners[index]) = (id, receivers[id as usize].triangle.0);
            }
        }
        let end = self.count.next_multiple_of(LANES).min(CLUSTER);
        self.lo[self.count..end].fill(f32::INFINITY);
        self.hi[self.count..end].fill(f32::INFINITY);
        // The bounds of blocks are yet to be found.
        (self.blocks, self.settled) = (HierarchicalZ::new(), self.count);
        self.far.fill(f32::NEG_INFINITY);
    }

    /// The receivers in shadow.
    pub(crate) fn shadowed(&self) -> impl Iterator<Item = u32> {
        let settled = self.lo[..self.count].iter().zip(&self.ids).filter(|(lo, _)| **lo == f32::INFINITY);
        settled.map(|(_, &id)| id)
    }

    /// Where the points of some cells of a row of cells of a block lie.
    #[inline(always)]
    fn range(&self, block: usize, row: usize, columns: &Range<usize>) -> Range<usize> {
        let first = block * BLOCK_CELLS * BLOCK_CELLS + row * BLOCK_CELLS;
        let [start, end] = [columns.start, columns.end].map(|column| self.first[(first + column) % FIRSTS]);
        usize::from(start)..usize::from(end)
    }

    /// Where the points of a block lie.
    #[inline(always)]
    fn block(&self, block: usize) -> Range<usize> {
        let first = block * BLOCK_CELLS * BLOCK_CELLS;
        let [start, end] = [first, first + BLOCK_CELLS * BLOCK_CELLS].map(|cell| self.first[cell % FIRSTS]);
        usize::from(start)..usize::from(end)
    }

    /// Tests eight points from one on with a triangle, and settles what it blocks for certain; tells which are in doubt.
    #[inline(always)]
    fn test_eight<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        (id, function): (u32, &Functions<S>),
        doubt: f32,
    ) -> u64 {
        let eight = first..first + LANES;
        let [x, y] = [0, 1].map(|k| Narrow::from_slice(simd, &self.at[k][eight.clone()]));
        let least = function.least_edge(x, y);
        let (lowest, highest) = function.keys(x, y);
        let near_lo = Narrow::from_slice(simd, &self.lo[eight.clone()]);
        let kept = (least.simd_ge(-doubt) & highest.simd_ge(near_lo)).to_bitmask();
        if kept == 0 {
            return 0;
        }
        let others = !u32x8::from_slice(simd, &self.owners[eight.clone()]).simd_eq(id);
        let near_hi = Narrow::from_slice(simd, &self.hi[eight.clone()]);
        let certain = least.simd_gt(doubt) & lowest.simd_gt(near_hi) & others;
        let infinite = Narrow::simd_from(simd, f32::INFINITY);
        certain.select(infinite, near_lo).store_slice(&mut self.lo[eight.clone()]);
        certain.select(infinite, near_hi).store_slice(&mut self.hi[eight]);
        let certain = certain.to_bitmask();
        self.settled += certain.count_ones() as usize;
        kept & !certain & others.to_bitmask()
    }
}

/// The functions of a triangle, in all lanes: c, x and y of its edges and its key, and the bounds of the key's c.
struct Functions<S: Simd> {
    edges: [[Narrow<S>; 3]; 3],
    slope: [Narrow<S>; 2],
    bounds: [Narrow<S>; 2],
}

impl<S: Simd> Functions<S> {
    #[inline(always)]
    fn new(simd: S, setups: &Setups, lane: usize) -> Self {
        let zero = Narrow::simd_from(simd, 0.0);
        let mut functions = Self { edges: [[zero; 3]; 3], slope: [zero; 2], bounds: [zero; 2] };
        // No closures over vectors: they would lose the instruction set.
        for (edge, parts) in functions.edges.iter_mut().zip(&setups.edges) {
            for (value, part) in edge.iter_mut().zip(parts) {
                *value = Narrow::simd_from(simd, part[lane % LANES]);
            }
        }
        for k in 0..2 {
            functions.slope[k] = Narrow::simd_from(simd, setups.slope[k + 1][lane % LANES]);
            functions.bounds[k] = Narrow::simd_from(simd, setups.bounds[k][lane % LANES]);
        }
        functions
    }

    /// The least edge function.
    #[inline(always)]
    fn least_edge(&self, x: Narrow<S>, y: Narrow<S>) -> Narrow<S> {
        let [one, two, three] = self.edges;
        let one = (one[0] + x * one[1]) + one[2] * y;
        let two = (two[0] + x * two[1]) + two[2] * y;
        let three = (three[0] + x * three[1]) + three[2] * y;
        one.min(two).min(three)
    }

    /// Bounds of the key.
    #[inline(always)]
    fn keys(&self, x: Narrow<S>, y: Narrow<S>) -> (Narrow<S>, Narrow<S>) {
        let key = x * self.slope[0] + self.slope[1] * y;
        (key + self.bounds[0], key + self.bounds[1])
    }
}

/// The number of the cell in a column and a row of cells: by blocks, see [`cells_of`].
#[inline(always)]
fn cell_at(column: usize, row: usize) -> usize {
    let within = BLOCK_CELLS - 1;
    ((row >> 2) << 7 | (column >> 2) << 4 | (row & within) << 2 | (column & within)) % (CELLS * CELLS)
}

/// Columns and rows of eight receivers.
#[inline(always)]
fn places_of<S: Simd>(simd: S, seen: &Sightings, first: usize, to_tile: &ToTile) -> [Narrow<S>; 2] {
    let mut places = [Narrow::simd_from(simd, 0.0); 2];
    for (axis, place) in places.iter_mut().enumerate() {
        let at = Lanes::from_slice(simd, &seen.at[axis][first..first + LANES]);
        let [offset, factor] = to_tile.at[axis];
        *place = narrow((at - offset) * factor);
    }
    places
}

/// The cells of eight receivers.
#[inline(always)]
fn cells_of<S: Simd>(simd: S, seen: &Sightings, first: usize, to_tile: &ToTile) -> u32x8<S> {
    let [x, y] = places_of(simd, seen, first, to_tile);
    let per_cell = 1.0 / CELL_SIDE as f32;
    let last = Narrow::simd_from(simd, (CELLS - 1) as f32);
    // In range: columns and rows lie in [0, 63].
    let x = u32x8::truncate_from((x * per_cell).max(0.0).min(last));
    let y = u32x8::truncate_from((y * per_cell).max(0.0).min(last));
    // Row and column of the block, then those of the cell in it: three bits and two.
    let within = BLOCK_CELLS as u32 - 1;
    (y >> 2) << 7 | (x >> 2) << 4 | (y & within) << 2 | (x & within)
}

/// Bounds of the keys of eight receivers in f32. The lower ones are finite or −∞: +∞ marks what is settled.
#[inline(always)]
fn keys_of<S: Simd>(simd: S, seen: &Sightings, first: usize, to_tile: &ToTile) -> (Narrow<S>, Narrow<S>) {
    let depth = Lanes::from_slice(simd, &seen.depth[first..first + LANES]);
    let [offset, factor] = to_tile.depth;
    let key = (depth - offset) * factor;
    let limit = Lanes::simd_from(simd, KEY_LIMIT);
    let infinite = Narrow::simd_from(simd, f32::INFINITY);
    let rounded = narrow(key.min(limit).max(-limit));
    let slack = rounded.abs() * KEY_SLACK + f32::MIN_POSITIVE;
    let is_less = rounded.simd_lt(KEY_LIMIT as f32);
    let is_more = rounded.simd_gt(-KEY_LIMIT as f32);
    (is_more.select(rounded - slack, -infinite), is_less.select(rounded + slack, infinite))
}

impl LeafDepth for Cells<'_> {
    #[inline(always)]
    fn blocks(&self) -> &HierarchicalZ {
        &self.blocks
    }

    #[inline(always)]
    fn hides_closely(&self, rect: Rect, key: f32) -> bool {
        let [columns, rows] = [rect.x0..rect.x1, rect.y0..rect.y1].map(|places| {
            // In range: a tile has 32 cells along each side.
            (places.start / CELL_SIDE) as usize..((places.end - 1) / CELL_SIDE) as usize + 1
        });
        if columns.len() * rows.len() > FEW_CELLS {
            return false;
        }
        for row in rows {
            for column in columns.clone() {
                if key >= self.far[cell_at(column, row)] {
                    return false;
                }
            }
        }
        true
    }

    #[inline(always)]
    fn refresh<S: Simd>(&mut self, simd: S) {
        if self.settled * REFRESH < self.count || self.count == 0 {
            return;
        }
        self.settled = 0;
        for by in bits(self.blocks.take_stale()) {
            for bx in 0..TILE_BLOCKS as usize {
                let first = (by * TILE_BLOCKS as usize + bx) * BLOCK_CELLS * BLOCK_CELLS;
                let mut of_block = f32::INFINITY;
                for cell in first..first + BLOCK_CELLS * BLOCK_CELLS {
                    let points = usize::from(self.first[cell])..usize::from(self.first[cell + 1]);
                    let mut least = f32::INFINITY;
                    for &lo in &self.lo[points] {
                        least = if lo < least { lo } else { least };
                    }
                    self.far[cell] = least;
                    of_block = if least < of_block { least } else { of_block };
                }
                self.blocks.set(bx, by, of_block);
            }
        }
        self.blocks.sum_up(simd);
    }

    #[inline(always)]
    fn rasterize<S: Simd>(
        tile: &mut Tile<'_, Self>,
        simd: S,
        (id, lane): (u32, usize),
        rect: Rect,
        greatest: f32,
        stats: &mut Stats,
    ) {
        let doubt = if tile.query.accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        let functions = Functions::new(simd, &tile.work.setups, lane);
        let settled = tile.work.depth.settled;
        let all = (2_u64 << ((rect.x1 - 1) / BLOCK_SIDE)) - (1 << (rect.x0 / BLOCK_SIDE));
        // Points that were tested already: ranges share vectors.
        let mut done = 0;
        for by in rect.y0 / BLOCK_SIDE..=(rect.y1 - 1) / BLOCK_SIDE {
            let met =
                if all.is_power_of_two() { all } else { tile.classify(simd, (lane, greatest), by, all).0 };
            for bx in bits(met) {
                stats.blocks += 1;
                let block = (by * TILE_BLOCKS) as usize + bx;
                let columns = cells_within(rect.x0..rect.x1, bx as u32);
                let rows = cells_within(rect.y0..rect.y1, by);
                if columns.len() == BLOCK_CELLS && rows.len() == BLOCK_CELLS {
                    let range = tile.work.depth.block(block);
                    tile.test_range(simd, (id, &functions), (range, doubt), &mut done, stats);
                } else {
                    for row in rows {
                        let range = tile.work.depth.range(block, row, &columns);
                        tile.test_range(simd, (id, &functions), (range, doubt), &mut done, stats);
                    }
                }
            }
        }
        if tile.work.depth.settled != settled {
            // Vectors reach into other blocks.
            tile.work.depth.blocks.mark_stale(0..TILE_SIDE);
        }
    }
}

/// The cells of a block, counted from its first, that some columns or rows of a tile meet.
#[inline(always)]
fn cells_within(places: Range<u32>, block: u32) -> Range<usize> {
    let first = block * BLOCK_SIDE;
    let start = places.start.max(first) - first;
    let end = places.end.min(first + BLOCK_SIDE) - first;
    (start / CELL_SIDE) as usize..((end - 1) / CELL_SIDE) as usize + 1
}

impl Tile<'_, Cells<'_>> {
    /// Tests a triangle with the points of a range, and with their neighbours in vectors. Those before `done` are done.
    #[inline(always)]
    fn test_range<S: Simd>(
        &mut self,
        simd: S,
        (id, functions): (u32, &Functions<S>),
        (range, doubt): (Range<usize>, f32),
        done: &mut usize,
        stats: &mut Stats,
    ) {
        let mut first = (range.start - range.start % LANES).max(*done);
        while first < range.end {
            stats.samples_tested += LANES as u64;
            let doubtful = self.work.depth.test_eight(simd, first, (id, functions), doubt);
            if doubtful != 0 {
                self.decide(first, doubtful, id, stats);
            }
            first += LANES;
            *done = first;
        }
    }

    /// Decides some of eight points from one on exactly.
    #[inline(never)]
    fn decide(&mut self, first: usize, doubtful: u64, id: u32, stats: &mut Stats) {
        let cells = &mut self.work.depth;
        for index in bits(doubtful).map(|lane| first + lane) {
            if cells.lo[index] == f32::INFINITY {
                continue;
            }
            stats.doubtful_samples += 1;
            let receiver = &cells.receivers[cells.ids[index] as usize];
            let triangle = self.query.triangles.triangle(id);
            if blocks(self.query.origin, receiver, (id, &triangle), &mut stats.ambiguous_coverage) {
                (cells.lo[index], cells.hi[index]) = (f32::INFINITY, f32::INFINITY);
                cells.settled += 1;
            }
        }
    }
}
