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

use fearless_simd::{prelude::*, u32x8};

use crate::depth::rounded_distances;
use crate::hits::NO_TRIANGLE;
use crate::lanes::{LANES, LaneMask, Lanes, Narrow, NarrowMask, bits};
use crate::pencil::Origin;
use crate::predicates::Distance;
use crate::ray::Ray;
use crate::triangles::Triangles;
use crate::window::{Rect, Row};

/// Rays along one side of a block: as many as there are lanes.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Rays along one side of a tile: its buffer, 12 bytes per ray, stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;
/// Blocks along one side of a tile: as many as there are lanes.
pub(crate) const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;
/// Blocks of a tile.
const BLOCKS: usize = (TILE_BLOCKS * TILE_BLOCKS) as usize;
/// Rows of eight rays of a tile.
const ROWS: usize = BLOCKS * BLOCK_SIDE as usize;

/// Keys that err by no more than this part of themselves give the distance: 1 in 4000 is then rounded by the exact stage.
const KEY_ERROR: f64 = 1.0 / (1_u64 << 38) as f64;

/// Room for records: what a tile's rays may need, and some more, so that records are dropped rarely.
const RECORDS: usize = ROWS * LANES + 512;
/// The record of rays that have hit nothing.
const NO_RECORD: u32 = u32::MAX;

/// 0 to 7.
const COLUMNS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

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
    /// A bound of its error.
    pub(crate) error: f32,
    pub(crate) id: u32,
}

/// What the rays of a tile have hit so far, in rows of eight rays.
#[derive(Debug)]
pub(crate) struct TileDepth {
    /// Bounds of each ray's key: −∞ for none, +∞ where nothing more matters.
    lo: Box<[[f32; LANES]; ROWS]>,
    hi: Box<[[f32; LANES]; ROWS]>,
    /// The record of each ray.
    nearest: Box<[[u32; LANES]; ROWS]>,
    records: Vec<Record>,
    /// Per block, the rays that have hit something.
    covered: [u64; BLOCKS],
    /// Per block, a lower bound of its rays' keys.
    far: [[f32; LANES]; TILE_BLOCKS as usize],
    /// Blocks whose bound is out of date.
    stale: u64,
    /// The least of `far`.
    farthest: f32,
}

impl TileDepth {
    /// Bytes of a buffer.
    pub(crate) const BYTES: usize = ROWS * LANES * (2 * size_of::<f32>() + size_of::<u32>())
        + RECORDS * size_of::<Record>()
        + size_of::<Self>();

    /// A buffer; [`TileDepth::clear`] readies it.
    pub(crate) fn new() -> Self {
        Self {
            lo: Box::new([[0.0; LANES]; ROWS]),
            hi: Box::new([[0.0; LANES]; ROWS]),
            nearest: Box::new([[NO_RECORD; LANES]; ROWS]),
            records: Vec::with_capacity(RECORDS),
            covered: [0; BLOCKS],
            far: [[0.0; LANES]; TILE_BLOCKS as usize],
            stale: 0,
            farthest: 0.0,
        }
    }

