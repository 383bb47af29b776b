//! Objects divided by cost, in up to eight parts.
//!
//! The part with the largest surface is divided in two, again and again, until there are eight or all are leaves. It is
//! divided at the plane across one of the axes, out of [`BINS`] − 1 each, with the least A₁w(n₁) + A₂w(n₂): A are the
//! surfaces of the boxes, to which the number of rays that meet them is proportional, and w(n) = n + 3⌈n/8⌉ is what n
//! objects cost, eight by eight. Without the second term leaves have 5.8 objects instead of 6.5, and rays meet as many
//! nodes and leaves (0.97 to 1.01 times). Which part is divided next, by surface or by surface and number, changes
//! nothing beyond 3 %.
//!
//! Of many objects a sample of [`SAMPLE`] decides.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Jeffrey
//! Goldsmith and John Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987 (cost).

use std::ops::Range;

use fearless_simd::{Level, dispatch, f32x4, i32x4, prelude::*};

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::cull_space::CullingSpace;
use crate::simd::lanes::{LANES, Narrow};

/// Objects of a leaf, and parts that objects are divided into.
pub(crate) const FANOUT: usize = LANES;
/// Planes that are tried across each axis, and one.
const BINS: usize = 16;
/// What all centres within count as one point: bins would have no width in f32.
const LEAST_EXTENT: f32 = 1e-30;
/// Objects that decide where many are divided, at most twice as many.
const SAMPLE: usize = 1 << 11;
/// Objects that two threads divide.
pub(crate) const MANY: usize = 1 << 12;

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

/// Consecutive objects, and half the surface of their box.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    pub(crate) objects: Range<usize>,
    pub(crate) bounds: Aabb,
    area: f32,
}

impl Section {
    #[inline(always)]
    fn new<S: Simd>(simd: S, items: &[Item], objects: Range<usize>) -> Self {
        let mut bounds = Narrow::simd_from(simd, f32::INFINITY);
        for item in &items[objects.clone()] {
            bounds = bounds.min(Narrow::load_array_ref(simd, &item.0));
        }
        let [x0, y0, z0, _, x1, y1, z1, _] = bounds.to_array();
        Self { objects, bounds: Aabb { lo: [x0, y0, z0], hi: [-x1, -y1, -z1] }, area: area(bounds) }
    }
}

/// Brings objects into an order in which up to eight parts are consecutive. By number alone if told so: then no part
/// has more than about an eighth. Two threads share in dividing many.
pub(crate) fn divide(level: Level, items: &mut [Item], by_number: bool) -> Vec<Section> {
    if items.len() <= MANY {
        return dispatch!(level, simd => divide_greedily(simd, items, FANOUT, by_number));
    }
    let middle = dispatch!(level, simd => divide_in_two(simd, items, by_number));
    let (left, right) = items.split_at_mut(middle);
    let half = |items| dispatch!(level, simd => divide_greedily(simd, items, FANOUT / 2, by_number));
    let (mut sections, more) = rayon::join(|| half(left), || half(right));
    sections.extend(more.into_iter().map(|section| Section {
        objects: section.objects.start + middle..section.objects.end + middle,
        ..section
    }));
    sections
}

/// Divides the largest part in two until there are so many.
#[inline(always)]
fn divide_greedily<S: Simd>(simd: S, items: &mut [Item], parts: usize, by_number: bool) -> Vec<Section> {
    let mut sections = Vec::with_capacity(FANOUT);
    sections.push(Section::new(simd, items, 0..items.len()));
    while sections.len() < parts {
        let (mut largest, mut size) = (None, -1.0);
        for (place, section) in sections.iter().enumerate() {
            let of_section = if by_number { section.objects.len() as f32 } else { section.area };
            if section.objects.len() > FANOUT && of_section > size {
                (largest, size) = (Some(place), of_section);
            }
        }
        let Some(place) = largest else { break };
        let objects = sections[place].objects.clone();
        let middle = objects.start + divide_in_two(simd, &mut items[objects.clone()], by_number);
        sections[place] = Section::new(simd, items, objects.start..middle);
        sections.push(Section::new(simd, items, middle..objects.end));
    }
    sections
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

    /// Where an object of those that the binning is over lies, in bins: in [0, [`BINS`]).
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

/// Brings objects into an order in which those of two parts are consecutive, and tells how many are in the first.
#[inline(always)]
fn divide_in_two<S: Simd>(simd: S, items: &mut [Item], by_number: bool) -> usize {
    let step = items.len().div_ceil(2 * SAMPLE);
    let binning = Binning::over(simd, items, step);
    let mut bins = Bins { bounds: [[[f32::INFINITY; LANES]; BINS]; 3], counts: [[0; BINS]; 3] };
    for item in items.iter().step_by(step) {
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
    let mut best: Option<Division> = None;
    for axis in 0..3 {
        best_across(simd, axis, &bins, &mut best);
    }
    let Some(Division { axis, bin, .. }) = best.filter(|_| !by_number) else {
        return in_halves(items, binning.bins_per_unit.to_array());
    };
    let (lo, bins_per_unit) = (binning.lo.to_array()[axis], binning.bins_per_unit.to_array()[axis]);
    // Each is exchanged, in place or not: a branch would be guessed wrong half of the time.
    let mut kept = 0;
    for index in 0..items.len() {
        let item = items[index];
        items.swap(index, kept);
        kept += usize::from((item.centre(axis) - lo) * bins_per_unit < bin as f32);
    }
    kept
}

/// Divides by number across the longest axis, where all centres are one point.
fn in_halves(items: &mut [Item], bins_per_unit: [f32; 4]) -> usize {
    let count = items.len() / 2;
    let axis = (0..3).min_by(|&a, &b| bins_per_unit[a].total_cmp(&bins_per_unit[b])).unwrap_or(0);
    let across = |one: &Item, other: &Item| one.centre(axis).total_cmp(&other.centre(axis));
    items.select_nth_unstable_by(count, across);
    count
}

/// What so many objects cost.
fn work(objects: u32) -> f32 {
    (objects + 3 * objects.div_ceil(FANOUT as u32)) as f32
}

/// The best division across one axis, where it is better. Both sides have objects.
#[inline(always)]
fn best_across<S: Simd>(simd: S, axis: usize, bins: &Bins, best: &mut Option<Division>) {
    let mut costs = [f32::INFINITY; BINS];
    let (mut bounds, mut count) = (Narrow::simd_from(simd, f32::INFINITY), 0);
    for (index, cost) in costs.iter_mut().enumerate().skip(1) {
        bounds = bounds.min(Narrow::load_array_ref(simd, &bins.bounds[axis][index - 1]));
        count += bins.counts[axis][index - 1];
        if count > 0 {
            *cost = area(bounds) * work(count);
        }
    }
    let (mut bounds, mut count) = (Narrow::simd_from(simd, f32::INFINITY), 0);
    for (bin, cost) in costs.iter().enumerate().skip(1).rev() {
        bounds = bounds.min(Narrow::load_array_ref(simd, &bins.bounds[axis][bin]));
        count += bins.counts[axis][bin];
        let cost = cost + area(bounds) * work(count);
        if count > 0 && best.is_none_or(|best| cost < best.cost) && cost < f32::INFINITY {
            *best = Some(Division { axis, bin, cost });
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
