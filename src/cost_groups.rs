//! Objects in groups of eight, divided by cost: the partition of the objects for arbitrary rays.
//!
//! Like [`crate::runs`], but neighbours are found by cost instead of along a curve, and groups may have room left. Every node
//! has up to eight children that are alike in capacity: node i of a level holds nodes 8i to 8i + 7 of the level below, and the
//! hierarchy is implicit in places: one per triangle, and some that stay empty.
//!
//! Objects are divided at the plane across one of the axes, out of [`BINS`] − 1 each, with the least n₁A₁ + n₂A₂: A are the
//! surfaces of the boxes, to which the number of rays that meet them is proportional. Only planes count that leave both sides room.
//! With half the planes for 64 objects and fewer, dividing took the same time, within 5 %; more room helps some scenes and
//! slows others (sponza, chess), as their numbers happen to fill the levels.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Timothy Kay and James
//! Kajiya, "Ray Tracing Complex Scenes", 1986; Jeffrey Goldsmith and John Salmon, "Automatic Creation of Object Hierarchies
//! for Ray Tracing", 1987 (cost).

use std::mem::size_of;

use fearless_simd::{Level, dispatch, f32x4, i32x4, prelude::*};
use rayon::prelude::*;

use crate::culling_space::CullingSpace;
use crate::gather::{bounds, eight_corners};
use crate::hits::NO_TRIANGLE;
use crate::lanes::{Boxes, LANES, Narrow};
use crate::runs::Node;
use crate::{Aabb, Triangles};

/// Triangles of a group, and children of a node.
const FANOUT: usize = LANES;
/// Places per triangle, in sixteenths: room to divide where it is best instead of where a group is full.
const ROOM: usize = 21;
/// Planes that are tried across each axis, and one.
const BINS: usize = 16;
/// What all centres within count as one point: bins would have no width in f32.
const LEAST_EXTENT: f32 = 1e-30;
/// Objects that are divided in parallel.
const PARALLEL: usize = 1 << 12;

/// Eight triangles in the culling space. Lanes without one repeat another.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Group {
    /// The corners a.
    pub(crate) a: [[f32; LANES]; 3],
    /// b − a.
    pub(crate) e1: [[f32; LANES]; 3],
    /// c − a.
    pub(crate) e2: [[f32; LANES]; 3],
    /// [`NO_TRIANGLE`] for none.
    pub(crate) ids: [u32; LANES],
}

/// Triangles in groups, with the boxes of the implicit hierarchy over them.
#[derive(Debug)]
pub(crate) struct Groups {
    groups: Vec<Group>,
    /// Boxes of the groups in the culling space, then of ever larger ones, up to one vector of boxes.
    levels: Vec<Vec<Boxes>>,
    triangles: usize,
}

impl Groups {
    /// Divides triangles by cost. O(n log n).
    pub(crate) fn new(triangles: &Triangles<'_>, space: &CullingSpace, level: Level) -> Self {
        // In range: there are fewer than 2³² triangles.
        let ids = 0..triangles.len() as u32;
        let mut items: Vec<Item> =
            ids.into_par_iter().with_min_len(1 << 12).map(|id| Item::new(triangles, space, id)).collect();
        let mut capacity = FANOUT;
        while children_for(items.len(), capacity) > FANOUT {
            capacity *= FANOUT;
        }
        let mut places = vec![NO_TRIANGLE; children_for(items.len(), capacity) * capacity];
        divide(&mut items, &mut places, capacity, level);
        drop(items);
        let boxes = group_boxes(triangles, space, &places, level);
        let eight = |ids: &[u32]| dispatch!(level, simd => Group::new(simd, triangles, space, ids));
        let of_groups = places.par_chunks(FANOUT).with_min_len(64).map(eight).collect();
        let mut groups = Self { groups: of_groups, levels: vec![boxes], triangles: triangles.len() };
        while let Some(top) = groups.levels.last().filter(|top| top.len() > 1) {
            let next = top.par_chunks(FANOUT).with_min_len(64).map(|children| {
                let mut boxes = Boxes::EMPTY;
                for (lane, child) in children.iter().enumerate() {
                    let union = (0..LANES).map(|lane| child.get(lane)).fold(Aabb::EMPTY, Aabb::union);
                    boxes.set(lane, &union);
                }
                boxes
            });
            let next = next.collect();
            groups.levels.push(next);
        }
        groups
    }

    /// Levels of boxes.
    pub(crate) fn levels(&self) -> usize {
        self.levels.len()
    }

    /// The vector of nodes that holds everything.
    pub(crate) fn root(&self) -> Node {
        Node::root_above(self.levels.len())
    }

    /// The boxes of a node's children, in the culling space.
    #[inline]
    pub(crate) fn boxes(&self, node: Node) -> Option<&Boxes> {
        node.boxes(&self.levels)
    }

    /// The triangles of a group; none in a place that fills up a vector of boxes.
    #[inline]
    pub(crate) fn group(&self, group: usize) -> Option<&Group> {
        self.groups.get(group)
    }

    /// Bytes at the peak.
    pub(crate) fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().map(Vec::capacity).sum();
        let kept = boxes * size_of::<Boxes>() + self.groups.capacity() * size_of::<Group>();
        let items = self.triangles * size_of::<Item>();
        let places = self.groups.len() * size_of::<[u32; FANOUT]>();
        places + if kept > items { kept } else { items }
    }
}

