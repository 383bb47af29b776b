//! Open rays grouped by origin: the pencils of eight receivers that lie close together, against all triangles within reach.
//!
//! For a receiver at p the triangle abc has edge functions d·n with n = (A + B)×(b − a), A = a − p, as in [`crate::intersect::pencil::setup`]: they depend on
//! the direction only through a dot product. So n is found once for eight receivers and a triangle, and serves all
//! directions. Which directions come into question is decided for eight of them at once, see [`crate::intersect::by_origin::direction_masks`].
//!
//! What comes before:
//! 1. A box is met by a direction from some point of another box iff the direction meets their Minkowski difference from
//!    zero. Groups of runs that no open direction meets, or that lie beyond reach, are dropped.
//! 2. A triangle that does not rise above the surface of any of the eight receivers is dropped for all directions, see
//!    [`crate::intersect::by_origin::horizon_planes`]: on convex surfaces, that is the whole neighbourhood.
//!
//! Based on: Ingo Wald et al., "Interactive Rendering with Coherent Ray Tracing", 2001 (packets); Alexander Reshetov, Alexei
//! Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (one bound for many rays).

pub(crate) mod direction_masks;
pub(crate) mod edges;
pub(crate) mod horizon_planes;

use fearless_simd::{prelude::*, u32x8};
use glam::DVec3;

use crate::exact::filter::{Cross, Sign};
use crate::exact::predicates::orientation;
use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::U;
use crate::geometry::aabb::widen as widen_point;
use crate::geometry::triangles::Triangle;
use crate::geometry::triangles::Triangles;
use crate::intersect::by_origin::edges::{Distances, Edges};
use crate::intersect::by_origin::horizon_planes::Planes;
use crate::intersect::directions::receivers::ReceiverCluster;
use crate::intersect::directions::samples::{SAMPLES, SampleDirections};
use crate::objects::boxes::Boxes;
use crate::objects::gather;
use crate::objects::runs::Runs;
use crate::options::Accuracy;
use crate::rays::hemisphere::Occlusion;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::{LANES, LaneMask, Lanes, Narrow, NarrowMask, Points, bits, widen};
use crate::stats::Stats;

/// Five roundings in f32 of n, d, products and sums; the rest pays for what is of second order.
pub(crate) const EDGE_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// A component of n or N, as a part of the product of the sizes of its factors.
pub(crate) const CROSS_ERROR: f64 = 24.0 * U;
/// Keeps divisors from being zero.
pub(crate) const TINY: f64 = 1e-290;
/// Boxes and reaches are widened by this part of their size: a few roundings in f32.
pub(crate) const BOX_SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Nodes that wait: eight for each level of at most eleven.
const STACK: usize = 96;

/// What all packets share.
#[derive(Clone, Copy)]
pub(crate) struct PacketQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) occlusion: &'a Occlusion<'a>,
    pub(crate) directions: &'a SampleDirections,
    pub(crate) runs: &'a Runs,
    pub(crate) accuracy: Accuracy,
}

/// The open rays of a packet: for each sample, the receivers as bits.
pub(crate) type OpenPacket = [u8; SAMPLES];

/// Eight receivers and their open rays.
struct Packet<'a, S: Simd> {
    query: PacketQuery<'a>,
    points: Points<S>,
    owners: u32x8<S>,
    ids: [u32; LANES],
    /// The middle of their box, and half its sides.
    centre: DVec3,
    half: DVec3,
    planes: Planes,
    open: &'a mut OpenPacket,
    /// Samples with open rays.
    live: u128,
}

