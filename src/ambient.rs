//! Open rays, one by one: the reference for the groupings.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1.

use crate::general;
use crate::hemisphere::{AmbientRay, Occlusion, OpenRays};
use crate::hits::NO_TRIANGLE;
use crate::probes::Probes;
use crate::{Error, Hits, Stats, Triangles};

/// Rays that are looked at together: those of some receivers.
const BATCH: usize = 1 << 18;

/// Finds which rays of the receivers are open, by the general path: words of bits, receiver by receiver.
pub(crate) fn by_ray(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
) -> Result<(Vec<u32>, Stats), Error> {
    let (rays, receivers) = (occlusion.samples.count(), occlusion.hemispheres.len());
    let words = OpenRays::words_for(rays);
    let mut open = vec![0; receivers * words];
    let mut stats = Stats::default();
    let batch = (BATCH / rays.max(1)).max(1);
    let mut probes: Vec<AmbientRay> = Vec::new();
    let mut places = Vec::new();
    for first in (0..receivers).step_by(batch) {
        probes.clear();
        places.clear();
        for receiver in first..receivers.min(first + batch) {
            for ray in 0..rays {
                if let Some(probe) = occlusion.ray(triangles, receiver, ray)? {
                    probes.push(probe);
                    places.push((receiver * words + ray / 32, ray % 32));
                }
            }
        }
        let mut hits = Hits::missed(probes.len());
        let of_batch = general::intersect(triangles, Probes::Ambient(&probes), true, &mut hits);
        stats = Stats { engine_bytes: stats.engine_bytes.max(of_batch.engine_bytes), ..stats.plus(of_batch) };
        for (&(word, bit), &id) in places.iter().zip(&hits.ids) {
            open[word] |= u32::from(id == NO_TRIANGLE) << bit;
        }
    }
    Ok((open, stats))
}
