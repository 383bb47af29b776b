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

use crate::hits::NO_TRIANGLE;
use crate::lanes::{LANES, Lanes, Narrow, NarrowMask, bits, narrow};
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
/// Rays along one side of a tile.
const SIDE: usize = TILE_SIDE as usize;

/// Keys that err by no more than this part of themselves give the distance: 1 in 4000 is then rounded by the exact stage.
const KEY_ERROR: f64 = 1.0 / (1_u64 << 38) as f64;
/// The same for 1/key and −key, with their roundings and that of the key to f32.
const T_ERROR: f64 = KEY_ERROR * 1.01;
/// Distances between these are neither subnormal nor saturated.
const PLAIN_T: [f32; 2] = [1e-30, 1e30];

/// Room for records: what a tile's rays may need, and some more, so that records are dropped rarely.
const RECORDS: usize = SIDE * SIDE + 512;
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
    key: [f64; 3],
    /// The least magnitude of the key that gives the distance: 1/[`KEY_ERROR`] times the error, rounded up.
    least: f32,
    id: u32,
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
    nearest: [[u32; SIDE]; SIDE],
    records: Vec<Record>,
    /// Per row, the rays that have hit something.
    covered: [u64; SIDE],
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

    /// Writes ids and distances of row `y`. `ray` makes the ray of a column.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &self,
        simd: S,
        y: u32,
        (ids, ts): &mut Row<'_>,
        (origin, triangles): (Origin, &Triangles<'_>),
        ray: impl Fn(u32) -> Ray,
    ) {
        let ((id_eights, last_ids), (t_eights, last_ts)) = (ids.as_chunks_mut(), ts.as_chunks_mut());
        let covered = self.covered[y as usize % SIDE];
        let decide = |x: u32, (ids, ts): (&[u32; LANES], &mut [f32; LANES]), doubtful: u64| {
            for lane in bits(doubtful) {
                // In range: fewer than eight columns.
                ts[lane] = Distance::new(&ray(x + lane as u32), &triangles.triangle(ids[lane])).rounded();
            }
        };
        let mut x = 0;
        for (ids, ts) in id_eights.iter_mut().zip(t_eights) {
            let doubtful = self.resolve(simd, (x, y), covered >> x & 0xFF, origin, (ids, ts));
            decide(x, (ids, ts), doubtful);
            x += BLOCK_SIDE;
        }
        if !last_ids.is_empty() {
            let (mut ids, mut ts) = ([0; LANES], [0.0; LANES]);
            let covered = covered >> x & ((1 << last_ids.len()) - 1);
            let doubtful = self.resolve(simd, (x, y), covered, origin, (&mut ids, &mut ts));
            decide(x, (&ids, &mut ts), doubtful);
            last_ids.copy_from_slice(&ids[..last_ids.len()]);
            last_ts.copy_from_slice(&ts[..last_ids.len()]);
        }
    }

    /// Ids and rounded distances of eight rays from column `x` of row `y`, of which some have hit something; the lanes
    /// where the nearest f32 is in doubt.
    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        (x, y): (u32, u32),
        covered: u64,
        origin: Origin,
        (ids, ts): (&mut [u32; LANES], &mut [f32; LANES]),
    ) -> u64 {
        if covered == 0 {
            (*ids, *ts) = ([NO_TRIANGLE; LANES], [f32::INFINITY; LANES]);
            return 0;
        }
        let (keys, least) = self.keys(simd, (x, y), covered, ids);
        let t = if matches!(origin, Origin::Point(_)) { Lanes::simd_from(simd, 1.0) / keys } else { -keys };
        // Rounding to f32 is monotonic, so equal ends leave no doubt. NaN is in doubt, and so are distances near to where
        // they saturate.
        let (lo, hi) = (narrow(t * (1.0 - T_ERROR)), narrow(t * (1.0 + T_ERROR)));
        let certain = lo.simd_eq(hi)
            & narrow(keys.abs()).simd_ge(least)
            & lo.simd_gt(PLAIN_T[0])
            & lo.simd_lt(PLAIN_T[1]);
        let hit = NarrowMask::from_bitmask(simd, covered);
        hit.select(lo, Narrow::simd_from(simd, f32::INFINITY)).store_slice(ts);
        covered & !certain.to_bitmask()
    }

    /// Ids and keys of some of eight rays, and the least magnitude of each that gives the distance.
    #[inline(always)]
    fn keys<S: Simd>(
        &self,
        simd: S,
        (x, y): (u32, u32),
        covered: u64,
        ids: &mut [u32; LANES],
    ) -> (Lanes<S>, Narrow<S>) {
        let numbers = eight(&self.nearest[y as usize % SIDE], x);
        let nearest = u32x8::from_slice(simd, numbers);
        let columns = Lanes::load_array(simd, COLUMNS) + f64::from(x);
        let mut all_keys = Lanes::simd_from(simd, f64::NAN);
        let mut all_least = Narrow::simd_from(simd, f32::INFINITY);
        let mut all_ids = u32x8::simd_from(simd, NO_TRIANGLE);
        let mut left = covered;
        // All rays with the record of the first one that is left: mostly one or two rounds.
        while left != 0 {
            let number = numbers[left.trailing_zeros() as usize % LANES];
            let Record { key: [c, along_x, along_y], least, id } = self.records[number as usize];
            let same = nearest.simd_eq(number);
            let keys = (columns * along_x + c) + along_y * f64::from(y);
            let (low, high) = same.widen();
            all_keys = simd.combine_mask64x4(low, high).select(keys, all_keys);
            all_least = same.select(Narrow::simd_from(simd, least), all_least);
            all_ids = same.select(u32x8::simd_from(simd, id), all_ids);
            left &= !same.to_bitmask();
        }
        all_ids.store_slice(ids);
        (all_keys, all_least)
    }
}

/// Eight elements of a row from column `x` on, which is at most 56.
#[inline(always)]
fn eight<T>(row: &[T; SIDE], x: u32) -> &[T] {
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
