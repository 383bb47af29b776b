//! Control cages of Catmull-Clark surfaces, and one step of their subdivision.
//!
//! A corner c of a face stands for the half-edge from its vertex to that of the next corner; `opposite` is the half-edge that runs
//! back in the neighbouring face. A step makes a vertex of each vertex, edge and face, and a quad of each corner, with the vertices
//! V, E, F, E' (of the vertex, the edge, the face, the edge before). With n edges around a vertex v, their other ends e_i, and face
//! points f_i (the means of faces):
//!
//! - E = (v + e + f_1 + f_2)/4, on a crease (v + e)/2;
//! - V = (n − 2)/n·v + (Σe_i + Σf_i)/n², on a crease 3/4·v + (e_1 + e_2)/8, in a corner v.
//!
//! A crease of sharpness s is a crease for s steps, a fraction of a step by interpolation; each step takes 1 away. Borders are
//! creases for ever. Two creases at a vertex make it one, more a corner, one alone ends in a smooth vertex.
//!
//! New vertices are rows of weights of old ones, so that any numbers at vertices can be subdivided by the same rows.
//!
//! Based on: Edwin Catmull and James Clark, "Recursively Generated B-Spline Surfaces on Arbitrary Topological Meshes", 1978; Tony
//! DeRose, Michael Kass and Tien Truong, "Subdivision Surfaces in Character Animation", 1998 (sharpness); the rules are those of
//! Pixar's OpenSubdiv 3 (uniform creases, edges and corners of borders sharp).

use glam::DVec3;

/// There is no opposite half-edge: a border.
pub(crate) const BORDER: u32 = u32::MAX;

/// A cage: faces without positions.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Cage {
    /// The first corner of each face, and behind the last the number of corners.
    pub(crate) firsts: Vec<u32>,
    /// The face of each corner.
    pub(crate) faces: Vec<u32>,
    /// The vertex of each corner.
    pub(crate) vertices: Vec<u32>,
    /// The half-edge that runs back, or [`BORDER`].
    pub(crate) opposite: Vec<u32>,
    /// Sharpness of each half-edge, equal on both sides: 0 is smooth, infinity is a crease for ever.
    pub(crate) sharpness: Vec<f32>,
    /// Sharpness of each vertex: infinity is a corner for ever.
    pub(crate) corners: Vec<f32>,
}

/// Rows of weights: new numbers from old ones.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Rows {
    ends: Vec<u32>,
    weights: Vec<(u32, f64)>,
}

impl Rows {
    /// Adds a row.
    pub(crate) fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        self.weights.extend(row);
        // In range: rows have a few dozen weights, and there are at most 2³² corners / 8 of them.
        self.ends.push(self.weights.len() as u32);
    }

    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// One row.
    pub(crate) fn row(&self, index: usize) -> &[(u32, f64)] {
        let first = if index == 0 { 0 } else { self.ends[index - 1] as usize };
        &self.weights[first..self.ends[index] as usize]
    }

    /// All new points.
    pub(crate) fn apply(&self, points: &[DVec3]) -> Vec<DVec3> {
        (0..self.len()).map(|index| weighted(self.row(index), points)).collect()
    }

    /// Some of the rows.
    pub(crate) fn picked(&self, indices: &[u32]) -> Self {
        let mut rows = Self::default();
        indices.iter().for_each(|&index| rows.push(self.row(index as usize).iter().copied()));
        rows
    }
}

/// Σ w·p.
pub(crate) fn weighted(row: &[(u32, f64)], points: &[DVec3]) -> DVec3 {
    row.iter().fold(DVec3::ZERO, |sum, &(index, weight)| sum + points[index as usize] * weight)
}

/// How a vertex moves, or how its surface looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// No crease, or one that ends here.
    Smooth,
    /// Two creases.
    Crease,
    /// More, or a sharp vertex.
    Corner,
}

/// Sharpness after a step.
fn decayed(sharpness: f32) -> f32 {
    (sharpness - 1.0).max(0.0)
}

impl Cage {
    /// A cage without faces, for so many vertices.
    pub(crate) fn empty(vertices: usize) -> Self {
        Self { firsts: vec![0], corners: vec![0.0; vertices], ..Self::default() }
    }

    /// Adds a face whose half-edges are borders for now.
    pub(crate) fn push_face(&mut self, vertices: impl IntoIterator<Item = u32>) {
        // In range: there are fewer than 2³² corners.
        let face = self.firsts.len() as u32 - 1;
        self.vertices.extend(vertices);
        self.faces.resize(self.vertices.len(), face);
        self.opposite.resize(self.vertices.len(), BORDER);
        self.sharpness.resize(self.vertices.len(), f32::INFINITY);
        self.firsts.push(self.vertices.len() as u32);
    }

