//! Embree as an engine: trees of three qualities, packets of 8 and 16 rays in blocks of pixels, told to be coherent.

pub(crate) mod ambient;
pub(crate) mod api;
mod bounce;
pub(crate) mod device;

use std::sync::Arc;

use crate::Result;
use crate::engines::embree::api::{RtcRay, RtcRayHit, Valid};
use crate::engines::embree::device::{Build, Coherence, Device, Mesh, Packet, ShadowPacket};
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::subjects::answer::{Blocked, Hits};
use crate::subjects::picture::Picture;
use crate::subjects::shadow::Shadow;
use crate::subjects::shadow_rays::{EPSILON, ShadowRays};
use crate::subjects::view_rays::{FilmRays, Strip, ViewRays};
use crate::subjects::{Model, Subject};

/// Pixels along a row of a block.
const BLOCK_WIDTH: usize = 4;

/// One way of using Embree.
#[derive(Debug)]
pub(crate) struct Embree {
    name: String,
    mesh: Mesh,
    /// Rays in a packet: 1, 8 or 16.
    packet: usize,
    prebuilt: bool,
}

/// All variants: quality, whether it is built before, and the name.
pub(crate) const VARIANTS: [(Build, bool, &str); 4] = [
    (Build::LowDynamic, false, "embree-low"),
    (Build::Medium, false, "embree-medium"),
    (Build::Medium, true, "embree-medium-prebuilt"),
    (Build::High, true, "embree-high-prebuilt"),
];

/// Prepares the variants that are wanted, with packets of these sizes. Each is built once, so that later builds find their
/// memory.
pub(crate) fn variants<S: Subject>(
    device: &Arc<Device>,
    subject: &S,
    packets: &[usize],
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Box<dyn Engine<S>>>>
where
    Embree: Engine<S>,
{
    let mut engines: Vec<Box<dyn Engine<S>>> = Vec::new();
    for (build, prebuilt, name) in VARIANTS {
        for &packet in packets {
            let name = format!("{name}-{packet}");
            if wanted(&name) {
                engines.push(Box::new(Embree::new(
                    device,
                    subject.model(),
                    (build, prebuilt),
                    name,
                    packet,
                )?));
            }
        }
    }
    Ok(engines)
}

impl Embree {
    /// Builds once.
    pub(crate) fn new(
        device: &Arc<Device>,
        model: &Model,
        (build, prebuilt): (Build, bool),
        name: String,
        packet: usize,
    ) -> Result<Self> {
        let mut mesh = Mesh::new(device, &model.positions, &model.triangles, build)?;
        mesh.build()?;
        Ok(Self { name, mesh, packet, prebuilt })
    }

    /// Builds, unless that is done, and traces with the packets asked for.
    pub(crate) fn times(&mut self, trace: impl FnOnce(&Mesh, usize)) -> Result<Times> {
        let mut build = 0.0;
        if !self.prebuilt {
            let built;
            (build, built) = timed(|| self.mesh.build());
            built?;
        }
        let (trace, ()) = timed(|| trace(&self.mesh, self.packet));
        Ok(Times { build, trace })
    }
}

impl Variant for Embree {
    fn name(&self) -> &str {
        &self.name
    }

    fn prebuilt(&self) -> bool {
        self.prebuilt
    }
}

impl Engine<Picture> for Embree {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        self.times(|mesh, packet| match packet {
            8 => trace::<8>(mesh, &picture.rays, answer),
            _ => trace::<16>(mesh, &picture.rays, answer),
        })
    }
}

impl Engine<Shadow> for Embree {
    fn run(&mut self, shadow: &Shadow, answer: &mut Blocked) -> Result<Times> {
        self.times(|mesh, packet| match packet {
            8 => shade::<8>(mesh, &shadow.rays, answer),
            _ => shade::<16>(mesh, &shadow.rays, answer),
        })
    }
}

/// Traces all rays in blocks of 4 x N/4 pixels.
fn trace<const N: usize>(mesh: &Mesh, rays: &ViewRays, answer: &mut Hits)
where
    RtcRayHit<N>: Packet<N>,
{
    rays.trace_strips(answer, N / BLOCK_WIDTH, |film, mut strip| {
        let mut packet = RtcRayHit::<N>::from_origin(rays.origin);
        for left in (0..film.width).step_by(BLOCK_WIDTH) {
            packet.reset();
            let valid = aim(&mut packet.ray, film, &strip, left);
            packet.intersect(mesh, &valid, Coherence::Coherent);
            store(&packet, &mut strip, film.width, left);
        }
    });
}

/// Traces a ray for each receiver, those of a block of 4 x N/4 pixels together.
fn shade<const N: usize>(mesh: &Mesh, rays: &ShadowRays, answer: &mut Blocked)
where
    RtcRay<N>: ShadowPacket<N>,
{
    rays.trace_blocks(N / BLOCK_WIDTH, answer, |blocks| {
        let mut packet = RtcRay::<N>::from_origin(rays.light);
        blocks.for_each(|points, blocked| {
            let valid = aim_at(&mut packet, rays.light, points);
            packet.occlude(mesh, &valid, Coherence::Coherent);
            for (n, blocked) in blocked.iter_mut().enumerate() {
                *blocked = packet.is_blocked(n);
            }
        });
    });
}

/// Sets the directions from the light to the points of a block; rays end just before them.
#[inline]
fn aim_at<const N: usize>(packet: &mut RtcRay<N>, light: [f32; 3], points: &[[f32; 3]]) -> Valid<N> {
    let mut valid = Valid([0; N]);
    for (n, point) in points.iter().enumerate() {
        packet.dir_x[n] = point[0] - light[0];
        packet.dir_y[n] = point[1] - light[1];
        packet.dir_z[n] = point[2] - light[2];
        valid.0[n] = -1;
    }
    packet.tfar = [1.0 - EPSILON; N];
    valid
}

/// Sets the directions of a block, and says which of its pixels are in the picture.
#[inline]
fn aim<const N: usize>(packet: &mut RtcRay<N>, rays: &FilmRays, strip: &Strip<'_>, left: usize) -> Valid<N> {
    let mut valid = Valid([0; N]);
    for row in 0..strip.rows {
        let (j, lane) = (strip.first_row + row, row * BLOCK_WIDTH);
        if left + BLOCK_WIDTH <= rays.width {
            let lanes = lane..lane + BLOCK_WIDTH;
            packet.dir_x[lanes.clone()].copy_from_slice(&rays.row_component::<BLOCK_WIDTH>(0, left, j));
            packet.dir_y[lanes.clone()].copy_from_slice(&rays.row_component::<BLOCK_WIDTH>(1, left, j));
            packet.dir_z[lanes.clone()].copy_from_slice(&rays.row_component::<BLOCK_WIDTH>(2, left, j));
            valid.0[lanes].fill(-1);
        } else {
            for i in left..rays.width {
                let n = lane + i - left;
                [packet.dir_x[n], packet.dir_y[n], packet.dir_z[n]] = rays.direction(i, j);
                valid.0[n] = -1;
            }
        }
    }
    valid
}

/// Copies the hits of a block into the answer.
#[inline]
fn store<const N: usize>(packet: &RtcRayHit<N>, strip: &mut Strip<'_>, width: usize, left: usize) {
    for row in 0..strip.rows {
        for i in left..width.min(left + BLOCK_WIDTH) {
            let (id, t) = packet.hit(row * BLOCK_WIDTH + i - left);
            strip.ids[row * width + i] = id;
            strip.ts[row * width + i] = t;
        }
    }
}
