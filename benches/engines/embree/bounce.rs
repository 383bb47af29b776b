//! Embree's closest hits of rays that share nothing: single rays, and packets of consecutive rays. Neither is told to be
//! coherent.

use crate::Result;
use crate::engines::embree::Embree;
use crate::engines::embree::api::{RtcRayHit, RtcRayHit1, Valid};
use crate::engines::embree::device::{Coherence, Mesh, Packet, arguments};
use crate::engines::engine::{Engine, Times};
use crate::subjects::ambient_rays::Departure;
use crate::subjects::answer::Hits;
use crate::subjects::bounce::Bounce;
use crate::subjects::bounce_rays::BounceRays;

impl Engine<Bounce> for Embree {
    fn run(&mut self, bounce: &Bounce, answer: &mut Hits) -> Result<Times> {
        self.times(|mesh, packet| match packet {
            1 => trace_singly(mesh, &bounce.rays, answer),
            8 => trace::<8>(mesh, &bounce.rays, answer),
            _ => trace::<16>(mesh, &bounce.rays, answer),
        })
    }
}

/// Traces all rays with `rtcIntersect1`.
fn trace_singly(mesh: &Mesh, rays: &BounceRays, answer: &mut Hits) {
    rays.trace_singly(answer, |point, direction| {
        let mut ray = RtcRayHit1::new(point, direction, rays.epsilon);
        ray.intersect(mesh, &mut arguments(Coherence::Incoherent))
    });
}

/// Traces N rays at a time.
fn trace<const N: usize>(mesh: &Mesh, rays: &BounceRays, answer: &mut Hits)
where
    RtcRayHit<N>: Packet<N>,
{
    rays.trace_chunks(answer, |departures, ids, ts| {
        let mut packet = RtcRayHit::<N>::from_origin([0.0; 3]);
        packet.ray.tnear = [rays.epsilon; N];
        for (departures, (ids, ts)) in departures.chunks(N).zip(ids.chunks_mut(N).zip(ts.chunks_mut(N))) {
            packet.reset();
            let valid = fill(&mut packet, departures);
            packet.intersect(mesh, &valid, Coherence::Incoherent);
            for (n, (id, t)) in ids.iter_mut().zip(ts).enumerate() {
                (*id, *t) = packet.hit(n);
            }
        }
    });
}

/// Sets the rays of a packet, and says how many there are.
#[inline]
fn fill<const N: usize>(packet: &mut RtcRayHit<N>, departures: &[Departure]) -> Valid<N> {
    let ray = &mut packet.ray;
    for (n, &(point, direction)) in departures.iter().enumerate() {
        [ray.org_x[n], ray.org_y[n], ray.org_z[n]] = point;
        [ray.dir_x[n], ray.dir_y[n], ray.dir_z[n]] = direction;
    }
    Valid(std::array::from_fn(|n| if n < departures.len() { -1 } else { 0 }))
}
