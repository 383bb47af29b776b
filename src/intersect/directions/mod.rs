//! Open rays by pencils, grouped by direction or by origin.
//!
//! The receivers are ordered once, along a curve in space, see [`crate::objects::point_order`], and put into packets of eight. By direction, each
//! sample is one parallel pencil over all packets, see [`crate::intersect::directions::cells`]. By origin, a packet's rays along all samples are
//! followed together, see [`crate::intersect::by_origin`].
//!
//! By direction takes less time than by origin wherever it was measured, for two thousand receivers (half) as for a million (a tenth):
//! koala, sponza, chess, 64 rays. But each direction looks at every triangle, so few receivers go in bundles, see
//! [`crate::query::occlusion`]: 20 thousand took 0.75 (koala), 0.65 (sponza) and 0.46 (chess) of the time by direction, with 5, 3 and 9
//! triangles per receiver; half as many receivers as triangles take about as long either way, a million several times as
//! long in bundles. [`Grouping::Auto`] takes what is faster.
//!
//! Tried and dropped: following the first part of each ray by origin, since much of the work lies near the surface, and the rest by
//! direction. Samples tested fell to a half (koala), but no time was gained for a part as long as the packet, and for twice that a
//! quarter was lost.
//!
//! Based on: Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001 (directions shared by many receivers); Sergey
//! Zhukov, Andrei Iones, Grigorij Kronin, "An Ambient Light Illumination Model", 1998.

pub(crate) mod binning;
pub(crate) mod cell_leaf;
pub(crate) mod cells;
pub(crate) mod packet_set;
pub(crate) mod receivers;
pub(crate) mod samples;

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::by_origin::{PacketQuery, close_rays};
use crate::intersect::directions::cell_leaf::CellQuery;
use crate::intersect::directions::cells::{CellScratch, close_rays_along};
use crate::intersect::directions::packet_set::PacketSet;
use crate::intersect::directions::receivers::{Horizons, PACKETS, RECEIVERS, ReceiverCluster};
use crate::intersect::directions::samples::{SAMPLES, SampleDirections};
use crate::objects::gather::{EightCorners, eight_corners};
use crate::objects::morton::{along_curve, bytes_for};
use crate::objects::runs::{RUN, Runs};
use crate::options::Accuracy;
use crate::rays::hemisphere::{Grouping, Occlusion, OpenRays, RaySample};
use crate::rays::point_order::PointGrid;
use crate::simd::lanes::LANES;
use crate::stats::Stats;

/// What t-coordinates and keys of f32 may err by, as a part of their size: a few roundings.
const REACH_SLACK: f64 = 1.0 / (1 << 18) as f64;
/// Coordinates up to here are compared in f32.
const GREATEST: f32 = 1e30;

/// Whether receivers are so few, compared with triangles, that their rays are better followed in bundles. With 64 rays each, bundles
/// are faster where receivers are half (koala, 1.8 times) or 0.6 (chess, 1.3 times) of the triangles, and slower where
/// they are 0.9 (sponza, 0.8 times).
pub(crate) fn are_few(triangles: &Triangles<'_>, occlusion: &Occlusion<'_>) -> bool {
    occlusion.grouping == Grouping::Auto && occlusion.hemispheres.len() <= triangles.len() / 3 * 2
}

/// What all clusters share.
#[derive(Clone, Copy)]
struct HemisphereQuery<'a> {
    triangles: &'a Triangles<'a>,
    occlusion: &'a Occlusion<'a>,
    directions: &'a SampleDirections,
    runs: &'a Runs,
    accuracy: Accuracy,
    level: Level,
}

/// Finds which rays of the receivers are open: words of bits, receiver by receiver.
pub(crate) fn open_rays(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    samples: &[RaySample],
    runs: &Runs,
    (accuracy, level): (Accuracy, Level),
) -> (Vec<u32>, Stats) {
    let receivers = occlusion.hemispheres.len();
    let order = along_curve(&PointGrid::over(occlusion.hemispheres), receivers, level);
    let words = OpenRays::words_for(samples.len());
    let open: Vec<AtomicU32> = (0..receivers * words).map(|_| AtomicU32::new(0)).collect();
    let clusters = order.par_chunks(RECEIVERS).map(|ids| ReceiverCluster::new(occlusion, ids));
    let set = PacketSet::new(clusters.collect(), samples.len());
    let corners =
        if occlusion.grouping == Grouping::Origin { Vec::new() } else { corners_of(triangles, runs, level) };
    let (mut stats, mut bytes) = (Stats::default(), 0);
    for (number, samples) in samples.chunks(SAMPLES).enumerate() {
        let directions = &SampleDirections::new(samples);
        let query = HemisphereQuery { triangles, occlusion, directions, runs, accuracy, level };
        stats = stats.plus(query.open_above(&set));
        if occlusion.grouping != Grouping::Origin {
            let of_directions = query.by_direction(&set, &corners);
            bytes = bytes.max(of_directions.engine_bytes);
            stats = stats.plus(Stats { engine_bytes: 0, ..of_directions });
        }
        query.scatter(&set, |id, word, bits| {
            let first = id as usize * words + number * (SAMPLES / 32);
            open[first + word].store(bits, Ordering::Relaxed);
        });
    }
    let threads = rayon::current_num_threads() * size_of::<Horizons>();
    let ordered =
        order.capacity() * size_of::<u32>() + set.bytes() + corners.capacity() * size_of::<EightCorners>();
    let bytes = runs.bytes() + threads + ordered + bytes as usize;
    stats.engine_bytes = bytes.max(runs.ordering_bytes()).max(runs.bytes() + bytes_for(receivers)) as u64;
    (open.into_iter().map(AtomicU32::into_inner).collect(), stats)
}

