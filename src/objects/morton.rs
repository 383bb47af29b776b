//! Orders triangles, or receivers, along a space-filling curve, in linear time.
//!
//! A triangle counts by its first corner. Cells of 32³ over the box of all positions are numbered along Lebesgue's
//! (Morton's) curve. A counting sort, in parallel over chunks of the order given, brings the items into the order of
//! cells; cells that hold many are sorted by finer cells of their own. Memory: 4 bytes per item for the permutation and
//! 128 KiB per chunk; cells are computed twice instead of kept. For receivers see
//! [`crate::intersect::irregular::order`] and [`crate::rays::point_order`].
//!
//! Until the end the permutation holds the finer cell above the bits of the id, as far as there is room: sorting a cell
//! then reads nothing else. Up to 8 million items all nine bits fit.
//!
//! Reading the finer cells from the positions once more took as long as all the rest (koala, two threads: 1.4 of 2.9
//! ms), since neighbours on the curve are strangers in memory.
//!
//! The order changes time only, never a hit: (t, id) is a total order.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966; Christian Lauterbach et al., "Fast BVH
//! Construction on GPUs", 2009 (Morton order of triangles).

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};

use fearless_simd::{Level, dispatch, prelude::*, u32x8};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::objects::gather::first_corners;
use crate::simd::lanes::{LANES, Narrow};

/// Bits of a cell number, and of a finer cell's within it.
pub(crate) const CELL_BITS: u32 = 15;
pub(crate) const FINE_BITS: u32 = 9;
/// Cells.
const CELLS: usize = 1 << CELL_BITS;
/// The most chunks that are counted side by side.
const MAX_CHUNKS: usize = 8;

/// Items with numbers along a curve.
pub(crate) trait OnCurve: Sync {
    /// Cells with at most this many items are left in the order given.
    const FEW: usize;

    /// Numbers of [`CELL_BITS`] + [`FINE_BITS`] bits of eight items from one on; the last one may be repeated.
    fn places<S: Simd>(&self, simd: S, first: u32) -> [u32; LANES];
}

/// Bytes that ordering takes at its peak, the permutation included.
pub(crate) fn bytes_for(items: usize) -> usize {
    let chunks = rayon::current_num_threads().min(MAX_CHUNKS);
    items * size_of::<u32>() + (chunks + 1) * CELLS * size_of::<u32>()
}

/// The triangles in the order of a curve.
pub(crate) fn of_triangles(triangles: &Triangles<'_>, level: Level) -> Vec<u32> {
    let cells = Cells::over(&triangles.position_bounds());
    along_curve(&FirstCorners { triangles, cells }, triangles.len(), level)
}

/// Items in the order of their curve.
pub(crate) fn along_curve<I: OnCurve>(items: &I, total: usize, level: Level) -> Vec<u32> {
    let threads = rayon::current_num_threads().min(MAX_CHUNKS);
    let chunk = total.div_ceil(threads).next_multiple_of(LANES);
    // In range: there are fewer than 2³² items.
    let ids_of = |index: usize| (index * chunk) as u32..((index + 1) * chunk).min(total) as u32;

    // Count each chunk's items per cell.
    let count_chunk = |index: usize| {
        let mut counts = vec![0_u32; CELLS];
        dispatch!(level, simd => count(simd, items, ids_of(index), &mut counts));
        counts
    };
    let chunks = total.div_ceil(chunk.max(1));
    let mut chunks: Vec<Vec<u32>> = (0..chunks).into_par_iter().map(count_chunk).collect();

    // The first place of each chunk's items of each cell.
    let (mut next, mut ends) = (0, Vec::with_capacity(CELLS));
    for cell in 0..CELLS {
        for counts in &mut chunks {
            next += std::mem::replace(&mut counts[cell], next);
        }
        ends.push(next);
    }

    // Every place is written once. Relaxed stores are plain ones; they let chunks write side by side.
    let order: Vec<AtomicU32> = (0..total).map(|_| AtomicU32::new(0)).collect();
    let packing = Packing::of(total);
    chunks.par_iter_mut().enumerate().for_each(|(index, next)| {
        dispatch!(level, simd => scatter(simd, items, ids_of(index), next, packing, &order));
    });
    let mut order: Vec<u32> = order.into_iter().map(AtomicU32::into_inner).collect();
    sort_within_cells(&mut order, &ends, I::FEW);
    order.par_iter_mut().with_min_len(1 << 14).for_each(|id| *id &= packing.ids);
    order
}

