//! Open rays, one by one: for samples that receivers do not share, and, by the general path, the reference for the
//! groupings.
//!
//! Receivers are taken along a curve, so many at a time that their rays fill a stream of [`crate::intersect::bundle`],
//! each by one thread: their rays exist no longer than that.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1.

use std::mem::size_of;
use std::sync::atomic::{AtomicU32, Ordering};

use fearless_simd::Level;
use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::stream::{Objects, STREAM, Workspace};
use crate::intersect::general;
use crate::intersect::ray_set::{Question, RaySet};
use crate::objects::morton;
use crate::objects::morton::along_curve;
use crate::rays::hemisphere::{AmbientRay, Occlusion, OpenRays};
use crate::rays::hits::{Hits, NO_TRIANGLE};
use crate::rays::point_order::PointGrid;
use crate::stats::Stats;

/// Rays of a share for the general path, which looks at all triangles for each.
const GENERAL: usize = 1 << 17;

/// What a thread keeps from one stream of rays to the next.
#[derive(Default)]
struct Share {
    rays: Vec<AmbientRay>,
    /// The word, and the bit in it, of each ray.
    places: Vec<(u32, u32)>,
    /// The words of the receivers.
    open: Vec<u32>,
    work: Workspace,
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
    // Shares write side by side, each word once. Relaxed stores are plain ones.
    let open: Vec<AtomicU32> = (0..receivers * words).map(|_| AtomicU32::new(0)).collect();
    let most = if objects.is_some() { STREAM } else { GENERAL };
    let share = (most / rays.max(1)).max(1);
    let of_share = |state: &mut Share, receivers: &[u32]| {
        state.fill(triangles, occlusion, receivers)?;
        let stats = state.close(most, triangles, objects);
        for (found, &receiver) in state.open.chunks(words.max(1)).zip(receivers) {
            let open = &open[receiver as usize * words..][..words];
            open.iter().zip(found).for_each(|(word, &bits)| word.store(bits, Ordering::Relaxed));
        }
        Ok(stats)
    };
    let shares = order.par_chunks(share);
    let stats = shares.map_init(Share::default, of_share).try_reduce(Stats::default, |one, other| {
        let engine_bytes = one.engine_bytes.max(other.engine_bytes);
        Ok(Stats { engine_bytes, ..one.plus(other) })
    })?;
    let of_ray = size_of::<AmbientRay>() + size_of::<(u32, u32)>();
    let threads = rayon::current_num_threads() as u64;
    let kept = objects.map_or(stats.engine_bytes * threads, |objects| {
        let of_thread = objects.workspace_bytes(STREAM) + (share * rays).max(STREAM) * of_ray;
        objects.bytes() as u64 + threads * of_thread as u64
    });
    let kept = kept + morton::bytes_for(receivers) as u64;
    let open = open.into_iter().map(AtomicU32::into_inner).collect();
    Ok((open, Stats { engine_bytes: kept, ..stats }))
}

impl Share {
    /// The rays of some receivers that point above the surface.
    fn fill(
        &mut self,
        triangles: &Triangles<'_>,
        occlusion: &Occlusion<'_>,
        receivers: &[u32],
    ) -> Result<(), Error> {
        let words = OpenRays::words_for(occlusion.samples.count());
        self.rays.clear();
        self.places.clear();
        self.open.clear();
        self.open.resize(receivers.len() * words, 0);
        for (place, &receiver) in receivers.iter().enumerate() {
            occlusion.rays_above(triangles, receiver as usize, |sample, ray| {
                let (word, bit) = (place * words + sample / 32, sample % 32);
                self.rays.push(ray);
                // In range: a share is small, and rays are fewer than 2³².
                self.places.push((word as u32, bit as u32));
                self.open[word] |= 1 << bit;
            })?;
        }
        Ok(())
    }

    /// Closes the rays that something occludes, so many at a time.
    fn close(&mut self, most: usize, triangles: &Triangles<'_>, objects: Option<&Objects<'_>>) -> Stats {
        let Self { rays, places, open, work } = self;
        let mut stats = Stats::default();
        for (rays, places) in rays.chunks(most).zip(places.chunks(most)) {
            let mut close = |ray: u32| {
                let (word, bit) = places[ray as usize];
                open[word as usize] &= !(1 << bit);
            };
            let set = RaySet::Ambient(rays);
            let found = objects.and_then(|objects| objects.any_of_stream(work, set, &mut close));
            let of_stream = found.unwrap_or_else(|| {
                let mut hits = Hits::missed(set.len());
                let stats = general::intersect(Question { triangles, set, any: true }, &mut hits);
                // In range: a stream is small.
                let closed = (0..set.len() as u32).filter(|&ray| hits.ids[ray as usize] != NO_TRIANGLE);
                closed.for_each(close);
                stats
            });
            stats = Stats {
                engine_bytes: of_stream.engine_bytes.max(stats.engine_bytes),
                ..stats.plus(of_stream)
            };
        }
        stats
    }
}