/// Closes those rays of a packet of a cluster that something within `reach` occludes. What lies farther may be left out, or
/// not.
#[inline(always)]
pub(crate) fn close_rays<S: Simd>(
    simd: S,
    query: PacketQuery<'_>,
    (cluster, packet): (&ReceiverCluster, usize),
    reach: f32,
    open: &mut OpenPacket,
) -> Stats {
    let mut stats = Stats::default();
    let mut live = 0;
    for (slot, open) in open.iter().enumerate() {
        live |= u128::from(*open != 0) << slot;
    }
    if live == 0 {
        return stats;
    }
    let first = packet * LANES;
    let [x, y, z] = [0, 1, 2].map(|k| Narrow::from_slice(simd, &cluster.at[k][first..first + LANES]));
    let bounds = cluster.packet_box(packet);
    let (lo, hi) = bounds.corners();
    let mut ids = [0; LANES];
    ids.copy_from_slice(&cluster.ids[first..first + LANES]);
    let mut packet = Packet {
        query,
        points: Points { x: widen(x), y: widen(y), z: widen(z) },
        owners: u32x8::from_slice(simd, &cluster.owners[first..first + LANES]),
        ids,
        centre: (lo + hi) * 0.5,
        half: (hi - lo) * 0.5,
        planes: Planes::of(query, &ids),
        open,
        live,
    };
    packet.descend(simd, &widened(&bounds, reach), &mut stats);
    stats
}

/// The box of what lies within reach of a box.
fn widened(bounds: &Aabb, reach: f32) -> Aabb {
    let slack = |x: f32| (x.abs() + reach) * BOX_SLACK + f32::MIN_POSITIVE;
    Aabb { lo: bounds.lo.map(|x| x - reach - slack(x)), hi: bounds.hi.map(|x| x + reach + slack(x)) }
}

impl<S: Simd> Packet<'_, S> {
    /// Goes through all runs that may matter.
    #[inline(always)]
    fn descend(&mut self, simd: S, within: &Aabb, stats: &mut Stats) {
        let PacketQuery { runs, directions, .. } = self.query;
        let mut stack = [(runs.root(), 0_u128); STACK];
        (stack[0].1, stats.nodes) = (self.live, stats.nodes + 1);
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (node, mask) = stack[waiting];
            let mask = mask & self.live;
            if mask == 0 {
                continue;
            }
            let Some(boxes) = runs.boxes(node) else { continue };
            stats.nodes += 1;
            stats.frustum_tests += LANES as u64;
            for lane in bits(overlapping(simd, boxes, within)) {
                let mask =
                    directions.meeting(simd, (self.centre, self.half), &boxes.get(lane), mask & self.live);
                if mask == 0 {
                    continue;
                }
                let child = node.child(lane);
                match child.leaf() {
                    Some(run) => self.intersect_run(simd, run, (within, mask), stats),
                    None if waiting < STACK => {
                        stack[waiting] = (child, mask);
                        waiting += 1;
                    }
                    None => {}
                }
            }
        }
    }

    /// Tests the triangles of a run.
    #[inline(always)]
    fn intersect_run(&mut self, simd: S, run: usize, (within, mask): (&Aabb, u128), stats: &mut Stats) {
        let (ids, count) = self.query.runs.ids(run);
        for (eight, ids) in ids.as_chunks::<LANES>().0.iter().enumerate() {
            let here = LANES.min(count.saturating_sub(eight * LANES));
            if here == 0 {
                continue;
            }
            let corners = gather::corners(simd, self.query.triangles, ids);
            let near = within_box(simd, &corners, within) & ((1 << here) - 1);
            let rising = if near == 0 { 0 } else { self.planes.rising(simd, &corners, near) };
            for lane in bits(rising) {
                let triangle = self.query.triangles.triangle(ids[lane]);
                self.intersect(simd, (ids[lane], &triangle), mask & self.live, stats);
            }
        }
    }

    /// Tests one triangle with the rays of some directions.
    #[inline(always)]
    fn intersect(&mut self, simd: S, (id, triangle): (u32, &Triangle), mask: u128, stats: &mut Stats) {
        let mask = self.query.directions.toward(simd, (self.centre, self.half), triangle, mask);
        if mask == 0 {
            return;
        }
        stats.triangles_set_up += 1;
        let corners = [triangle.a, triangle.b, triangle.c];
        let relative = [
            Points::splat(simd, corners[0]).minus(self.points),
            Points::splat(simd, corners[1]).minus(self.points),
            Points::splat(simd, corners[2]).minus(self.points),
        ];
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        let side = relative[0].dot(normal.value);
        let side_error = relative[0].magnitudes().dot(normal.permanent) * CROSS_ERROR + TINY;
        let (positive, negative) = self.sides(triangle, side, side_error);
        let others = !self.owners.simd_eq(id).to_bitmask() & 0xFF;
        let facing = if self.query.occlusion.back_faces { positive | negative } else { negative };
        let alive = facing & others;
        if alive == 0 {
            return;
        }
        let edges = Edges::new(simd, triangle, &relative, LaneMask::from_bitmask(simd, negative));
        let distance = Distances::new(simd, normal, side, side_error);
        for slot in each(mask) {
            self.test(simd, (id, triangle), (&edges, &distance), (slot, alive), stats);
        }
    }

    /// Tests one triangle with the rays of one direction.
    #[inline(always)]
    fn test(
        &mut self,
        simd: S,
        (id, triangle): (u32, &Triangle),
        (edges, distance): (&Edges<S>, &Distances<S>),
        (slot, alive): (usize, u64),
        stats: &mut Stats,
    ) {
        let PacketQuery { occlusion, directions, accuracy, .. } = self.query;
        let doubt = if accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        let direction = directions.one(slot);
        let least = edges.least(direction);
        let mut kept = (!least.simd_lt(-doubt)).to_bitmask() & u64::from(self.open[slot]) & alive;
        if kept == 0 {
            return;
        }
        stats.samples_tested += LANES as u64;
        let mut closed = least.simd_gt(doubt).to_bitmask() & kept;
        let t_max = directions.t_max(slot);
        if t_max < f64::INFINITY {
            let (within, beyond) = distance.compare(simd, direction, t_max);
            (closed, kept) = (closed & within, kept & !beyond);
        }
        for lane in bits(kept & !closed) {
            stats.doubtful_samples += 1;
            let sample = directions.given(slot).1;
            let ray = occlusion.untested_ray(self.ids[lane] as usize, &sample);
            closed |= u64::from(ray.is_blocked_by(id, triangle, stats)) << lane;
        }
        // In range: eight bits.
        self.open[slot] &= !(closed as u8);
        if self.open[slot] == 0 {
            self.live &= !(1 << slot);
        }
    }

    /// The receivers, as bits, with A·N > 0 and with A·N < 0: exactly.
    #[inline(always)]
    fn sides(&self, triangle: &Triangle, side: Lanes<S>, error: Lanes<S>) -> (u64, u64) {
        let (mut positive, mut negative) =
            (side.simd_gt(error).to_bitmask(), (-side).simd_gt(error).to_bitmask());
        let doubtful = !(positive | negative) & 0xFF;
        for lane in bits(doubtful).filter(|&lane| self.ids[lane] != NO_TRIANGLE) {
            let point = self.query.occlusion.hemispheres[self.ids[lane] as usize].receiver.point;
            match orientation(triangle.a, triangle.b, triangle.c, widen_point(point)) {
                Sign::Positive => positive |= 1 << lane,
                Sign::Negative => negative |= 1 << lane,
                Sign::Zero => {}
            }
        }
        (positive, negative)
    }
}

