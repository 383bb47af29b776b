//! Embree's open rays: packets of 8 and 16, receiver by receiver or direction by direction within groups of neighbouring
//! receivers. Packets are filled up across receivers and directions.
//!
//! Told to be coherent are those direction by direction only: in trials on a busy machine (koala, sponza; 300,000 receivers)
//! the flag took a tenth to a half off their time in seven cases of eight. Receiver by receiver it added some in four of eight, and in
//! three of the four with packets of 16.

use std::sync::Arc;

use rayon::prelude::*;

use crate::Result;
use crate::engines::embree::api::{RtcRay, Valid};
use crate::engines::embree::device::{Build, Coherence, Device, Mesh, ShadowPacket};
use crate::engines::embree::{Embree, VARIANTS};
use crate::engines::engine::{Engine, Times, Variant};
use crate::subjects::Model;
use crate::subjects::ambient::Ambient;
use crate::subjects::ambient_rays::AmbientRays;
use crate::subjects::answer::OpenBits;
use crate::subjects::directions::{Axes, Random};

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

/// Prepares the variants that are wanted, as [`crate::engines::embree::variants`] does.
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
    let coherence = match order {
        Order::Receivers => Coherence::Incoherent,
        Order::Directions => Coherence::Coherent,
    };
    rays.trace_groups(answer, |mut group| {
        let (points, directions) = (group.points, &rays.directions);
        let mut lanes = Lanes::<N>::new(mesh, rays.interval, coherence);
        match order {
            Order::Receivers => {
                for (receiver, &point) in points.iter().enumerate() {
                    for ray in group.rays_above(receiver) {
                        lanes.push(point, directions[ray], (receiver, ray), |at| group.set_open(at));
                    }
                }
            }
            Order::Directions => {
                for (ray, &direction) in directions.iter().enumerate() {
                    for receiver in group.receivers_below(ray) {
                        lanes.push(points[receiver], direction, (receiver, ray), |at| group.set_open(at));
                    }
                }
            }
        }
        lanes.flush(|at| group.set_open(at));
    });
}

/// Embree with random rays of each receiver's own, as bakers have them: as likely as their cosine is great.
#[derive(Debug)]
pub(crate) struct RandomEmbree {
    embree: Embree,
}

/// A receiver with its normal of length 1.
pub(crate) type Start = ([f32; 3], [f32; 3]);

/// Receivers that one task takes.
const STARTS_OF_TASK: usize = 256;

impl RandomEmbree {
    /// Builds once.
    pub(crate) fn new(device: &Arc<Device>, model: &Model) -> Result<Self> {
        let embree = Embree::new(device, model, (Build::Medium, false), "embree-random".into(), 16)?;
        Ok(Self { embree })
    }

    /// Builds, and finds the share of each receiver's rays that are open.
    pub(crate) fn run(
        &mut self,
        starts: &[Start],
        interval: [f32; 2],
        rays: usize,
        open: &mut [f32],
    ) -> Result<Times> {
        self.embree.times(|mesh, _| {
            let tasks = starts.par_chunks(STARTS_OF_TASK).zip(open.par_chunks_mut(STARTS_OF_TASK));
            tasks.enumerate().with_max_len(1).for_each(|(task, (starts, open))| {
                open.fill(0.0);
                let mut lanes = Lanes::<16>::new(mesh, interval, Coherence::Incoherent);
                for (receiver, &(point, normal)) in starts.iter().enumerate() {
                    let axes = Axes::around(normal);
                    let mut random = Random::new((task * STARTS_OF_TASK + receiver) as u64);
                    for ray in 0..rays {
                        let direction = axes.cosine(random.pair());
                        lanes.push(point, direction, (receiver, ray), |(receiver, _)| open[receiver] += 1.0);
                    }
                }
                lanes.flush(|(receiver, _)| open[receiver] += 1.0);
                open.iter_mut().for_each(|open| *open /= rays as f32);
            });
        })
    }
}

/// Receiver and ray.
type Place = (usize, usize);

/// A packet that is being filled.
struct Lanes<'a, const N: usize> {
    mesh: &'a Mesh,
    coherence: Coherence,
    t_max: f32,
    packet: RtcRay<N>,
    places: [Place; N],
    count: usize,
}

impl<'a, const N: usize> Lanes<'a, N>
where
    RtcRay<N>: ShadowPacket<N>,
{
    /// An empty packet of rays from t_min to t_max.
    fn new(mesh: &'a Mesh, [t_min, t_max]: [f32; 2], coherence: Coherence) -> Self {
        let mut packet = RtcRay::from_origin([0.0; 3]);
        packet.tnear = [t_min; N];
        Self { mesh, coherence, t_max, packet, places: [(0, 0); N], count: 0 }
    }

    /// Adds a ray. When the packet is full, it is traced, and those that are open are told.
    #[inline]
    fn push(&mut self, point: [f32; 3], direction: [f32; 3], place: Place, open: impl FnMut(Place)) {
        let n = self.count;
        let packet = &mut self.packet;
        [packet.org_x[n], packet.org_y[n], packet.org_z[n]] = point;
        [packet.dir_x[n], packet.dir_y[n], packet.dir_z[n]] = direction;
        self.places[n] = place;
        self.count = n + 1;
        if self.count == N {
            self.flush(open);
        }
    }

    /// Traces the rays that there are.
    #[inline]
    fn flush(&mut self, mut open: impl FnMut(Place)) {
        let valid = Valid(std::array::from_fn(|n| if n < self.count { -1 } else { 0 }));
        self.packet.tfar = [self.t_max; N];
        self.packet.occlude(self.mesh, &valid, self.coherence);
        for (n, &place) in self.places[..self.count].iter().enumerate() {
            if !self.packet.is_blocked(n) {
                open(place);
            }
        }
        self.count = 0;
    }
}
