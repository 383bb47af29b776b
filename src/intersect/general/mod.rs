//! The general path: Algorithm 1 for arbitrary rays, in place, with no stored hierarchy.
//!
//! ```text
//! intersect(rays, objects):
//!     rays <- those of `rays` that may meet bounds(objects)
//!     if few rays or few objects: directly intersect all pairs
//!     else: L, R <- partition(objects), see [`Partition`];
//!           the rays fall into those that meet L first and those that meet R first:
//!           phase 1   intersect(L-first rays, L) and intersect(R-first rays, R) in parallel
//!           phase 2   intersect(L-first rays, R) and intersect(R-first rays, L) in parallel
//! ```
//!
//! Each phase touches every ray and every object once, so both halves run in parallel without locks, copies or atomics,
//! and every ray sees its near side first. Rays and objects are permuted in place: 88 bytes per ray, 4 per object.
//! Voxels need lists of their own.
//!
//! Termination: testing all of r·o pairs is taken to cost no more than one more step when r·o·T ≤ 2rB + oS, with T, B
//! and S the costs of a pair, of a ray against a box and of moving an object. Their ratios 3 : 2 : 4 are estimates from
//! operation counts, and change time only: 3 : 1 : 8 has 1 % fewer instructions on sponza and 5 % more on koala, 3 : 2
//! : 2 has 6 and 7 % more, 3 : 2 : 16 1 and 34 % (10,000 diffuse-bounce rays, counted by callgrind).
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1; Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011 (streaming in
//! place).

pub(crate) mod active;
pub(crate) mod partition;
pub(crate) mod slab;

use std::mem::size_of;

use crate::exact::predicates::Distance;
use crate::geometry::aabb::Aabb;
use crate::intersect::general::active::{Active, move_to_front};
use crate::intersect::general::partition::spatial::Ledger;
use crate::intersect::general::partition::{Partitioner, Parts, bounds_of};
use crate::intersect::general::slab::Slabs;
use crate::intersect::ray_set::{Nearest, Question};
use crate::options::Partition;
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

/// What a step reads of an object: its place, its vertices and their positions.
const OBJECT_BYTES: usize = size_of::<u32>() + size_of::<[u32; 3]>() + size_of::<[[f32; 3]; 3]>();

/// What all steps share.
#[derive(Debug, Clone, Copy)]
struct Recursion<'a> {
    question: Question<'a>,
    partitioner: Partitioner<'a>,
    /// What testing a pair costs: decides where the recursion ends.
    pair_cost: usize,
}

/// Finds the nearest, or any, hit of each ray, with the default partition.
pub(crate) fn intersect(question: Question<'_>, hits: &mut Hits) -> Stats {
    intersect_by(Partition::default(), question, (hits, &mut []))
}

/// Finds the nearest, or any, hit of each ray, and counts the pairs of each unless there is no room for that.
pub(crate) fn intersect_by(
    partition: Partition,
    question: Question<'_>,
    answer: (&mut Hits, &mut [u32]),
) -> Stats {
    intersect_down_to(PAIR_COST, partition, question, answer)
}

/// The same, ending where the cost of a pair says.
fn intersect_down_to(
    pair_cost: usize,
    partition: Partition,
    question: Question<'_>,
    (hits, pairs): (&mut Hits, &mut [u32]),
) -> Stats {
    let Question { triangles, set, any } = question;
    // In range: both counts fit u32.
    let mut objects: Vec<u32> = (0..triangles.len() as u32).collect();
    let start = |index| {
        let ray = set.ray(index);
        Active { slabs: Slabs::new(&ray), nearest: Nearest::none(ray.t_max), ray: index, tested: 0 }
    };
    let mut active: Vec<Active> = (0..set.len() as u32).map(start).collect();
    let bytes = objects.capacity() * size_of::<u32>() + active.capacity() * size_of::<Active>();

    let ledger = &Ledger::default();
    let partitioner = Partitioner { triangles, partition, ledger };
    let recursion = Recursion { question, partitioner, pair_cost };
    let bounds = bounds_of(triangles, &objects);
    let mut stats = recursion.intersect(&mut active, &mut objects, &bounds, true);
    stats.engine_bytes += bytes as u64 + ledger.peak();

    for Active { ray, nearest, tested, .. } in active {
        if let Some(pairs) = pairs.get_mut(ray as usize) {
            *pairs = tested;
        }
        if nearest.is_hit() {
            hits.ids[ray as usize] = nearest.id;
            if !any {
                hits.ts[ray as usize] =
                    Distance::new(&set.ray(ray), &triangles.triangle(nearest.id)).rounded();
            }
        }
    }
    stats
}

