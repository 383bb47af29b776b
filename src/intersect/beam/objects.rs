//! The objects of beams: a working copy of the triangles in their order, and the boxes of the implicit hierarchy over
//! it.
//!
//! Coordinates are multiplied by a power of two, so that the scene is smaller than 1 and larger than 1/4: products of
//! three lengths then stay in the range of f32. Triangles are a corner and two edges, b − a and c − a, each rounded
//! once: 40 bytes with the id. All of it lasts as long as the query.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (implicit hierarchies).

use fearless_simd::Level;
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::intersect::beam::order::{Fanouts, Order};
use crate::objects::closed::ClosedTriangles;
use crate::objects::runs::RUN;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::WIDTH;

/// Scales are powers of two up to this one, and down to its inverse.
const MOST_SCALE: i32 = 100;
/// Coordinates that are larger than the scene by more than this are scaled by their own size.
const FAR_AWAY: f64 = (1_u64 << 24) as f64;
/// Half a box that holds nothing: less than any distance is.
const NOWHERE: f32 = -1e30;

/// A power of two by which all coordinates are multiplied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale(f32);

impl Scale {
    /// So that everything in a box is smaller than 1.
    pub(crate) fn of(bounds: &Aabb) -> Self {
        let [x, y, z] = bounds.extent();
        let (lo, hi) = bounds.corners();
        let size = x.max(y).max(z).max(lo.abs().max(hi.abs()).max_element() / FAR_AWAY);
        // Zero has the least exponent of all.
        let exponent = (size.to_bits() >> 52) as i32 - 1023;
        let exponent = (-1 - exponent).clamp(-MOST_SCALE, MOST_SCALE);
        // In range: a normal number.
        Self(f32::from_bits(((exponent + 127) as u32) << 23))
    }

    /// A length, scaled.
    #[inline(always)]
    pub(crate) fn of_length(self, x: f32) -> f32 {
        x * self.0
    }

    /// A limit, scaled.
    pub(crate) fn of_distance(self, x: f64) -> f32 {
        (x * f64::from(self.0)) as f32
    }
}

/// Up to 16 triangles, coordinate by coordinate: a, b − a and c − a.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    pub(crate) a: [[f32; RUN]; 3],
    pub(crate) ab: [[f32; RUN]; 3],
    pub(crate) ac: [[f32; RUN]; 3],
    pub(crate) ids: [u32; RUN],
    /// Places that hold a triangle, and those that hold one whose back faces need no test once a receiver is known to
    /// lie outside.
    pub(crate) present: u16,
    pub(crate) closed: u16,
}

impl Run {
    /// No triangles.
    pub(crate) const EMPTY: Self = Self {
        a: [[0.0; RUN]; 3],
        ab: [[0.0; RUN]; 3],
        ac: [[0.0; RUN]; 3],
        ids: [NO_TRIANGLE; RUN],
        present: 0,
        closed: 0,
    };

    /// Of some triangles; [`NO_TRIANGLE`] leaves a place empty.
    pub(crate) fn of(
        triangles: &Triangles<'_>,
        ids: &[u32; RUN],
        scale: Scale,
        is_closed: impl Fn(u32) -> bool,
    ) -> Self {
        let mut run = Self { ids: *ids, ..Self::EMPTY };
        for (place, &id) in ids.iter().enumerate().filter(|(_, id)| **id != NO_TRIANGLE) {
            let [a, b, c] = triangles.corners(TriangleId(id));
            for k in 0..3 {
                let [a, b, c] = [a[k], b[k], c[k]].map(|x| scale.of_length(x));
                (run.a[k][place], run.ab[k][place], run.ac[k][place]) = (a, b - a, c - a);
            }
            run.present |= 1 << place;
            run.closed |= u16::from(is_closed(id)) << place;
        }
        run
    }

    /// Puts a triangle of another run into a place.
    #[inline(always)]
    pub(crate) fn copy_from(&mut self, place: usize, run: &Self, from: usize) {
        let (place, from) = (place % RUN, from % RUN);
        for k in 0..3 {
            self.a[k][place] = run.a[k][from];
            self.ab[k][place] = run.ab[k][from];
            self.ac[k][place] = run.ac[k][from];
        }
        self.ids[place] = run.ids[from];
        let bit = 1 << place;
        self.present |= bit;
        self.closed = self.closed & !bit | (run.closed >> from & 1) << place;
    }
}

