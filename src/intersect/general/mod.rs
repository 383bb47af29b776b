//! The general path: Algorithm 1 for arbitrary rays, in place, with no stored hierarchy.
//!
//! ```text
//! intersect(rays, objects):
//!     rays <- those of `rays` that may meet bounds(objects)
//!     if few rays or few objects: test all pairs
//!     else: split the objects into L and R, see [`Partition`], the rays by the sign of their direction along the axis of the
//!           split into those that meet L first and those that meet R first:
//!           phase 1   (L-first rays, L) and (R-first rays, R) in parallel
//!           phase 2   (L-first rays, R) and (R-first rays, L) in parallel
//! ```
//!
//! Each phase touches every ray and every object once, so both halves run in parallel without locks, copies or atomics, and
//! every ray sees its near side first. Rays and objects are permuted in place: 88 bytes per ray, 4 per object. Voxels
//! need lists of their own.
//!
//! Termination: testing all of r·o pairs is taken to cost no more than one more step when r·o·T ≤ 2rB + oS, with T, B and S
//! the costs of a pair, of a ray against a box and of moving an object. Their ratios 3 : 2 : 4 are estimates from operation
//! counts, and change time only: 3 : 1 : 8 has 1 % fewer instructions on sponza and 5 % more on koala, 3 : 2 : 2 has 6 and 7 % more,
//! 3 : 2 : 16 1 and 34 % (10,000 diffuse-bounce rays, counted by callgrind).
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1; Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011 (streaming in place).

pub(crate) mod partition;
pub(crate) mod slab;

use std::mem::size_of;

use crate::exact::distance::Distance;
use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::general::partition::Split;
use crate::intersect::general::partition::sampled;
use crate::intersect::general::partition::spatial::{Halves, Ledger};
use crate::intersect::general::partition::{Partition, given};
use crate::intersect::general::slab::Slabs;
use crate::intersect::ray_set::{Nearest, Probes};
use crate::rays::hits::Hits;
use crate::stats::Stats;

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

/// What a step reads of an object: its place, its vertices and their positions.
const OBJECT_BYTES: usize = size_of::<u32>() + size_of::<[u32; 3]>() + size_of::<[[f32; 3]; 3]>();

/// A ray on its way down, with the nearest hit so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Active {
    pub(crate) slabs: Slabs,
    pub(crate) nearest: Nearest,
    ray: u32,
    /// Pairs that were evaluated for it: what the others leave of 88 bytes.
    tested: u32,
}

/// The query that all steps share.
#[derive(Debug, Clone, Copy)]
struct Query<'a> {
    triangles: &'a Triangles<'a>,
    probes: Probes<'a>,
    any: bool,
    partition: Partition,
    /// What testing a pair costs: decides where the recursion ends.
    pair_cost: usize,
    ledger: &'a Ledger,
}

/// Finds the nearest, or any, hit of each ray, with the default partition.
pub(crate) fn intersect(triangles: &Triangles<'_>, probes: Probes<'_>, any: bool, hits: &mut Hits) -> Stats {
    intersect_by(Partition::default(), (triangles, probes, any), (hits, &mut []))
}

/// Finds the nearest, or any, hit of each ray, and counts the pairs of each unless there is no room for that.
pub(crate) fn intersect_by(
    partition: Partition,
    query: (&Triangles<'_>, Probes<'_>, bool),
    answer: (&mut Hits, &mut [u32]),
) -> Stats {
    intersect_down_to(PAIR_COST, partition, query, answer)
}

/// The same, ending where the cost of a pair says.
fn intersect_down_to(
    pair_cost: usize,
    partition: Partition,
    (triangles, probes, any): (&Triangles<'_>, Probes<'_>, bool),
    (hits, pairs): (&mut Hits, &mut [u32]),
) -> Stats {
    // In range: both counts fit u32.
    let mut objects: Vec<u32> = (0..triangles.len() as u32).collect();
    let start = |index| {
        let ray = probes.ray(index);
        Active { slabs: Slabs::new(&ray), nearest: Nearest::none(ray.t_max), ray: index, tested: 0 }
    };
    let mut active: Vec<Active> = (0..probes.len() as u32).map(start).collect();
    let bytes = objects.capacity() * size_of::<u32>() + active.capacity() * size_of::<Active>();

    let ledger = Ledger::default();
    let query = Query { triangles, probes, any, partition, pair_cost, ledger: &ledger };
    let bounds = bounds_of(triangles, &objects);
    let mut stats = query.recurse(&mut active, &mut objects, &bounds, true);
    stats.engine_bytes += bytes as u64 + ledger.peak();

    for Active { ray, nearest, tested, .. } in active {
        if let Some(pairs) = pairs.get_mut(ray as usize) {
            *pairs = tested;
        }
        if nearest.is_hit() {
            hits.ids[ray as usize] = nearest.id;
            if !any {
                hits.ts[ray as usize] =
                    Distance::new(&probes.ray(ray), &triangles.triangle(nearest.id)).rounded(&mut stats);
            }
        }
    }
    stats
}