    /// The corners of a face.
    pub(crate) fn corners_of(&self, face: u32) -> std::ops::Range<u32> {
        self.firsts[face as usize]..self.firsts[face as usize + 1]
    }

    /// The next corner around the face.
    pub(crate) fn next(&self, corner: u32) -> u32 {
        let range = self.corners_of(self.faces[corner as usize]);
        if corner + 1 == range.end { range.start } else { corner + 1 }
    }

    /// The corner before.
    pub(crate) fn before(&self, corner: u32) -> u32 {
        let range = self.corners_of(self.faces[corner as usize]);
        if corner == range.start { range.end - 1 } else { corner - 1 }
    }

    pub(crate) fn vertex(&self, corner: u32) -> u32 {
        self.vertices[corner as usize]
    }

    /// The half-edge that runs back.
    pub(crate) fn across(&self, corner: u32) -> Option<u32> {
        Some(self.opposite[corner as usize]).filter(|&corner| corner != BORDER)
    }

    /// The half-edge that runs back, unless a crease for ever lies between.
    pub(crate) fn across_smooth(&self, corner: u32) -> Option<u32> {
        self.across(corner).filter(|_| self.sharpness[corner as usize].is_finite())
    }

    /// The corners at the vertex of a corner, from there to the right as far as there are faces, then to the left. `across` goes
    /// from one to the other.
    pub(crate) fn fan(&self, corner: u32, across: impl Fn(&Self, u32) -> Option<u32>) -> Vec<u32> {
        let mut fan = vec![corner];
        let mut last = corner;
        while let Some(right) = across(self, self.before(last)) {
            if right == corner {
                return fan;
            }
            fan.push(right);
            last = right;
        }
        let mut first = corner;
        while let Some(left) = across(self, first) {
            first = self.next(left);
            fan.push(first);
        }
        fan
    }

    /// The other ends of the edges around a vertex with their sharpness, given its corners.
    pub(crate) fn spokes(&self, fan: &[u32]) -> Vec<(u32, f32)> {
        let mut spokes = Vec::with_capacity(fan.len() + 1);
        for &corner in fan {
            spokes.push((self.vertex(self.next(corner)), self.sharpness[corner as usize]));
            let before = self.before(corner);
            if self.across(before).is_none() {
                spokes.push((self.vertex(before), f32::INFINITY));
            }
        }
        spokes
    }

    /// The rule of a vertex for the sharpness of its edges and its own.
    pub(crate) fn rule(spokes: &[(u32, f32)], own: f32) -> Rule {
        match (own > 0.0, spokes.iter().filter(|spoke| spoke.1 > 0.0).count()) {
            (false, 0 | 1) => Rule::Smooth,
            (false, 2) => Rule::Crease,
            _ => Rule::Corner,
        }
    }

    /// The cage after one step, and its vertices as rows over those before: first those of vertices, then of edges, then of faces.
    pub(crate) fn refined(&self) -> (Self, Rows) {
        let mut rows = Rows::default();
        let mut fans = vec![BORDER; self.corners.len()];
        // Backwards, so that each vertex keeps its first corner.
        for corner in (0..self.vertices.len() as u32).rev() {
            fans[self.vertex(corner) as usize] = corner;
        }
        // In range, here and below: cages have fewer than 2³² corners.
        for (vertex, &corner) in fans.iter().enumerate() {
            rows.push(self.vertex_row(vertex as u32, corner));
        }
        let mut edges = vec![BORDER; self.vertices.len()];
        for corner in 0..self.vertices.len() as u32 {
            let edge = match self.across(corner) {
                Some(other) if other < corner => edges[other as usize],
                other => {
                    rows.push(self.edge_row(corner, other));
                    rows.len() as u32 - 1
                }
            };
            edges[corner as usize] = edge;
        }
        let first_face = rows.len() as u32;
        for face in 0..self.firsts.len() as u32 - 1 {
            rows.push(self.face_row(face, 1.0));
        }
        (self.children(&edges, first_face, rows.len()), rows)
    }

