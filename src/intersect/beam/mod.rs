//! Rays that many receivers share, as beams: neighbouring receivers along one direction, under one bound.
//!
//! ```text
//! order the objects by cost, and the receivers in parcels of 256
//! for each parcel, in parallel, for each direction:
//!     the rays above the horizon are open
//!     close by the last occluders of this direction
//!     descend(all objects): the boxes that the beam may meet, large ones first; a run of sixteen triangles is a leaf
//! ```
//!
//! A leaf decides for the whole beam, for packets, or ray by ray: [`closing`]. Nothing of a direction is kept but its
//! last occluders. Each ray is decided exactly, so that neither the order of work nor what a thread remembers changes
//! an answer.
//!
//! Measured with 64 rays above the horizon of each receiver, nanoseconds a ray on one core of Zen 5, orders included: a
//! million receivers take 10.6 (koala), 10.2 (sponza) and 35 (chess). 200 thousand take 26, 26 and 100; by a grid of
//! cells for each direction, which beams took the place of, they took 112, 114 and 192. A ray of koala has a part of
//! 0.05 in nodes, 0.4 in triangles that are set up and 0.3 in tests of sixteen rays; of chess, whose pieces have more
//! triangles than receivers, 0.14, 2.7 and 2.1. The cost grows with the triangles for each receiver: with 20 thousand
//! receivers (5, 3.3 and 9 triangles each) it is 148, 180 and 540, and bundles, at 180 to 210, are faster on chess.
//!
//! What made beams fast: pairs of a triangle and a packet are listed without branches before any is tested, and a
//! triangle's rectangle is compared with those of packets before its functions are (chess 54 to 37). Kernels must be
//! compiled with the instruction set of their surroundings: as functions of their own, or with closures over vectors,
//! they took 8 times as long. Tried and dropped: parcels of 64, 128 and 192 receivers (1.0 to 1.1 times with few
//! receivers, 1.1 to 1.3 times with many on chess).
//!
//! Half of the triangles of closed surfaces are never tested: [`crate::objects::closed`] has the rule. A receiver's
//! first ray that no front face blocks is tested with back faces as well; if it is open, and no triangle contains the
//! receiver, front faces are enough from then on.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011; Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001 (directions shared by many
//! receivers); Sergey Zhukov, Andrei Iones, Grigorij Kronin, "An Ambient Light Illumination Model", 1998.

pub(crate) mod closing;
pub(crate) mod direction;
pub(crate) mod functions;
pub(crate) mod objects;
pub(crate) mod occluders;
pub(crate) mod order;
pub(crate) mod parcel;
pub(crate) mod query;
pub(crate) mod sides;
pub(crate) mod walk;

use std::sync::atomic::{AtomicU32, Ordering};

use fearless_simd::{Level, dispatch, prelude::*, u32x16};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::beam::closing::{Beam, Faces};
use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::objects::{Objects, Scale};
use crate::intersect::beam::occluders::LastOccluders;
use crate::intersect::beam::parcel::{Bits, PACKETS, Parcel, RECEIVERS};
use crate::intersect::beam::query::Query;
use crate::intersect::beam::sides::Sides;
use crate::objects::morton;
use crate::rays::hemisphere::{Occlusion, OpenRays, RaySample};
use crate::simd::lanes::WIDTH;
use crate::stats::Stats;

/// Directions for which a thread keeps occluders at the same time.
const DIRECTIONS: usize = 128;
/// Parcels in a row that one thread takes: neighbours have the same occluders.
const PARCELS: usize = 8;
/// Parcels, and directions, of which the cost is sampled.
const SAMPLED_PARCELS: usize = 16;
const SAMPLED_DIRECTIONS: usize = 32;
/// Coordinates up to here are compared in f32.
const GREATEST: f32 = 1e30;

/// What a thread keeps from parcel to parcel.
struct Workspace {
    parcel: Box<Parcel>,
    last: LastOccluders,
    sides: Sides,
    open: Vec<Bits>,
    stats: Stats,
    /// Rays above the horizon.
    rays: u64,
}

impl Workspace {
    fn new(directions: usize) -> Self {
        let (parcel, last) = (Parcel::new(), LastOccluders::new(directions));
        Self { parcel, last, sides: Sides::new(), open: Vec::new(), stats: Stats::default(), rays: 0 }
    }