impl Query<'_> {
    /// One step of Algorithm 1. Rays that are not filtered all count as active.
    fn recurse(&self, rays: &mut [Active], objects: &mut [u32], bounds: &Aabb, filtered: bool) -> Stats {
        if rays.is_empty() {
            return Stats::default();
        }
        let mut stats = Stats { nodes: 1, ..Stats::default() };
        stats.touch((size_of_val(rays) + objects.len() * OBJECT_BYTES) as u64);
        let rays = if filtered { self.filter(rays, bounds, &mut stats) } else { rays };
        stats.filters_skipped += u64::from(!filtered);
        if rays.is_empty() {
            return stats;
        }
        if self.terminates(rays.len(), objects.len()) {
            return stats.plus(self.leaf(rays, objects));
        }
        if self.partition == Partition::Spatial
            && let Some(mut halves) = Halves::new(self.triangles, objects, bounds, self.ledger)
        {
            let [left, right] = &mut halves.lists;
            stats.references_made += (left.len() + right.len()) as u64;
            let split = Split { left: left.len(), axis: halves.axis, ascending: true, sampled: None };
            return stats.plus(self.descend(rays, [left, right], halves.bounds, split));
        }
        let mut split = self.split(rays, objects, bounds, &mut stats);
        let (left, right) = objects.split_at_mut(split.left);
        // In a voxel, only what lies within it.
        let boxes = [&*left, &*right].map(|side| bounds_of(self.triangles, side).common(*bounds));
        if self.partition == Partition::Given {
            if !given::separates(bounds, &boxes, [left.len(), right.len()]) {
                let query = Query { partition: Partition::Middle, ..*self };
                return stats.plus(query.recurse(rays, objects, bounds, true));
            }
            split = given::in_space(split.left, &boxes);
        }
        stats.plus(self.descend(rays, [left, right], boxes, split))
    }

    /// Near side first, then the far side with what the near side has found.
    fn descend(&self, rays: &mut [Active], sides: [&mut [u32]; 2], boxes: [Aabb; 2], split: Split) -> Stats {
        let [left, right] = sides;
        let parallel = rays.len() * (left.len() + right.len()) > PARALLEL_PAIRS;
        let left_first = match split.sampled {
            // One order for all rays: fewer steps, which cannot run in parallel.
            Some(sampled) if !parallel => {
                if sampled.most_ascend == split.ascending {
                    rays.len()
                } else {
                    0
                }
            }
            _ => partition(rays, |active| active.slabs.ascends(split.axis) == split.ascending),
        };
        let (left_first, right_first) = rays.split_at_mut(left_first);
        let [skip_left, skip_right] = split.sampled.map_or([false; 2], |sampled| sampled.met_by_most);

        let mut stats = Stats::default();
        for far in [false, true] {
            let (one, other) = if far {
                (&mut *right_first, &mut *left_first)
            } else {
                (&mut *left_first, &mut *right_first)
            };
            // What the near side has found makes what was sampled out of date.
            let mut one = || self.recurse(one, left, &boxes[0], far || !skip_left);
            let mut other = || self.recurse(other, right, &boxes[1], far || !skip_right);
            let (one, other) = if parallel { rayon::join(one, other) } else { (one(), other()) };
            stats = stats.plus(one).plus(other);
        }
        stats
    }

    /// The rays that may still find something in a box.
    fn filter<'b>(&self, rays: &'b mut [Active], bounds: &Aabb, stats: &mut Stats) -> &'b mut [Active] {
        let active = partition(rays, |active| self.may_meet(active, bounds));
        stats.box_tests += rays.len() as u64;
        stats.culled_by_bound += (rays.len() - active) as u64;
        &mut rays[..active]
    }

    /// Whether testing all pairs is estimated to cost no more than one more step.
    fn terminates(&self, rays: usize, objects: usize) -> bool {
        objects <= 2 || rays * objects * self.pair_cost <= 2 * rays * BOX_COST + objects * SPLIT_COST
    }

    /// Whether a ray may still find something in a box.
    fn may_meet(&self, active: &Active, bounds: &Aabb) -> bool {
        let Active { slabs, nearest, .. } = active;
        !(self.any && nearest.is_hit()) && slabs.may_meet(bounds, nearest.hi)
    }

    /// Splits objects in place, as the partition says; both sides hold some.
    fn split(&self, rays: &[Active], objects: &mut [u32], bounds: &Aabb, stats: &mut Stats) -> Split {
        match self.partition {
            Partition::Given => {
                // As they are given they stay: their ids are consecutive.
                let left = given::half(self.triangles.group_ends(), objects[0], objects.len());
                Split { left, axis: 0, ascending: true, sampled: None }
            }
            Partition::Sampled => match sampled::split(self.triangles, rays, objects) {
                Some((split, sampled)) => {
                    stats.rays_sampled += sampled as u64;
                    split
                }
                None => self.split_at_middle(objects, bounds),
            },
            Partition::Middle | Partition::Spatial => self.split_at_middle(objects, bounds),
        }
    }

    /// Splits objects by their centres at the middle of the longest side; at the median where that is lopsided.
    fn split_at_middle(&self, objects: &mut [u32], bounds: &Aabb) -> Split {
        let axis = bounds.longest_axis();
        let centre = |id: u32| self.triangles.bounds(id).centre()[axis];
        let middle = bounds.centre()[axis];
        let mut left = partition(objects, |&id| centre(id) < middle);
        if left.min(objects.len() - left) < objects.len() / LOPSIDED + 1 {
            // Triangles that share a vertex have boxes that all begin there: the middle would peel them off one by one.
            left = objects.len() / 2;
            objects.select_nth_unstable_by(left, |&one, &other| centre(one).total_cmp(&centre(other)));
        }
        Split { left, axis, ascending: true, sampled: None }
    }

    /// "DirectlyIntersect": all pairs.
    fn leaf(&self, rays: &mut [Active], objects: &[u32]) -> Stats {
        let mut stats = Stats { triangles_set_up: objects.len() as u64, ..Stats::default() };
        for active in rays {
            let (ray, before) = (self.probes.ray(active.ray), stats.samples_tested);
            for &id in objects {
                if self.any && active.nearest.is_hit() {
                    break;
                }
                // In another voxel it was found already.
                if active.nearest.id == id {
                    continue;
                }
                stats.samples_tested += 1;
                self.probes.test((active.ray, &ray), id, self.triangles, &mut active.nearest, &mut stats);
            }
            // In range: there are fewer than 2³² objects.
            active.tested = active.tested.saturating_add((stats.samples_tested - before) as u32);
        }
        stats
    }
}