/// Those of eight boxes, as bits, that overlap another.
#[inline(always)]
fn overlapping<S: Simd>(simd: S, boxes: &Boxes, other: &Aabb) -> u64 {
    let mut met = NarrowMask::simd_from(simd, true);
    for k in 0..3 {
        met &= Narrow::load_array_ref(simd, &boxes.lo[k]).simd_le(other.hi[k])
            & Narrow::load_array_ref(simd, &boxes.hi[k]).simd_ge(other.lo[k]);
    }
    met.to_bitmask()
}

/// Those of eight triangles, as bits, whose boxes overlap a box.
#[inline(always)]
fn within_box<S: Simd>(simd: S, [a, b, c]: &[Points<S>; 3], bounds: &Aabb) -> u64 {
    let (lo, hi) = bounds.corners();
    let mut met = LaneMask::simd_from(simd, true);
    for ([a, b, c], (lo, hi)) in [[a.x, b.x, c.x], [a.y, b.y, c.y], [a.z, b.z, c.z]]
        .into_iter()
        .zip(lo.to_array().into_iter().zip(hi.to_array()))
    {
        met &= a.min(b).min(c).simd_le(hi) & a.max(b).max(c).simd_ge(lo);
    }
    met.to_bitmask()
}

/// The directions of a set.
fn each(mut mask: u128) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let slot = mask.trailing_zeros() as usize;
        (mask != 0).then(|| {
            mask &= mask - 1;
            slot
        })
    })
}