/// Counts items per cell.
#[inline(always)]
fn count<S: Simd>(simd: S, items: &impl OnCurve, ids: std::ops::Range<u32>, counts: &mut [u32]) {
    for first in ids.clone().step_by(LANES) {
        let places = items.places(simd, first);
        for place in &places[..LANES.min((ids.end - first) as usize)] {
            counts[(place >> FINE_BITS) as usize % CELLS] += 1;
        }
    }
}

/// Brings items to the places that are next in their cells.
#[inline(always)]
fn scatter<S: Simd>(
    simd: S,
    items: &impl OnCurve,
    ids: std::ops::Range<u32>,
    next: &mut [u32],
    packing: Packing,
    order: &[AtomicU32],
) {
    for first in ids.clone().step_by(LANES) {
        let places = items.places(simd, first);
        for (id, place) in (first..ids.end).zip(places) {
            let next = &mut next[(place >> FINE_BITS) as usize % CELLS];
            let fine = place & ((1 << FINE_BITS) - 1);
            order[*next as usize].store(packing.pack(fine, id), Ordering::Relaxed);
            *next += 1;
        }
    }
}

/// Sorts the items of each cell that holds many by (finer cell, id), in parallel over disjoint cells.
fn sort_within_cells(order: &mut [u32], ends: &[u32], few: usize) {
    let (mut rest, mut start) = (order, 0);
    let mut slices = Vec::new();
    for &end in ends {
        let (cell, after) = rest.split_at_mut((end - start) as usize);
        (rest, start) = (after, end);
        if cell.len() > few {
            slices.push(cell);
        }
    }
    slices.into_par_iter().with_min_len(16).for_each(|cell: &mut [u32]| cell.sort_unstable());
}

/// How a finer cell and an id share a u32.
#[derive(Debug, Clone, Copy)]
struct Packing {
    /// The bits of ids.
    ids: u32,
    /// The finer cell loses its last bits where ids need them,
    lost: u32,
    /// and stands above this many bits.
    shift: u32,
}

impl Packing {
    /// For the ids of so many items.
    fn of(items: usize) -> Self {
        // In range: at most 32.
        let shift = (usize::BITS - items.leading_zeros()).min(u32::BITS - 1);
        let lost = (FINE_BITS).saturating_sub(u32::BITS - shift);
        let ids = if items >> shift == 0 { (1 << shift) - 1 } else { u32::MAX };
        Self { ids, lost, shift }
    }

    /// A finer cell with an id.
    fn pack(self, fine: u32, id: u32) -> u32 {
        if self.ids == u32::MAX { id } else { fine >> self.lost << self.shift | id }
    }
}

/// Cubic cells over a box, numbered along the curve. f32 is fine enough.
pub(crate) struct Cells {
    lo: [f32; 3],
    per_unit: f32,
}

impl Cells {
    /// 256 fine cells along the longest side.
    pub(crate) fn over(bounds: &Aabb) -> Self {
        let longest = bounds.extent()[bounds.longest_axis()];
        let per_unit = if longest > 0.0 { 256.0 / longest } else { 0.0 };
        Self { lo: bounds.lo, per_unit: per_unit as f32 }
    }

    /// The numbers of eight points; what lies outside counts for the cells at the border.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(&self, simd: S, points: [Narrow<S>; 3]) -> [u32; LANES] {
        let mut cells = points;
        for (k, x) in cells.iter_mut().enumerate() {
            *x = (*x - self.lo[k]) * self.per_unit;
        }
        numbers(simd, cells, 0xFF)
    }
}

