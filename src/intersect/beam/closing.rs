//! One beam: the rays of a parcel along one direction, closed by runs of triangles.
//!
//! Sixteen triangles are set up at once, [`crate::intersect::beam::functions`], and compared with the beam: those that
//! miss it are dropped, and one that covers it closes all rays. Any other is compared with sixteen packets at once:
//! those it covers are closed, those it misses are left, and the rest are tested ray by ray, sixteen at once. What f32
//! leaves in doubt f64 decides, and then exact arithmetic.
//!
//! Based on: Erik Sintorn et al., "Per-Triangle Shadow Volumes Using a View-Sample Cluster Hierarchy", 2014 (a
//! hierarchy of samples against triangles); Kirill Dmitriev et al., "Faster Ray Tracing with SIMD Shaft Culling", 2004
//! (shafts that decide for all rays).

use fearless_simd::{mask16x16, mask32x16, prelude::*, u16x16};

use crate::exact::filter::Sign;
use crate::exact::predicates::facing;
use crate::geometry::aabb::widen;
use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::functions::{Coefficients, Functions, SetUp, splat};
use crate::intersect::beam::objects::Run;
use crate::intersect::beam::parcel::{Bits, PACKETS, Parcel};
use crate::intersect::beam::query::Query;
use crate::intersect::beam::sides::Sides;
use crate::simd::lanes::{WIDTH, Wide, bits};
use crate::stats::Stats;

/// What rounding adds to half sides of rectangles, in parts of the reach of a parcel.
const RECTANGLE_SLACK: f32 = 8.0 / (1 << 24) as f32;
/// A rectangle is fitted again when so many of its rays are closed, as the inverse of a part.
const FIT: u32 = 4;
/// Packets that a triangle may meet before all are compared with its functions.
const FEW: u32 = 3;
/// A triangle that closes fewer rays is not worth remembering.
const WORTH: u32 = 16;

/// Which faces of closed components are tested. Those of others always are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Faces {
    Both,
    /// Front faces, and what is seen edge-on.
    Front,
    /// The rest.
    Back,
}

/// A triangle that closed rays, by its run and its place there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Occluder {
    pub(crate) run: u32,
    pub(crate) lane: u32,
    pub(crate) closed: u32,
}

/// Boxes in u, v and x_k around the rays of packets.
#[derive(Debug)]
struct PacketBoxes {
    middle: [[f32; PACKETS]; 3],
    half: [[f32; PACKETS]; 3],
}

/// The rays of a parcel along a direction.
pub(crate) struct Beam<'a> {
    pub(crate) query: &'a Query<'a>,
    pub(crate) parcel: &'a Parcel,
    pub(crate) direction: &'a Direction,
    pub(crate) faces: Faces,
    /// Rays that nothing has closed, packets with such, and how many they are.
    pub(crate) open: Bits,
    live: u32,
    pub(crate) count: u32,
    packets: PacketBoxes,
    /// The box around the packets that are alive: middle and half sides.
    pub(crate) middle: [f32; 3],
    pub(crate) half: [f32; 3],
    /// Rays when it was fitted.
    fitted: u32,
    /// Where all rays are, packet by packet: u and v.
    places: [[[f32; WIDTH]; 2]; PACKETS],
    /// Of the run that is tested: functions; the least and the greatest u, and v; the rays that each triangle has
    /// closed; and pairs of a triangle and a packet, the triangle in the upper byte.
    coefficients: Coefficients,
    sides: [[f32; WIDTH]; 4],
    closed_by: [u32; WIDTH],
    pairs: [u16; WIDTH * (PACKETS + 1)],
    /// Receivers that a triangle of a closed component may contain.
    pub(crate) touched: Bits,
    /// The run that is tested, and what closed many rays.
    pub(crate) run: u32,
    pub(crate) occluders: &'a mut Vec<Occluder>,
    /// Where receivers lie to triangles.
    sides_of_planes: &'a mut Sides,
    pub(crate) stats: &'a mut Stats,
}

