//! Bounds of the depth keys of a tile's rays, and the farthest of its blocks.
//!
//! Each ray keeps an interval of f32 that holds the key (greater is nearer) of what it has hit. The farthest of a
//! block, see [`crate::intersect::grid::hierarchical_z`], is known only once all of its rays have hit something.
//!
//! Based on: Edwin Catmull, "A Subdivision Algorithm for Computer Display of Curved Surfaces", 1974 (the z-buffer).

use fearless_simd::prelude::*;

use crate::intersect::grid::hierarchical_z::HierarchicalZ;
use crate::intersect::pencil::rect::TILE_SIDE;
use crate::simd::lanes::{LANES, Narrow, NarrowMask, bits, least_of};

/// The bit of each of eight rays.
pub(crate) const LANE_BITS: [u32; LANES] = [1, 2, 4, 8, 16, 32, 64, 128];

/// Rays along one side of a tile.
pub(crate) const SIDE: usize = TILE_SIDE as usize;

/// How near the rays of a tile have hit something so far, row by row.
#[derive(Debug)]
pub(crate) struct TileKeys {
    /// Bounds of each ray's key: −∞ for none, +∞ where nothing more matters.
    lo: [[f32; SIDE]; SIDE],
    hi: [[f32; SIDE]; SIDE],
    /// Per row, the rays that have hit something.
    pub(crate) covered: [u64; SIDE],
    /// The farthest of the blocks.
    pub(crate) blocks: HierarchicalZ,
    /// Columns and rows.
    size: [u32; 2],
    /// Whether all of the above is ready: it is not before some triangle may have met a ray.
    pub(crate) ready: bool,
}

impl TileKeys {
    /// Bounds for no rays; [`TileKeys::clear`] and [`TileKeys::make_ready`] ready them.
    pub(crate) fn new() -> Self {
        Self {
            lo: [[0.0; SIDE]; SIDE],
            hi: [[0.0; SIDE]; SIDE],
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

    /// Readies the bounds.
    #[inline(never)]
    pub(crate) fn make_ready(&mut self) {
        self.lo.fill([f32::NEG_INFINITY; SIDE]);
        self.hi.fill([f32::NEG_INFINITY; SIDE]);
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

    /// Keeps bounds for some of eight rays from column `x` of row `y`, the others having the second of the bounds. The
    /// row of blocks is to be told by [`HierarchicalZ::mark_stale`].
    #[inline(always)]
    pub(crate) fn keep<S: Simd>(
        &mut self,
        (x, y): (u32, u32),
        mask: NarrowMask<S>,
        [lo, hi]: [[Narrow<S>; 2]; 2],
    ) {
        let row = y as usize % SIDE;
        mask.select(lo[0], lo[1]).store_slice(eight_mut(&mut self.lo[row], x));
        mask.select(hi[0], hi[1]).store_slice(eight_mut(&mut self.hi[row], x));
        self.cover(x, y, mask.to_bitmask());
    }

    /// Bounds of the key of one ray.
    #[inline(always)]
    pub(crate) fn at(&self, x: u32, y: u32) -> [f32; 2] {
        let (x, y) = (x as usize % SIDE, y as usize % SIDE);
        [self.lo[y][x], self.hi[y][x]]
    }

    /// Keeps bounds for some of eight rays from column `x` of row `y`.
    pub(crate) fn put_some(&mut self, (x, y): (u32, u32), rays: u64, [lo, hi]: [&[f32; LANES]; 2]) {
        let row = y as usize % SIDE;
        for (kept, new) in [(&mut self.lo[row], lo), (&mut self.hi[row], hi)] {
            for ((kept, &new), &bit) in eight_mut(kept, x).iter_mut().zip(new).zip(&LANE_BITS) {
                *kept = if rays as u32 & bit == bit { new } else { *kept };
            }
        }
        self.cover(x, y, rays);
    }

    /// Keeps bounds for one ray.
    #[inline(always)]
    pub(crate) fn put(&mut self, x: u32, y: u32, [lo, hi]: [f32; 2]) {
        let (column, row) = (x as usize % SIDE, y as usize % SIDE);
        (self.lo[row][column], self.hi[row][column]) = (lo, hi);
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
pub(crate) fn eight_mut<T>(row: &mut [T; SIDE], x: u32) -> &mut [T] {
    let x = (x as usize).min(SIDE - LANES);
    &mut row[x..x + LANES]
}
