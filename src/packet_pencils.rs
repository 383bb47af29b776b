//! Open rays grouped by origin: the pencils of eight receivers that lie close together, against all triangles within reach.
//!
//! For a receiver at p the triangle abc has edge functions d·n with n = (A + B)×(b − a), A = a − p, as in [`crate::setup`]: they depend on
//! the direction only through a dot product. So n is found once for eight receivers and a triangle, and serves all
//! directions. Which directions come into question is decided for eight of them at once, from the middle c of the receivers' box: for p = c + δ the
//! function differs by 2d·(δ×(b − a)).
//!
//! What comes before:
//! 1. A box is met by a direction from some point of another box iff the direction meets their Minkowski difference from
//!    zero. Groups of runs that no open direction meets, or that lie beyond reach, are dropped.
//! 2. A triangle that does not rise above the surface of any of the eight receivers is dropped for all directions: on convex
//!    surfaces, that is the whole neighbourhood.
//!
//! **Filter.** With |d_k| ≤ 1, n divided by its error E = 8u₃₂·Σ|n_k| + 24u·|A + B|·|b − a| leaves doubt within ±1 only: n, d and their
//! products and sums round five times.
//!
//! Based on: Ingo Wald et al., "Interactive Rendering with Coherent Ray Tracing", 2001 (packets); Alexander Reshetov, Alexei
//! Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (one bound for many rays).

use fearless_simd::{prelude::*, u32x8};
use glam::DVec3;

use crate::approx::{Cross, Sign};
use crate::bounds::U;
use crate::departure::Side;
use crate::gather;
use crate::hemisphere::{Above, Hemisphere, Occlusion};
use crate::hits::NO_TRIANGLE;
use crate::lanes::{Boxes, LANES, LaneMask, Lanes, Narrow, NarrowMask, Points, bits, narrow, widen};
use crate::predicates::orientation;
use crate::receiver_cluster::ReceiverCluster;
use crate::runs::Runs;
use crate::sample_directions::{SAMPLES, SampleDirections};
use crate::triangles::{Triangle, widen as widen_point};
use crate::{Aabb, Accuracy, Stats, Triangles};

/// Five roundings in f32 of n, d, products and sums; the rest pays for what is of second order.
const EDGE_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// A component of n or N, as a part of the product of the sizes of its factors.
const CROSS_ERROR: f64 = 24.0 * U;
/// Keeps divisors from being zero.
const TINY: f64 = 1e-290;
/// Boxes and reaches are widened by this part of their size: a few roundings in f32.
const BOX_SLACK: f32 = 1.0 / (1 << 20) as f32;
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

/// The planes above which rays of a packet go.
struct Planes {
    count: usize,
    planes: [Plane; LANES],
}

