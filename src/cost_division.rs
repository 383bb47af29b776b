//! Objects divided by cost, again and again, down to groups of eight.
//!
//! Objects are divided at the plane across one of the axes, out of [`BINS`] − 1 each, with the least n₁A₁ + n₂A₂: A are the
//! surfaces of the boxes, to which the number of rays that meet them is proportional. Only planes count that leave both sides room.
//! With half the planes for 64 objects and fewer, dividing took the same time, within 5 %; more room helps some scenes and
//! slows others (sponza, chess), as their numbers happen to fill the levels.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Jeffrey Goldsmith and
//! John Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987 (cost).

use fearless_simd::{Level, dispatch, f32x4, i32x4, prelude::*};

use crate::culling_space::CullingSpace;
use crate::lanes::{LANES, Narrow};
use crate::{Aabb, Triangles};

/// Objects of a group, and children of a node.
pub(crate) const FANOUT: usize = LANES;
/// Places per triangle, in sixteenths: room to divide where it is best instead of where a group is full.
const ROOM: usize = 21;
/// Planes that are tried across each axis, and one.
const BINS: usize = 16;
/// What all centres within count as one point: bins would have no width in f32.
const LEAST_EXTENT: f32 = 1e-30;
/// Objects that are divided in parallel.
const PARALLEL: usize = 1 << 12;

/// Children of a capacity that so many objects are given.
pub(crate) fn children_for(objects: usize, capacity: usize) -> usize {
    (objects * ROOM / 16).div_ceil(capacity).max(1)
}

/// A triangle while it is sorted: the box [lo, id, −hi, 0] in the culling space. So one minimum unites two boxes.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Item([f32; LANES]);

impl Item {
    pub(crate) fn new(triangles: &Triangles<'_>, space: &CullingSpace, id: u32) -> Self {
        let Aabb { lo: [x0, y0, z0], hi: [x1, y1, z1] } = space.aabb(&triangles.bounds(id));
        // The id is only ever copied.
        Self([x0, y0, z0, f32::from_bits(id), -x1, -y1, -z1, 0.0])
    }

    fn id(&self) -> u32 {
        self.0[3].to_bits()
    }

    /// Twice the centre.
    fn centre(&self) -> [f32; 3] {
        [0, 1, 2].map(|k| self.0[k] - self.0[k + 4])
    }

    /// Twice the centre, and a number without meaning.
    #[inline(always)]
    fn centre_lanes<S: Simd>(&self, simd: S) -> f32x4<S> {
        let (lo, minus_hi) = Narrow::load_array_ref(simd, &self.0).split();
        lo - minus_hi
    }
}

/// Divides objects among children of a capacity, as many as there is place for, then each child's among its own.
pub(crate) fn divide(items: &mut [Item], places: &mut [u32], capacity: usize, level: Level) {
    let children = places.len() / capacity;
    if children > 1 {
        let (count, left) = dispatch!(level, simd => best_division(simd, items, children, capacity));
        let (items, more_items) = items.split_at_mut(count);
        let (places, more_places) = places.split_at_mut(left * capacity);
        let parallel = items.len() + more_items.len() > PARALLEL;
        let mut one = || divide(items, places, capacity, level);
        let mut other = || divide(more_items, more_places, capacity, level);
        if parallel {
            rayon::join(one, other);
        } else {
            one();
            other();
        }
    } else if capacity > FANOUT {
        let capacity = capacity / FANOUT;
        let children = children_for(items.len(), capacity).min(FANOUT);
        divide(items, &mut places[..children * capacity], capacity, level);
    } else {
        for (place, item) in places.iter_mut().zip(items) {
            *place = item.id();
        }
    }
}

/// A division of objects: those in bins below one, across an axis.
#[derive(Debug, Clone, Copy)]
struct Division {
    axis: usize,
    bin: usize,
    count: usize,
    cost: f32,
}

/// How centres become bins.
#[derive(Clone, Copy)]
struct Binning<S: Simd> {
    lo: f32x4<S>,
    bins_per_unit: f32x4<S>,
}

impl<S: Simd> Binning<S> {
    #[inline(always)]
    fn over(simd: S, items: &[Item]) -> Self {
        let mut lo = f32x4::simd_from(simd, f32::INFINITY);
        let mut hi = -lo;
        for item in items {
            let centre = item.centre_lanes(simd);
            (lo, hi) = (lo.min(centre), hi.max(centre));
        }
        let extent = hi - lo;
        let (zero, bins) = (f32x4::simd_from(simd, 0.0), f32x4::simd_from(simd, BINS as f32 * 0.9999));
        Self { lo, bins_per_unit: extent.simd_gt(zero + LEAST_EXTENT).select(bins / extent, zero) }
    }

