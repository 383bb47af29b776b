//! The order of the objects, and the shape of the implicit hierarchy over it.
//!
//! Runs of up to 16 triangles are the lowest level, and up to 16 nodes of a level make one of the next: a node's number
//! tells its children, and nothing points anywhere. To divide objects by cost all the same, there is room for [`SPARE`]
//! times as many triangles as there are. A section of the objects, with so many places for nodes, is divided in two at
//! the plane with the least A₁w(n₁) + A₂w(n₂) that leaves both parts room, where A are the surfaces of the boxes and
//! w(n) = n + 3⌈n/16⌉; the section with the largest surface first, until each has one place or fits a run. Sections
//! then go from the largest box to the smallest, as any hit is looked for: what is large ends most rays.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Jeffrey
//! Goldsmith and John Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987 (cost); Thiago Ize and
//! Charles Hansen, "RTSAH Traversal Order for Occlusion Rays", 2011 (occluders that are likely first).

use std::ops::Range;

use fearless_simd::{Level, dispatch, f32x4, f32x8, i32x4, prelude::*};
use rayon::prelude::*;

use crate::geometry::triangles::Triangles;
use crate::objects::runs::RUN;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::WIDTH;

/// Room for triangles, as a multiple of their number: at 46 bytes for each place, boxes and the id while they are
/// copied included, 63 bytes a triangle.
const SPARE: f64 = 1.35;
/// Planes that are tried across each axis, and one.
const BINS: usize = 16;
/// Objects that decide where many are divided, at most twice as many.
const SAMPLE: usize = 1 << 11;
/// Centres within this, as a part of the coordinates' size, count as one point.
const LEAST_EXTENT: f32 = 1e-30;
/// Runs of a section that is divided by a thread of its own.
const MANY_RUNS: usize = 256;

/// How many children the nodes of each level have, from the top. The last level's children are runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fanouts(Vec<usize>);

impl Fanouts {
    /// With room for some triangles and some to spare.
    fn of(triangles: usize) -> Self {
        let runs = ((triangles as f64 * SPARE / RUN as f64) as usize).max(triangles.div_ceil(RUN)).max(1);
        let mut fanouts = vec![WIDTH; (1..).find(|&levels| WIDTH.pow(levels) >= runs).unwrap_or(1) as usize];
        // The upper two levels share what the full ones below leave.
        let full = WIDTH.pow((fanouts.len() as u32).saturating_sub(2));
        let upper = runs.div_ceil(full);
        match &mut fanouts[..] {
            [only] => *only = runs,
            [first, second, ..] => {
                *first = upper.div_ceil(WIDTH);
                *second = upper.div_ceil(*first);
            }
            [] => {}
        }
        Self(fanouts)
    }

    /// Of each level, from the top.
    pub(crate) fn levels(&self) -> &[usize] {
        &self.0
    }

    /// All runs, full or not.
    pub(crate) fn runs(&self) -> usize {
        self.0.iter().product()
    }
}

/// Triangles in their order: those of each run, and [`NO_TRIANGLE`] where there is room.
#[derive(Debug)]
pub(crate) struct Order {
    pub(crate) fanouts: Fanouts,
    pub(crate) runs: Vec<[u32; RUN]>,
}

impl Order {
    /// Bytes that a triangle takes while it is sorted, beside its place.
    pub(crate) const BYTES_TO_SORT: usize = size_of::<Item>();

    /// By cost. O(n log n).
    pub(crate) fn by_cost(triangles: &Triangles<'_>, level: Level) -> Self {
        let fanouts = Fanouts::of(triangles.len());
        // In range: there are fewer than 2³² triangles.
        let ids = (0..triangles.len() as u32).into_par_iter().with_min_len(1 << 12);
        let mut items: Vec<Item> = ids.map(|id| Item::new(triangles, id)).collect();
        let mut runs = vec![[NO_TRIANGLE; RUN]; fanouts.runs()];
        arrange(level, &mut items, fanouts.levels(), &mut runs);
        Self { fanouts, runs }
    }
}

/// Puts objects into runs, below a node with some fanouts.
fn arrange(level: Level, items: &mut [Item], fanouts: &[usize], runs: &mut [[u32; RUN]]) {
    let Some((&children, below)) = fanouts.split_first() else {
        for (place, item) in runs[0].iter_mut().zip(items) {
            *place = item.id();
        }
        return;
    };
    if items.is_empty() {
        return;
    }
    let runs_of_child = runs.len() / children;
    let sections = dispatch!(level, simd => divide(simd, items, children, runs_of_child * RUN));
    let mut rest = items;
    let mut parts: Vec<(&mut [Item], f32)> = Vec::with_capacity(sections.len());
    for section in &sections {
        let (items, after) = rest.split_at_mut(section.objects.len());
        (rest, _) = (after, parts.push((items, section.size)));
    }
    parts.sort_by(|one, other| other.1.total_cmp(&one.1));
    let parts = parts.into_iter().zip(runs.chunks_mut(runs_of_child));
    if runs_of_child >= MANY_RUNS {
        let parts: Vec<_> = parts.collect();
        parts.into_par_iter().for_each(|((items, _), runs)| arrange(level, items, below, runs));
    } else {
        parts.for_each(|((items, _), runs)| arrange(level, items, below, runs));
    }
}

