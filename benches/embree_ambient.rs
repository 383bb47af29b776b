//! Embree's open rays: packets of 8 and 16, receiver by receiver or direction by direction within groups of neighbouring
//! receivers. Packets are filled up across receivers and directions.

use std::sync::Arc;

use crate::Result;
use crate::ambient::Ambient;
use crate::ambient_rays::{AmbientRays, Group};
use crate::answer::OpenBits;
use crate::embree::{Coherence, Device, Mesh, ShadowPacket};
use crate::embree_api::{RtcRay, Valid};
use crate::embree_engine::{Embree, VARIANTS};
use crate::engine::{Engine, Times, Variant};

/// The order of the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// All rays of a receiver, then those of its neighbour.
    Receivers,
    /// The rays in one direction from all receivers of a group, then those in the next.
    Directions,
}

/// Embree with an order of rays.
#[derive(Debug)]
struct AmbientEmbree {
    embree: Embree,
    order: Order,
}

/// Prepares the variants that are wanted, as [`crate::embree_engine::variants`] does.
pub(crate) fn variants(
    device: &Arc<Device>,
    ambient: &Ambient,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Box<dyn Engine<Ambient>>>> {
    let mut engines: Vec<Box<dyn Engine<Ambient>>> = Vec::new();
    for (build, prebuilt, name) in VARIANTS {
        for packet in [8, 16] {
            for (order, suffix) in [(Order::Receivers, "receivers"), (Order::Directions, "directions")] {
                let name = format!("{name}-{packet}-{suffix}");
                if wanted(&name) {
                    let embree = Embree::new(device, &ambient.model, (build, prebuilt), name, packet)?;
                    engines.push(Box::new(AmbientEmbree { embree, order }));
                }
            }
        }
    }
    Ok(engines)
}

impl Variant for AmbientEmbree {
    fn name(&self) -> &str {
        self.embree.name()
    }

    fn prebuilt(&self) -> bool {
        self.embree.prebuilt()
    }
}

impl Engine<Ambient> for AmbientEmbree {
    fn run(&mut self, ambient: &Ambient, answer: &mut OpenBits) -> Result<Times> {
        let order = self.order;
        self.embree.times(|mesh, packet| match packet {
            8 => trace::<8>(mesh, &ambient.rays, order, answer),
            _ => trace::<16>(mesh, &ambient.rays, order, answer),
        })
    }
}

/// Traces all rays.
fn trace<const N: usize>(mesh: &Mesh, rays: &AmbientRays, order: Order, answer: &mut OpenBits)
where
    RtcRay<N>: ShadowPacket<N>,
{
    rays.trace_groups(answer, |mut group| {
        let mut lanes = Lanes::<N>::new(mesh, rays.interval, order);
        match order {
            Order::Receivers => {
                for receiver in 0..group.points.len() {
                    for ray in group.rays_above(receiver) {
                        lanes.push(&mut group, rays, receiver, ray);
                    }
                }
            }
            Order::Directions => {
                for ray in 0..rays.directions.len() {
                    for receiver in group.receivers_below(ray) {
                        lanes.push(&mut group, rays, receiver, ray);
                    }
                }
            }
        }
        lanes.flush(&mut group);
    });
}

/// A packet that is being filled.
struct Lanes<'a, const N: usize> {
    mesh: &'a Mesh,
    coherence: Coherence,
    t_max: f32,
    packet: RtcRay<N>,
    /// Receiver and ray of each lane.
    owners: [(u32, u32); N],
    count: usize,
}

impl<'a, const N: usize> Lanes<'a, N>
where
    RtcRay<N>: ShadowPacket<N>,
{
    /// An empty packet of rays from t_min to t_max.
    fn new(mesh: &'a Mesh, [t_min, t_max]: [f32; 2], order: Order) -> Self {
        let mut packet = RtcRay::from_origin([0.0; 3]);
        packet.tnear = [t_min; N];
        let coherence = match (order, std::env::var("COH").as_deref()) {
            (_, Ok("0")) => Coherence::Incoherent,
            _ => Coherence::Coherent,
        };
        Self { mesh, coherence, t_max, packet, owners: [(0, 0); N], count: 0 }
    }

    /// Adds a ray, and traces the packet when it is full.
    #[inline]
    fn push(&mut self, group: &mut Group<'_>, rays: &AmbientRays, receiver: usize, ray: usize) {
        let n = self.count;
        let packet = &mut self.packet;
        [packet.org_x[n], packet.org_y[n], packet.org_z[n]] = group.points[receiver];
        [packet.dir_x[n], packet.dir_y[n], packet.dir_z[n]] = rays.directions[ray];
        self.owners[n] = (receiver as u32, ray as u32);
        self.count = n + 1;
        if self.count == N {
            self.flush(group);
        }
    }

    /// Traces the rays that there are.
    fn flush(&mut self, group: &mut Group<'_>) {
        let valid = Valid(std::array::from_fn(|n| if n < self.count { -1 } else { 0 }));
        self.packet.tfar = [self.t_max; N];
        self.packet.occlude(self.mesh, &valid, self.coherence);
        for (n, &(receiver, ray)) in self.owners[..self.count].iter().enumerate() {
            if !self.packet.is_blocked(n) {
                group.set_open(receiver as usize, ray as usize);
            }
        }
        self.count = 0;
    }
}
