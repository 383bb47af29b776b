//! Charts: the pieces of surface that a texture shows in one piece.
//!
//! Two triangles belong together if they share an edge whose ends have equal positions and equal texture coordinates, bit by
//! bit whatever their indices, and lie on opposite sides of it, in the surface (they run through it in opposite directions)
//! and in the texture (they turn the same way there). A chart is a component of that relation. So halves that are mirrored
//! onto each other are two charts even where they meet, and so are faces stacked onto the same texture coordinates.
//!
//! Triangles without area in the texture belong together with such triangles only.
//!
//! Based on: Bruno Lévy, Sylvain Petitjean, Nicolas Ray and Jérôme Maillot, "Least Squares Conformal Maps for Automatic
//! Texture Atlas Generation", 2002 (charts); Robert Tarjan, "Efficiency of a Good But Not Linear Set Union Algorithm", 1975.

use rayon::prelude::*;
use umbel_core::TriangleId;

use crate::bake::atlas::texel_coverage::Footprint;
use crate::scene::{NO_INDEX, Scene};

/// The charts of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Charts {
    /// The chart of each triangle; [`NO_INDEX`] for those without texture coordinates.
    pub(crate) of_triangle: Vec<u32>,
    /// Which way the triangles of each chart turn in the texture: 1, −1 (mirrored), or 0 without area.
    pub(crate) turns: Vec<i8>,
}

/// An edge of a triangle. Equal ends are neighbours when sorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Position and texture coordinate of the smaller end, then of the larger one.
    ends: [u32; 4],
    /// Which way its triangle turns.
    turn: i8,
    /// Whether the triangle runs from the larger end to the smaller one.
    is_reversed: bool,
    triangle: u32,
}

impl Charts {
    /// Finds them. O(n log n) time; 72 bytes per triangle while it runs. Chart ids rise with their first triangles.
    pub(crate) fn new(scene: &Scene) -> Self {
        // In range: geometry has fewer than 2³² triangles.
        let ids = 0..scene.triangles.len() as u32;
        let turns: Vec<Option<i8>> = ids
            .into_par_iter()
            .map(|id| scene.uv_corners(TriangleId(id)).map(|uv| Footprint::new(uv, 1).turn))
            .collect();
        let mut sets = Sets((0..turns.len() as u32).collect());
        for group in
            edges(scene, &turns).chunk_by(|one, other| (one.ends, one.turn) == (other.ends, other.turn))
        {
            let (forward, backward) = group.split_at(group.partition_point(|edge| !edge.is_reversed));
            if let (Some(one), Some(other)) = (forward.first(), backward.first()) {
                group.iter().for_each(|edge| sets.join(one.triangle, edge.triangle));
                sets.join(one.triangle, other.triangle);
            }
        }
        Self::number(sets, &turns)
    }

    /// Numbers the sets of triangles that have texture coordinates.
    fn number(mut sets: Sets, turns: &[Option<i8>]) -> Self {
        let mut charts = Self { of_triangle: vec![NO_INDEX; turns.len()], turns: Vec::new() };
        for (triangle, turn) in turns.iter().enumerate() {
            let Some(turn) = *turn else { continue };
            // The root of a set is its smallest triangle: it is numbered before the others.
            let root = sets.root(triangle as u32) as usize;
            if charts.of_triangle[root] == NO_INDEX {
                charts.of_triangle[root] = charts.turns.len() as u32;
                charts.turns.push(turn);
            }
            charts.of_triangle[triangle] = charts.of_triangle[root];
        }
        charts
    }
}

/// The edges of all triangles that have texture coordinates, sorted.
fn edges(scene: &Scene, turns: &[Option<i8>]) -> Vec<Edge> {
    let (positions, uvs) = (first_equals(&scene.positions), first_equals(&scene.uvs));
    let of_triangle = |(triangle, turn): (usize, &Option<i8>)| {
        let turn = (*turn)?;
        let (corners, uv_corners) = (scene.triangles[triangle], scene.uv_indices[triangle]);
        let ends = [0, 1, 2].map(|k| [positions[corners[k] as usize], uvs[uv_corners[k] as usize]]);
        let edges = [0, 1, 2].map(|k| {
            let (from, to) = (ends[k], ends[(k + 1) % 3]);
            let [low, high] = if from <= to { [from, to] } else { [to, from] };
            let ends = [low[0], low[1], high[0], high[1]];
            Edge { ends, turn, is_reversed: from > to, triangle: triangle as u32 }
        });
        Some(edges)
    };
    let mut edges: Vec<Edge> = turns.par_iter().enumerate().filter_map(of_triangle).flatten_iter().collect();
    edges.par_sort_unstable();
    edges
}

/// For each point the smallest index of those with the same bits; −0 counts as 0.
fn first_equals<const N: usize>(points: &[[f32; N]]) -> Vec<u32> {
    let key = |index: u32| points[index as usize].map(|x| (x + 0.0).to_bits());
    // In range: indices of corners are 32 bits wide.
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by_key(|&index| (key(index), index));
    let mut firsts = vec![0; points.len()];
    for equal in order.chunk_by(|&one, &other| key(one) == key(other)) {
        equal.iter().for_each(|&index| firsts[index as usize] = equal[0]);
    }
    firsts
}

/// Disjoint sets of triangles. The smallest of a set is its root.
struct Sets(Vec<u32>);

impl Sets {
    /// The root of a triangle's set. Halves the path to it.
    fn root(&mut self, triangle: u32) -> u32 {
        let mut at = triangle as usize;
        while self.0[at] as usize != at {
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at as u32
    }

    /// Makes one set of two.
    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.root(one), self.root(other));
        self.0[one.max(other) as usize] = one.min(other);
    }
}
