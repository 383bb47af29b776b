//! The spatial partition: a voxel is halved, and each half references the triangles whose boxes reach into it.
//!
//! A triangle may be referenced by both halves. Its hit at a point is found in a half that holds the point, which the
//! slab test of that half keeps; found elsewhere as well it is the same hit. A voxel is not halved in space where that
//! does not reduce: when a half keeps more than 7/8 of the triangles, or both together have more than 3/2 as many. The
//! lists on one way down are then together no longer than 12 times the triangles, whatever the scene.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (spatial partitions); Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011
//! (implicit kd-trees).

use std::sync::atomic::{AtomicU64, Ordering};

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;

/// A half keeps at most all but this part of the triangles.
const LEAST_PART: usize = 8;

/// Bytes of the lists of all voxels that are worked on, now and at most.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    now: AtomicU64,
    peak: AtomicU64,
}

impl Ledger {
    /// The most bytes so far.
    pub(crate) fn peak(&self) -> u64 {
        self.peak.load(Ordering::Relaxed)
    }
}

/// The triangles in the halves of a voxel. Their bytes are in the ledger while they live.
#[derive(Debug)]
pub(crate) struct Halves<'a> {
    pub(crate) lists: [Vec<u32>; 2],
    /// The triangles' boxes as far as they lie in each half.
    pub(crate) bounds: [Aabb; 2],
    /// Across which the voxel was halved.
    pub(crate) axis: usize,
    ledger: &'a Ledger,
}

impl<'a> Halves<'a> {
    /// Halves a voxel across its longest side; `None` where that does not reduce.
    pub(crate) fn new(
        triangles: &Triangles<'_>,
        objects: &[u32],
        voxel: &Aabb,
        ledger: &'a Ledger,
    ) -> Option<Self> {
        let axis = voxel.longest_axis();
        // In range, as it lies between two f32.
        let plane = voxel.centre()[axis] as f32;
        let reaches = |id: u32| {
            let bounds = triangles.bounds(id);
            [bounds.lo[axis] <= plane, bounds.hi[axis] >= plane]
        };
        let mut counts = [0; 2];
        for &id in objects {
            let sides = reaches(id);
            counts = [0, 1].map(|side| counts[side] + usize::from(sides[side]));
        }
        let most = objects.len() - objects.len().div_ceil(LEAST_PART);
        if counts[0].max(counts[1]) > most || (counts[0] + counts[1]) * 2 > objects.len() * 3 {
            return None;
        }
        let mut lists = counts.map(Vec::with_capacity);
        let mut bounds = [Aabb::EMPTY; 2];
        for &id in objects {
            for (side, _) in reaches(id).into_iter().enumerate().filter(|(_, reaches)| *reaches) {
                lists[side].push(id);
                bounds[side] = bounds[side].union(triangles.bounds(id));
            }
        }
        let (mut left, mut right) = (*voxel, *voxel);
        (left.hi[axis], right.lo[axis]) = (plane, plane);
        let halves = Self { lists, bounds: [bounds[0].common(left), bounds[1].common(right)], axis, ledger };
        let now = ledger.now.fetch_add(halves.bytes(), Ordering::Relaxed) + halves.bytes();
        ledger.peak.fetch_max(now, Ordering::Relaxed);
        Some(halves)
    }

    /// References to triangles in both lists.
    pub(crate) fn references(&self) -> u64 {
        self.lists.iter().map(|list| list.len() as u64).sum()
    }

    fn bytes(&self) -> u64 {
        self.lists.iter().map(|list| (list.capacity() * size_of::<u32>()) as u64).sum()
    }
}

impl Drop for Halves<'_> {
    fn drop(&mut self) {
        self.ledger.now.fetch_sub(self.bytes(), Ordering::Relaxed);
    }
}
