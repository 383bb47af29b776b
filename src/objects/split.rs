//! Objects divided in two at the plane of least cost.
//!
//! The cost of a division is A₁w(n₁) + A₂w(n₂): A are the surfaces of the boxes, to which the number of rays that meet
//! them is proportional, and w(n) = n + 3⌈n/l⌉ is what n objects cost that are tested in leaves of l. Planes at equal
//! distances across each axis are tried, [`BINS`] − 1 each; of many objects a sample of [`SAMPLE`] decides.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Jeffrey
//! Goldsmith and John Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987 (cost).

use fearless_simd::{f32x4, i32x4, prelude::*};

use crate::geometry::aabb::Aabb;
use crate::simd::lanes::{LANES, Narrow};

/// Planes that are tried across each axis, and one.
const BINS: usize = 16;
/// What all centres within count as one point: bins would have no width in f32.
const LEAST_EXTENT: f32 = 1e-30;
/// Objects that decide where many are divided, at most twice as many.
const SAMPLE: usize = 1 << 11;

/// An object while it is sorted: its box as [lo, id, −hi, 0]. So one minimum unites two boxes.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(crate) struct Item([f32; LANES]);

impl Item {
    /// An object with its box, which it may keep in any unit that does not overflow when two sides are added.
    pub(crate) fn new(bounds: &Aabb, id: u32) -> Self {
        let Aabb { lo: [x0, y0, z0], hi: [x1, y1, z1] } = *bounds;
        // The id is only ever copied.
        Self([x0, y0, z0, f32::from_bits(id), -x1, -y1, -z1, 0.0])
    }

    pub(crate) fn id(&self) -> u32 {
        self.0[3].to_bits()
    }

    /// Twice the centre along an axis.
    #[inline(always)]
    fn centre(&self, axis: usize) -> f32 {
        self.0[axis & 3] - self.0[axis & 3 | 4]
    }

    /// Twice the centre, and a number without meaning.
    #[inline(always)]
    fn centre_lanes<S: Simd>(&self, simd: S) -> f32x4<S> {
        let (lo, minus_hi) = Narrow::load_array_ref(simd, &self.0).split();
        lo - minus_hi
    }
}

/// The box around some objects, and half its surface; 0 for the empty one.
#[inline(always)]
pub(crate) fn bounds_and_area<S: Simd>(simd: S, items: &[Item]) -> (Aabb, f32) {
    let mut bounds = Narrow::simd_from(simd, f32::INFINITY);
    for item in items {
        bounds = bounds.min(Narrow::load_array_ref(simd, &item.0));
    }
    let [x0, y0, z0, _, x1, y1, z1, _] = bounds.to_array();
    (Aabb { lo: [x0, y0, z0], hi: [-x1, -y1, -z1] }, area(bounds))
}

/// Brings objects into an order in which those of two parts are consecutive, at the plane of least cost with leaves of
/// so many objects; tells how many are in the first part. `None` where there is no such plane: all centres are one
/// point, or `fits` refuses all. It is asked about the number of objects in both parts, of which every `step`-th was
/// counted.
#[inline(always)]
pub(crate) fn divide_by_cost<S: Simd>(
    simd: S,
    items: &mut [Item],
    leaf: usize,
    fits: impl Fn([u32; 2], usize) -> bool,
) -> Option<usize> {
    let step = step_of(items);
    let binning = Binning::over(simd, items, step);
    let bins = Bins::of(simd, items, step, binning);
    let mut best: Option<Division> = None;
    for axis in 0..3 {
        bins.best_across(simd, axis, leaf as u32, |counts| fits(counts, step), &mut best);
    }
    let Division { axis, bin, .. } = best?;
    let (lo, bins_per_unit) = (binning.lo.to_array()[axis], binning.bins_per_unit.to_array()[axis]);
    // Each is exchanged, in place or not: a branch would be guessed wrong half of the time.
    let mut kept = 0;
    for index in 0..items.len() {
        let item = items[index];
        items.swap(index, kept);
        kept += usize::from((item.centre(axis) - lo) * bins_per_unit < bin as f32);
    }
    Some(kept)
}