    /// The quads of the next step.
    fn children(&self, edges: &[u32], first_face: u32, vertices: usize) -> Self {
        let mut next = Self::empty(vertices);
        for (corner, &vertex) in (0_u32..).zip(&self.vertices) {
            let before = self.before(corner);
            let face = first_face + self.faces[corner as usize];
            next.push_face([vertex, edges[corner as usize], face, edges[before as usize]]);
            let quad = corner as usize * 4;
            let back = self.across(corner).map_or(BORDER, |other| 4 * self.next(other) + 3);
            let left = self.across(before).map_or(BORDER, |other| 4 * other);
            let sharpness = |of: u32| decayed(self.sharpness[of as usize]);
            next.opposite[quad..].copy_from_slice(&[back, 4 * self.next(corner) + 2, 4 * before + 1, left]);
            next.sharpness[quad..].copy_from_slice(&[sharpness(corner), 0.0, 0.0, sharpness(before)]);
        }
        for (vertex, &own) in self.corners.iter().enumerate() {
            next.corners[vertex] = decayed(own);
        }
        next
    }

    /// The mean of a face, times a factor.
    fn face_row(&self, face: u32, factor: f64) -> impl Iterator<Item = (u32, f64)> {
        let corners = self.corners_of(face);
        let weight = factor / f64::from(corners.end - corners.start);
        corners.map(move |corner| (self.vertex(corner), weight))
    }

    /// The point of an edge.
    fn edge_row(&self, corner: u32, other: Option<u32>) -> Vec<(u32, f64)> {
        let ends = [self.vertex(corner), self.vertex(self.next(corner))];
        let sharp = f64::from(self.sharpness[corner as usize].min(1.0));
        let Some(other) = other.filter(|_| sharp < 1.0) else {
            return ends.map(|vertex| (vertex, 0.5)).to_vec();
        };
        let weight = sharp * 0.5 + (1.0 - sharp) * 0.25;
        let mut row = ends.map(|vertex| (vertex, weight)).to_vec();
        for side in [corner, other] {
            row.extend(self.face_row(self.faces[side as usize], (1.0 - sharp) * 0.25));
        }
        gathered(row)
    }

    /// The new place of a vertex, with one of its corners.
    fn vertex_row(&self, vertex: u32, corner: u32) -> Vec<(u32, f64)> {
        if corner == BORDER {
            return vec![(vertex, 1.0)];
        }
        let fan = self.fan(corner, Self::across);
        let spokes = self.spokes(&fan);
        let own = self.corners[vertex as usize];
        let later: Vec<(u32, f32)> = spokes.iter().map(|&(end, sharp)| (end, decayed(sharp))).collect();
        let (now, then) = (Self::rule(&spokes, own), Self::rule(&later, decayed(own)));
        let row = |rule: Rule, sharp: &[(u32, f32)], factor: f64| {
            self.ruled_row(rule, (vertex, &fan), sharp, factor)
        };
        if now == then {
            return gathered(row(now, &spokes, 1.0));
        }
        // What stops being sharp within this step, by the fraction of the step: the mean of all that does.
        let all = spokes.iter().map(|spoke| spoke.1).chain([own]);
        let ending: Vec<f64> = all.filter(|&s| s > 0.0 && s <= 1.0).map(f64::from).collect();
        let share = if ending.is_empty() { 1.0 } else { ending.iter().sum::<f64>() / ending.len() as f64 };
        let mut both = row(now, &spokes, share);
        both.extend(row(then, &later, 1.0 - share));
        gathered(both)
    }

    /// The new place of a vertex under one rule, times a factor.
    fn ruled_row(
        &self,
        rule: Rule,
        (vertex, fan): (u32, &[u32]),
        spokes: &[(u32, f32)],
        factor: f64,
    ) -> Vec<(u32, f64)> {
        match rule {
            Rule::Corner => vec![(vertex, factor)],
            Rule::Crease => {
                let sharp = spokes.iter().filter(|spoke| spoke.1 > 0.0);
                let ends = sharp.map(|&(end, _)| (end, factor * 0.125));
                [(vertex, factor * 0.75)].into_iter().chain(ends).collect()
            }
            Rule::Smooth => {
                let n = spokes.len() as f64;
                let mut row = vec![(vertex, factor * (n - 2.0) / n)];
                row.extend(spokes.iter().map(|&(end, _)| (end, factor / (n * n))));
                for &corner in fan {
                    row.extend(self.face_row(self.faces[corner as usize], factor / (n * n)));
                }
                row
            }
        }
    }
}

/// A row in which each vertex stands once, in ascending order.
fn gathered(mut row: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    // Stable: the sums do not depend on the sort.
    row.sort_by_key(|&(vertex, _)| vertex);
    row.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    row
}
