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
//! A leaf decides for the whole beam, for packets, or ray by ray: [`closing`]. Nothing of a direction is kept but its last occluders. Each ray is
//! decided exactly, so that neither the order of work nor what a thread remembers changes an answer.
//!
//! Half of the triangles of closed surfaces are never tested: [`crate::objects::closed`] has the rule. A receiver's first ray that no front face
//! blocks is tested with back faces as well; if it is open, and no triangle contains the receiver, front faces are enough from then on.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011; Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001 (directions shared by many receivers); Sergey
//! Zhukov, Andrei Iones, Grigorij Kronin, "An Ambient Light Illumination Model", 1998.

pub(crate) mod closing;
pub(crate) mod direction;
pub(crate) mod functions;
pub(crate) mod objects;
pub(crate) mod occluders;
pub(crate) mod order;
pub(crate) mod parcel;
pub(crate) mod walk;

use std::sync::atomic::{AtomicU32, Ordering};

use fearless_simd::{Level, dispatch, f32x16, prelude::*, u32x16};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::beam::closing::{Beam, Faces};
use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::objects::{Objects, Scale};
use crate::intersect::beam::occluders::LastOccluders;
use crate::intersect::beam::parcel::{Bits, PACKETS, Parcel, RECEIVERS};
use crate::objects::morton;
use crate::rays::hemisphere::{Occlusion, OpenRays, RaySample};
use crate::stats::Stats;

/// Triangles, rays or packets side by side.
pub(crate) const WIDTH: usize = 16;
/// Sixteen numbers.
pub(crate) type Wide<S> = f32x16<S>;

/// Directions for which a thread keeps occluders at the same time.
const DIRECTIONS: usize = 128;
/// Parcels in a row that one thread takes: neighbours have the same occluders.
const PARCELS: usize = 8;
/// Coordinates up to here are compared in f32.
const GREATEST: f32 = 1e30;
/// Places of boxes and of rays err by less than this part of the scene's size, 1 at most: twice six roundings of two
/// coordinates each.
const SLACK: f32 = 32.0 / (1 << 24) as f32;

/// What all beams share.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) occlusion: &'a Occlusion<'a>,
    pub(crate) objects: &'a Objects,
    /// What is added around boxes.
    pub(crate) slack: f32,
}

impl Query<'_> {
    /// The scaled point of a receiver.
    #[inline(always)]
    fn scaled(&self, id: u32) -> [f32; 3] {
        let scale = self.objects.scale;
        self.occlusion.hemispheres[id as usize].receiver.point.map(|x| scale.of_length(x))
    }
}

/// What a thread keeps from parcel to parcel.
struct Workspace {
    parcel: Box<Parcel>,
    last: LastOccluders,
    open: Vec<Bits>,
    stats: Stats,
}

impl Workspace {
    fn new(directions: usize) -> Self {
        Self { parcel: Parcel::new(), last: LastOccluders::new(directions), open: Vec::new(), stats: Stats::default() }
    }
}

/// Finds which rays of the receivers are open: words of bits, receiver by receiver. `None` where numbers are too large for f32.
pub(crate) fn open_rays(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    samples: &[RaySample],
    level: Level,
) -> Option<(Vec<u32>, Stats)> {
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
    let query = Query { triangles, occlusion, objects: &objects, slack: SLACK };
    let words = OpenRays::words_for(samples.len());
    // Parcels write side by side, each word once. Relaxed stores are plain ones.
    let open: Vec<AtomicU32> = (0..order.len() * words).map(|_| AtomicU32::new(0)).collect();
    let mut stats = Stats::default();
    for (number, samples) in samples.chunks(DIRECTIONS).enumerate() {
        let directions = direction::in_order(samples, objects.scale);
        let store = |id: u32, word: usize, bits: u32| {
            open[id as usize * words + number * (DIRECTIONS / 32) + word].store(bits, Ordering::Relaxed);
        };
        let parcels = order.par_chunks(RECEIVERS).with_min_len(PARCELS);
        let of_parcel = |work: &mut Workspace, ids: &[u32]| {
            work.stats = Stats::default();
            work.parcel.fill(&query, ids);
            dispatch!(level, simd => close_parcel(simd, &query, &directions, work));
            dispatch!(level, simd => scatter(simd, work, &directions, store));
            work.stats
        };
        let of_batch = parcels.map_init(|| Workspace::new(directions.len()), of_parcel);
        stats = stats.plus(of_batch.reduce(Stats::default, Stats::plus));
    }
    let of_thread = size_of::<Parcel>() + LastOccluders::bytes_for(samples.len().min(DIRECTIONS)) + DIRECTIONS * size_of::<Bits>();
    let kept = objects.bytes + order.capacity() * size_of::<u32>() + rayon::current_num_threads() * of_thread;
    stats.engine_bytes = kept.max(morton::bytes_for(order.len())) as u64;
    Some((open.into_iter().map(AtomicU32::into_inner).collect(), stats))
}

/// Finds the open rays of a parcel, direction by direction.
#[inline(always)]
fn close_parcel<S: Simd>(simd: S, query: &Query<'_>, directions: &[Direction], work: &mut Workspace) {
    let Workspace { parcel, last, open, stats } = work;
    open.clear();
    for (slot, direction) in directions.iter().enumerate() {
        let above = parcel.above(simd, query, direction);
        open.push(close_beam(simd, (query, parcel, direction), above, (last, slot), stats));
    }
}

/// Finds the open ones of some rays.
#[inline(always)]
fn close_beam<S: Simd>(
    simd: S,
    (query, parcel, direction): (&Query<'_>, &mut Parcel, &Direction),
    above: Bits,
    (last, slot): (&mut LastOccluders, usize),
    stats: &mut Stats,
) -> Bits {
    if above == [0; PACKETS] {
        return above;
    }
    let follows_rule = query.objects.any_closed && direction.limit == f32::INFINITY;
    let any_may = (0..PACKETS).any(|packet| above[packet] & !parcel.both_sides[packet] != 0);
    let LastOccluders { places, found } = last;
    let mut beam = Beam::new(simd, (query, parcel, direction), above, found, stats);
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
            words[direction.index / 32 % (DIRECTIONS / 32)] |= ((bits >> lanes) & 1) << (direction.index % 32) as u32;
        }
        for (word, words) in words[..count].iter().enumerate() {
            for (&id, bits) in ids.iter().zip(words.to_array()) {
                store(id, word, bits);
            }
        }
    }
}
