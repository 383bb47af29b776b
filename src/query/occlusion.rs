//! Open rays, one by one: for samples that receivers do not share, and, by the general path, the reference for the
//! groupings.
//!
//! Receivers are taken along a curve, in batches whose rays fill a window of [`crate::intersect::bundle`], each by one
//! thread: their probes exist no longer than that.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1.

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};

use fearless_simd::Level;
use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::triangles::Triangles;
use crate::intersect::beam::Beams;
use crate::intersect::bundle::{Objects, WINDOW, Workspace};
use crate::intersect::general;
use crate::intersect::ray_set::Probes;
use crate::objects::morton;
use crate::objects::morton::along_curve;
use crate::objects::point_order::PointGrid;
use crate::rays::hemisphere::{AmbientRay, Grouping, Occlusion, OpenRays, RaySample, RaySamples};
use crate::rays::hits::Hits;
use crate::rays::hits::NO_TRIANGLE;
use crate::stats::Stats;

/// Rays of a batch for the general path, which looks at all triangles for each.
const GENERAL: usize = 1 << 17;

/// Triangles per receiver from which on bundles are faster everywhere, and up to which beams are.
const FEW: f64 = 6.0;
const MANY: f64 = 0.8;
/// Fitted to koala, sponza and chess with 20 thousand to a million receivers: nanoseconds on one core of Zen 5 for a
/// ray, a node, a triangle that is set up and sixteen rays that are tested, in beams.
const BEAM_COSTS: [f64; 4] = [5.0, 28.0, 3.0, 7.6];
/// The same for a ray, and for a triangle, in bundles.
const BUNDLE_COSTS: [f64; 2] = [130.0, 500.0];

/// What a thread keeps from batch to batch.
#[derive(Default)]
struct Batch {
    probes: Vec<AmbientRay>,
    /// The word, and the bit in it, of each probe.
    places: Vec<(u32, u32)>,
    /// The words of the receivers.
    open: Vec<u32>,
    work: Workspace,
}

/// Finds the open rays in beams, [`crate::intersect::beam`], where all receivers share their samples and that is
/// estimated to take less time than bundles, or is asked for.
pub(crate) fn in_beams(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    level: Level,
) -> Option<(Vec<u32>, Stats)> {
    let RaySamples::Shared(samples) = occlusion.samples else { return None };
    let per_receiver = triangles.len() as f64 / occlusion.hemispheres.len().max(1) as f64;
    let is_few = match occlusion.grouping {
        Grouping::Auto => per_receiver > FEW,
        Grouping::Direction => false,
        Grouping::Origin => true,
    };
    if is_few {
        return None;
    }
    let beams = Beams::new(triangles, occlusion, level)?;
    let is_sure = occlusion.grouping == Grouping::Direction || per_receiver < MANY;
    (is_sure || are_faster(&beams, triangles, occlusion, samples)).then(|| beams.open_rays(samples))
}

/// Whether beams take less time than bundles, by what some of them cost.
fn are_faster(
    beams: &Beams<'_>,
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    samples: &[RaySample],
) -> bool {
    let (stats, rays) = beams.sampled(samples);
    let [ray, node, triangle, test] = BEAM_COSTS;
    let tests = stats.samples_tested as f64 / 16.0;
    let cost = node * stats.nodes as f64 + triangle * stats.triangles_set_up as f64 + test * tests;
    let in_beams = ray + cost / rays.max(1) as f64;
    // About half of the samples are above the horizon.
    let total = (occlusion.hemispheres.len() * samples.len()) as f64 * 0.5;
    let [ray, triangle] = BUNDLE_COSTS;
    in_beams < ray + triangle * triangles.len() as f64 / total
}

