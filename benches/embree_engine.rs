//! Embree as an engine: trees of three qualities, packets of 8 and 16 rays in blocks of pixels, told to be coherent.

use std::sync::Arc;

use crate::Result;
use crate::answer::Answer;
use crate::embree::{Build, Device, Mesh, Packet};
use crate::embree_api::{RtcRayHit, Valid};
use crate::engine::{Engine, Times, timed};
use crate::subject::Subject;
use crate::view_rays::{Strip, ViewRays};

/// Pixels along a row of a block.
const BLOCK_WIDTH: usize = 4;

/// One way of using Embree.
#[derive(Debug)]
pub(crate) struct Embree {
    name: String,
    mesh: Mesh,
    /// Rays in a packet: 8 or 16.
    packet: usize,
    prebuilt: bool,
}

/// All variants: quality, whether it is built before, and the name.
const VARIANTS: [(Build, bool, &str); 4] = [
    (Build::LowDynamic, false, "embree-low"),
    (Build::Medium, false, "embree-medium"),
    (Build::Medium, true, "embree-medium-prebuilt"),
    (Build::High, true, "embree-high-prebuilt"),
];

/// Prepares the variants that are wanted. Each is built once, so that later builds find their memory.
pub(crate) fn variants(
    device: &Arc<Device>,
    subject: &Subject,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Box<dyn Engine>>> {
    let mut engines: Vec<Box<dyn Engine>> = Vec::new();
    for (build, prebuilt, name) in VARIANTS {
        for packet in [8, 16] {
            let name = format!("{name}-{packet}");
            if wanted(&name) {
                let mut mesh = Mesh::new(device, &subject.positions, &subject.triangles, build)?;
                mesh.build()?;
                engines.push(Box::new(Embree { name, mesh, packet, prebuilt }));
            }
        }
    }
    Ok(engines)
}

impl Engine for Embree {
    fn name(&self) -> &str {
        &self.name
    }

    fn prebuilt(&self) -> bool {
        self.prebuilt
    }

    fn run(&mut self, subject: &Subject, answer: &mut Answer) -> Result<Times> {
        let mut build = 0.0;
        if !self.prebuilt {
            let built;
            (build, built) = timed(|| self.mesh.build());
            built?;
        }
        let (trace, ()) = timed(|| match self.packet {
            8 => trace::<8>(&self.mesh, &subject.rays, answer),
            _ => trace::<16>(&self.mesh, &subject.rays, answer),
        });
        Ok(Times { build, trace })
    }
}

/// Traces all rays in blocks of 4 x N/4 pixels.
fn trace<const N: usize>(mesh: &Mesh, rays: &ViewRays, answer: &mut Answer)
where
    RtcRayHit<N>: Packet<N>,
{
    rays.trace_strips(answer, N / BLOCK_WIDTH, |mut strip| {
        let mut packet = RtcRayHit::<N>::from_origin(rays.origin);
        for left in (0..rays.width).step_by(BLOCK_WIDTH) {
            packet.reset();
            let valid = aim(&mut packet, rays, &strip, left);
            packet.intersect(mesh, &valid);
            store(&packet, &mut strip, rays.width, left);
        }
    });
}

/// Sets the directions of a block, and says which of its pixels are in the picture.
#[inline]
fn aim<const N: usize>(
    packet: &mut RtcRayHit<N>,
    rays: &ViewRays,
    strip: &Strip<'_>,
    left: usize,
) -> Valid<N> {
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
