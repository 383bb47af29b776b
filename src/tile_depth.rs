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
//! The farthest of a block, see [`crate::hierarchical_z`], is known only once all of its rays have hit something.
//!
//! Based on: Edwin Catmull, "A Subdivision Algorithm for Computer Display of Curved Surfaces", 1974 (the z-buffer).

use std::mem::size_of;

use fearless_simd::{prelude::*, u32x8};

use crate::hierarchical_z::{HierarchicalZ, TILE_SIDE, least_of};
use crate::lanes::{LANES, Narrow, NarrowMask, bits};

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
    /// The farthest of the blocks.
    pub(crate) blocks: HierarchicalZ,
    /// Columns and rows.
    size: [u32; 2],
    /// Whether all of the above is ready: it is not before some triangle may have met a ray.
    pub(crate) ready: bool,
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
            blocks: HierarchicalZ::new(),
            size: [0; 2],
            ready: false,
        }
    }

    /// Forgets all hits. Rays outside `width` x `height` do not exist: everything is hidden from them.
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        (self.blocks, self.size, self.ready) = (HierarchicalZ::new(), [width, height], false);
    }

    /// Readies the buffer.
    #[inline(never)]
    pub(crate) fn make_ready(&mut self) {
        self.lo.fill([f32::NEG_INFINITY; SIDE]);
        self.hi.fill([f32::NEG_INFINITY; SIDE]);
        self.nearest.fill([NO_RECORD; SIDE]);
        self.records.clear();
        self.covered.fill(0);
        let [width, height] = self.size.map(|side| side as usize);
        self.ready = true;
        for y in 0..SIDE {
            let outside = if y < height { width } else { 0 };
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

    /// Brings the lower bounds of blocks up to date. O(rays of stale rows of blocks).
    #[inline(always)]
    pub(crate) fn refresh_blocks<S: Simd>(&mut self, simd: S) {
        if !self.ready {
            return;
        }
        let mut changed = false;
        for by in bits(self.blocks.take_stale()) {
            let rows = by % LANES * LANES..by % LANES * LANES + LANES;
            let all = self.covered[rows.clone()].iter().fold(u64::MAX, |all, row| all & row);
            for bx in 0..LANES {
                if all >> (bx * LANES) & 0xFF == 0xFF {
                    let mut least = Narrow::simd_from(simd, f32::INFINITY);
                    for row in &self.lo[rows.clone()] {
                        least = least.min(Narrow::from_slice(simd, &row[bx * LANES..bx * LANES + LANES]));
                    }
                    self.blocks.set(bx, by, least_of(least));
                    changed = true;
                }
            }
        }
        if changed {
            self.blocks.sum_up(simd);
        }
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
    /// second of the bounds. The row of blocks is to be told by
    /// [`HierarchicalZ::mark_stale`].
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