/// The numbers of eight cells along the curve, up to 2ᵏ − 1 = `last` ≤ 255 on each axis; what lies outside counts for
/// the cells at the border.
#[inline(always)]
pub(crate) fn numbers<S: Simd>(simd: S, cells: [Narrow<S>; 3], last: u32) -> [u32; LANES] {
    let mut numbers = u32x8::simd_from(simd, 0);
    for (k, cell) in cells.into_iter().enumerate() {
        let cell = cell.max(0.0).min(Narrow::simd_from(simd, last as f32));
        // NaN, from numbers beyond f32, is some number: the mask keeps it inside.
        numbers |= spread(u32x8::truncate_from(cell) & last) << (2 - k as u32);
    }
    numbers.to_array()
}

/// Triangles, by their first corners.
struct FirstCorners<'a> {
    triangles: &'a Triangles<'a>,
    cells: Cells,
}

impl OnCurve for FirstCorners<'_> {
    /// One or two runs.
    const FEW: usize = 32;

    #[inline(always)]
    fn places<S: Simd>(&self, simd: S, first: u32) -> [u32; LANES] {
        self.cells.places(simd, first_corners(simd, self.triangles, first))
    }
}

/// Bit k of a number of 8 bits moves to bit 3k.
#[inline(always)]
fn spread<S: Simd>(x: u32x8<S>) -> u32x8<S> {
    let x = (x | x << 8) & 0x0000_F00F;
    let x = (x | x << 4) & 0x000C_30C3;
    (x | x << 2) & 0x0024_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::isa::Isa;

    fn ordered(positions: &[[f32; 3]], indices: &[[u32; 3]]) -> Vec<u32> {
        let triangles = Triangles::new(positions, indices).expect("valid triangles");
        of_triangles(&triangles, Isa::Auto.level().expect("every machine has one"))
    }

    #[test]
    fn cells_are_numbered_along_the_curve() {
        let positions = [[0.0, 0.0, 0.0], [8.0, 8.0, 8.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]];
        let indices: Vec<[u32; 3]> = (0..5).map(|i| [i; 3]).collect();
        assert_eq!(ordered(&positions, &indices), [0, 4, 3, 2, 1]);
    }

    #[test]
    fn finer_cells_order_those_that_hold_many() {
        // One cell of 32³, its finer cells from the last to the first; a far corner sets the scale.
        let count = 200_u16;
        let positions: Vec<[f32; 3]> =
            (1..=count).map(|i| [f32::from(count - i) / 30.0, 0.0, 0.0]).chain([[256.0; 3]]).collect();
        let indices: Vec<[u32; 3]> = (0..=u32::from(count)).map(|i| [i; 3]).collect();
        let order = ordered(&positions, &indices);
        let cells: Vec<u32> = order.iter().map(|&id| positions[id as usize][0] as u32).collect();
        assert!(cells.is_sorted(), "{cells:?}");
    }

    #[test]
    fn order_is_a_permutation() {
        let positions: Vec<[f32; 3]> =
            (0..999_u16).map(|i| [f32::from(i * 37 % 101), f32::from(i % 7), 0.0]).collect();
        let indices: Vec<[u32; 3]> = (0..997).map(|i| [i, i + 1, i + 2]).collect();
        let mut order = ordered(&positions, &indices);
        order.sort_unstable();
        assert!(order.into_iter().eq(0..997));
    }

    #[test]
    fn packing_gives_back_the_id() {
        for triangles in [1, 2, 1000, (1 << 23) - 1, 1 << 23, 1 << 31, (1 << 32) - 1] {
            let packing = Packing::of(triangles);
            let last = (triangles - 1) as u32;
            for id in [0, last / 2, last] {
                assert_eq!(packing.pack(511, id) & packing.ids, id);
            }
        }
    }
}