impl Recursion<'_> {
    /// One step of Algorithm 1. Rays that are not filtered all count as active.
    fn intersect(&self, rays: &mut [Active], objects: &mut [u32], bounds: &Aabb, filtered: bool) -> Stats {
        let mut stats = Stats::default();
        let rays = self.active(rays, (&*objects, bounds), filtered, &mut stats);
        if rays.is_empty() {
            return stats;
        }
        if self.terminates(rays.len(), objects.len()) {
            return stats.plus(self.directly_intersect(rays, objects));
        }
        let parts = self.partitioner.partition(rays, objects, bounds, &mut stats);
        stats.plus(self.near_first(rays, parts))
    }

    /// The rays that may still find something among objects within a box, or all of them.
    fn active<'r>(
        &self,
        rays: &'r mut [Active],
        (objects, bounds): (&[u32], &Aabb),
        filtered: bool,
        stats: &mut Stats,
    ) -> &'r mut [Active] {
        if rays.is_empty() {
            return rays;
        }
        stats.nodes += 1;
        stats.touch((size_of_val(rays) + objects.len() * OBJECT_BYTES) as u64);
        if !filtered {
            stats.filters_skipped += 1;
            return rays;
        }
        let active = move_to_front(rays, |active| self.may_meet(active, bounds));
        stats.box_tests += rays.len() as u64;
        stats.culled_by_bound += (rays.len() - active) as u64;
        &mut rays[..active]
    }

    /// Whether a ray may still find something in a box.
    fn may_meet(&self, active: &Active, bounds: &Aabb) -> bool {
        let Active { slabs, nearest, .. } = active;
        !(self.question.any && nearest.is_hit()) && slabs.may_meet(bounds, nearest.hi)
    }

    /// Whether testing all pairs is estimated to cost no more than one more step.
    fn terminates(&self, rays: usize, objects: usize) -> bool {
        objects <= 2 || rays * objects * self.pair_cost <= 2 * rays * BOX_COST + objects * SPLIT_COST
    }

    /// Both parts: for each ray the near one first, then the far one with what the near one has found.
    fn near_first(&self, rays: &mut [Active], mut parts: Parts<'_>) -> Stats {
        let Parts { bounds, axis, ascending, sampled, partition, .. } = parts;
        let [left, right] = parts.objects();
        let changed;
        let recursion = if partition == self.partitioner.partition {
            self
        } else {
            changed = Self { partitioner: Partitioner { partition, ..self.partitioner }, ..*self };
            &changed
        };
        let parallel = rays.len() * (left.len() + right.len()) > PARALLEL_PAIRS;
        let left_first = match sampled {
            // One order for all rays: fewer steps, which cannot run in parallel.
            Some(sampled) if !parallel && sampled.most_ascend == ascending => rays.len(),
            Some(_) if !parallel => 0,
            _ => move_to_front(rays, |active| active.slabs.ascends(axis) == ascending),
        };
        let (left_first, right_first) = rays.split_at_mut(left_first);
        let [skip_left, skip_right] = sampled.map_or([false; 2], |sampled| sampled.met_by_most);

        let mut stats = Stats::default();
        for far in [false, true] {
            let (one, other) = if far {
                (&mut *right_first, &mut *left_first)
            } else {
                (&mut *left_first, &mut *right_first)
            };
            // What the near side has found makes what was sampled out of date.
            let mut one = || recursion.intersect(one, left, &bounds[0], far || !skip_left);
            let mut other = || recursion.intersect(other, right, &bounds[1], far || !skip_right);
            let (one, other) = if parallel { rayon::join(one, other) } else { (one(), other()) };
            stats = stats.plus(one).plus(other);
        }
        stats
    }

    /// "DirectlyIntersect": all pairs.
    fn directly_intersect(&self, rays: &mut [Active], objects: &[u32]) -> Stats {
        let Question { triangles, set, any } = self.question;
        let mut stats = Stats { triangles_set_up: objects.len() as u64, ..Stats::default() };
        for active in rays {
            let (ray, before) = (set.ray(active.ray), stats.samples_tested);
            for &id in objects {
                if any && active.nearest.is_hit() {
                    break;
                }
                // In another voxel it was found already.
                if active.nearest.id == id {
                    continue;
                }
                stats.samples_tested += 1;
                set.test((active.ray, &ray), id, triangles, &mut active.nearest, &mut stats);
            }
            // In range: there are fewer than 2³² objects.
            active.tested = active.tested.saturating_add((stats.samples_tested - before) as u32);
        }
        stats
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::ray::Ray;
    use crate::geometry::triangles::Triangles;
    use crate::intersect::ray_set::RaySet;
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
        let set = RaySet::Rays(Rays::General(&rays));
        let hits = |pair_cost: usize, partition: Partition| {
            let mut hits = Hits::missed(rays.len());
            let question = Question { triangles: &triangles, set, any: false };
            let stats = intersect_down_to(pair_cost, partition, question, (&mut hits, &mut []));
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
