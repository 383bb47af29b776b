//! All packets of receivers, with their open rays along a set of samples.
//!
//! Rays of one sample stand together, a byte for each packet: threads that work on different samples share no byte, nor do those that
//! work on different packets. Relaxed stores are plain ones.
//!
//! Based on: Ingo Wald et al., "Interactive Rendering with Coherent Ray Tracing", 2001 (packets).

use std::mem::size_of;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::geometry::aabb::Aabb;
use crate::intersect::directions::cell_leaf::CellPacket;
use crate::intersect::directions::receivers::{PACKETS, ReceiverCluster};
use crate::intersect::directions::samples::SAMPLES;
use crate::simd::lanes::LANES;

/// Packets, cluster by cluster.
pub(crate) struct PacketSet {
    pub(crate) clusters: Vec<Box<ReceiverCluster>>,
    open: Vec<AtomicU8>,
    /// Of all receivers.
    pub(crate) bounds: Aabb,
}

impl PacketSet {
    /// Clusters, with no open ray.
    pub(crate) fn new(clusters: Vec<Box<ReceiverCluster>>, samples: usize) -> Self {
        let rays = clusters.len() * PACKETS * samples.min(SAMPLES);
        let boxes = clusters
            .iter()
            .flat_map(|cluster| (0..cluster.packets()).map(|packet| cluster.packet_box(packet)));
        let bounds = boxes.fold(Aabb::EMPTY, Aabb::union);
        Self { open: (0..rays).map(|_| AtomicU8::new(0)).collect(), clusters, bounds }
    }

    /// Bytes of it.
    pub(crate) fn bytes(&self) -> usize {
        self.clusters.len() * size_of::<ReceiverCluster>() + self.open.capacity()
    }

    /// Packets, or room for them.
    pub(crate) fn packets(&self) -> usize {
        self.clusters.len() * PACKETS
    }

    /// The cluster of a packet, and where it stands there.
    #[inline(always)]
    fn place(&self, packet: usize) -> (&ReceiverCluster, std::ops::Range<usize>) {
        let first = packet % PACKETS * LANES;
        (&self.clusters[packet / PACKETS], first..first + LANES)
    }

    /// The receivers of a packet whose ray along a sample is open, as bits.
    #[inline(always)]
    pub(crate) fn open(&self, packet: usize, slot: usize) -> u8 {
        self.open[slot * self.packets() + packet].load(Ordering::Relaxed)
    }

    /// Says which are open.
    #[inline(always)]
    pub(crate) fn set_open(&self, packet: usize, slot: usize, open: u8) {
        self.open[slot * self.packets() + packet].store(open, Ordering::Relaxed);
    }

    /// Leaves open what is open here as well.
    #[inline(always)]
    pub(crate) fn close(&self, packet: usize, slot: usize, open: u8) {
        self.set_open(packet, slot, self.open(packet, slot) & open);
    }

    /// The points of a packet, coordinate by coordinate.
    #[inline(always)]
    pub(crate) fn points(&self, packet: usize) -> [&[f32]; 3] {
        let (cluster, eight) = self.place(packet);
        let [x, y, z] = &cluster.at;
        [&x[eight.clone()], &y[eight.clone()], &z[eight]]
    }

    /// A packet for a cell of a direction.
    #[inline(always)]
    pub(crate) fn cell_packet(
        &self,
        packet: usize,
        slot: usize,
        (sides, near): ([f32; 4], f32),
    ) -> CellPacket<'_> {
        let (cluster, eight) = self.place(packet);
        CellPacket {
            sides,
            near,
            at: self.points(packet),
            ids: &cluster.ids[eight.clone()],
            owners: &cluster.owners[eight],
            open: self.open(packet, slot),
        }
    }
}