#[derive(Clone, Copy)]
struct Plane {
    /// The normal upward, and what bounds the error of its components.
    normal: DVec3,
    permanent: DVec3,
    /// A point of it.
    at: DVec3,
    /// The triangle in it, as seen from above.
    triangle: Option<Triangle>,
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
        let runs = self.query.runs;
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
                let mask = self.meeting(simd, &boxes.get(lane), mask & self.live);
                if mask == 0 {
                    continue;
                }
                let child = Runs::child(node, lane);
                match runs.run(child) {
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

    /// Those of some directions that meet a box from some point of the packet's.
    #[inline(always)]
    fn meeting(&self, simd: S, bounds: &Aabb, mask: u128) -> u128 {
        let (lo, hi) = bounds.corners();
        let middle = (lo + hi) * 0.5 - self.centre;
        let half = (hi - lo) * 0.5 + self.half;
        let half = half + (middle.abs() + half) * f64::from(BOX_SLACK) + f64::from(f32::MIN_POSITIVE);
        let (m, h) = (middle.as_vec3(), half.as_vec3());
        if m.abs().cmple(h).all() {
            return mask;
        }
        let mut met = 0;
        for block in blocks(mask) {
            let ([x, y, z], [u, v, w]) = self.query.directions.eight(simd, block * LANES);
            let ahead = (x * m.x + y * m.y + z * m.z).simd_ge(-(u * h.x + v * h.y + w * h.z));
            let across_x = (y * m.z - z * m.y).abs().simd_le(v * h.z + w * h.y);
            let across_y = (z * m.x - x * m.z).abs().simd_le(w * h.x + u * h.z);
            let across_z = (x * m.y - y * m.x).abs().simd_le(u * h.y + v * h.x);
            let all = (ahead & across_x & across_y & across_z).to_bitmask();
            met |= u128::from(all) << (block * LANES);
        }
        met & mask
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
        let mask = self.directions_to(simd, triangle, mask);
        if mask == 0 {
            return;
        }
        stats.triangles_set_up += 1;
        let zero = Lanes::simd_from(simd, 0.0);
        let Points { x, y, z } = self.points;
        let points = Points { x, y, z };
        let corners = [triangle.a, triangle.b, triangle.c];
        let relative = [
            Points::splat(simd, corners[0]).minus(points),
            Points::splat(simd, corners[1]).minus(points),
            Points::splat(simd, corners[2]).minus(points),
        ];
        let sides = [triangle.b - triangle.a, triangle.c - triangle.b, triangle.a - triangle.c];
        let normal = Cross::of(sides[0], -sides[2]);
        let side = relative[0].dot(normal.value);
        let side_error = magnitudes(relative[0]).dot(normal.permanent) * CROSS_ERROR + TINY;
        let (positive, negative) = self.sides(triangle, side, side_error);
        let others = !self.owners.simd_eq(id).to_bitmask() & 0xFF;
        let facing = if self.query.occlusion.back_faces { positive | negative } else { negative };
        let alive = facing & others;
        if alive == 0 {
            return;
        }
        let turned = LaneMask::from_bitmask(simd, negative);
        let mut edges = [[Narrow::simd_from(simd, 0.0); 3]; 3];
        for (k, edge) in edges.iter_mut().enumerate() {
            let ends = relative[k].plus(relative[(k + 1) % 3]);
            let along = Points::splat(simd, sides[k]);
            let n = Points {
                x: ends.y * along.z - ends.z * along.y,
                y: ends.z * along.x - ends.x * along.z,
                z: ends.x * along.y - ends.y * along.x,
            };
            let size = sum_of(magnitudes(n));
            // The sum of the ends may cancel, their errors do not.
            let sizes = sum_of(magnitudes(relative[k])) + sum_of(magnitudes(relative[(k + 1) % 3]));
            let error = size * EDGE_ERROR + sizes * (sides[k].abs().max_element() * CROSS_ERROR) + TINY;
            let scale = (zero + 1.0) / error;
            let scale = turned.select(-scale, scale);
            *edge = [narrow(n.x * scale), narrow(n.y * scale), narrow(n.z * scale)];
        }
        let distance = Distances::new(simd, normal, side, side_error);
        let doubt = if self.query.accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        for slot in each(mask) {
            let [x, y, z] = self.query.directions.one(slot);
            let [one, two, three] = edges;
            let one = one[0] * x + one[1] * y + one[2] * z;
            let two = two[0] * x + two[1] * y + two[2] * z;
            let three = three[0] * x + three[1] * y + three[2] * z;
            let least = one.min(two).min(three);
            let open = u64::from(self.open[slot]) & alive;
            let mut kept = (!least.simd_lt(-doubt)).to_bitmask() & open;
            if kept == 0 {
                continue;
            }
            stats.samples_tested += LANES as u64;
            let mut certain = least.simd_gt(doubt).to_bitmask() & kept;
            let t_max = self.query.directions.t_max(slot);
            if t_max < f64::INFINITY {
                let (within, beyond) = distance.compare(simd, [x, y, z], t_max);
                (certain, kept) = (certain & within, kept & !beyond);
            }
            for lane in bits(kept & !certain) {
                stats.doubtful_samples += 1;
                let sample = self.query.directions.given(slot).1;
                let ray = self.query.occlusion.untested_ray(self.ids[lane] as usize, &sample);
                let blocked = ray.is_blocked_by(id, triangle, &mut stats.ambiguous_coverage);
                certain |= u64::from(blocked) << lane;
            }
            // In range: eight bits.
            self.open[slot] &= !(certain as u8);
            if self.open[slot] == 0 {
                self.live &= !(1 << slot);
            }
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

    /// Those of some directions in which the triangle may be met from some point of the packet's box.
    #[inline(always)]
    fn directions_to(&self, simd: S, triangle: &Triangle, mask: u128) -> u128 {
        let corners = [triangle.a - self.centre, triangle.b - self.centre, triangle.c - self.centre];
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        // The plane as seen from the box: beside it, or through it.
        let side = corners[0].dot(normal.value);
        let spread = (self.half + corners[0].abs() * CROSS_ERROR).dot(normal.permanent);
        if side.abs() <= spread * (1.0 + 1e-6) || side.is_nan() {
            return mask;
        }
        let sign = if side > 0.0 { 1.0 } else { -1.0 };
        let (mut n, mut limit) = ([[0.0_f32; 3]; 3], [0.0_f32; 3]);
        for k in 0..3 {
            let along = corners[(k + 1) % 3] - corners[k];
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let cross = Cross::sized(from + to, from.abs() + to.abs(), along);
            let spread = Cross::of(self.half, along).permanent * 2.0;
            let size = cross.permanent.x + cross.permanent.y + cross.permanent.z;
            let slack = (spread.x + spread.y + spread.z) * 1.001 + size * EDGE_ERROR;
            // Scaled, so that nothing leaves the range of f32.
            let scale = sign / (slack + size + TINY);
            n[k] = (cross.value * scale).as_vec3().to_array();
            limit[k] = -(slack * scale.abs()) as f32 - BOX_SLACK;
        }
        let mut met = 0;
        for block in blocks(mask) {
            let ([x, y, z], _) = self.query.directions.eight(simd, block * LANES);
            let one = (x * n[0][0] + y * n[0][1] + z * n[0][2]).simd_lt(limit[0]);
            let two = (x * n[1][0] + y * n[1][1] + z * n[1][2]).simd_lt(limit[1]);
            let three = (x * n[2][0] + y * n[2][1] + z * n[2][2]).simd_lt(limit[2]);
            met |= u128::from(!(one | two | three).to_bitmask() & 0xFF) << (block * LANES);
        }
        met & mask
    }
}

/// How far a triangle's plane is from eight receivers: |A·N|, and N over the sum of its components.
struct Distances<S: Simd> {
    normal: [f32; 3],
    /// Bounds of |A·N| over that sum.
    bounds: [Narrow<S>; 2],
}

impl<S: Simd> Distances<S> {
    #[inline(always)]
    fn new(simd: S, normal: Cross, side: Lanes<S>, error: Lanes<S>) -> Self {
        let size = normal.permanent.x + normal.permanent.y + normal.permanent.z + TINY;
        let zero = Narrow::simd_from(simd, 0.0);
        let lo = narrow((side.abs() - error) * (1.0 / size));
        let hi = narrow((side.abs() + error) * (1.0 / size));
        let bounds = [
            (lo * (1.0 - BOX_SLACK) - f32::MIN_POSITIVE).max(zero),
            hi * (1.0 + BOX_SLACK) + f32::MIN_POSITIVE,
        ];
        Self { normal: (normal.value / size).as_vec3().to_array(), bounds }
    }

    /// The receivers from which the plane is nearer than a limit for certain, and those from which it is farther.
    #[inline(always)]
    fn compare(&self, simd: S, [x, y, z]: [f32; 3], t_max: f64) -> (u64, u64) {
        let [u, v, w] = self.normal;
        let q = (u * x + v * y + w * z).abs();
        let limit = |q: f32, slack: f64| (f64::from(q) * t_max * (1.0 + slack)) as f32;
        let slack = f64::from(BOX_SLACK);
        let least = Narrow::simd_from(simd, limit(q - BOX_SLACK, -slack));
        let most = Narrow::simd_from(simd, limit(q + BOX_SLACK, slack));
        (self.bounds[1].simd_lt(least).to_bitmask(), self.bounds[0].simd_gt(most).to_bitmask())
    }
}

impl Planes {
    /// Of some receivers: one for each triangle that they lie on.
    fn of(query: PacketQuery<'_>, ids: &[u32]) -> Self {
        let none = Plane { normal: DVec3::ZERO, permanent: DVec3::ZERO, at: DVec3::ZERO, triangle: None };
        let mut planes = Self { count: 0, planes: [none; LANES] };
        let mut last = None;
        for &id in ids.iter().filter(|id| **id != NO_TRIANGLE) {
            let Hemisphere { receiver, above } = query.occlusion.hemispheres[id as usize];
            let key = (receiver.triangle, above);
            if last == Some(key) && matches!(above, Above::Side(_)) {
                continue;
            }
            last = Some(key);
            let plane = match above {
                Above::Normal(normal) => {
                    let normal = widen_point(normal);
                    Plane { normal, permanent: normal.abs(), at: widen_point(receiver.point), triangle: None }
                }
                Above::Side(side) => {
                    let Triangle { a, b, c } = query.triangles.triangle(receiver.triangle.0);
                    let (b, c) = if side == Side::Front { (b, c) } else { (c, b) };
                    let cross = Cross::of(b - a, c - a);
                    let triangle = Some(Triangle { a, b, c });
                    Plane { normal: cross.value, permanent: cross.permanent, at: a, triangle }
                }
            };
            planes.planes[planes.count] = plane;
            planes.count += 1;
        }
        planes
    }

    /// Those of eight triangles that have a corner strictly above some plane; those in doubt are decided, or kept.
    #[inline(always)]
    fn rising<S: Simd>(&self, simd: S, corners: &[Points<S>; 3], lanes: u64) -> u64 {
        let mut rising = 0;
        for plane in &self.planes[..self.count] {
            let at = Points::splat(simd, plane.at);
            let mut doubtful = 0;
            for corner in corners {
                let relative = corner.minus(at);
                let height = relative.dot(plane.normal);
                let error = magnitudes(relative).dot(plane.permanent) * CROSS_ERROR;
                let above = height.simd_gt(error).to_bitmask();
                rising |= above;
                doubtful |= !(above | height.simd_lt(-error).to_bitmask());
            }
            for lane in bits(doubtful & lanes & !rising) {
                let [a, b, c] = corners;
                let corner = |p: &Points<S>| {
                    DVec3::new(p.x.to_array()[lane], p.y.to_array()[lane], p.z.to_array()[lane])
                };
                let rises = [corner(a), corner(b), corner(c)].into_iter().any(|p| plane.is_below(p));
                rising |= u64::from(rises) << lane;
            }
        }
        rising & lanes
    }
}

impl Plane {
    /// Whether a point may lie strictly above: exactly, where there is a triangle.
    #[cold]
    fn is_below(&self, point: DVec3) -> bool {
        let Some(Triangle { a, b, c }) = self.triangle else { return true };
        let same = |k: usize| a[k] == b[k] && b[k] == c[k] && c[k] == point[k];
        if point == a || point == b || point == c || same(0) || same(1) || same(2) {
            return false;
        }
        // orient3d is positive for points on the back.
        orientation(a, b, c, point) == Sign::Negative
    }
}

/// |x|, |y| and |z|.
#[inline(always)]
fn magnitudes<S: Simd>(Points { x, y, z }: Points<S>) -> Points<S> {
    Points { x: x.abs(), y: y.abs(), z: z.abs() }
}

/// x + y + z.
#[inline(always)]
fn sum_of<S: Simd>(Points { x, y, z }: Points<S>) -> Lanes<S> {
    x + y + z
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

/// The blocks of eight directions that hold any of a set.
fn blocks(mask: u128) -> impl Iterator<Item = usize> {
    (0..SAMPLES / LANES).filter(move |block| mask >> (block * LANES) & 0xFF != 0)
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
