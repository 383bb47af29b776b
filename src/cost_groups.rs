//! Objects in groups of eight, divided by cost: the partition of the objects for arbitrary rays.
//!
//! Like [`crate::runs`], but neighbours are found by cost instead of along a curve, and groups may have room left. Every node
//! has up to eight children that are alike in capacity: node i of a level holds nodes 8i to 8i + 7 of the level below, and the
//! hierarchy is implicit in places: one per triangle, and some that stay empty.
//!
//! Objects are divided at the plane across one of the axes, out of [`BINS`] − 1 each, with the least n₁A₁ + n₂A₂: A are the
//! surfaces of the boxes, to which the number of rays that meet them is proportional. Only planes count that leave both sides room.
//!
//! Based on: Ingo Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binning); Timothy Kay and James
//! Kajiya, "Ray Tracing Complex Scenes", 1986; Jeffrey Goldsmith and John Salmon, "Automatic Creation of Object Hierarchies
//! for Ray Tracing", 1987 (cost).

use std::mem::size_of;

use fearless_simd::{Level, dispatch, prelude::*};
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
        divide(&mut items, &mut places, capacity);
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
        let present = ids_of(places, 0);
        let mut eight = [present.last().copied().unwrap_or(0); LANES];
        eight[..present.len()].copy_from_slice(present);
        let corners = eight_corners(simd, triangles, &eight);
        let [mut a, mut e1, mut e2] = [[[0.0; LANES]; 3]; 3];
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

/// A triangle while it is sorted: its box in the culling space.
#[derive(Debug, Clone, Copy)]
struct Item {
    bounds: Aabb,
    id: u32,
}

impl Item {
    fn new(triangles: &Triangles<'_>, space: &CullingSpace, id: u32) -> Self {
        Self { bounds: space.aabb(&triangles.bounds(id)), id }
    }

    /// Twice the centre.
    fn centre(&self) -> [f32; 3] {
        [0, 1, 2].map(|k| self.bounds.lo[k] + self.bounds.hi[k])
    }
}

/// Divides objects among children of a capacity, as many as there is place for, then each child's among its own.
fn divide(items: &mut [Item], places: &mut [u32], capacity: usize) {
    let children = places.len() / capacity;
    if children > 1 {
        let (count, left) = best_division(items, children, capacity);
        let (items, more_items) = items.split_at_mut(count);
        let (places, more_places) = places.split_at_mut(left * capacity);
        let parallel = items.len() + more_items.len() > PARALLEL;
        let mut one = || divide(items, places, capacity);
        let mut other = || divide(more_items, more_places, capacity);
        if parallel {
            rayon::join(one, other);
        } else {
            one();
            other();
        }
    } else if capacity > FANOUT {
        let capacity = capacity / FANOUT;
        let children = children_for(items.len(), capacity).min(FANOUT);
        divide(items, &mut places[..children * capacity], capacity);
    } else {
        for (place, item) in places.iter_mut().zip(items) {
            *place = item.id;
        }
    }
}

/// One bin: what its objects cover, and how many they are.
#[derive(Debug, Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
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
#[derive(Debug, Clone, Copy)]
struct Binning {
    lo: [f32; 3],
    bins_per_unit: [f32; 3],
}

impl Binning {
    fn over(items: &[Item]) -> Self {
        let centres = items.iter().fold(Aabb::EMPTY, |bounds, item| {
            let centre = item.centre();
            bounds.union(Aabb { lo: centre, hi: centre })
        });
        let per_unit = |k: usize| {
            let extent = centres.hi[k] - centres.lo[k];
            if extent > 0.0 { BINS as f32 * 0.9999 / extent } else { 0.0 }
        };
        Self { lo: centres.lo, bins_per_unit: [per_unit(0), per_unit(1), per_unit(2)] }
    }

    fn bins(&self, item: &Item) -> [usize; 3] {
        let centre = item.centre();
        // In range: the quotient is at least 0, and a tiny extent may make it infinite.
        [0, 1, 2].map(|k| (((centre[k] - self.lo[k]) * self.bins_per_unit[k]) as usize).min(BINS - 1))
    }
}

/// Brings objects into the best order, and tells how many of them, and of the children, are on the left.
fn best_division(items: &mut [Item], children: usize, capacity: usize) -> (usize, usize) {
    let binning = Binning::over(items);
    let mut bins = [[Bin { bounds: Aabb::EMPTY, count: 0 }; BINS]; 3];
    for item in &*items {
        for (bins, bin) in bins.iter_mut().zip(binning.bins(item)) {
            bins[bin].bounds = bins[bin].bounds.union(item.bounds);
            bins[bin].count += 1;
        }
    }
    let mut best: Option<Division> = None;
    for (axis, bins) in bins.iter().enumerate() {
        for division in divisions(axis, bins) {
            let needed =
                division.count.div_ceil(capacity) + (items.len() - division.count).div_ceil(capacity);
            let fits = needed <= children && division.count > 0 && division.count < items.len();
            if fits && best.is_none_or(|best| division.cost < best.cost) {
                best = Some(division);
            }
        }
    }
    let Some(Division { axis, bin, count, .. }) = best else {
        // Nothing fits, or all centres are one point.
        let left = children / 2;
        let count = items.len() * left / children;
        let axis = (0..3).min_by(|&a, &b| binning.bins_per_unit[a].total_cmp(&binning.bins_per_unit[b]));
        let axis = axis.unwrap_or(0);
        if count < items.len() {
            items.select_nth_unstable_by(count, |one, other| {
                one.centre()[axis].total_cmp(&other.centre()[axis])
            });
        }
        return (count, left);
    };
    let mut kept = 0;
    for index in 0..items.len() {
        if binning.bins(&items[index])[axis] < bin {
            items.swap(kept, index);
            kept += 1;
        }
    }
    let (left, right) = (count.div_ceil(capacity), (items.len() - count).div_ceil(capacity));
    let spare = children - left - right;
    (count, left + (spare * count + items.len() / 2) / items.len())
}

/// The divisions across one axis, with their costs.
fn divisions(axis: usize, bins: &[Bin; BINS]) -> [Division; BINS - 1] {
    let mut divisions = [Division { axis, bin: 0, count: 0, cost: 0.0 }; BINS - 1];
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for (index, division) in divisions.iter_mut().enumerate() {
        bounds = bounds.union(bins[index].bounds);
        count += bins[index].count;
        (division.bin, division.count, division.cost) = (index + 1, count, area(&bounds) * count as f32);
    }
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for (index, division) in divisions.iter_mut().enumerate().rev() {
        bounds = bounds.union(bins[index + 1].bounds);
        count += bins[index + 1].count;
        division.cost += area(&bounds) * count as f32;
    }
    divisions
}

/// Half the surface of a box; 0 for the empty one.
fn area(bounds: &Aabb) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|k| bounds.hi[k] - bounds.lo[k]);
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
    fn triangles_at_one_place_are_divided_by_number() {
        check(&scattered(1000, 0.0));
        check(&vec![[1.0, 2.0, 3.0]; 3 * 300]);
    }
}