/// Finds which rays of the receivers are open: words of bits, receiver by receiver. In bundles, or by the general path.
pub(crate) fn by_ray(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    objects: Option<&Objects<'_>>,
    level: Level,
) -> Result<(Vec<u32>, Stats), Error> {
    let (rays, receivers) = (occlusion.samples.count(), occlusion.hemispheres.len());
    let words = OpenRays::words_for(rays);
    // Neighbours go through the same parts of the scene.
    let order = along_curve(&PointGrid::over(occlusion.hemispheres), receivers, level);
    // Batches write side by side, each word once. Relaxed stores are plain ones.
    let open: Vec<AtomicU32> = (0..receivers * words).map(|_| AtomicU32::new(0)).collect();
    let most = if objects.is_some() { WINDOW } else { GENERAL };
    let batch = (most / rays.max(1)).max(1);
    let of_batch = |state: &mut Batch, receivers: &[u32]| {
        state.fill(triangles, occlusion, receivers)?;
        let stats = state.close(most, triangles, objects);
        for (found, &receiver) in state.open.chunks(words.max(1)).zip(receivers) {
            let open = &open[receiver as usize * words..][..words];
            open.iter().zip(found).for_each(|(word, &bits)| word.store(bits, Ordering::Relaxed));
        }
        Ok(stats)
    };
    let batches = order.par_chunks(batch);
    let stats = batches.map_init(Batch::default, of_batch).try_reduce(Stats::default, |one, other| {
        let engine_bytes = one.engine_bytes.max(other.engine_bytes);
        Ok(Stats { engine_bytes, ..one.plus(other) })
    })?;
    let of_ray = size_of::<AmbientRay>() + size_of::<(u32, u32)>();
    let threads = rayon::current_num_threads() as u64;
    let kept = objects.map_or(stats.engine_bytes * threads, |objects| {
        let of_thread = objects.workspace_bytes(WINDOW) + (batch * rays).max(WINDOW) * of_ray;
        objects.bytes() as u64 + threads * of_thread as u64
    });
    let kept = kept + morton::bytes_for(receivers) as u64;
    let open = open.into_iter().map(AtomicU32::into_inner).collect();
    Ok((open, Stats { engine_bytes: kept, ..stats }))
}

impl Batch {
    /// The rays of some receivers that point above the surface.
    fn fill(
        &mut self,
        triangles: &Triangles<'_>,
        occlusion: &Occlusion<'_>,
        receivers: &[u32],
    ) -> Result<(), Error> {
        let words = OpenRays::words_for(occlusion.samples.count());
        self.probes.clear();
        self.places.clear();
        self.open.clear();
        self.open.resize(receivers.len() * words, 0);
        for (place, &receiver) in receivers.iter().enumerate() {
            occlusion.rays_above(triangles, receiver as usize, |ray, probe| {
                let (word, bit) = (place * words + ray / 32, ray % 32);
                self.probes.push(probe);
                // In range: a batch is small, and rays are fewer than 2³².
                self.places.push((word as u32, bit as u32));
                self.open[word] |= 1 << bit;
            })?;
        }
        Ok(())
    }

    /// Closes the rays that something occludes, so many at a time.
    fn close(&mut self, most: usize, triangles: &Triangles<'_>, objects: Option<&Objects<'_>>) -> Stats {
        let Self { probes, places, open, work } = self;
        let mut stats = Stats::default();
        for (probes, places) in probes.chunks(most).zip(places.chunks(most)) {
            let mut close = |probe: u32| {
                let (word, bit) = places[probe as usize];
                open[word as usize] &= !(1 << bit);
            };
            let probes = Probes::Ambient(probes);
            let found = objects.and_then(|objects| objects.any_of_window(work, probes, &mut close));
            let of_window = found.unwrap_or_else(|| {
                let mut hits = Hits::missed(probes.len());
                let stats = general::intersect(triangles, probes, true, &mut hits);
                // In range: a window is small.
                let closed =
                    (0..probes.len() as u32).filter(|&probe| hits.ids[probe as usize] != NO_TRIANGLE);
                closed.for_each(close);
                stats
            });
            stats = Stats {
                engine_bytes: of_window.engine_bytes.max(stats.engine_bytes),
                ..stats.plus(of_window)
            };
        }
        stats
    }
}