/// A triangle while it is sorted: its box as [lo, id, −hi, 0]. So one minimum unites two boxes.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Item([f32; 8]);

impl Item {
    fn new(triangles: &Triangles<'_>, id: u32) -> Self {
        let bounds = triangles.bounds(id);
        let ([x0, y0, z0], [x1, y1, z1]) = (bounds.lo, bounds.hi);
        // The id is only ever copied. Half of each box: sums do not overflow.
        let half = |x: f32| x * 0.5;
        Self([half(x0), half(y0), half(z0), f32::from_bits(id), -half(x1), -half(y1), -half(z1), 0.0])
    }

    fn id(&self) -> u32 {
        self.0[3].to_bits()
    }

    /// The centre along an axis.
    #[inline(always)]
    fn centre(&self, axis: usize) -> f32 {
        self.0[axis & 3] - self.0[axis & 3 | 4]
    }

    /// The centre, and a number without meaning.
    #[inline(always)]
    fn centre_lanes<S: Simd>(&self, simd: S) -> f32x4<S> {
        let (lo, minus_hi) = f32x8::load_array_ref(simd, &self.0).split();
        lo - minus_hi
    }
}

/// Consecutive objects with places for nodes.
#[derive(Debug, Clone)]
struct Section {
    objects: Range<usize>,
    places: usize,
    /// The surface of the box, and the sum of its sides, in some unit.
    area: f32,
    size: f32,
}

impl Section {
    #[inline(always)]
    fn new<S: Simd>(simd: S, items: &[Item], objects: Range<usize>, places: usize) -> Self {
        let mut bounds = f32x8::simd_from(simd, f32::INFINITY);
        for item in &items[objects.clone()] {
            bounds = bounds.min(f32x8::load_array_ref(simd, &item.0));
        }
        let [x0, y0, z0, _, x1, y1, z1, _] = bounds.to_array();
        let size = -(x0 + x1) - (y0 + y1) - (z0 + z1);
        Self { objects, places, area: area(bounds), size }
    }
}