impl Group {
    /// The triangles of a group's places.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        triangles: &Triangles<'_>,
        space: &CullingSpace,
        places: &[u32],
    ) -> Self {
        let mut ids = [NO_TRIANGLE; LANES];
        ids.copy_from_slice(places);
        let [mut a, mut e1, mut e2] = [[[0.0; LANES]; 3]; 3];
        let present = ids_of(places, 0);
        let Some(&last) = present.last() else { return Self { a, e1, e2, ids } };
        let mut eight = [last; LANES];
        eight[..present.len()].copy_from_slice(present);
        let corners = eight_corners(simd, triangles, &eight);
        for k in 0..3 {
            let corner = |corner: usize| Narrow::load_array_ref(simd, &corners[corner][k]);
            let from = space.coordinate(corner(0), k);
            a[k] = from.to_array();
            e1[k] = (space.coordinate(corner(1), k) - from).to_array();
            e2[k] = (space.coordinate(corner(2), k) - from).to_array();
        }
        Self { a, e1, e2, ids }
    }
}

/// Children of a capacity that so many objects are given.
fn children_for(objects: usize, capacity: usize) -> usize {
    (objects * ROOM / 16).div_ceil(capacity).max(1)
}

/// The triangles of a group: those before the first empty place. None in a group that fills up a vector of boxes.
fn ids_of(places: &[u32], group: usize) -> &[u32] {
    let ids = places.get(group * FANOUT..(group + 1) * FANOUT).unwrap_or(&[]);
    let count = ids.iter().position(|&id| id == NO_TRIANGLE).unwrap_or(ids.len());
    &ids[..count]
}

/// The boxes of all groups.
fn group_boxes(triangles: &Triangles<'_>, space: &CullingSpace, places: &[u32], level: Level) -> Vec<Boxes> {
    let groups = places.len() / FANOUT;
    let of_vector = |vector: usize| {
        let mut boxes = Boxes::EMPTY;
        dispatch!(level, simd => {
            for (lane, group) in (vector * FANOUT..(vector * FANOUT + FANOUT).min(groups)).enumerate() {
                let ids = ids_of(places, group);
                if let Some(&last) = ids.last() {
                    let mut eight = [last; FANOUT];
                    eight[..ids.len()].copy_from_slice(ids);
                    boxes.set(lane, &space.aabb(&bounds(simd, triangles, &eight)));
                }
            }
        });
        boxes
    };
    (0..groups.div_ceil(FANOUT)).into_par_iter().with_min_len(32).map(of_vector).collect()
}

/// A triangle while it is sorted: the box [lo, id, −hi, 0] in the culling space. So one minimum unites two boxes.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Item([f32; LANES]);

impl Item {
    fn new(triangles: &Triangles<'_>, space: &CullingSpace, id: u32) -> Self {
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
fn divide(items: &mut [Item], places: &mut [u32], capacity: usize, level: Level) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Isa;

    /// Small triangles at places of a sequence, and a few that are as large as all of them.
    fn scattered(count: u16, step: f32) -> Vec<[f32; 3]> {
        let corner = |i: u16, k: u16| {
            let place = |m: u16| f32::from(i * m % 101) * step;
            let size = if i.is_multiple_of(50) { 60.0 } else { 0.5 };
            [place(37) + f32::from(k) * size, place(17) + f32::from(k * k) * size, place(5)]
        };
        (0..count).flat_map(|i| (0..3).map(move |k| corner(i, k))).collect()
    }

    fn check(positions: &[[f32; 3]]) {
        let indices: Vec<[u32; 3]> =
            (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let triangles = Triangles::new(positions, &indices).expect("valid triangles");
        let space = CullingSpace::over(&triangles.position_bounds()).expect("a space");
        let groups = Groups::new(&triangles, &space, Isa::Auto.level().expect("every machine has one"));
        let mut seen = vec![0; triangles.len()];
        let mut nodes = vec![(groups.root(), Aabb { lo: [-1.0; 3], hi: [1.0; 3] })];
        while let Some((node, around)) = nodes.pop() {
            let Some(boxes) = groups.boxes(node) else { continue };
            for lane in 0..LANES {
                let bounds = boxes.get(lane);
                assert!(bounds.is_empty() || bounds.union(around) == around, "{bounds:?} in {around:?}");
                match node.child(lane).leaf() {
                    Some(group) => {
                        let ids = groups.group(group).map_or([NO_TRIANGLE; LANES], |group| group.ids);
                        for id in ids.into_iter().filter(|&id| id != NO_TRIANGLE) {
                            seen[id as usize] += 1;
                            let own = space.aabb(&triangles.bounds(id));
                            assert_eq!(own.union(bounds), bounds, "triangle {id}");
                        }
                    }
                    None => nodes.push((node.child(lane), if bounds.is_empty() { around } else { bounds })),
                }
            }
        }
        assert!(seen.iter().all(|&count| count == 1), "each triangle stands in one group");
    }

    #[test]
    fn every_triangle_stands_in_one_group_and_all_boxes_around_it() {
        for count in [1, 8, 9, 64, 65, 999, 5000] {
            check(&scattered(count, 1.0));
        }
    }

    #[test]
    fn points_without_triangles_are_one_empty_group() {
        check(&[[0.0; 3], [1.0; 3]]);
    }

    #[test]
    fn triangles_at_one_place_are_divided_by_number() {
        check(&scattered(1000, 0.0));
        check(&vec![[1.0, 2.0, 3.0]; 3 * 300]);
    }
}