/// The boxes of a node's children: middles and half sides, rounded outward.
#[derive(Debug, Clone)]
pub(crate) struct NodeBoxes {
    pub(crate) middle: [[f32; WIDTH]; 3],
    pub(crate) half: [[f32; WIDTH]; 3],
}

impl NodeBoxes {
    const EMPTY: Self = Self { middle: [[0.0; WIDTH]; 3], half: [[NOWHERE; WIDTH]; 3] };

    /// Of some boxes.
    fn of(boxes: &[Aabb]) -> Self {
        let mut all = Self::EMPTY;
        for (place, bounds) in boxes.iter().enumerate().filter(|(_, bounds)| !bounds.is_empty()) {
            for k in 0..3 {
                let (lo, hi) = (bounds.lo[k], bounds.hi[k]);
                let middle = lo * 0.5 + hi * 0.5;
                all.middle[k][place] = middle;
                all.half[k][place] = (hi - middle).max(middle - lo).next_up();
            }
        }
        all
    }
}

/// Triangles in the order of beams.
#[derive(Debug)]
pub(crate) struct Objects {
    pub(crate) runs: Vec<Run>,
    /// Nodes of each level, from the top; the children of the last level are runs.
    pub(crate) levels: Vec<Vec<NodeBoxes>>,
    pub(crate) fanouts: Fanouts,
    pub(crate) scale: Scale,
    pub(crate) closed: ClosedTriangles,
    /// Whether there are closed components.
    pub(crate) any_closed: bool,
    /// Bytes at the peak.
    pub(crate) bytes: usize,
}

impl Objects {
    /// Orders and copies triangles. Back faces need no test at all, or those of closed components.
    pub(crate) fn new(triangles: &Triangles<'_>, scale: Scale, back_faces: bool, level: Level) -> Self {
        // One after the other: together they would take more memory.
        let closed = if back_faces { ClosedTriangles::new(triangles) } else { ClosedTriangles::default() };
        let order = Order::by_cost(triangles, level);
        let is_closed = |id: u32| !back_faces || closed.contains(id);
        let runs: Vec<Run> = order
            .runs
            .par_iter()
            .with_min_len(64)
            .map(|ids| Run::of(triangles, ids, scale, is_closed))
            .collect();
        let mut boxes: Vec<Aabb> =
            order.runs.par_iter().with_min_len(64).map(|ids| box_of(triangles, ids, scale)).collect();
        let mut levels = Vec::new();
        for &fanout in order.fanouts.levels().iter().rev() {
            levels.push(boxes.chunks(fanout).map(NodeBoxes::of).collect());
            boxes = boxes
                .chunks(fanout)
                .map(|boxes| boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union))
                .collect();
        }
        levels.reverse();
        let to_find = if back_faces { ClosedTriangles::bytes_to_find(triangles) } else { 0 };
        let nodes: usize = levels.iter().map(Vec::capacity).sum();
        let copied = runs.capacity() * size_of::<Run>() + nodes * size_of::<NodeBoxes>();
        let ordered = order.runs.capacity() * size_of::<[u32; RUN]>();
        let to_order = triangles.len() * Order::BYTES_TO_SORT;
        let bytes = to_find.max(closed.bytes() + ordered + copied.max(to_order));
        let any_closed = closed.has_any();
        Self { runs, levels, fanouts: order.fanouts, scale, closed, any_closed, bytes }
    }
}

/// The box of a run, scaled.
fn box_of(triangles: &Triangles<'_>, ids: &[u32; RUN], scale: Scale) -> Aabb {
    let present = ids.iter().filter(|id| **id != NO_TRIANGLE);
    let corners = present.flat_map(|&id| triangles.corners(TriangleId(id)));
    Aabb::of_points(corners.map(|corner| corner.map(|x| scale.of_length(x))))
}
