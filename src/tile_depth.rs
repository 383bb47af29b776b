//! The nearest hit of each ray of a tile, while it is worked on, and the farthest of its blocks.
//!
//! Each ray keeps an interval of f32 that holds its depth key (greater is nearer) and the number of a record: the id of
//! the triangle and its key as a function of column and row, in f64. The interval decides the order wherever it can; where
//! those of two triangles overlap, the exact order decides. The record gives the distance at the end, for all rays of a row
//! that hit the same triangle at once.
//!
//! Records of triangles that have been hidden since are dropped when there is no room for more: a tile has fewer rays than
//! records.
//!
//! Blocks keep a lower bound of their rays' keys: what lies behind it is hidden from all of them. It is known only once all
//! rays of a block have hit something, and a bound that is out of date is still one, so it is refreshed now and then.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use std::mem::size_of;
use std::ops::Range;

use fearless_simd::{prelude::*, u32x8};

use crate::lanes::{LANES, Narrow, NarrowMask, bits};
use crate::window::Rect;

/// Rays along one side of a block: as many as there are lanes.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Rays along one side of a tile: its buffer, 12 bytes per ray, stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;
/// Blocks along one side of a tile: as many as there are lanes.
pub(crate) const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;
/// Rays along one side of a tile.
pub(crate) const SIDE: usize = TILE_SIDE as usize;

/// Keys that err by no more than this part of themselves give the distance: 1 in 4000 is then rounded by the exact stage.
pub(crate) const KEY_ERROR: f64 = 1.0 / (1_u64 << 38) as f64;
/// Room for records: what a tile's rays may need, and some more, so that records are dropped rarely.
const RECORDS: usize = SIDE * SIDE + 512;
/// The record of rays that have hit nothing.
const NO_RECORD: u32 = u32::MAX;

/// A hit of one ray: its key lies in [lo, hi].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) lo: f32,
    pub(crate) hi: f32,
    pub(crate) record: u32,
}

/// A triangle that some ray of the tile has hit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record {
    /// The key c + xk_x + yk_y at column x and row y of the tile.
    pub(crate) key: [f64; 3],
    /// The least magnitude of the key that gives the distance: 1/[`KEY_ERROR`] times the error, rounded up.
    pub(crate) least: f32,
    pub(crate) id: u32,
}

impl Record {
    /// A triangle's record, with the error of its key.
    #[inline(always)]
    pub(crate) fn new(id: u32, key: [f64; 3], error: f64) -> Self {
        Self { key, least: (error * ((1.0 + f64::from(f32::EPSILON)) / KEY_ERROR)) as f32, id }
    }
}

/// What the rays of a tile have hit so far, row by row.
#[derive(Debug)]
pub(crate) struct TileDepth {
    /// Bounds of each ray's key: −∞ for none, +∞ where nothing more matters.
    lo: [[f32; SIDE]; SIDE],
    hi: [[f32; SIDE]; SIDE],
    /// The record of each ray.
    pub(crate) nearest: [[u32; SIDE]; SIDE],
    pub(crate) records: Vec<Record>,
    /// Per row, the rays that have hit something.
    pub(crate) covered: [u64; SIDE],
    /// Per block, a lower bound of its rays' keys.
    far: [[f32; LANES]; TILE_BLOCKS as usize],
    /// Rows of blocks whose bounds may be out of date.
    stale: u64,
    /// The least of `far`.
    farthest: f32,
}

impl TileDepth {
    /// Bytes of the records of a buffer.
    pub(crate) const RECORD_BYTES: usize = RECORDS * size_of::<Record>();

    /// A buffer; [`TileDepth::clear`] readies it.
    pub(crate) fn new() -> Self {
        Self {
            lo: [[0.0; SIDE]; SIDE],
            hi: [[0.0; SIDE]; SIDE],
            nearest: [[NO_RECORD; SIDE]; SIDE],
            records: Vec::with_capacity(RECORDS),
            covered: [0; SIDE],
            far: [[0.0; LANES]; TILE_BLOCKS as usize],
            stale: 0,
            farthest: 0.0,
        }
    }