/// The box of some triangles.
fn bounds_of(triangles: &Triangles<'_>, objects: &[u32]) -> Aabb {
    objects.iter().fold(Aabb::EMPTY, |bounds, &id| bounds.union(triangles.bounds(id)))
}

/// Moves what satisfies the predicate to the front and returns how many those are. O(n), in place.
pub(crate) fn partition<T>(items: &mut [T], predicate: impl Fn(&T) -> bool) -> usize {
    let mut kept = 0;
    for index in 0..items.len() {
        if predicate(&items[index]) {
            items.swap(kept, index);
            kept += 1;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::ray::Ray;
    use crate::rays::pencil::Rays;

    /// Where the recursion ends changes no bit of a hit: from leaves that hold everything to leaves of two triangles.
    #[test]
    fn termination_changes_no_hit() {
        let at = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) * 2.0 - 1.0;
        let point = |k: u32| DVec3::new(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        let near = |k: u32, j: u32| (point(k) + point(1000 + 3 * k + j) * 0.3).as_vec3().to_array();
        let positions: Vec<[f32; 3]> = (0..300).flat_map(|k| [0, 1, 2].map(|j| near(k, j))).collect();
        let indices: Vec<[u32; 3]> = (0..300).map(|k| [0, 1, 2].map(|j| 3 * k + j)).collect();
        let triangles = Triangles::new(&positions, &indices).expect("finite");
        let rays: Vec<Ray> = (0..500).map(|k| Ray::new(point(9000 + k), point(20_000 + k))).collect();
        let probes = Probes::Rays(Rays::General(&rays));
        let hits = |pair_cost: usize, partition: Partition| {
            let mut hits = Hits::missed(rays.len());
            let query = (&triangles, probes, false);
            let stats = intersect_down_to(pair_cost, partition, query, (&mut hits, &mut []));
            (hits, stats.nodes)
        };
        for partition in Partition::ALL {
            let (whole, one) = hits(0, partition);
            assert_eq!(one, 1);
            assert!(whole.ids().iter().filter(|&&id| id != crate::rays::hits::NO_TRIANGLE).count() > 100);
            let mut nodes = one;
            for pair_cost in [1, PAIR_COST, 100, 10_000] {
                let (found, more) = hits(pair_cost, partition);
                assert!(more >= nodes, "{more} nodes with {pair_cost}");
                assert_eq!(found, whole, "{partition:?}, {pair_cost}");
                nodes = more;
            }
        }
    }
}
