//! Open rays, one by one: for samples that receivers do not share, and, by the general path, the reference for the groupings.
//!
//! Receivers are taken in batches whose rays fill a window of [`crate::bundles`], each by one thread: their probes exist no
//! longer than that.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1.

use std::mem::size_of;

use rayon::prelude::*;

use crate::bundles::{Objects, WINDOW, Workspace};
use crate::general;
use crate::hemisphere::{AmbientRay, Occlusion, OpenRays};
use crate::hits::NO_TRIANGLE;
use crate::probes::Probes;
use crate::{Error, Hits, Stats, Triangles};

/// Rays of a batch for the general path, which looks at all triangles for each.
const GENERAL: usize = 1 << 17;

/// What a thread keeps from batch to batch.
#[derive(Default)]
struct Batch {
    probes: Vec<AmbientRay>,
    /// The word, and the bit in it, of each probe.
    places: Vec<(u32, u32)>,
    work: Workspace,
}

/// Finds which rays of the receivers are open: words of bits, receiver by receiver. In bundles, or by the general path.
pub(crate) fn by_ray(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    objects: Option<&Objects<'_>>,
) -> Result<(Vec<u32>, Stats), Error> {
    let (rays, receivers) = (occlusion.samples.count(), occlusion.hemispheres.len());
    let words = OpenRays::words_for(rays);
    let mut open = vec![0; receivers * words];
    let most = if objects.is_some() { WINDOW } else { GENERAL };
    let batch = (most / rays.max(1)).max(1);
    let of_batch = |state: &mut Batch, (index, open): (usize, &mut [u32])| {
        state.fill(triangles, occlusion, index * batch..receivers.min((index + 1) * batch))?;
        for &(word, bit) in &state.places {
            open[word as usize] |= 1 << bit;
        }
        Ok(state.close(most, triangles, objects, open))
    };
    let batches = open.par_chunks_mut((batch * words).max(1)).enumerate();
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
    Ok((open, Stats { engine_bytes: kept, ..stats }))
}

impl Batch {
    /// The rays of some receivers that point above the surface.
    fn fill(
        &mut self,
        triangles: &Triangles<'_>,
        occlusion: &Occlusion<'_>,
        receivers: std::ops::Range<usize>,
    ) -> Result<(), Error> {
        let rays = occlusion.samples.count();
        let words = OpenRays::words_for(rays);
        self.probes.clear();
        self.places.clear();
        for (place, receiver) in receivers.enumerate() {
            for ray in 0..rays {
                if let Some(probe) = occlusion.ray(triangles, receiver, ray)? {
                    self.probes.push(probe);
                    // In range: a batch is small, and rays are fewer than 2³².
                    self.places.push(((place * words + ray / 32) as u32, (ray % 32) as u32));
                }
            }
        }
        Ok(())
    }

    /// Closes the rays that something occludes, so many at a time.
    fn close(
        &mut self,
        most: usize,
        triangles: &Triangles<'_>,
        objects: Option<&Objects<'_>>,
        open: &mut [u32],
    ) -> Stats {
        let Self { probes, places, work } = self;
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