/// The corners of all triangles in the order of the runs: directions read them one after the other.
fn corners_of(triangles: &Triangles<'_>, runs: &Runs, level: Level) -> Vec<EightCorners> {
    let of_group = |group: usize| {
        let first = group * LANES;
        let last = LANES.min(triangles.len() - first) - 1;
        let mut ids = [0; LANES];
        for (lane, id) in ids.iter_mut().enumerate() {
            *id = runs.id(first / RUN, first % RUN + lane.min(last));
        }
        dispatch!(level, simd => eight_corners(simd, triangles, &ids))
    };
    (0..triangles.len().div_ceil(LANES)).into_par_iter().with_min_len(64).map(of_group).collect()
}

/// Whether places and distances are in the range of f32 with room to spare, for all triangles and receivers.
pub(crate) fn are_in_range(runs: &Runs, occlusion: &Occlusion<'_>) -> bool {
    let is_small = |x: &f32| x.abs() < GREATEST;
    let Aabb { lo, hi } = runs.bounds();
    let points = occlusion.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point);
    (runs.bounds().is_empty() || lo.iter().chain(&hi).all(is_small))
        && points.into_iter().all(|point| point.iter().all(is_small))
}

/// The greatest power of two up to a positive normal number.
fn power_of_two_below(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & 0x7FF0_0000_0000_0000)
}

impl HemisphereQuery<'_> {
    /// Opens all rays that point above the surface. Grouped by origin, closes those that something occludes at once.
    fn open_above(self, set: &PacketSet) -> Stats {
        let Self { triangles, occlusion, directions, runs, accuracy, level } = self;
        let query = PacketQuery { triangles, occlusion, directions, runs, accuracy };
        let by_origin = occlusion.grouping == Grouping::Origin;
        let reach = directions.longest();
        let clusters = set.clusters.par_iter().enumerate();
        let of_cluster = |horizons: &mut Box<Horizons>, number: usize, cluster: &ReceiverCluster| {
            horizons.read((triangles, occlusion), cluster);
            let mut stats = Stats::default();
            for packet in 0..cluster.packets() {
                let mut open = [0; SAMPLES];
                let place = (cluster, packet);
                let of_packet = dispatch!(level, simd => {
                    horizons.above(simd, (triangles, occlusion), place, directions, &mut open);
                    if by_origin { close_rays(simd, query, place, reach, &mut open) } else { Stats::default() }
                });
                stats = stats.plus(of_packet);
                for (slot, &open) in open[..directions.count()].iter().enumerate() {
                    set.set_open(number * PACKETS + packet, slot, open);
                }
            }
            stats
        };
        clusters
            .map_init(Horizons::new, |horizons, (number, cluster)| of_cluster(horizons, number, cluster))
            .reduce(Stats::default, Stats::plus)
    }

    /// Closes the rays that something occludes, direction by direction.
    fn by_direction(self, set: &PacketSet, corners: &[EightCorners]) -> Stats {
        let Self { triangles, occlusion, directions, runs, accuracy, level } = self;
        let (bytes, bounds) = (AtomicUsize::new(0), runs.bounds().union(set.bounds));
        let along = |scratch: &mut CellScratch, slot: usize| {
            let sample = directions.given(slot).1;
            let unit = power_of_two_below(sample.direction.abs().max_element());
            let (direction, t_max) = (sample.direction / unit, f64::from(sample.t_max) * unit);
            let [x, y, z] = bounds.extent();
            let slack = x.max(y).max(z) * REACH_SLACK;
            let reach = [t_max * (1.0 - REACH_SLACK) - slack, t_max * (1.0 + REACH_SLACK) + slack];
            let reach = reach.map(|reach| reach as f32);
            let query =
                CellQuery { triangles, corners, occlusion, sample, direction, bounds, accuracy, reach };
            let place = (runs, set, slot);
            let stats = dispatch!(level, simd => close_rays_along(simd, &query, place, scratch));
            bytes.fetch_max(scratch.bytes(), Ordering::Relaxed);
            stats
        };
        let slots = (0..directions.count()).into_par_iter();
        let stats = slots.map_init(CellScratch::new, along).reduce(Stats::default, Stats::plus);
        let threads = rayon::current_num_threads().min(directions.count());
        Stats { engine_bytes: (bytes.into_inner() * threads) as u64, ..stats }
    }

    /// Hands out the open rays of all receivers.
    fn scatter(self, set: &PacketSet, store: impl Fn(u32, usize, u32) + Sync) {
        set.clusters.par_iter().enumerate().for_each(|(number, cluster)| {
            let open = |packet, slot| set.open(number * PACKETS + packet, slot);
            dispatch!(self.level, simd => cluster.scatter(simd, open, self.directions, &store));
        });
    }
}