    /// Forgets all hits. Rays outside `width` x `height` do not exist: everything is hidden from them.
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        self.lo.fill([f32::NEG_INFINITY; LANES]);
        self.hi.fill([f32::NEG_INFINITY; LANES]);
        self.nearest.fill([NO_RECORD; LANES]);
        self.records.clear();
        self.covered.fill(0);
        self.far = [[f32::NEG_INFINITY; LANES]; TILE_BLOCKS as usize];
        (self.stale, self.farthest) = (0, f32::NEG_INFINITY);
        for y in 0..TILE_SIDE {
            let outside = if y < height { width } else { 0 };
            for x in outside..TILE_SIDE {
                let (row, lane) = place(x, y);
                (self.lo[row][lane], self.hi[row][lane]) = (f32::INFINITY, f32::INFINITY);
                self.cover(row, 1 << lane);
            }
        }
    }

    /// Notes that some rays of a block have hit something.
    #[inline(always)]
    pub(crate) fn cover(&mut self, block: usize, rays: u64) {
        let covered = &mut self.covered[block % BLOCKS];
        *covered |= rays;
        self.stale |= u64::from(*covered == u64::MAX) << (block % BLOCKS);
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

    /// Brings the lower bounds up to date. O(rays of stale blocks).
    #[inline(always)]
    pub(crate) fn refresh<S: Simd>(&mut self, simd: S) {
        if self.stale == 0 {
            return;
        }
        for block in bits(std::mem::take(&mut self.stale)) {
            let mut least = Narrow::simd_from(simd, f32::INFINITY);
            for row in &self.lo[block * LANES..block * LANES + LANES] {
                least = least.min(Narrow::load_array_ref(simd, row));
            }
            self.far[block / LANES][block % LANES] = least_of(least);
        }
        let mut least = Narrow::load_array_ref(simd, &self.far[0]);
        for row in &self.far[1..] {
            least = least.min(Narrow::load_array_ref(simd, row));
        }
        self.farthest = least_of(least);
    }

    /// Whether something whose keys are at most `key` is hidden from all rays.
    pub(crate) fn hides(&self, key: f64) -> bool {
        key < f64::from(self.farthest)
    }

    /// Whether something whose keys are at most `key` is hidden from a block.
    #[inline(always)]
    pub(crate) fn hides_in_block(&self, bx: u32, by: u32, key: f32) -> bool {
        key < self.far[(by % TILE_BLOCKS) as usize][(bx % TILE_BLOCKS) as usize]
    }

    /// Whether something whose keys are at most `key` is hidden from a rectangle of rays; only small ones are looked at.
    #[inline(always)]
    pub(crate) fn hides_in_rect(&self, rect: Rect, key: f32) -> bool {
        let (bx0, bx1) = (rect.x0 / BLOCK_SIDE, (rect.x1 - 1) / BLOCK_SIDE);
        let (by0, by1) = (rect.y0 / BLOCK_SIDE, (rect.y1 - 1) / BLOCK_SIDE);
        if bx1 - bx0 > 1 || by1 - by0 > 1 {
            return key < self.farthest;
        }
        self.hides_in_block(bx0, by0, key)
            && self.hides_in_block(bx1, by0, key)
            && self.hides_in_block(bx0, by1, key)
            && self.hides_in_block(bx1, by1, key)
    }

    /// The lower bounds of a row of blocks.
    #[inline(always)]
    pub(crate) fn far<S: Simd>(&self, simd: S, by: u32) -> Narrow<S> {
        Narrow::load_array_ref(simd, &self.far[(by % TILE_BLOCKS) as usize])
    }

    /// Lower bounds of the keys of a row.
    #[inline(always)]
    pub(crate) fn lo<S: Simd>(&self, simd: S, row: usize) -> Narrow<S> {
        Narrow::load_array_ref(simd, &self.lo[row % ROWS])
    }

    /// Upper bounds of the keys of a row.
    #[inline(always)]
    pub(crate) fn hi<S: Simd>(&self, simd: S, row: usize) -> Narrow<S> {
        Narrow::load_array_ref(simd, &self.hi[row % ROWS])
    }

    /// Keeps bounds and the number of a record for some rays of a row; the block is to be told by [`TileDepth::cover`].
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(
        &mut self,
        simd: S,
        row: usize,
        mask: NarrowMask<S>,
        [lo, hi]: [Narrow<S>; 2],
        record: u32,
    ) {
        let row = row % ROWS;
        let (near_lo, near_hi) = (self.lo(simd, row), self.hi(simd, row));
        mask.select(lo, near_lo).store_slice(&mut self.lo[row]);
        mask.select(hi, near_hi).store_slice(&mut self.hi[row]);
        let nearest = u32x8::load_array_ref(simd, &self.nearest[row]);
        mask.select(u32x8::simd_from(simd, record), nearest).store_slice(&mut self.nearest[row]);
    }

    /// The nearest hit of a ray, with the id of its triangle.
    pub(crate) fn nearest(&self, (row, lane): (usize, usize)) -> Option<(Candidate, u32)> {
        let record = self.nearest[row][lane];
        let id = self.records.get(record as usize)?.id;
        Some((Candidate { lo: self.lo[row][lane], hi: self.hi[row][lane], record }, id))
    }

    /// The key of a record at column x and row y.
    pub(crate) fn key(&self, record: u32, x: u32, y: u32) -> f64 {
        let [c, along_x, along_y] = self.records[record as usize].key;
        c + along_x * f64::from(x) + along_y * f64::from(y)
    }

    /// Keeps a hit.
    pub(crate) fn put(&mut self, (row, lane): (usize, usize), Candidate { lo, hi, record }: Candidate) {
        (self.lo[row][lane], self.hi[row][lane]) = (lo, hi);
        self.nearest[row][lane] = record;
        self.cover(row / LANES, 1 << (row % LANES * LANES + lane));
    }

    /// Writes ids and distances of at most eight rays from column 8`bx` of row `y`. `ray` makes the ray of a lane.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &self,
        simd: S,
        (bx, y): (u32, u32),
        (ids, ts): &mut Row<'_>,
        origin: Origin,
        triangles: &Triangles<'_>,
        ray: impl Fn(usize) -> Ray,
    ) {
        let nearest = u32x8::load_array_ref(simd, &self.nearest[row_of(bx, y) % ROWS]);
        let missed = nearest.simd_eq(u32x8::simd_from(simd, NO_RECORD));
        let (all_ids, keys) = self.keys(simd, (bx, y), nearest, !missed.to_bitmask() & 0xFF);
        let error = keys.abs() * KEY_ERROR;
        let (rounded, doubtful) = rounded_distances(simd, keys - error, keys + error, origin);
        let rounded = missed.select(Narrow::simd_from(simd, f32::INFINITY), rounded).to_array();
        let all_ids = all_ids.to_array();
        if let (Ok(ids), Ok(ts)) = (<&mut [u32; LANES]>::try_from(&mut **ids), (&mut **ts).try_into()) {
            let ts: &mut [f32; LANES] = ts;
            (*ids, *ts) = (all_ids, rounded);
        } else {
            ids.copy_from_slice(&all_ids[..ids.len()]);
            ts.copy_from_slice(&rounded[..ids.len()]);
        }
        for lane in bits(doubtful & !missed.to_bitmask() & ((1 << ids.len()) - 1)) {
            ts[lane] = Distance::new(&ray(lane), &triangles.triangle(ids[lane])).rounded();
        }
    }

    /// Ids and keys of a row; NaN where they err too much.
    #[inline(always)]
    fn keys<S: Simd>(
        &self,
        simd: S,
        (bx, y): (u32, u32),
        nearest: u32x8<S>,
        mut lanes: u64,
    ) -> (u32x8<S>, Lanes<S>) {
        let unknown = Lanes::simd_from(simd, f64::NAN);
        let (mut ids, mut keys) = (u32x8::simd_from(simd, NO_TRIANGLE), unknown);
        let x = Lanes::load_array(simd, COLUMNS) + f64::from(bx * BLOCK_SIDE);
        let records = nearest.to_array();
        while lanes != 0 {
            // All rays with the record of the first one that is left.
            let number = records[lanes.trailing_zeros() as usize % LANES];
            let same = nearest.simd_eq(u32x8::simd_from(simd, number));
            let Record { key: [c, along_x, along_y], error, id } = self.records[number as usize];
            let key = (x * along_x + c) + along_y * f64::from(y);
            let precise = (key.abs() * KEY_ERROR).simd_ge(Lanes::simd_from(simd, f64::from(error)));
            let (low, high) = same.widen();
            let same_wide: LaneMask<S> = simd.combine_mask64x4(low, high);
            keys = same_wide.select(precise.select(key, unknown), keys);
            ids = same.select(u32x8::simd_from(simd, id), ids);
            lanes &= !same.to_bitmask();
        }
        (ids, keys)
    }
}

/// The least lane; none is NaN.
#[inline(always)]
fn least_of<S: Simd>(lanes: Narrow<S>) -> f32 {
    lanes.to_array().into_iter().fold(f32::INFINITY, |least, x| if x < least { x } else { least })
}

/// The row and lane of a ray of a tile: block by block, row by row within a block.
pub(crate) fn place(x: u32, y: u32) -> (usize, usize) {
    (row_of(x / BLOCK_SIDE, y), (x % BLOCK_SIDE) as usize)
}

/// The row of eight rays in column `bx` of blocks.
#[inline(always)]
pub(crate) fn row_of(bx: u32, y: u32) -> usize {
    (((y / BLOCK_SIDE) * TILE_BLOCKS + bx) * BLOCK_SIDE + y % BLOCK_SIDE) as usize
}
