//! Dividing objects as they are given: between groups, and within a group at the middle of its order.
//!
//! Groups are flat, and halves are made of whole ones: at the end nearest to the middle of the triangles. Two such
//! steps at most halve the triangles, or leave a single group: one that covers the middle comes to lie at an end of its
//! side, and the next step cuts it off. So k groups of any sizes make the recursion no deeper than 2·log₂(n) steps and
//! those within a group.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (a given partition, such as the scene graph).

use crate::geometry::aabb::Aabb;

/// Whole runs of a group's order stay together.
const RUN: usize = 64;
/// A given order is followed while the areas of both halves' boxes, weighed by their parts of the objects, are at most
/// this part of their parent's area: for halves of a cube that is 2/3, for those of a random order 1. With 3/4 the
/// order of a file is followed nowhere among the shared scenes but between the groups of one.
const COHERENT: f64 = 0.875;

/// How many of `len` consecutive triangles, from `first` on, are on the left side; `ends` are those of all groups.
pub(crate) fn half(ends: &[u32], first: u32, len: usize) -> usize {
    let (first, middle) = (first as usize, first as usize + len / 2);
    let next = ends.partition_point(|&end| end as usize <= middle);
    let before = next.checked_sub(1).map(|group| ends[group] as usize).filter(|&end| end > first);
    let after = ends.get(next).map(|&end| end as usize).filter(|&end| end < first + len);
    match (before, after) {
        (Some(before), Some(after)) if after - middle < middle - before => after - first,
        (Some(end), _) | (None, Some(end)) => end - first,
        (None, None) if len > 2 * RUN => (len / 2).next_multiple_of(RUN),
        (None, None) => len / 2,
    }
}

/// Whether two sides of so many objects have so much smaller boxes than both together that fewer rays meet each: a
/// given order is coherent. Not weighed, a few triangles with a large box would count as half of the objects: then
/// following the groups of jet, which do not separate it, took 1.5 times the tests.
pub(crate) fn separates(bounds: &Aabb, boxes: &[Aabb; 2], counts: [usize; 2]) -> bool {
    let area = |bounds: &Aabb| {
        let [x, y, z] = bounds.extent();
        x * y + y * z + z * x
    };
    let [left, right] = [0, 1].map(|side| counts[side] as f64 * area(&boxes[side]));
    left + right <= COHERENT * (counts[0] + counts[1]) as f64 * area(bounds)
}

/// The order in space of two sides: the axis along which their centres lie farthest apart, and whether they ascend
/// along it.
pub(crate) fn order(boxes: &[Aabb; 2]) -> (usize, bool) {
    let [one, other] = boxes.map(|bounds| bounds.centre());
    let apart = [0, 1, 2].map(|k| other[k] - one[k]);
    let axis = (0..3).fold(0, |most, k| if apart[k].abs() > apart[most].abs() { k } else { most });
    (axis, apart[axis] >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn halves_are_made_of_whole_groups() {
        // The end nearest to the middle; of two as near the first.
        assert_eq!(half(&[10, 55, 100], 0, 100), 55);
        assert_eq!(half(&[10, 90, 100], 0, 100), 10);
        assert_eq!(half(&[40, 60, 100], 0, 100), 40);
        assert_eq!(half(&[99, 100], 0, 100), 99);
        assert_eq!(half(&[1, 100], 0, 100), 1);
        assert_eq!(half(&[50, 100], 0, 100), 50);
        // Ends outside what is divided do not count, nor does where it begins.
        assert_eq!(half(&[10, 55, 100], 10, 90), 45);
        assert_eq!(half(&[10, 55, 100, 400], 55, 45), 22);
        // Within a group, whole runs of 64.
        assert_eq!(half(&[1000], 0, 1000), 512);
        assert_eq!(half(&[], 0, 1000), 512);
        assert_eq!(half(&[8, 1008], 8, 1000), 512);
        assert_eq!(half(&[100], 0, 100), 50);
        assert_eq!(half(&[], 7, 3), 1);
    }

    /// The depth that the head of this file promises, for sizes that are hard on halves.
    #[test]
    fn groups_of_any_sizes_are_divided_soon() {
        fn depth(ends: &[u32], first: u32, len: usize) -> u32 {
            let is_one_group = !ends.iter().any(|&end| end > first && (end as usize) < first as usize + len);
            if is_one_group {
                return 0;
            }
            let left = half(ends, first, len);
            assert!(left > 0 && left < len);
            1 + depth(ends, first, left).max(depth(ends, first + left as u32, len - left))
        }
        let doubling: Vec<u32> = (1..20).map(|k| 1 << k).collect();
        let halving: Vec<u32> = (1..20).map(|k| (1 << 20) - (1 << (20 - k))).chain([1 << 20]).collect();
        let single: Vec<u32> = (1..=5000).collect();
        let alternating: Vec<u32> = (0..1000).flat_map(|k| [k * 1000 + 1, k * 1000 + 1000]).collect();
        for ends in [doubling, halving, single, alternating] {
            let triangles = ends[ends.len() - 1];
            let found = depth(&ends, 0, triangles as usize);
            assert!(found <= 2 * triangles.ilog2() + 2, "{found} for {triangles}");
        }
    }
}
