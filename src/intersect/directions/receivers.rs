//! A cluster of receivers, coordinate by coordinate: what all directions read.
//!
//! Which receivers a direction leaves above their surface follows from the sign of d·N. With N and d over their greatest
//! components, both rounded to f32, each of three products errs by less than six roundings of 1, sums included, and by what N errs in
//! f64. Signs within that are decided exactly.

use fearless_simd::{prelude::*, u32x8};

use crate::exact::filter::Cross;
use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::U;
use crate::geometry::aabb::widen;
use crate::geometry::triangles::Triangles;
use crate::intersect::by_origin::OpenPacket;
use crate::intersect::directions::samples::{SAMPLES, SampleDirections};
use crate::objects::offset::Side;
use crate::rays::hemisphere::{Above, Hemisphere, Occlusion, OpenRays};
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::{LANES, Narrow, bits};

/// Rounding in f32 of components of N and of d, their products and two sums, for |d_k| ≤ 1.
const FACING_ERROR: f64 = 18.0 / (1 << 24) as f64;
/// A component of N: the differences of its corners, their products and the difference of those, as parts of the permanent.
const NORMAL_ERROR: f64 = 8.0 * U;

/// The most packets of a cluster, and the most receivers: fewer than there are places, so that packets may end early.
pub(crate) const PACKETS: usize = 288;
pub(crate) const RECEIVERS: usize = 2048;
const PLACES: usize = PACKETS * LANES;

/// See [`ReceiverCluster::far_away`].
const FAR_AWAY: f64 = 1.5;

/// The receivers of a cluster, packet by packet. Places without a receiver have the id [`NO_TRIANGLE`].
#[derive(Debug)]
pub(crate) struct ReceiverCluster {
    count: usize,
    pub(crate) at: [[f32; PLACES]; 3],
    /// The index of each, and the triangle that it lies on.
    pub(crate) ids: [u32; PLACES],
    pub(crate) owners: [u32; PLACES],
}

/// Where the half spaces of a cluster's receivers point to.
#[derive(Debug)]
pub(crate) struct Horizons {
    /// At most 1 per component.
    normal: [[f32; PLACES]; 3],
    /// d·N is certain beyond this.
    tolerance: [f32; PLACES],
}

impl ReceiverCluster {
    /// At most [`RECEIVERS`] receivers in packets of neighbours: a packet ends where the next receiver lies far away. Places that
    /// are left over repeat the one before.
    pub(crate) fn new(occlusion: &Occlusion<'_>, ids: &[u32]) -> Box<Self> {
        let mut cluster = Box::new(Self {
            count: 0,
            at: [[0.0; PLACES]; 3],
            ids: [NO_TRIANGLE; PLACES],
            owners: [NO_TRIANGLE; PLACES],
        });
        let point = |id: u32| occlusion.hemispheres[id as usize].receiver.point;
        let bounds = Aabb::of_points(ids.iter().map(|&id| point(id)));
        let far = far_away(&bounds, ids.len());
        let mut spare = PACKETS - ids.len().div_ceil(LANES);
        let mut packet = Aabb::EMPTY;
        for id in neighbours(&bounds, ids, point) {
            let one = Aabb::of_points([point(id)]);
            let grown = packet.union(one);
            let [x, y, z] = grown.extent();
            if !cluster.count.is_multiple_of(LANES) && spare > 0 && x.max(y).max(z) > far {
                spare -= 1;
                cluster.pad();
            }
            packet = if cluster.count.is_multiple_of(LANES) { one } else { grown };
            cluster.push(occlusion, id);
        }
        cluster.pad();
        cluster
    }

    /// Adds a receiver.
    fn push(&mut self, occlusion: &Occlusion<'_>, id: u32) {
        let (index, receiver) = (self.count, occlusion.hemispheres[id as usize].receiver);
        (self.ids[index], self.owners[index]) = (id, receiver.triangle.0);
        for (at, x) in self.at.iter_mut().zip(receiver.point) {
            at[index] = x;
        }
        self.count += 1;
    }

    /// Fills the packet up.
    fn pad(&mut self) {
        while !self.count.is_multiple_of(LANES) {
            let index = self.count;
            self.at.iter_mut().for_each(|at| at[index] = at[index - 1]);
            self.count += 1;
        }
    }

    /// The box of the receivers of a packet.
    #[inline(always)]
    pub(crate) fn packet_box(&self, packet: usize) -> Aabb {
        let first = packet * LANES;
        Aabb::of_points(
            (first..self.count.min(first + LANES)).map(|index| [0, 1, 2].map(|k| self.at[k][index])),
        )
    }

    /// The places of a packet that hold receivers, as bits.
    #[inline(always)]
    pub(crate) fn here(&self, packet: usize) -> u64 {
        let ids = &self.ids[packet * LANES..][..LANES];
        (0..LANES).filter(|&lane| ids[lane] != NO_TRIANGLE).fold(0, |here, lane| here | 1 << lane)
    }

    /// Packets of the cluster.
    pub(crate) fn packets(&self) -> usize {
        self.count / LANES
    }