    /// Forgets all hits. Rays outside `width` x `height` do not exist: everything is hidden from them.
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        self.lo.fill([f32::NEG_INFINITY; SIDE]);
        self.hi.fill([f32::NEG_INFINITY; SIDE]);
        self.nearest.fill([NO_RECORD; SIDE]);
        self.records.clear();
        self.covered.fill(0);
        self.far = [[f32::NEG_INFINITY; LANES]; TILE_BLOCKS as usize];
        (self.stale, self.farthest) = (u64::MAX >> (u64::BITS - TILE_BLOCKS), f32::NEG_INFINITY);
        for y in 0..SIDE {
            let outside = if y < height as usize { width as usize } else { 0 };
            self.lo[y][outside..].fill(f32::INFINITY);
            self.hi[y][outside..].fill(f32::INFINITY);
            self.covered[y] = u64::MAX.checked_shl(outside as u32).unwrap_or(0);
        }
    }

    /// Notes that some of eight rays from column `x` of row `y` have hit something.
    #[inline(always)]
    fn cover(&mut self, x: u32, y: u32, rays: u64) {
        self.covered[y as usize % SIDE] |= rays << (x % TILE_SIDE);
    }

    /// Notes that the bounds of a row of blocks may be out of date.
    #[inline(always)]
    pub(crate) fn mark_stale(&mut self, rows: Range<u32>) {
        let (first, last) = (rows.start / BLOCK_SIDE, (rows.end - 1) / BLOCK_SIDE);
        self.stale |= (2 << last) - (1 << first);
    }

    /// The number that the next record will have.
    #[inline(always)]
    pub(crate) fn next_record(&mut self) -> u32 {
        if self.records.len() == RECORDS {
            self.drop_hidden();
        }
        // In range: there are at most RECORDS.
        self.records.len() as u32
    }

    /// Adds the record that some rays refer to by now.
    #[inline(always)]
    pub(crate) fn record(&mut self, record: Record) {
        self.records.push(record);
    }

    /// Drops the records that no ray refers to. O(rays + records).
    #[cold]
    fn drop_hidden(&mut self) {
        let mut places = vec![NO_RECORD; self.records.len()];
        let mut kept = Vec::with_capacity(RECORDS);
        for record in self.nearest.as_flattened_mut().iter_mut().filter(|record| **record != NO_RECORD) {
            let old = *record as usize;
            if places[old] == NO_RECORD {
                places[old] = kept.len() as u32;
                kept.push(self.records[old]);
            }
            *record = places[old];
        }
        self.records = kept;
    }

    /// Brings the lower bounds up to date. O(rays of stale rows of blocks).
    #[inline(always)]
    pub(crate) fn refresh<S: Simd>(&mut self, simd: S) {
        if self.stale == 0 {
            return;
        }
        let mut changed = false;
        for by in bits(std::mem::take(&mut self.stale)) {
            let rows = by % LANES * LANES..by % LANES * LANES + LANES;
            let all = self.covered[rows.clone()].iter().fold(u64::MAX, |all, row| all & row);
            for bx in 0..LANES {
                if all >> (bx * LANES) & 0xFF == 0xFF {
                    let mut least = Narrow::simd_from(simd, f32::INFINITY);
                    for row in &self.lo[rows.clone()] {
                        least = least.min(Narrow::from_slice(simd, &row[bx * LANES..bx * LANES + LANES]));
                    }
                    self.far[by % LANES][bx] = least_of(least);
                    changed = true;
                }
            }
        }
        if changed {
            let mut least = Narrow::load_array_ref(simd, &self.far[0]);
            for row in &self.far[1..] {
                least = least.min(Narrow::load_array_ref(simd, row));
            }
            self.farthest = least_of(least);
        }
    }

    /// Whether something whose keys are at most `key` is hidden from all rays.
    pub(crate) fn hides(&self, key: f64) -> bool {
        key < f64::from(self.farthest)
    }

    /// Whether something whose keys are at most `key` is hidden from all blocks that a rectangle of rays meets.
    #[inline(always)]
    pub(crate) fn hides_in_rect<S: Simd>(&self, simd: S, rect: Rect, key: f32) -> bool {
        if key < self.farthest {
            return true;
        }
        let blocks = (2_u64 << ((rect.x1 - 1) / BLOCK_SIDE)) - (1 << (rect.x0 / BLOCK_SIDE));
        for by in rect.y0 / BLOCK_SIDE..=(rect.y1 - 1) / BLOCK_SIDE {
            if self.far(simd, by).simd_gt(key).to_bitmask() & blocks != blocks {
                return false;
            }
        }
        true
    }

    /// The lower bounds of a row of blocks.
    #[inline(always)]
    pub(crate) fn far<S: Simd>(&self, simd: S, by: u32) -> Narrow<S> {
        Narrow::load_array_ref(simd, &self.far[(by % TILE_BLOCKS) as usize])
    }

    /// Lower bounds of the keys of eight rays from column `x` of row `y`.
    #[inline(always)]
    pub(crate) fn lo<S: Simd>(&self, simd: S, x: u32, y: u32) -> Narrow<S> {
        Narrow::from_slice(simd, eight(&self.lo[y as usize % SIDE], x))
    }

    /// Upper bounds of the same.
    #[inline(always)]
    pub(crate) fn hi<S: Simd>(&self, simd: S, x: u32, y: u32) -> Narrow<S> {
        Narrow::from_slice(simd, eight(&self.hi[y as usize % SIDE], x))
    }

    /// Keeps bounds and the number of a record for some of eight rays from column `x` of row `y`, the others having the
    /// second of the bounds. The row of blocks is to be told by [`TileDepth::mark_stale`].
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(
        &mut self,
        simd: S,
        (x, y): (u32, u32),
        mask: NarrowMask<S>,
        [lo, hi]: [[Narrow<S>; 2]; 2],
        record: u32,
    ) {
        let row = y as usize % SIDE;
        mask.select(lo[0], lo[1]).store_slice(eight_mut(&mut self.lo[row], x));
        mask.select(hi[0], hi[1]).store_slice(eight_mut(&mut self.hi[row], x));
        let nearest = eight_mut(&mut self.nearest[row], x);
        let other = u32x8::from_slice(simd, nearest);
        mask.select(u32x8::simd_from(simd, record), other).store_slice(nearest);
        self.cover(x, y, mask.to_bitmask());
    }

    /// The nearest hit of a ray, with the id of its triangle.
    pub(crate) fn nearest(&self, x: u32, y: u32) -> Option<(Candidate, u32)> {
        let (x, y) = (x as usize, y as usize);
        let record = self.nearest[y][x];
        let id = self.records.get(record as usize)?.id;
        Some((Candidate { lo: self.lo[y][x], hi: self.hi[y][x], record }, id))
    }

    /// The key of a record at column x and row y.
    pub(crate) fn key(&self, record: u32, x: u32, y: u32) -> f64 {
        let [c, along_x, along_y] = self.records[record as usize].key;
        c + along_x * f64::from(x) + along_y * f64::from(y)
    }

    /// Keeps a hit.
    pub(crate) fn put(&mut self, x: u32, y: u32, Candidate { lo, hi, record }: Candidate) {
        let (column, row) = (x as usize, y as usize);
        (self.lo[row][column], self.hi[row][column]) = (lo, hi);
        self.nearest[row][column] = record;
        self.cover(x, y, 1);
    }
}

/// Eight elements of a row from column `x` on, which is at most 56.
#[inline(always)]
pub(crate) fn eight<T>(row: &[T; SIDE], x: u32) -> &[T] {
    let x = (x as usize).min(SIDE - LANES);
    &row[x..x + LANES]
}

/// The same, to be changed.
#[inline(always)]
fn eight_mut<T>(row: &mut [T; SIDE], x: u32) -> &mut [T] {
    let x = (x as usize).min(SIDE - LANES);
    &mut row[x..x + LANES]
}

/// The least lane; none is NaN.
#[inline(always)]
fn least_of<S: Simd>(lanes: Narrow<S>) -> f32 {
    lanes.to_array().into_iter().fold(f32::INFINITY, |least, x| if x < least { x } else { least })
}
