//! The nearest hit of each ray of a tile, while it is worked on, and the farthest of its blocks.
//!
//! Each ray keeps an interval of f32 that holds its depth key (greater is nearer), an id, and the key in f64. The interval
//! decides the order wherever it can; where those of two triangles overlap, the exact order decides. The f64 key gives the
//! distance at the end.
//!
//! Blocks keep a lower bound of their rays' keys: what lies behind it is hidden from all of them. It is known only once all
//! rays of a block have hit something, and a bound that is out of date is still one, so it is refreshed now and then.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use std::mem::size_of;

use fearless_simd::{prelude::*, u32x8};

use crate::depth::{precedes, rounded_distances};
use crate::hits::NO_TRIANGLE;
use crate::lanes::{LANES, LaneMask, Lanes, Narrow, NarrowMask, bits};
use crate::pencil::Origin;
use crate::predicates::Distance;
use crate::ray::Ray;
use crate::triangles::Triangles;
use crate::window::{Rect, Row};

/// Rays along one side of a block: as many as there are lanes.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Rays along one side of a tile: its buffer, 20 bytes per ray, stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;
/// Blocks along one side of a tile: as many as there are lanes.
pub(crate) const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;
/// Blocks of a tile.
const BLOCKS: usize = (TILE_BLOCKS * TILE_BLOCKS) as usize;
/// Rows of eight rays of a tile.
const ROWS: usize = BLOCKS * BLOCK_SIDE as usize;

/// The keys kept in f64 err by no more than this part of themselves, or are NaN: 1 in 4000 distances is then rounded by
/// the exact stage.
pub(crate) const KEY_ERROR: f64 = 1.0 / (1_u64 << 38) as f64;

/// A hit that is to be compared with the nearest one: its key lies in [lo, hi], and is about `key`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileCandidate {
    pub(crate) id: u32,
    pub(crate) lo: f32,
    pub(crate) hi: f32,
    pub(crate) key: f64,
}

/// What the rays of a tile have hit so far, in rows of eight rays.
#[derive(Debug)]
pub(crate) struct TileDepth {
    /// Bounds of each ray's key: −∞ for none, +∞ where nothing more matters.
    lo: Box<[[f32; LANES]; ROWS]>,
    hi: Box<[[f32; LANES]; ROWS]>,
    ids: Box<[[u32; LANES]; ROWS]>,
    /// The keys of rays that have hit something: within [`KEY_ERROR`], or NaN.
    keys: Box<[[f64; LANES]; ROWS]>,
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
    pub(crate) const BYTES: usize =
        ROWS * LANES * (2 * size_of::<f32>() + size_of::<u32>() + size_of::<f64>()) + size_of::<Self>();