/// Brings objects into an order in which up to so many sections are consecutive, each of at most `room` objects.
#[inline(always)]
fn divide<S: Simd>(simd: S, items: &mut [Item], places: usize, room: usize) -> Vec<Section> {
    let mut sections = Vec::with_capacity(places);
    sections.push(Section::new(simd, items, 0..items.len(), places));
    loop {
        let divisible = |section: &Section| section.places > 1 && section.objects.len() > RUN;
        let largest = (0..sections.len())
            .filter(|&place| divisible(&sections[place]))
            .max_by(|&one, &other| sections[one].area.total_cmp(&sections[other].area));
        let Some(place) = largest else { break };
        let Section { objects, places, .. } = sections[place].clone();
        let (count, first_places) = divide_in_two(simd, &mut items[objects.clone()], places, room);
        let middle = objects.start + count;
        sections[place] = Section::new(simd, items, objects.start..middle, first_places);
        let second = Section::new(simd, items, middle..objects.end, places - first_places);
        sections.insert(place + 1, second);
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
}

/// Bins across the three axes: what their objects cover, as of [`Item`], and how many they are.
struct Bins {
    bounds: [[[f32; 8]; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    #[inline(always)]
    fn of<S: Simd>(simd: S, items: &[Item], step: usize, binning: Binning<S>) -> Self {
        let mut bins = Self { bounds: [[[f32::INFINITY; 8]; BINS]; 3], counts: [[0; BINS]; 3] };
        for item in items.iter().step_by(step) {
            let bounds = f32x8::load_array_ref(simd, &item.0);
            let place = (item.centre_lanes(simd) - binning.lo) * binning.bins_per_unit;
            let [x, y, z, _] = place.to_int::<i32x4<S>>().to_array();
            for (axis, bin) in [x, y, z].into_iter().enumerate() {
                // In range, and known to be.
                let bin = bin as usize % BINS;
                let union = &mut bins.bounds[axis][bin];
                f32x8::load_array_ref(simd, union).min(bounds).store_slice(union);
                bins.counts[axis][bin] += 1;
            }
        }
        bins
    }

    /// The best division across one axis, where it is better. Both sides have objects and find room, if the objects
    /// that were counted are all.
    #[inline(always)]
    fn best_across<S: Simd>(
        &self,
        simd: S,
        axis: usize,
        (places, room): (usize, f32),
        best: &mut Option<Division>,
    ) {
        let (mut costs, mut needed) = ([f32::INFINITY; BINS], [0.0; BINS]);
        let (mut bounds, mut count) = (f32x8::simd_from(simd, f32::INFINITY), 0);
        for index in 1..BINS {
            bounds = bounds.min(f32x8::load_array_ref(simd, &self.bounds[axis][index - 1]));
            count += self.counts[axis][index - 1];
            if count > 0 {
                costs[index] = area(bounds) * work(count);
                needed[index] = (count as f32 / room).ceil();
            }
        }
        let (mut bounds, mut count) = (f32x8::simd_from(simd, f32::INFINITY), 0);
        for bin in (1..BINS).rev() {
            bounds = bounds.min(f32x8::load_array_ref(simd, &self.bounds[axis][bin]));
            count += self.counts[axis][bin];
            let cost = costs[bin] + area(bounds) * work(count);
            let fits = needed[bin] + (count as f32 / room).ceil() <= places as f32;
            if count > 0 && fits && best.is_none_or(|best| cost < best.cost) && cost < f32::INFINITY {
                *best = Some(Division { axis, bin, cost });
            }
        }
    }
}

/// Brings objects into an order in which those of two parts are consecutive. Tells how many are in the first, and how
/// many of the places it gets: both parts find room.
#[inline(always)]
fn divide_in_two<S: Simd>(simd: S, items: &mut [Item], places: usize, room: usize) -> (usize, usize) {
    let total = items.len();
    let step = total.div_ceil(2 * SAMPLE);
    let binning = Binning::over(simd, items, step);
    let bins = Bins::of(simd, items, step, binning);
    let mut best: Option<Division> = None;
    for axis in 0..3 {
        bins.best_across(simd, axis, (places, room as f32 / step as f32), &mut best);
    }
    if let Some(Division { axis, bin, .. }) = best {
        let (lo, bins_per_unit) = (binning.lo.to_array()[axis], binning.bins_per_unit.to_array()[axis]);
        // Each is exchanged, in place or not: a branch would be guessed wrong half of the time.
        let mut kept = 0;
        for index in 0..total {
            let item = items[index];
            items.swap(index, kept);
            kept += usize::from((item.centre(axis) - lo) * bins_per_unit < bin as f32);
        }
        // Samples may err: those that were not looked at count here.
        let needed = [kept.div_ceil(room), (total - kept).div_ceil(room)];
        if needed[0] > 0 && needed[1] > 0 && needed[0] + needed[1] <= places {
            let share = (places as f64 * kept as f64 / total as f64).round() as usize;
            return (kept, share.clamp(needed[0], places - needed[1]));
        }
    }
    // By number across the longest axis.
    let bins_per_unit = binning.bins_per_unit.to_array();
    let across = |axis: usize| if bins_per_unit[axis] > 0.0 { bins_per_unit[axis] } else { f32::INFINITY };
    let axis = (0..3).min_by(|&a, &b| across(a).total_cmp(&across(b))).unwrap_or(0);
    let first_places = places / 2;
    let count = (total * first_places / places).max(1);
    items.select_nth_unstable_by(count, |one, other| one.centre(axis).total_cmp(&other.centre(axis)));
    (count, first_places)
}

/// What so many objects cost.
fn work(objects: u32) -> f32 {
    (objects + 3 * objects.div_ceil(RUN as u32)) as f32
}

/// The surface of a box as of [`Item`], in some unit; 0 for the empty one.
#[inline(always)]
fn area<S: Simd>(bounds: f32x8<S>) -> f32 {
    let (lo, minus_hi) = bounds.split();
    let [x, y, z, _] = (-(lo + minus_hi)).to_array();
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::isa::Isa;

    #[test]
    fn there_is_room_for_all_and_not_much_more() {
        for triangles in (0..600).chain([4000, 5000, 66_447, 99_994, 178_848, 4_000_000]) {
            let fanouts = Fanouts::of(triangles);
            assert!(fanouts.levels().iter().all(|&fanout| (1..=WIDTH).contains(&fanout)), "{fanouts:?}");
            let places = fanouts.runs() * RUN;
            assert!(places >= triangles, "{triangles}: {fanouts:?}");
            assert!(places as f64 <= (triangles as f64 + 64.0) * 1.5, "{triangles}: {fanouts:?}");
        }
    }

    #[test]
    fn each_triangle_has_one_place() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for (count, spread) in [(1, 1.0), (15, 1.0), (17, 0.0), (700, 0.0), (5000, 1.0), (70_000, 1.0)] {
            let positions: Vec<[f32; 3]> =
                (0..3 * count).map(|_| [next() * spread, next(), 1e30 * next()]).collect();
            let positions = if spread == 0.0 { vec![[1.0; 3]; 3 * count] } else { positions };
            let indices: Vec<[u32; 3]> = (0..count as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
            let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
            let order = Order::by_cost(&triangles, Isa::Auto.level().expect("every machine has one"));
            let mut ids: Vec<u32> =
                order.runs.as_flattened().iter().copied().filter(|&id| id != NO_TRIANGLE).collect();
            ids.sort_unstable();
            assert!(ids.into_iter().eq(0..count as u32), "{count} triangles");
        }
    }
}
