//! The recursion of the pencil path.
//!
//! ```text
//! while the rays are more than a tile: split the film, both halves in parallel
//! intersect(rays, objects):
//!     the parts of the objects, eight, that the frustum of the rays meets before all that they have hit; near ones first:
//!         a run of triangles: directly intersect.   more objects: intersect(rays, part)
//! ```
//!
//! Rays are split first: a tile's depth buffer then fits a cache, and halves share nothing, so no lock is needed. A
//! common origin gives a true order from front to back; with the farthest hit of the tile it drops what is hidden.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1.

pub(crate) mod leaf;
pub(crate) mod rect;
pub(crate) mod screen_bounds;
pub(crate) mod setup;
pub(crate) mod viewport;
pub(crate) mod window;

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
    /// "DirectlyIntersect": tests a run of triangles within a box against all rays, now or in the end.
    fn directly_intersect(&mut self, runs: &Runs, run: usize, bounds: &Aabb, stats: &mut Stats);
    /// Tests what was put off.
    fn finish(&mut self, stats: &mut Stats);
}

/// Finds the hits of a sub-pencil with all objects.
pub(crate) fn intersect_objects(rays: &mut impl SubPencil, runs: &Runs) -> Stats {
    let mut stats = Stats::default();
    intersect(rays, runs, runs.root(), &mut stats);
    rays.finish(&mut stats);
    stats
}

/// One step of Algorithm 1. The node is divided already: into eight parts, whose boxes are asked together.
fn intersect(rays: &mut impl SubPencil, runs: &Runs, node: Node, stats: &mut Stats) {
    let Some(boxes) = runs.boxes(node) else { return };
    stats.nodes += 1;
    let (met, ts) = rays.enter(boxes, stats);
    let (near_first, kept) = near_first(met, &ts);
    for &lane in &near_first[..kept] {
        if rays.hides(ts[lane]) {
            stats.culled_by_depth += 1;
            continue;
        }
        let part = node.child(lane);
        match part.leaf() {
            Some(run) => rays.directly_intersect(runs, run, &boxes.get(lane), stats),
            None => intersect(rays, runs, part, stats),
        }
    }
}

/// The lanes that were met, by the least t within them, and how many they are.
fn near_first(met: u64, ts: &[f64; LANES]) -> ([usize; LANES], usize) {
    let (mut lanes, mut kept) = ([0; LANES], 0);
    for lane in bits(met) {
        lanes[kept] = lane;
        kept += 1;
    }
    // Of equal ones the first: copies of a mesh come one after the other.
    lanes[..kept].sort_unstable_by(|&one, &other| ts[one].total_cmp(&ts[other]).then(one.cmp(&other)));
    (lanes, kept)
}