    /// A buffer; [`TileDepth::clear`] readies it.
    pub(crate) fn new() -> Self {
        Self {
            lo: Box::new([[0.0; LANES]; ROWS]),
            hi: Box::new([[0.0; LANES]; ROWS]),
            ids: Box::new([[NO_TRIANGLE; LANES]; ROWS]),
            keys: Box::new([[f64::NAN; LANES]; ROWS]),
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
        self.ids.fill([NO_TRIANGLE; LANES]);
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

    /// Notes that some rays of a row have hit something.
    #[inline(always)]
    fn cover(&mut self, row: usize, lanes: u64) {
        let (block, shift) = (row / LANES % BLOCKS, row % LANES * LANES);
        self.covered[block] |= lanes << shift;
        self.stale |= u64::from(self.covered[block] == u64::MAX) << block;
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

    /// Keeps bounds, id and keys for some rays of a row.
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(
        &mut self,
        simd: S,
        row: usize,
        mask: NarrowMask<S>,
        [lo, hi]: [Narrow<S>; 2],
        id: u32,
        keys: Lanes<S>,
    ) {
        let row = row % ROWS;
        let (near_lo, near_hi) = (self.lo(simd, row), self.hi(simd, row));
        mask.select(lo, near_lo).store_slice(&mut self.lo[row]);
        mask.select(hi, near_hi).store_slice(&mut self.hi[row]);
        let ids = u32x8::load_array_ref(simd, &self.ids[row]);
        mask.select(u32x8::simd_from(simd, id), ids).store_slice(&mut self.ids[row]);
        let (low, high) = mask.widen();
        let wide: LaneMask<S> = simd.combine_mask64x4(low, high);
        let near = Lanes::load_array_ref(simd, &self.keys[row]);
        wide.select(keys, near).store_slice(&mut self.keys[row]);
        self.cover(row, mask.to_bitmask());
    }

    /// Keeps the nearer of the candidate and what a ray has hit. `exact` makes the ray; `None` lets keys decide.
    pub(crate) fn offer(
        &mut self,
        (row, lane): (usize, usize),
        candidate: TileCandidate,
        triangles: &Triangles<'_>,
        exact: Option<&dyn Fn() -> Ray>,
        ambiguous: &mut u64,
    ) {
        let (lo, hi) = (self.lo[row][lane], self.hi[row][lane]);
        let (id, key) = (self.ids[row][lane], self.keys[row][lane]);
        let nearer = if id == NO_TRIANGLE || candidate.lo > hi {
            true
        } else if candidate.hi < lo {
            false
        } else if let Some(ray) = exact {
            precedes(&ray(), candidate.id, id, triangles, ambiguous)
        } else if candidate.key.is_nan() || key.is_nan() {
            candidate.lo > lo
        } else {
            candidate.key > key || (candidate.key == key && candidate.id < id)
        };
        if nearer {
            self.put((row, lane), candidate);
        }
    }

    /// Notes that a ray has hit something and that nothing more about it matters.
    pub(crate) fn settle(&mut self, place: (usize, usize), id: u32) {
        self.put(place, TileCandidate { id, lo: f32::INFINITY, hi: f32::INFINITY, key: f64::NAN });
    }

    /// Keeps a candidate.
    fn put(&mut self, (row, lane): (usize, usize), TileCandidate { id, lo, hi, key }: TileCandidate) {
        (self.lo[row][lane], self.hi[row][lane]) = (lo, hi);
        (self.ids[row][lane], self.keys[row][lane]) = (id, key);
        self.cover(row, 1 << lane);
    }

    /// Writes ids and distances of at most eight rays of a row. `ray` makes the ray of a lane.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &self,
        simd: S,
        row: usize,
        (ids, ts): &mut Row<'_>,
        origin: Origin,
        triangles: &Triangles<'_>,
        ray: impl Fn(usize) -> Ray,
    ) {
        let kept = &self.ids[row % ROWS];
        let keys = Lanes::load_array_ref(simd, &self.keys[row % ROWS]);
        let error = keys.abs() * KEY_ERROR;
        let (mut rounded, doubtful) = rounded_distances(simd, keys - error, keys + error, origin);
        let none = u32x8::simd_from(simd, NO_TRIANGLE);
        let missed = u32x8::load_array_ref(simd, kept).simd_eq(none);
        rounded = missed.select(Narrow::simd_from(simd, f32::INFINITY), rounded);
        let doubtful = doubtful & !missed.to_bitmask();
        if let (Ok(ids), Ok(ts)) = (<&mut [u32; LANES]>::try_from(&mut **ids), (&mut **ts).try_into()) {
            let ts: &mut [f32; LANES] = ts;
            (*ids, *ts) = (*kept, rounded.to_array());
        } else {
            ids.copy_from_slice(&kept[..ids.len()]);
            ts.copy_from_slice(&rounded.to_array()[..ids.len()]);
        }
        for lane in bits(doubtful & ((1 << ids.len()) - 1)) {
            ts[lane] = Distance::new(&ray(lane), &triangles.triangle(kept[lane])).rounded();
        }
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