    /// Finds the open rays of a parcel along some directions.
    fn close(&mut self, query: &Query<'_>, directions: &[Direction], ids: &[u32], level: Level) {
        (self.stats, self.rays) = (Stats::default(), 0);
        self.parcel.fill(query, ids);
        self.sides.forget();
        dispatch!(level, simd => close_parcel(simd, query, directions, self));
    }
}

/// Objects and receivers in their orders, ready for directions.
pub(crate) struct Beams<'a> {
    triangles: &'a Triangles<'a>,
    occlusion: &'a Occlusion<'a>,
    objects: Objects,
    order: Vec<u32>,
    level: Level,
}

impl<'a> Beams<'a> {
    /// Orders objects and receivers. `None` where numbers are too large for f32.
    pub(crate) fn new(
        triangles: &'a Triangles<'a>,
        occlusion: &'a Occlusion<'a>,
        level: Level,
    ) -> Option<Self> {
        let points = occlusion.hemispheres.par_iter().with_min_len(1 << 12).map(|hemisphere| {
            let point = hemisphere.receiver.point;
            Aabb { lo: point, hi: point }
        });
        let bounds = points.reduce(|| Aabb::EMPTY, Aabb::union).union(triangles.position_bounds());
        if !bounds.lo.iter().chain(&bounds.hi).all(|x| x.abs() < GREATEST) {
            return None;
        }
        let make = || Objects::new(triangles, Scale::of(&bounds), occlusion.back_faces, level);
        let (objects, order) = rayon::join(make, || parcel::in_parcels(occlusion.hemispheres, level));
        Some(Self { triangles, occlusion, objects, order, level })
    }

    fn query(&self) -> Query<'_> {
        let Self { triangles, occlusion, objects, .. } = self;
        Query::new(triangles, occlusion, objects)
    }

    /// What some parcels cost along some of the directions, evenly chosen from all; and how many rays that was.
    pub(crate) fn sampled(&self, samples: &[RaySample]) -> (Stats, u64) {
        let query = self.query();
        let chosen: Vec<RaySample> =
            samples.iter().step_by(samples.len().div_ceil(SAMPLED_DIRECTIONS).max(1)).copied().collect();
        let directions = direction::in_order(&chosen, self.objects.scale);
        let parcels = self.order.len().div_ceil(RECEIVERS);
        let chosen = self.order.par_chunks(RECEIVERS).step_by(parcels.div_ceil(SAMPLED_PARCELS).max(1));
        let costs = chosen.map_init(
            || Workspace::new(directions.len()),
            |work, ids| {
                work.close(&query, &directions, ids, self.level);
                (work.stats, work.rays)
            },
        );
        costs.reduce(Default::default, |one, other| (one.0.plus(other.0), one.1 + other.1))
    }

    /// Finds which rays of the receivers are open: words of bits, receiver by receiver.
    pub(crate) fn open_rays(&self, samples: &[RaySample]) -> (Vec<u32>, Stats) {
        let Self { objects, order, level, .. } = self;
        let (query, words) = (self.query(), OpenRays::words_for(samples.len()));
        // Parcels write side by side, each word once. Relaxed stores are plain ones.
        let open: Vec<AtomicU32> = (0..order.len() * words).map(|_| AtomicU32::new(0)).collect();
        let mut stats = Stats::default();
        for (number, samples) in samples.chunks(DIRECTIONS).enumerate() {
            let directions = direction::in_order(samples, objects.scale);
            let store = |id: u32, word: usize, bits: u32| {
                open[id as usize * words + number * (DIRECTIONS / 32) + word].store(bits, Ordering::Relaxed);
            };
            let of_parcel = |work: &mut Workspace, ids: &[u32]| {
                work.close(&query, &directions, ids, *level);
                dispatch!(*level, simd => scatter(simd, work, &directions, store));
                work.stats
            };
            let parcels = order.par_chunks(RECEIVERS).with_min_len(PARCELS);
            let of_batch = parcels.map_init(|| Workspace::new(directions.len()), of_parcel);
            stats = stats.plus(of_batch.reduce(Stats::default, Stats::plus));
        }
        let directions = samples.len().min(DIRECTIONS);
        let of_thread = size_of::<Parcel>()
            + Sides::BYTES
            + LastOccluders::bytes_for(directions)
            + directions * size_of::<Bits>();
        let threads = rayon::current_num_threads() * of_thread;
        let ordered = order.capacity() * size_of::<u32>();
        stats.engine_bytes = (objects.bytes + (ordered + threads).max(morton::bytes_for(order.len()))) as u64;
        (open.into_iter().map(AtomicU32::into_inner).collect(), stats)
    }
}

