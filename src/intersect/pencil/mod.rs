//! The recursion of the pencil path.
//!
//! ```text
//! intersect(rays, objects):
//!     while the rays are more than a tile: split the film, both halves in parallel
//!     drop objects outside the frustum or behind all that the rays have hit
//!     a run of triangles: leaf.   more objects: split, recurse, near ones first
//! ```
//!
//! Rays are split first: a tile's depth buffer then fits a cache, and halves share nothing, so no lock is needed. A common
//! origin gives a true order from front to back; with the farthest hit of the tile it drops what is hidden.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1.

pub(crate) mod leaf;
pub(crate) mod rect;
pub(crate) mod screen_bounds;
pub(crate) mod setup;

use crate::geometry::aabb::Aabb;
use crate::objects::boxes::Boxes;
use crate::objects::runs::{Node, Runs};
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// A set of rays that one bound stands for.
pub(crate) trait SubPencil {
    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each. Counts the tests.
    fn enter(&mut self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]);
    /// Whether what lies no nearer than t is hidden from all rays.
    fn hides(&self, t: f64) -> bool;
    /// Tests a run of triangles within a box against all rays, now or later.
    fn intersect(&mut self, runs: &Runs, run: usize, bounds: &Aabb, stats: &mut Stats);
    /// Finishes what was put off.
    fn finish(&mut self, stats: &mut Stats);
}

/// Finds the hits of a sub-pencil with all objects.
pub(crate) fn intersect_objects(rays: &mut impl SubPencil, runs: &Runs) -> Stats {
    let mut stats = Stats::default();
    descend(rays, runs, runs.root(), &mut stats);
    rays.finish(&mut stats);
    stats
}

/// One step of the recursion: a node that the rays may meet.
fn descend(rays: &mut impl SubPencil, runs: &Runs, node: Node, stats: &mut Stats) {
    let Some(boxes) = runs.boxes(node) else { return };
    stats.nodes += 1;
    // Keep what the rays may meet, and take the near ones first.
    let (met, ts) = rays.enter(boxes, stats);
    let (mut near_first, mut kept) = ([0; LANES], 0);
    for lane in bits(met) {
        near_first[kept] = lane;
        kept += 1;
    }
    let near_first = &mut near_first[..kept];
    near_first.sort_unstable_by(|&one, &other| ts[one].total_cmp(&ts[other]));
    for &mut lane in near_first {
        if rays.hides(ts[lane]) {
            stats.culled_by_depth += 1;
            continue;
        }
        let child = node.child(lane);
        match child.leaf() {
            Some(run) => rays.intersect(runs, run, &boxes.get(lane), stats),
            None => descend(rays, runs, child, stats),
        }
    }
}
