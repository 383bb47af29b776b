//! Objects as runs: 16 consecutive triangles share one box, 8 boxes the next one up.
//!
//! The hierarchy is implicit in the order of the triangles: node i of a level holds nodes 8i to 8i + 7 of the level
//! below, whose boxes are tested together. Boxes are computed in one streaming pass for each query and forgotten after
//! it.
//!
//! The order is the file's where that is coherent, else the one of [`crate::objects::morton`]. Measured by the area of
//! the runs' boxes over that of the triangles' own boxes: both are near each other when neighbours in the file are
//! neighbours in space, however large the triangles are.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (given partitions, implicit hierarchies).

use std::mem::size_of;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::objects::boxes::Boxes;
use crate::objects::gather::bounds;
use crate::objects::morton::{bytes_for, of_triangles};
use crate::simd::lanes::LANES;

/// Triangles per run.
pub(crate) const RUN: usize = 16;
/// Children per node: one vector of boxes.
const FANOUT: usize = LANES;
/// Runs whose boxes have more than this multiple of the area of their triangles' boxes are ordered anew. With
/// 4, sponza keeps the order of its file and visits 75 thousand nodes for a frame; with 2 it is ordered and visits 31.
const COHERENT_AREA: f64 = 2.0;

/// Runs that are looked at to judge the order.
const SAMPLED: usize = 512;

/// A node of the implicit hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Node {
    level: usize,
    index: usize,
}

impl Node {
    /// The node above all levels.
    pub(crate) fn root_above(levels: usize) -> Self {
        Self { level: levels, index: 0 }
    }

    /// The boxes of its children.
    pub(crate) fn boxes(self, levels: &[Vec<Boxes>]) -> Option<&Boxes> {
        levels.get(self.level.checked_sub(1)?)?.get(self.index)
    }

    /// A child.
    pub(crate) fn child(self, lane: usize) -> Self {
        Self { level: self.level - 1, index: self.index * FANOUT + lane }
    }

    /// The run that a node without children stands for.
    pub(crate) fn leaf(self) -> Option<usize> {
        (self.level == 0).then_some(self.index)
    }
}

/// An order of triangles: a permutation and nothing else.
#[derive(Debug, Clone)]
pub(crate) struct Order {
    /// The triangle at each place; empty for the order of the file.
    places: Vec<u32>,
    triangles: usize,
}

impl Order {
    /// The order of the file.
    pub(crate) fn as_given(triangles: usize) -> Self {
        Self { places: Vec::new(), triangles }
    }
}

/// Triangles in an order, with the boxes of the implicit hierarchy over it.
#[derive(Debug)]
pub(crate) struct Runs {
    order: Order,
    /// Boxes of the runs, then of ever larger parts, up to one vector of boxes.
    levels: Vec<Vec<Boxes>>,
    /// Bytes that finding the order took.
    ordering: usize,
}

impl Runs {
    /// Runs in a given order, in that of the file, or in a better one. O(n).
    pub(crate) fn new(triangles: &Triangles<'_>, level: Level, kept: Option<Order>) -> Self {
        let mut ordering = 0;
        let order = kept.filter(|order| order.triangles == triangles.len()).unwrap_or_else(|| {
            let mut places = Vec::new();
            if !is_coherent(triangles) {
                ordering = bytes_for(triangles.len());
                places = of_triangles(triangles, level);
            }
            Order { places, triangles: triangles.len() }
        });
        let boxes = run_boxes(triangles, &order.places, level);
        let mut runs = Self { order, levels: vec![boxes], ordering };
        while let Some(top) = runs.levels.last().filter(|top| top.len() > 1) {
            let next = top.chunks(FANOUT).map(|children| gather(children.iter().map(union))).collect();
            runs.levels.push(next);
        }
        runs
    }

    /// What a later query may use again.
    pub(crate) fn into_order(self) -> Order {
        self.order
    }

    /// The box of everything.
    pub(crate) fn bounds(&self) -> Aabb {
        self.boxes(self.root()).map_or(Aabb::EMPTY, union)
    }

    /// The vector of nodes that holds everything.
    pub(crate) fn root(&self) -> Node {
        Node::root_above(self.levels.len())
    }