impl<'a> Beam<'a> {
    /// All rays of a parcel that are above the horizon.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        (query, parcel, direction): (&'a Query<'a>, &'a Parcel, &'a Direction),
        open: Bits,
        (occluders, sides_of_planes): (&'a mut Vec<Occluder>, &'a mut Sides),
        stats: &'a mut Stats,
    ) -> Self {
        let mut beam = Self {
            query,
            parcel,
            direction,
            faces: Faces::Both,
            open,
            live: 0,
            count: 0,
            packets: PacketBoxes { middle: [[0.0; PACKETS]; 3], half: [[0.0; PACKETS]; 3] },
            middle: [0.0; 3],
            half: [0.0; 3],
            fitted: 0,
            places: [[[0.0; WIDTH]; 2]; PACKETS],
            coefficients: [[0.0; WIDTH]; 14],
            sides: [[0.0; WIDTH]; 4],
            closed_by: [0; WIDTH],
            pairs: [0; WIDTH * (PACKETS + 1)],
            touched: [0; PACKETS],
            run: u32::MAX,
            occluders,
            sides_of_planes,
            stats,
        };
        beam.bound_packets(simd);
        beam.restart(simd, open);
        beam
    }

    /// Takes some of the rays as those that are open.
    #[inline(always)]
    pub(crate) fn restart<S: Simd>(&mut self, simd: S, open: Bits) {
        self.open = open;
        (self.live, self.count) = (0, 0);
        for (packet, open) in open.iter().enumerate() {
            self.live |= u32::from(*open != 0) << packet;
            self.count += open.count_ones();
        }
        if self.count > 0 {
            self.fit(simd);
        }
    }

    /// Bounds the rays of each packet.
    #[inline(always)]
    fn bound_packets<S: Simd>(&mut self, simd: S) {
        let inf = Wide::splat(simd, f32::INFINITY);
        let (mut lo, mut hi) = ([inf; 3], [-inf; 3]);
        for one_of_each in &self.parcel.transposed {
            let at = self.direction.load(simd, one_of_each);
            let [u, v] = self.direction.across(simd, at);
            (lo[0], hi[0]) = (lo[0].min(u), hi[0].max(u));
            (lo[1], hi[1]) = (lo[1].min(v), hi[1].max(v));
            (lo[2], hi[2]) = (lo[2].min(at[0]), hi[2].max(at[0]));
        }
        for (at, places) in self.parcel.at.iter().zip(&mut self.places) {
            let at = self.direction.load(simd, at);
            let [u, v] = self.direction.across(simd, at);
            u.store_slice(&mut places[0]);
            v.store_slice(&mut places[1]);
        }
        let slack = self.parcel.reach * RECTANGLE_SLACK;
        for axis in 0..3 {
            ((lo[axis] + hi[axis]) * 0.5).store_slice(&mut self.packets.middle[axis]);
            ((hi[axis] - lo[axis]) * 0.5 + slack).store_slice(&mut self.packets.half[axis]);
        }
    }

    /// Bounds the packets that are alive.
    #[inline(always)]
    fn fit<S: Simd>(&mut self, simd: S) {
        let live = mask32x16::from_bitmask(simd, u64::from(self.live));
        let inf = Wide::splat(simd, f32::INFINITY);
        let slack = self.parcel.reach * RECTANGLE_SLACK;
        for axis in 0..3 {
            let middle = Wide::load_array_ref(simd, &self.packets.middle[axis]);
            let half = Wide::load_array_ref(simd, &self.packets.half[axis]);
            let lo = live.select(middle - half, inf).reduce_min();
            let hi = live.select(middle + half, -inf).reduce_max();
            self.middle[axis] = (lo + hi) * 0.5;
            self.half[axis] = (hi - lo) * 0.5 + slack;
        }
        self.fitted = self.count;
    }

    /// Tests a run.
    #[inline(always)]
    pub(crate) fn close_by<S: Simd>(&mut self, simd: S, number: u32, run: &Run) {
        // A function of its own, with the instruction set: called from several places.
        simd.vectorize(
            #[inline(always)]
            || self.close_by_sixteen(simd, number, run),
        );
    }

    #[inline(always)]
    fn close_by_sixteen<S: Simd>(&mut self, simd: S, number: u32, run: &Run) {
        self.run = number;
        let limited = self.direction.limit < f32::INFINITY;
        let set_up = SetUp::new(simd, self.direction, run, (self.parcel.middle, self.parcel.reach));
        let certain = run.closed & !set_up.edge_on;
        let here = run.present
            & match self.faces {
                Faces::Both => !0,
                Faces::Front => !(set_up.away & certain),
                Faces::Back => set_up.away & certain,
            };
        if here == 0 {
            return;
        }
        self.stats.triangles_set_up += u64::from(here.count_ones());
        let (middle, half) = (splat(simd, self.middle), splat(simd, self.half));
        let [least, most] = set_up.functions.extremes(limited, &middle, &half);
        // What is seen edge-on may be a back face.
        let never = if self.query.occlusion.back_faces { 0 } else { set_up.edge_on };
        // In range: sixteen bits.
        let covering = least.simd_gt(1.0).to_bitmask() as u16 & here & !never;
        if covering != 0 && self.parcel.has_no_strays() {
            self.remember(covering.trailing_zeros(), self.count);
            (self.open, self.live, self.count) = ([0; PACKETS], 0, 0);
            return;
        }
        let [[u0, u1], [v0, v1]] = set_up.sides;
        let slack = self.query.slack;
        let apart = (u0 - (middle[0] + half[0])).max(middle[0] - half[0] - u1);
        let apart = apart.max(v0 - (middle[1] + half[1])).max(middle[1] - half[1] - v1);
        let missed = most.simd_lt(-1.0) | apart.simd_gt(slack);
        let meeting = !(missed.to_bitmask() as u16) & here;
        if meeting == 0 {
            return;
        }
        set_up.functions.store(&mut self.coefficients);
        for (stored, side) in self.sides.iter_mut().zip([u0, u1, v0, v1]) {
            side.store_slice(stored);
        }
        let pairs = self.pair_up(simd, run, (meeting, never));
        self.close_pairs(simd, run, (pairs, never));
        if self.count * FIT < self.fitted * (FIT - 1) && self.count > 0 {
            self.fit(simd);
        }
    }

    /// Remembers a triangle of the run that is tested.
    fn remember(&mut self, lane: u32, closed: u32) {
        self.occluders.push(Occluder { run: self.run, lane, closed });
    }

    /// Closes the packets that triangles of the run cover, and lists the pairs of a triangle and a packet that it may
    /// meet. Tells how many these are.
    #[inline(always)]
    fn pair_up<S: Simd>(&mut self, simd: S, run: &Run, (meeting, never): (u16, u16)) -> usize {
        let limited = self.direction.limit < f32::INFINITY;
        let numbers = u16x16::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
        let (middle, half) = (load(simd, &self.packets.middle), load(simd, &self.packets.half));
        let slack = self.query.slack;
        let mut pairs = 0;
        self.closed_by = [0; WIDTH];
        for lane in bits(u64::from(meeting)) {
            let lane = lane % WIDTH;
            let [u0, u1, v0, v1] = &self.sides;
            let apart = (u0[lane] - middle[0]).max(middle[0] - u1[lane]) - half[0];
            let apart = apart.max((v0[lane] - middle[1]).max(middle[1] - v1[lane]) - half[1]);
            let mut meets = !apart.simd_gt(slack).to_bitmask() & u64::from(self.live);
            if meets.count_ones() > FEW {
                let functions = Functions::of_one(simd, &self.coefficients, lane);
                let [least, most] = functions.extremes(limited, &middle, &half);
                meets &= !most.simd_lt(-1.0).to_bitmask();
                let covered = least.simd_gt(1.0).to_bitmask() & meets;
                if covered != 0 && never >> lane & 1 == 0 {
                    self.close_packets(simd, (run.ids[lane], lane), covered);
                    meets &= !covered;
                }
            }
            let chosen = mask16x16::from_bitmask(simd, meets);
            // In range: less than sixteen.
            (numbers | (lane << 8) as u16)
                .compress(chosen)
                .store_slice(&mut self.pairs[pairs..pairs + WIDTH]);
            pairs += meets.count_ones() as usize;
        }
        pairs
    }

    /// Closes all rays of packets by a triangle.
    #[inline(always)]
    fn close_packets<S: Simd>(&mut self, simd: S, (id, lane): (u32, usize), covered: u64) {
        for packet in bits(covered) {
            let packet = packet % PACKETS;
            let left = self.open[packet] & self.parcel.exempt(simd, packet, id);
            self.closed_by[lane] += (self.open[packet] & !left).count_ones();
            self.set_open(packet, left);
        }
    }

    /// Tests the rays of pairs, sixteen at once.
    #[inline(always)]
    fn close_pairs<S: Simd>(&mut self, simd: S, run: &Run, (pairs, never): (usize, u16)) {
        let limited = self.direction.limit < f32::INFINITY;
        let [k, ..] = self.direction.axes;
        self.stats.samples_tested += (pairs * WIDTH) as u64;
        for pair in 0..pairs {
            let pair = usize::from(self.pairs[pair]);
            let (lane, packet) = (pair >> 8 & (WIDTH - 1), pair % PACKETS);
            let functions = Functions::of_one(simd, &self.coefficients, lane);
            let [u, v] = &self.places[packet];
            let (u, v) = (Wide::load_array_ref(simd, u), Wide::load_array_ref(simd, v));
            let least =
                functions.least(limited, u, v, Wide::load_array_ref(simd, &self.parcel.at[packet][k]));
            let certain = if never >> lane & 1 == 1 { f32::INFINITY } else { 1.0 };
            let open = self.open[packet] & !self.parcel.own(simd, packet, run.ids[lane]);
            // In range: sixteen bits.
            let closed = least.simd_gt(certain).to_bitmask() as u16 & open;
            let doubtful = !(least.simd_lt(-1.0).to_bitmask() as u16) & open & !closed;
            self.set_open(packet, self.open[packet] & !closed);
            self.closed_by[lane] += closed.count_ones();
            if doubtful != 0 {
                self.decide(run, lane, packet, doubtful);
            }
        }
        for lane in 0..WIDTH {
            let closed = self.closed_by[lane];
            self.count -= closed;
            if closed >= WORTH {
                // In range: less than sixteen.
                self.remember(lane as u32, closed);
            }
        }
    }

    /// Leaves these rays of a packet open.
    #[inline(always)]
    fn set_open(&mut self, packet: usize, open: u16) {
        self.open[packet] = open;
        self.live &= !(u32::from(open == 0) << packet);
    }

    /// Decides, one by one, the rays of a packet that f32 leaves in doubt.
    #[inline(never)]
    fn decide(&mut self, run: &Run, lane: usize, packet: usize, doubtful: u16) {
        let id = run.ids[lane];
        self.stats.doubtful_samples += u64::from(doubtful.count_ones());
        let (query, receivers) = (self.query, &self.parcel.ids[packet * WIDTH..][..WIDTH]);
        let find = |place: usize| {
            let receiver = receivers[place % WIDTH] as usize;
            let point = query.occlusion.hemispheres[receiver].receiver.point;
            (query.triangles.triangle(id), widen(point))
        };
        // In range: sixteen packets.
        let [within, positive] = self.sides_of_planes.of((id, packet as u16), doubtful, &find);
        if query.objects.any_closed && run.closed >> lane & 1 == 1 {
            self.touched[packet] |= within & doubtful & !self.parcel.outside[packet];
        }
        let left = doubtful & !within;
        if left == 0 {
            return;
        }
        let triangle = query.triangles.triangle(id);
        // Where d·N is zero the line lies beside the plane, or in it.
        let met = match facing(self.direction.sample.direction, &triangle) {
            Sign::Negative => !positive,
            Sign::Zero => 0,
            Sign::Positive => positive,
        };
        for place in bits(u64::from(left & met)) {
            let receiver = receivers[place % WIDTH] as usize;
            let ray = query.occlusion.untested_ray(receiver, &self.direction.sample);
            if ray.is_blocked_by(id, &triangle, self.stats) {
                self.set_open(packet, self.open[packet] & !(1 << place));
                self.closed_by[lane] += 1;
            }
        }
    }
}

/// Three times sixteen numbers.
#[inline(always)]
fn load<S: Simd>(simd: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> [Wide<S>; 3] {
    [Wide::load_array_ref(simd, x), Wide::load_array_ref(simd, y), Wide::load_array_ref(simd, z)]
}
