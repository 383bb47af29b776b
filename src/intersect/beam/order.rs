//! The order of the objects, and the shape of the implicit hierarchy over it.
//!
//! Runs of up to 16 triangles are the lowest level, and up to 16 nodes of a level make one of the next: a node's number
//! tells its children, and nothing points anywhere. To divide objects by cost all the same, there is room for [`SPARE`]
//! times as many triangles as there are. A section of the objects, with so many places for nodes, is divided in two at
//! the plane of least cost that leaves both parts room, [`crate::objects::split`]; the section with the largest surface
//! first, until each has one place or fits a run. Sections then go from the largest box to the smallest, as any hit is
//! looked for: what is large ends most rays.
//!
//! Based on: Thiago Ize and Charles Hansen, "RTSAH Traversal Order for Occlusion Rays", 2011 (occluders that are likely
//! first).

use std::ops::Range;

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::objects::runs::RUN;
use crate::objects::split::{Item, bounds_and_area, divide_by_cost, divide_by_number};
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::WIDTH;

/// Room for triangles, as a multiple of their number: at 46 bytes for each place, boxes and the id while they are
/// copied included, 63 bytes a triangle.
const SPARE: f64 = 1.35;
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
        let mut items: Vec<Item> = ids.map(|id| Item::new(&half(triangles.bounds(id)), id)).collect();
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

/// Half a triangle's box: sums of its sides do not overflow.
fn half(Aabb { lo, hi }: Aabb) -> Aabb {
    Aabb { lo: lo.map(|x| x * 0.5), hi: hi.map(|x| x * 0.5) }
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
        let (Aabb { lo, hi }, area) = bounds_and_area(simd, &items[objects.clone()]);
        let size = (hi[0] - lo[0]) + (hi[1] - lo[1]) + (hi[2] - lo[2]);
        Self { objects, places, area, size }
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

/// Brings objects into an order in which those of two parts are consecutive. Tells how many are in the first, and how
/// many of the places it gets: both parts find room.
#[inline(always)]
fn divide_in_two<S: Simd>(simd: S, items: &mut [Item], places: usize, room: usize) -> (usize, usize) {
    let total = items.len();
    let fits = |counts: [u32; 2], step: usize| {
        let room = room as f32 / step as f32;
        let [first, second] = counts.map(|count| (count as f32 / room).ceil());
        first + second <= places as f32
    };
    if let Some(first) = divide_by_cost(simd, items, RUN, fits) {
        // Samples may err: those that were not looked at count here.
        let needed = [first.div_ceil(room), (total - first).div_ceil(room)];
        if needed[0] > 0 && needed[1] > 0 && needed[0] + needed[1] <= places {
            let share = (places as f64 * first as f64 / total as f64).round() as usize;
            return (first, share.clamp(needed[0], places - needed[1]));
        }
    }
    let first_places = places / 2;
    let count = (total * first_places / places).max(1);
    divide_by_number(simd, items, count);
    (count, first_places)
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
