//! The general path: Algorithm 1 for arbitrary rays, in place, with no stored hierarchy.
//!
//! ```text
//! intersect(rays, objects):
//!     rays <- those of `rays` that may meet bounds(objects)
//!     if few rays or few objects: test all pairs
//!     else: split the objects at the middle of the longest side into L and R, the rays by the sign of their direction
//!           along that side into those that meet L first and those that meet R first:
//!           phase 1   (L-first rays, L) and (R-first rays, R) in parallel
//!           phase 2   (L-first rays, R) and (R-first rays, L) in parallel
//! ```
//!
//! Each phase touches every ray and every object once, so both halves run in parallel without locks, copies or atomics, and
//! every ray sees its near side first. Rays and objects are permuted in place: 32 bytes per ray, 4 per object.
//!
//! Termination: testing all of r·o pairs is taken to cost no more than one more step when r·o·T ≤ 2rB + oS, with T, B and S
//! the costs of a pair, of a ray against a box and of moving an object. Their ratios 3 : 2 : 4 are estimates from operation
//! counts; they have not been tuned by measurement yet, and change time only.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1; Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011 (streaming in place).

use std::mem::size_of;

use crate::predicates::Distance;
use crate::probes::{Nearest, Probes};
use crate::{Aabb, Hits, Stats, Triangles};

/// Relative cost of one ray against one triangle.
const PAIR_COST: usize = 3;
/// Relative cost of one ray against one box.
const BOX_COST: usize = 2;
/// Relative cost of moving one object.
const SPLIT_COST: usize = 4;
/// Pairs below which a step stays on its thread.
const PARALLEL_PAIRS: usize = 1 << 16;
/// A split with less than this part of the objects on one side is made at the median instead. The depth of the recursion
/// is at most log(n)/log(8/7), 166 steps for 2³² objects: any stack holds that.
const LOPSIDED: usize = 8;

/// A ray on its way down, with the nearest hit so far.
#[derive(Debug, Clone, Copy)]
struct Active {
    ray: u32,
    nearest: Nearest,
}

/// The query that all steps share.
#[derive(Debug, Clone, Copy)]
struct Query<'a> {
    triangles: &'a Triangles<'a>,
    probes: Probes<'a>,
    any: bool,
}

/// Finds the nearest, or any, hit of each ray.
pub(crate) fn intersect(triangles: &Triangles<'_>, probes: Probes<'_>, any: bool, hits: &mut Hits) -> Stats {
    // In range: both counts fit u32.
    let mut objects: Vec<u32> = (0..triangles.len() as u32).collect();
    let start = |ray| Active { ray, nearest: Nearest::none(probes.ray(ray).t_max) };
    let mut active: Vec<Active> = (0..probes.len() as u32).map(start).collect();
    let bytes = objects.capacity() * size_of::<u32>() + active.capacity() * size_of::<Active>();

    let query = Query { triangles, probes, any };
    let bounds = bounds_of(triangles, &objects);
    let mut stats = query.recurse(&mut active, &mut objects, &bounds);
    stats.engine_bytes += bytes as u64;

    for Active { ray, nearest } in active {
        if nearest.is_hit() {
            hits.ids[ray as usize] = nearest.id;
            if !any {
                hits.ts[ray as usize] =
                    Distance::new(&probes.ray(ray), &triangles.triangle(nearest.id)).rounded();
            }
        }
    }
    stats
}

impl Query<'_> {
    /// One step of Algorithm 1.
    fn recurse(&self, rays: &mut [Active], objects: &mut [u32], bounds: &Aabb) -> Stats {
        let mut stats = Stats { nodes: 1, box_tests: rays.len() as u64, ..Stats::default() };
        let active = partition(rays, |active| self.may_meet(active, bounds));
        stats.culled_by_bound += (rays.len() - active) as u64;
        let rays = &mut rays[..active];
        if rays.is_empty() {
            return stats;
        }
        if self.terminates(rays.len(), objects.len()) {
            return stats.plus(self.leaf(rays, objects));
        }

        let axis = bounds.longest_axis();
        let parallel = rays.len() * objects.len() > PARALLEL_PAIRS;
        let (left, right) = self.split(objects, bounds, axis);
        let (left_box, right_box) = (bounds_of(self.triangles, left), bounds_of(self.triangles, right));
        let left_first = partition(rays, |active| self.probes.ray(active.ray).direction[axis] >= 0.0);
        let (left_first, right_first) = rays.split_at_mut(left_first);

        // Near side first, then the far side with what the near side has found.
        for swapped in [false, true] {
            let (one, other) = if swapped {
                (&mut *right_first, &mut *left_first)
            } else {
                (&mut *left_first, &mut *right_first)
            };
            let mut one = || self.recurse(one, left, &left_box);
            let mut other = || self.recurse(other, right, &right_box);
            let (one, other) = if parallel { rayon::join(one, other) } else { (one(), other()) };
            stats = stats.plus(one).plus(other);
        }
        stats
    }

    /// Whether testing all pairs is estimated to cost no more than one more step.
    fn terminates(&self, rays: usize, objects: usize) -> bool {
        objects <= 2 || rays * objects * PAIR_COST <= 2 * rays * BOX_COST + objects * SPLIT_COST
    }

    /// Whether a ray may still find something in a box.
    fn may_meet(&self, active: &Active, bounds: &Aabb) -> bool {
        let Active { ray, nearest } = active;
        !(self.any && nearest.is_hit()) && bounds.may_meet(&self.probes.ray(*ray), nearest.hi)
    }

    /// Splits objects by their centres at the middle of the longest side; at the median where that is lopsided.
    fn split<'b>(
        &self,
        objects: &'b mut [u32],
        bounds: &Aabb,
        axis: usize,
    ) -> (&'b mut [u32], &'b mut [u32]) {
        let centre = |id: u32| self.triangles.bounds(id).centre()[axis];
        let middle = bounds.centre()[axis];
        let mut left = partition(objects, |&id| centre(id) < middle);
        if left.min(objects.len() - left) < objects.len() / LOPSIDED + 1 {
            // Triangles that share a vertex have boxes that all begin there: the middle would peel them off one by one.
            left = objects.len() / 2;
            objects.select_nth_unstable_by(left, |&one, &other| centre(one).total_cmp(&centre(other)));
        }
        objects.split_at_mut(left)
    }

    /// "DirectlyIntersect": all pairs.
    fn leaf(&self, rays: &mut [Active], objects: &[u32]) -> Stats {
        let mut stats = Stats { triangles_set_up: objects.len() as u64, ..Stats::default() };
        for &id in objects {
            for active in rays.iter_mut() {
                if self.any && active.nearest.is_hit() {
                    continue;
                }
                stats.samples_tested += 1;
                let ray = self.probes.ray(active.ray);
                self.probes.test((active.ray, &ray), id, self.triangles, &mut active.nearest, &mut stats);
            }
        }
        stats
    }
}

/// The box of some triangles.
fn bounds_of(triangles: &Triangles<'_>, objects: &[u32]) -> Aabb {
    objects.iter().fold(Aabb::EMPTY, |bounds, &id| bounds.union(triangles.bounds(id)))
}

/// Moves what satisfies the predicate to the front and returns how many those are. O(n), in place.
fn partition<T>(items: &mut [T], predicate: impl Fn(&T) -> bool) -> usize {
    let mut kept = 0;
    for index in 0..items.len() {
        if predicate(&items[index]) {
            items.swap(kept, index);
            kept += 1;
        }
    }
    kept
}