/// Brings objects into an order in which so many are the first part, across the axis where their centres reach farthest.
#[inline(always)]
pub(crate) fn divide_by_number<S: Simd>(simd: S, items: &mut [Item], count: usize) {
    let binning = Binning::over(simd, items, step_of(items));
    let bins_per_unit = binning.bins_per_unit.to_array();
    let across = |axis: usize| if bins_per_unit[axis] > 0.0 { bins_per_unit[axis] } else { f32::INFINITY };
    let axis = (0..3).min_by(|&a, &b| across(a).total_cmp(&across(b))).unwrap_or(0);
    items.select_nth_unstable_by(count, |one, other| one.centre(axis).total_cmp(&other.centre(axis)));
}

/// Of how many objects one is counted.
fn step_of(items: &[Item]) -> usize {
    items.len().div_ceil(2 * SAMPLE)
}

/// A division of objects: those in bins below one, across an axis.
#[derive(Debug, Clone, Copy)]
struct Division {
    axis: usize,
    bin: usize,
    cost: f32,
}

/// How centres become bins.
#[derive(Clone, Copy)]
struct Binning<S: Simd> {
    lo: f32x4<S>,
    /// 0 across an axis on which all centres are one point.
    bins_per_unit: f32x4<S>,
}

impl<S: Simd> Binning<S> {
    #[inline(always)]
    fn over(simd: S, items: &[Item], step: usize) -> Self {
        let mut lo = f32x4::simd_from(simd, f32::INFINITY);
        let mut hi = -lo;
        for item in items.iter().step_by(step) {
            let centre = item.centre_lanes(simd);
            (lo, hi) = (lo.min(centre), hi.max(centre));
        }
        let extent = hi - lo;
        let (zero, bins) = (f32x4::simd_from(simd, 0.0), f32x4::simd_from(simd, BINS as f32 * 0.9999));
        Self { lo, bins_per_unit: extent.simd_gt(zero + LEAST_EXTENT).select(bins / extent, zero) }
    }
}

/// Bins across the three axes: what their objects cover, as of [`Item`], and how many they are.
struct Bins {
    bounds: [[[f32; LANES]; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    #[inline(always)]
    fn of<S: Simd>(simd: S, items: &[Item], step: usize, binning: Binning<S>) -> Self {
        let mut bins = Self { bounds: [[[f32::INFINITY; LANES]; BINS]; 3], counts: [[0; BINS]; 3] };
        for item in items.iter().step_by(step) {
            let bounds = Narrow::load_array_ref(simd, &item.0);
            let place = (item.centre_lanes(simd) - binning.lo) * binning.bins_per_unit;
            let [x, y, z, _] = place.to_int::<i32x4<S>>().to_array();
            for (axis, bin) in [x, y, z].into_iter().enumerate() {
                // In range, and known to be.
                let bin = bin as usize % BINS;
                let union = &mut bins.bounds[axis][bin];
                Narrow::load_array_ref(simd, union).min(bounds).store_slice(union);
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    /// The best division across one axis, where it is better. Both sides have objects.
    #[inline(always)]
    fn best_across<S: Simd>(
        &self,
        simd: S,
        axis: usize,
        leaf: u32,
        fits: impl Fn([u32; 2]) -> bool,
        best: &mut Option<Division>,
    ) {
        let work = |objects: u32| (objects + 3 * objects.div_ceil(leaf)) as f32;
        let mut costs = [f32::INFINITY; BINS];
        let (mut bounds, mut below) = (Narrow::simd_from(simd, f32::INFINITY), 0);
        for (index, cost) in costs.iter_mut().enumerate().skip(1) {
            bounds = bounds.min(Narrow::load_array_ref(simd, &self.bounds[axis][index - 1]));
            below += self.counts[axis][index - 1];
            if below > 0 {
                *cost = area(bounds) * work(below);
            }
        }
        let total = below + self.counts[axis][BINS - 1];
        let (mut bounds, mut count) = (Narrow::simd_from(simd, f32::INFINITY), 0);
        for (bin, cost) in costs.iter().enumerate().skip(1).rev() {
            bounds = bounds.min(Narrow::load_array_ref(simd, &self.bounds[axis][bin]));
            count += self.counts[axis][bin];
            let cost = cost + area(bounds) * work(count);
            let is_better = best.is_none_or(|best| cost < best.cost) && cost < f32::INFINITY;
            if count > 0 && is_better && fits([total - count, count]) {
                *best = Some(Division { axis, bin, cost });
            }
        }
    }
}

/// Half the surface of a box as of [`Item`]; 0 for the empty one.
#[inline(always)]
fn area<S: Simd>(bounds: Narrow<S>) -> f32 {
    let (lo, minus_hi) = bounds.split();
    let [x, y, z, _] = (-(lo + minus_hi)).to_array();
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}