/// Finds the open rays of a parcel, direction by direction.
#[inline(always)]
fn close_parcel<S: Simd>(simd: S, query: &Query<'_>, directions: &[Direction], work: &mut Workspace) {
    let Workspace { parcel, last, sides, open, stats, rays } = work;
    open.clear();
    for (slot, direction) in directions.iter().enumerate() {
        let above = parcel.above(simd, query, direction);
        *rays += above.iter().map(|above| u64::from(above.count_ones())).sum::<u64>();
        open.push(close_beam(simd, (query, parcel, direction), above, (last, slot, sides), stats));
    }
}

/// Finds the open ones of some rays.
#[inline(always)]
fn close_beam<S: Simd>(
    simd: S,
    (query, parcel, direction): (&Query<'_>, &mut Parcel, &Direction),
    above: Bits,
    (last, slot, sides): (&mut LastOccluders, usize, &mut Sides),
    stats: &mut Stats,
) -> Bits {
    if above == [0; PACKETS] {
        return above;
    }
    let follows_rule = query.objects.any_closed && direction.limit == f32::INFINITY;
    let any_may = (0..PACKETS).any(|packet| above[packet] & !parcel.both_sides[packet] != 0);
    let LastOccluders { places, found } = last;
    let mut beam = Beam::new(simd, (query, parcel, direction), above, (found, sides), stats);
    beam.occluders.clear();
    let is_one_sided = !query.occlusion.back_faces;
    beam.faces = if is_one_sided || follows_rule && any_may { Faces::Front } else { Faces::Both };
    if places[slot].present != 0 {
        beam.close_by(simd, u32::MAX, &places[slot]);
    }
    if beam.count > 0 {
        beam.walk(simd);
    }
    if beam.faces == Faces::Both || is_one_sided || beam.count == 0 {
        let open = beam.open;
        last.update(slot, query.objects);
        return open;
    }
    let open = beam.open;
    let asked: Bits = std::array::from_fn(|packet| open[packet] & !parcel.outside[packet]);
    if asked != [0; PACKETS] {
        beam.faces = Faces::Back;
        beam.restart(simd, asked);
        beam.walk(simd);
    }
    let (left, touched) = (beam.open, beam.touched);
    last.update(slot, query.objects);
    if asked == [0; PACKETS] {
        return open;
    }
    for packet in 0..PACKETS {
        parcel.both_sides[packet] |= touched[packet];
        parcel.outside[packet] |= left[packet] & !parcel.both_sides[packet];
    }
    std::array::from_fn(|packet| open[packet] & !asked[packet] | left[packet])
}

/// Hands out the bits of each receiver as words, in the order of the samples as given.
#[inline(always)]
fn scatter<S: Simd>(simd: S, work: &Workspace, directions: &[Direction], store: impl Fn(u32, usize, u32)) {
    let parcel = &work.parcel;
    let lanes = u32x16::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    let count = OpenRays::words_for(directions.len());
    for (packet, ids) in parcel.ids[..parcel.count].chunks(WIDTH).enumerate() {
        let mut words = [u32x16::splat(simd, 0); DIRECTIONS / 32];
        for (direction, open) in directions.iter().zip(&work.open) {
            let bits = u32x16::splat(simd, u32::from(open[packet]));
            // In range: less than 32.
            words[direction.index / 32 % (DIRECTIONS / 32)] |=
                ((bits >> lanes) & 1) << (direction.index % 32) as u32;
        }
        for (word, words) in words[..count].iter().enumerate() {
            for (&id, bits) in ids.iter().zip(words.to_array()) {
                store(id, word, bits);
            }
        }
    }
}
