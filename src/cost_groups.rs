//! Objects in groups of eight, divided by cost: the partition of the objects for arbitrary rays.
//!
//! Like [`crate::runs`], but neighbours are found by cost instead of along a curve, and groups may have room left. Every node
//! has up to eight children that are alike in capacity: node i of a level holds nodes 8i to 8i + 7 of the level below, and the
//! hierarchy is implicit in places: one per triangle, and some that stay empty.
//!
//! How they are divided: [`crate::cost_division`].
//!
//! Based on: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes", 1986 (boxes).

use std::mem::size_of;

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::cost_division::{FANOUT, Item, children_for, divide};
use crate::culling_space::CullingSpace;
use crate::gather::{bounds, eight_corners};
use crate::hits::NO_TRIANGLE;
use crate::lanes::{Boxes, LANES, Narrow};
use crate::runs::Node;
use crate::{Aabb, Triangles};

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
