//! The nearest hit of each ray of a tile, while it is worked on.
//!
//! Each ray keeps an interval that holds its depth key, see [`crate::intersect::grid::tile_keys`], and the number of a
//! record: the id of the triangle and its key as a function of column and row, in f64. The interval decides the order
//! wherever it can; where those of two triangles overlap, the exact order decides. The record gives the distance at the
//! end, for all rays of a row that hit the same triangle at once.
//!
//! Records of triangles that have been hidden since are dropped when there is no room for more: a tile has fewer rays
//! than records.
//!
//! Based on: Edwin Catmull, "A Subdivision Algorithm for Computer Display of Curved Surfaces", 1974 (the z-buffer).

use std::mem::size_of;
use std::ops::Range;

use fearless_simd::{prelude::*, u32x8};

use crate::intersect::grid::relations::{Relations, Twins};
use crate::intersect::grid::tile_keys::{LANE_BITS, SIDE, TileKeys, eight, eight_mut};
use crate::simd::lanes::{LANES, Narrow, NarrowMask};

/// Keys that err by no more than this part of themselves give the distance: 1 in 4000 is then rounded by the exact
/// stage.
pub(crate) const KEY_ERROR: f64 = 1.0 / (1_u64 << 38) as f64;
/// Room for records: what a tile's rays may need, and some more, so that records are dropped rarely.
const RECORDS: usize = SIDE * SIDE + 512;
/// Records of a block that are looked at together.
const FEW: usize = 4;
/// The record of rays that have hit nothing.
const NO_RECORD: u32 = u32::MAX;

/// The numbers of a few records.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FewRecords {
    records: [u32; FEW],
    count: usize,
}

impl FewRecords {
    /// None.
    pub(crate) const NONE: Self = Self { records: [NO_RECORD; FEW], count: 0 };

    /// Those for which something is true; `None` where it is not known of one.
    pub(crate) fn split(&self, mut is_true: impl FnMut(u32) -> Option<bool>) -> Option<Self> {
        let mut some = Self::NONE;
        for &record in &self.records[..self.count] {
            if is_true(record)? {
                some.records[some.count] = record;
                some.count += 1;
            }
        }
        Some(some)
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }
}

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
    /// How near they are.
    pub(crate) keys: TileKeys,
    /// The record of each ray.
    pub(crate) nearest: [[u32; SIDE]; SIDE],
    pub(crate) records: Vec<Record>,
    pub(crate) relations: Relations,
    pub(crate) twins: Twins,
}

impl TileDepth {
    /// Bytes of the records of a buffer.
    pub(crate) const RECORD_BYTES: usize = RECORDS * size_of::<Record>();

    /// A buffer; [`TileDepth::clear`] and [`TileDepth::make_ready`] ready it.
    pub(crate) fn new() -> Self {
        Self {
            keys: TileKeys::new(),
            nearest: [[NO_RECORD; SIDE]; SIDE],
            records: Vec::with_capacity(RECORDS),
            relations: Relations::NONE,
            twins: Twins::NONE,
        }
    }

    /// Forgets all hits. Rays outside `width` x `height` do not exist.
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        self.keys.clear(width, height);
        self.relations.forget();
        self.twins.forget();
    }

    /// Readies the buffer.
    #[inline(never)]
    pub(crate) fn make_ready(&mut self) {
        self.keys.make_ready();
        self.nearest.fill([NO_RECORD; SIDE]);
        self.records.clear();
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

    /// Keeps bounds and the number of a record for some of eight rays from column `x` of row `y`, the others having the
    /// second of the bounds. The row of blocks is to be told by
    /// [`HierarchicalZ::mark_stale`].
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(
        &mut self,
        simd: S,
        (x, y): (u32, u32),
        mask: NarrowMask<S>,
        bounds: [[Narrow<S>; 2]; 2],
        record: u32,
    ) {
        self.keys.keep((x, y), mask, bounds);
        let nearest = eight_mut(&mut self.nearest[y as usize % SIDE], x);
        let other = u32x8::from_slice(simd, nearest);
        mask.select(u32x8::simd_from(simd, record), other).store_slice(nearest);
    }

    /// Of some rays of eight from column `x` of row `y`, as bits, those with the record of the first one; and its number.
    pub(crate) fn with_first(&self, (x, y): (u32, u32), rays: u64) -> (u64, u32) {
        let numbers = eight(&self.nearest[y as usize % SIDE], x);
        let first = numbers[rays.trailing_zeros() as usize % LANES];
        let same =
            numbers.iter().zip(&LANE_BITS).map(|(&number, &bit)| if number == first { bit } else { 0 });
        (u64::from(same.fold(0, |same, bit| same | bit)) & rays, first)
    }

    /// Those of eight rays from column `x` of row `y` that have one of some records.
    #[inline(always)]
    pub(crate) fn having<S: Simd>(
        &self,
        simd: S,
        (x, y): (u32, u32),
        FewRecords { records, count }: &FewRecords,
    ) -> NarrowMask<S> {
        let numbers = u32x8::from_slice(simd, eight(&self.nearest[y as usize % SIDE], x));
        let mut having = NarrowMask::simd_from(simd, false);
        for &record in &records[..*count % (FEW + 1)] {
            having |= numbers.simd_eq(record);
        }
        having
    }

    /// The numbers of the records that the rays of some rows of a block from column `x` on have, if there are few and all have one.
    pub(crate) fn block_records(&self, x: u32, rows: Range<u32>) -> Option<FewRecords> {
        let rows = &self.nearest[rows.start as usize..rows.end as usize];
        let mut last = rows.first()?[x as usize % SIDE];
        let (mut found, mut count) = ([last; FEW], 1);
        for row in rows {
            let numbers = eight(row, x);
            // Most rows are of one record.
            if numbers.iter().fold(0, |differing, number| differing | (number ^ last)) == 0 {
                continue;
            }
            for &number in numbers {
                if number != last && !found.contains(&number) {
                    *found.get_mut(count)? = number;
                    count += 1;
                }
                last = number;
            }
        }
        (!found.contains(&NO_RECORD)).then_some(FewRecords { records: found, count })
    }

    /// The nearest hit of a ray, with the id of its triangle.
    pub(crate) fn nearest(&self, x: u32, y: u32) -> Option<(Candidate, u32)> {
        let record = self.nearest[y as usize][x as usize];
        let id = self.records.get(record as usize)?.id;
        let [lo, hi] = self.keys.at(x, y);
        Some((Candidate { lo, hi, record }, id))
    }

    /// The key of a record at column x and row y.
    pub(crate) fn key(&self, record: u32, x: u32, y: u32) -> f64 {
        let [c, along_x, along_y] = self.records[record as usize].key;
        c + along_x * f64::from(x) + along_y * f64::from(y)
    }

    /// Keeps hits of some of eight rays from column `x` of row `y`.
    pub(crate) fn put_some(
        &mut self,
        (x, y): (u32, u32),
        rays: u64,
        bounds: [&[f32; LANES]; 2],
        record: u32,
    ) {
        let numbers = eight_mut(&mut self.nearest[y as usize % SIDE], x);
        for (number, &bit) in numbers.iter_mut().zip(&LANE_BITS) {
            *number = if rays as u32 & bit == bit { record } else { *number };
        }
        self.keys.put_some((x, y), rays, bounds);
    }

    /// Keeps a hit.
    pub(crate) fn put(&mut self, x: u32, y: u32, Candidate { lo, hi, record }: Candidate) {
        self.nearest[y as usize][x as usize] = record;
        self.keys.put(x, y, [lo, hi]);
    }
}
