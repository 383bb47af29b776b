//! Hierarchical z: what lies behind all rays of a block of a tile is hidden from them.
//!
//! Keys are greater where things are nearer. Each block of 8x8 columns and rows keeps a lower bound of its rays' keys.
//! A bound that is out of date is still one, so it is refreshed now and then only, by rows of blocks.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use std::ops::Range;

use fearless_simd::prelude::*;

use crate::intersect::pencil::rect::{Rect, TILE_SIDE};
use crate::simd::lanes::{LANES, Narrow, least_of};

/// Rays along one side of a block: as many as there are lanes.
pub(crate) const BLOCK_SIDE: u32 = 8;
/// Blocks along one side of a tile: as many as there are lanes.
pub(crate) const TILE_BLOCKS: u32 = TILE_SIDE / BLOCK_SIDE;

/// The farthest of the blocks of a tile.
#[derive(Debug)]
pub(crate) struct HierarchicalZ {
    /// Per block, a lower bound of its rays' keys.
    far: [[f32; LANES]; TILE_BLOCKS as usize],
    /// Rows of blocks whose bounds may be out of date.
    stale: u64,
    /// The least of `far`.
    farthest: f32,
}

impl HierarchicalZ {
    /// Nothing is hidden.
    pub(crate) fn new() -> Self {
        let nothing = f32::NEG_INFINITY;
        Self {
            far: [[nothing; LANES]; TILE_BLOCKS as usize],
            stale: u64::MAX >> (u64::BITS - TILE_BLOCKS),
            farthest: nothing,
        }
    }

    /// Notes that the bounds of some rows of rays may be out of date.
    #[inline(always)]
    pub(crate) fn mark_stale(&mut self, rows: Range<u32>) {
        let (first, last) = (rows.start / BLOCK_SIDE, (rows.end - 1) / BLOCK_SIDE);
        self.stale |= (2 << last) - (1 << first);
    }

    /// The rows of blocks, as bits, that are to be brought up to date by [`HierarchicalZ::set`].
    #[inline(always)]
    pub(crate) fn take_stale(&mut self) -> u64 {
        std::mem::take(&mut self.stale)
    }

    /// Sets the bound of a block; [`HierarchicalZ::sum_up`] is to follow.
    #[inline(always)]
    pub(crate) fn set(&mut self, bx: usize, by: usize, far: f32) {
        self.far[by % LANES][bx % LANES] = far;
    }

    /// Finds the least of all bounds.
    #[inline(always)]
    pub(crate) fn sum_up<S: Simd>(&mut self, simd: S) {
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
}