    /// Where an object lies, in bins: in [0, [`BINS`]).
    #[inline(always)]
    fn place(&self, simd: S, item: &Item) -> f32x4<S> {
        (item.centre_lanes(simd) - self.lo) * self.bins_per_unit
    }
}

/// Bins across the three axes: what their objects cover, as of [`Item`], and how many they are.
struct Bins {
    bounds: [[[f32; LANES]; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

/// Brings objects into the best order, and tells how many of them, and of the children, are on the left.
#[inline(always)]
fn best_division<S: Simd>(simd: S, items: &mut [Item], children: usize, capacity: usize) -> (usize, usize) {
    let binning = Binning::over(simd, items);
    let mut bins = Bins { bounds: [[[f32::INFINITY; LANES]; BINS]; 3], counts: [[0; BINS]; 3] };
    for item in &*items {
        let bounds = Narrow::load_array_ref(simd, &item.0);
        let [x, y, z, _] = binning.place(simd, item).to_int::<i32x4<S>>().to_array();
        for (axis, bin) in [x, y, z].into_iter().enumerate() {
            // In range, and known to be.
            let bin = bin as usize % BINS;
            let union = &mut bins.bounds[axis][bin];
            Narrow::load_array_ref(simd, union).min(bounds).store_slice(union);
            bins.counts[axis][bin] += 1;
        }
    }
    // Capacities are powers of two.
    let filled = |count: usize| (count + capacity - 1) >> capacity.trailing_zeros();
    let mut best: Option<Division> = None;
    for axis in 0..3 {
        for division in divisions(simd, axis, &bins) {
            let needed = filled(division.count) + filled(items.len() - division.count);
            let fits = needed <= children && division.count > 0 && division.count < items.len();
            if fits && best.is_none_or(|best| division.cost < best.cost) {
                best = Some(division);
            }
        }
    }
    let Some(Division { axis, bin, count, .. }) = best else {
        return in_halves(items, children, binning.bins_per_unit.to_array());
    };
    let (lo, bins_per_unit) = (binning.lo.to_array()[axis], binning.bins_per_unit.to_array()[axis]);
    // Each is exchanged, in place or not: a branch would be guessed wrong half of the time.
    let mut kept = 0;
    for index in 0..items.len() {
        let place = (items[index].centre()[axis] - lo) * bins_per_unit;
        items.swap(kept, index);
        kept += usize::from(place < bin as f32);
    }
    let (left, right) = (filled(count), filled(items.len() - count));
    let spare = children - left - right;
    (count, left + (spare * count + items.len() / 2) / items.len())
}

/// Divides by number across the longest axis, where no plane fits or all centres are one point.
fn in_halves(items: &mut [Item], children: usize, bins_per_unit: [f32; 4]) -> (usize, usize) {
    let left = children / 2;
    let count = items.len() * left / children;
    let axis = (0..3).min_by(|&a, &b| bins_per_unit[a].total_cmp(&bins_per_unit[b])).unwrap_or(0);
    if count < items.len() {
        let across = |one: &Item, other: &Item| one.centre()[axis].total_cmp(&other.centre()[axis]);
        items.select_nth_unstable_by(count, across);
    }
    (count, left)
}

/// The divisions across one axis, with their costs.
#[inline(always)]
fn divisions<S: Simd>(simd: S, axis: usize, bins: &Bins) -> [Division; BINS - 1] {
    let mut divisions = [Division { axis, bin: 0, count: 0, cost: 0.0 }; BINS - 1];
    let (mut bounds, mut count) = (Narrow::simd_from(simd, f32::INFINITY), 0);
    for (index, division) in divisions.iter_mut().enumerate() {
        bounds = bounds.min(Narrow::load_array_ref(simd, &bins.bounds[axis][index]));
        count += bins.counts[axis][index] as usize;
        (division.bin, division.count, division.cost) = (index + 1, count, area(bounds) * count as f32);
    }
    let (mut bounds, mut count) = (Narrow::simd_from(simd, f32::INFINITY), 0);
    for (index, division) in divisions.iter_mut().enumerate().rev() {
        bounds = bounds.min(Narrow::load_array_ref(simd, &bins.bounds[axis][index + 1]));
        count += bins.counts[axis][index + 1];
        division.cost += area(bounds) * count as f32;
    }
    divisions
}

/// Half the surface of a box as of [`Item`]; 0 for the empty one.
#[inline(always)]
fn area<S: Simd>(bounds: Narrow<S>) -> f32 {
    let (lo, minus_hi) = bounds.split();
    let [x, y, z, _] = (-(lo + minus_hi)).to_array();
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}