    /// Hands out, for each receiver, the bits of up to 128 samples as words, in the order of the samples as given.
    #[inline(always)]
    pub(crate) fn scatter<S: Simd>(
        &self,
        simd: S,
        open: impl Fn(usize, usize) -> u8,
        directions: &SampleDirections,
        mut store: impl FnMut(u32, usize, u32),
    ) {
        let lanes = u32x8::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7]);
        let count = OpenRays::words_for(directions.count());
        for (packet, ids) in self.ids[..self.count].chunks(LANES).enumerate() {
            let mut words = [u32x8::simd_from(simd, 0); SAMPLES / 32];
            for slot in 0..directions.count() {
                let sample = directions.given(slot).0;
                let byte = u32x8::simd_from(simd, u32::from(open(packet, slot)));
                // In range: less than 32.
                words[sample / 32 % (SAMPLES / 32)] |= ((byte >> lanes) & 1) << (sample % 32) as u32;
            }
            for (word, words) in words[..count].iter().enumerate() {
                for (&id, bits) in ids.iter().zip(words.to_array()).filter(|(id, _)| **id != NO_TRIANGLE) {
                    store(id, word, bits);
                }
            }
        }
    }
}

impl Horizons {
    /// None.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self { normal: [[0.0; PLACES]; 3], tolerance: [0.0; PLACES] })
    }

    /// Reads those of a cluster in place of those before.
    pub(crate) fn read(
        &mut self,
        (triangles, occlusion): (&Triangles<'_>, &Occlusion<'_>),
        cluster: &ReceiverCluster,
    ) {
        for (index, &id) in cluster.ids[..cluster.count].iter().enumerate() {
            if let Some(hemisphere) = occlusion.hemispheres.get(id as usize) {
                let (normal, tolerance) = normal_of(triangles, hemisphere);
                for (all, x) in self.normal.iter_mut().zip(normal) {
                    all[index] = x;
                }
                self.tolerance[index] = tolerance;
            }
        }
    }

    /// For each sample, the receivers of a packet whose direction points above their surface.
    #[inline(always)]
    pub(crate) fn above<S: Simd>(
        &self,
        simd: S,
        (triangles, occlusion): (&Triangles<'_>, &Occlusion<'_>),
        (cluster, packet): (&ReceiverCluster, usize),
        directions: &SampleDirections,
        above: &mut OpenPacket,
    ) {
        let first = packet * LANES;
        let eight = first..first + LANES;
        let [x, y, z] = [0, 1, 2].map(|k| Narrow::from_slice(simd, &self.normal[k][eight.clone()]));
        let tolerance = Narrow::from_slice(simd, &self.tolerance[eight]);
        let here = cluster.here(packet);
        above.fill(0);
        for (slot, above) in above.iter_mut().enumerate().take(directions.count()) {
            let d = directions.one(slot);
            let dot = x * d[0] + y * d[1] + z * d[2];
            let mut up = dot.simd_gt(tolerance).to_bitmask();
            let doubtful = !(up | (-dot).simd_gt(tolerance).to_bitmask());
            for lane in bits(doubtful & here) {
                let hemisphere = &occlusion.hemispheres[cluster.ids[first + lane] as usize];
                up |= u64::from(hemisphere.is_above(triangles, directions.given(slot).1.direction)) << lane;
            }
            // In range: eight bits.
            *above = (up & here) as u8;
        }
    }
}

/// The size of a packet's box beyond which it is not worth its places: a few times that of a square of the cluster's
/// surface that holds eight, if the receivers were spread over the largest side of its box.
fn far_away(bounds: &Aabb, count: usize) -> f64 {
    let [x, y, z] = bounds.extent();
    let area = (x * y).max(y * z).max(z * x);
    FAR_AWAY * (area * LANES as f64 / count as f64).sqrt()
}

/// Receivers in the order of a curve through their box: finer than the order of all.
fn neighbours(bounds: &Aabb, ids: &[u32], point: impl Fn(u32) -> [f32; 3]) -> Vec<u32> {
    let longest = bounds.extent()[bounds.longest_axis()];
    let cells_per_unit = if longest > 0.0 { 1023.0 / longest } else { 0.0 };
    let cell = |x: f32, lo: f32| ((f64::from(x) - f64::from(lo)) * cells_per_unit) as u32;
    let key = |&id: &u32| {
        let place = (0..3).fold(0, |place, k| place | spread(cell(point(id)[k], bounds.lo[k])) << (2 - k));
        u64::from(place) << 32 | u64::from(id)
    };
    let mut keys: Vec<u64> = ids.iter().map(key).collect();
    keys.sort_unstable();
    // In range: the lower half.
    keys.into_iter().map(|key| key as u32).collect()
}

/// Bit k of a number of 10 bits moves to bit 3k.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

/// Where a receiver's half space points to, and the greatest d·N that is in doubt.
fn normal_of(triangles: &Triangles<'_>, hemisphere: &Hemisphere) -> ([f32; 3], f32) {
    let (normal, permanent) = match hemisphere.above {
        Above::Normal(normal) => (widen(normal), 0.0),
        Above::Side(side) => {
            let triangle = triangles.triangle(hemisphere.receiver.triangle.0);
            let cross = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
            let normal = if side == Side::Front { cross.value } else { -cross.value };
            (normal, cross.permanent.max_element())
        }
    };
    let size = normal.abs().max_element();
    let tolerance = (FACING_ERROR + permanent * (3.0 * NORMAL_ERROR) / size) as f32;
    // NaN, from a zero normal, is always in doubt.
    ((normal / size).as_vec3().to_array(), tolerance)
}
