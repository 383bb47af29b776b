//! Objects as runs: 64 consecutive triangles share one box, 16 boxes the next one up.
//!
//! The hierarchy is implicit in the order of the triangles: node i of a level holds nodes 16i to 16i + 15 of the level
//! below. Boxes are computed in one streaming pass for each query and forgotten after it.
//!
//! The order is the file's where that is coherent, else the one of [`crate::order`]. Measured by the area of the runs'
//! boxes over that of the triangles' own boxes: both are near each other when neighbours in the file are neighbours in
//! space, however large the triangles are.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011 (given partitions, implicit hierarchies).

use std::mem::size_of;
use std::ops::Range;

use rayon::prelude::*;

use crate::order::along_curve;
use crate::{Aabb, Triangles};

/// Triangles per run.
const RUN: usize = 64;
/// Children per node.
const FANOUT: usize = 16;
/// Runs whose boxes have more than this multiple of the area of their triangles' boxes are ordered anew.
const COHERENT_AREA: f64 = 8.0;

/// A node of the implicit hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Node {
    level: usize,
    index: usize,
}

/// Triangles in an order, with the boxes of the implicit hierarchy over it.
#[derive(Debug)]
pub(crate) struct Runs {
    /// The order of the triangles; empty for the order of the file.
    order: Vec<u32>,
    /// Boxes of the runs, then of ever larger groups, up to one node.
    levels: Vec<Vec<Aabb>>,
    triangles: usize,
}

impl Runs {
    /// Runs in the order of the file, or in a better one. O(n).
    pub(crate) fn new(triangles: &Triangles<'_>) -> Self {
        let (boxes, area) = run_boxes(triangles, &[]);
        let area_of_runs: f64 = boxes.par_iter().map(area_of).sum();
        let mut runs = Self {
            order: Vec::new(),
            levels: vec![boxes],
            triangles: triangles.len(),
        };
        if area_of_runs > COHERENT_AREA * area {
            let bounds = runs.levels[0]
                .iter()
                .copied()
                .fold(Aabb::EMPTY, Aabb::union);
            runs.levels.clear();
            runs.order = along_curve(triangles, &bounds);
            runs.levels.push(run_boxes(triangles, &runs.order).0);
        }
        while let Some(top) = runs.levels.last().filter(|top| top.len() > 1) {
            let union = |boxes: &[Aabb]| boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
            let next = top.chunks(FANOUT).map(union).collect();
            runs.levels.push(next);
        }
        runs
    }

    /// The node that holds everything, or `None` without triangles.
    pub(crate) fn root(&self) -> Option<Node> {
        (self.triangles > 0).then(|| Node {
            level: self.levels.len() - 1,
            index: 0,
        })
    }

    /// The box of a node.
    pub(crate) fn bounds(&self, node: Node) -> &Aabb {
        &self.levels[node.level][node.index]
    }

    /// The children of a node, or `None` for a run.
    pub(crate) fn children(&self, node: Node) -> Option<impl Iterator<Item = Node>> {
        let level = node.level.checked_sub(1)?;
        let first = node.index * FANOUT;
        let last = (first + FANOUT).min(self.levels[level].len());
        Some((first..last).map(move |index| Node { level, index }))
    }

    /// The ids of a run's triangles.
    pub(crate) fn triangles(&self, run: Node) -> impl Iterator<Item = u32> {
        range(run.index, self.triangles).map(|place| id_at(&self.order, place))
    }

    /// Bytes kept.
    pub(crate) fn bytes(&self) -> usize {
        let boxes: usize = self.levels.iter().map(Vec::capacity).sum();
        self.order.capacity() * size_of::<u32>() + boxes * size_of::<Aabb>()
    }
}

/// The places of a run.
fn range(run: usize, triangles: usize) -> Range<usize> {
    run * RUN..(run * RUN + RUN).min(triangles)
}

/// The triangle at a place of the order.
fn id_at(order: &[u32], place: usize) -> u32 {
    // In range: there are fewer than 2³² triangles.
    order.get(place).copied().unwrap_or(place as u32)
}

/// The box of each run, and the summed area of the triangles' own boxes.
fn run_boxes(triangles: &Triangles<'_>, order: &[u32]) -> (Vec<Aabb>, f64) {
    let count = triangles.len();
    let boxes: Vec<(Aabb, f64)> = (0..count.div_ceil(RUN))
        .into_par_iter()
        .with_min_len(64)
        .map(|run| {
            range(run, count).fold((Aabb::EMPTY, 0.0), |(bounds, area), place| {
                let own = triangles.bounds(id_at(order, place));
                (bounds.union(own), area + area_of(&own))
            })
        })
        .collect();
    let area = boxes.iter().map(|&(_, area)| area).sum();
    (boxes.into_iter().map(|(bounds, _)| bounds).collect(), area)
}

/// Half the surface of a box. Flat boxes count by their perimeter as well, or a wall would weigh nothing.
fn area_of(bounds: &Aabb) -> f64 {
    let [x, y, z] = bounds.extent();
    x * y + y * z + z * x
}