    /// The boxes of a node's children.
    pub(crate) fn boxes(&self, node: Node) -> Option<&Boxes> {
        node.boxes(&self.levels)
    }

    /// The ids of a run's triangles, and how many there are.
    pub(crate) fn ids(&self, run: usize) -> ([u32; RUN], usize) {
        ids_of(run, &self.order.places, self.order.triangles)
    }

    /// The id of one of a run's triangles.
    #[inline(always)]
    pub(crate) fn id(&self, run: usize, place: usize) -> u32 {
        id_at(&self.order.places, run * RUN + place)
    }

    /// Bytes that were needed to find the order.
    pub(crate) fn ordering_bytes(&self) -> usize {
        self.ordering
    }

    /// Bytes kept.
    pub(crate) fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().map(Vec::capacity).sum();
        self.order.places.capacity() * size_of::<u32>() + boxes * size_of::<Boxes>()
    }
}

/// The box around all lanes.
fn union(boxes: &Boxes) -> Aabb {
    (0..LANES).map(|lane| boxes.get(lane)).fold(Aabb::EMPTY, Aabb::union)
}

/// Up to eight boxes as a vector.
fn gather(bounds: impl Iterator<Item = Aabb>) -> Boxes {
    let mut boxes = Boxes::EMPTY;
    bounds.enumerate().for_each(|(lane, bounds)| boxes.set(lane, &bounds));
    boxes
}

/// The ids of a run's triangles, padded with the first one's, and how many there are.
#[inline(always)]
fn ids_of(run: usize, order: &[u32], triangles: usize) -> ([u32; RUN], usize) {
    let first = run * RUN;
    let count = RUN.min(triangles - first);
    // In range: there are fewer than 2³² triangles.
    let mut ids = [first as u32; RUN];
    if order.is_empty() {
        (0..).zip(&mut ids[..count]).for_each(|(place, id)| *id += place);
    } else {
        ids.fill(order[first]);
        ids[..count].copy_from_slice(&order[first..first + count]);
    }
    (ids, count)
}

/// The triangle at a place of the order.
fn id_at(order: &[u32], place: usize) -> u32 {
    // In range: there are fewer than 2³² triangles.
    order.get(place).copied().unwrap_or(place as u32)
}

/// Whether the order of the file is a good one: by the areas of some runs, evenly spread.
fn is_coherent(triangles: &Triangles<'_>) -> bool {
    let runs = triangles.len().div_ceil(RUN);
    let sampled = (0..runs).step_by((runs / SAMPLED).max(1));
    let areas = sampled.map(|run| {
        let (ids, count) = ids_of(run, &[], triangles.len());
        let own = ids[..count].iter().map(|&id| triangles.bounds(id));
        own.fold((Aabb::EMPTY, 0.0), |(all, sum), own| (all.union(own), sum + area_of(&own)))
    });
    let (of_runs, of_triangles) =
        areas.fold((0.0, 0.0), |sum, (bounds, area)| (sum.0 + area_of(&bounds), sum.1 + area));
    of_runs <= COHERENT_AREA * of_triangles
}

/// The boxes of all runs.
fn run_boxes(triangles: &Triangles<'_>, order: &[u32], level: Level) -> Vec<Boxes> {
    let runs = triangles.len().div_ceil(RUN);
    let of_vector = |vector: usize| {
        let mut boxes = Boxes::EMPTY;
        dispatch!(level, simd => {
            for (lane, run) in (vector * FANOUT..(vector * FANOUT + FANOUT).min(runs)).enumerate() {
                // What pads a run is in it.
                let (ids, _) = ids_of(run, order, triangles.len());
                boxes.set(lane, &bounds(simd, triangles, &ids));
            }
        });
        boxes
    };
    (0..runs.div_ceil(FANOUT)).into_par_iter().with_min_len(32).map(of_vector).collect()
}

/// Half the surface of a box. Flat boxes count by their perimeter as well, or a wall would weigh nothing.
fn area_of(bounds: &Aabb) -> f64 {
    let [x, y, z] = bounds.extent();
    x * y + y * z + z * x
}
