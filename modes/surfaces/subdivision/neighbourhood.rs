//! What determines a Catmull-Clark surface over one quad: the faces around it, and the shapes that these can have.
//!
//! The limit surface over a quad depends on the vertices of all faces that touch it. Two quads whose neighbourhoods have the same
//! *shape* (who touches whom, and where creases are) are the same linear map of their vertices. A shape is *regular* where its
//! surface is one bicubic B-spline: every vertex has four faces, or two along a border or an endless crease, or one in a corner of
//! them. Elsewhere one step of subdivision gives four quads, each with a shape of its own and with rows that make its vertices
//! from the shape's. Three of the four are mostly regular and the fourth mostly has the shape of its parent, so that few shapes
//! serve a whole mesh, as deep as anybody goes.
//!
//! Beyond a border the B-spline takes the points 2·p − q: then its second derivative across is 0, as the crease rule has it.
//!
//! Based on: Jos Stam, "Exact Evaluation of Catmull-Clark Subdivision Surfaces at Arbitrary Parameter Values", 1998; Matthias
//! Nießner, Charles Loop, Mark Meyer and Tony DeRose, "Feature-Adaptive GPU Rendering of Catmull-Clark Subdivision Surfaces", 2012.

use std::collections::HashMap;

use crate::surfaces::subdivision::bezier_rows::{BezierRows, Rings};
use crate::surfaces::subdivision::cage::{BORDER, Cage, Rows, Rule};
use crate::surfaces::subdivision::limit_masks::Limit;

/// Index of a shape.
pub(crate) type ShapeId = u32;

/// All shapes of a mesh and of whatever its quads are subdivided into.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Shapes {
    shapes: Vec<Shape>,
    known: HashMap<Vec<u32>, ShapeId>,
    /// Of the rows of patches.
    bytes: usize,
}

/// A shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Shape {
    /// One bicubic patch.
    Regular(BezierRows),
    /// What a step makes of it: the quads at its corners, each with that corner first.
    Irregular {
        /// The vertices and the shape of the quad at each corner.
        children: Box<[(Rows, ShapeId); 4]>,
        /// The patches that it has after some steps.
        rings: Rings,
        /// Where the corners end up, where that can be told at once.
        limits: Box<[Option<Limit>; 4]>,
    },
}

/// The vertices around a quad, its own four first, and its corner in each face.
pub(crate) struct Neighbourhood {
    pub(crate) vertices: Vec<u32>,
    /// A corner of each face, in the order in which they are found.
    faces: Vec<u32>,
}

impl Neighbourhood {
    /// The neighbourhood of a quad in a cage of quads.
    pub(crate) fn of(cage: &Cage, face: u32) -> Self {
        let mut found = Self { vertices: Vec::with_capacity(20), faces: Vec::with_capacity(12) };
        for corner in cage.corners_of(face) {
            for around in cage.fan(corner, Cage::across) {
                let is_new = |&known: &u32| cage.faces[known as usize] != cage.faces[around as usize];
                if found.faces.iter().all(is_new) {
                    found.take(cage, around);
                }
            }
        }
        found
    }

    fn take(&mut self, cage: &Cage, corner: u32) {
        self.faces.push(corner);
        for corner in around(cage, corner) {
            let vertex = cage.vertex(corner);
            if !self.vertices.contains(&vertex) {
                self.vertices.push(vertex);
            }
        }
    }

    /// The neighbourhood as a cage of its own.
    fn cage(&self, cage: &Cage) -> Cage {
        let mut local = Cage::empty(self.vertices.len());
        // In range: neighbourhoods are small parts of cages.
        let index = |vertex: u32| self.vertices.iter().position(|&v| v == vertex).unwrap_or(0) as u32;
        let place = |corner: u32| {
            let face =
                self.faces.iter().position(|&f| cage.faces[f as usize] == cage.faces[corner as usize])?;
            let turn = around(cage, self.faces[face]).iter().position(|&c| c == corner)?;
            Some((4 * face + turn) as u32)
        };
        for &face in &self.faces {
            local.push_face(around(cage, face).map(|corner| index(cage.vertex(corner))));
        }
        let corners = self.faces.iter().flat_map(|&face| around(cage, face));
        for (at, corner) in corners.enumerate() {
            local.opposite[at] = cage.across(corner).and_then(place).unwrap_or(BORDER);
            // Only what touches the quad matters, and all else is forgotten.
            let ends = [local.vertices[at], local.vertex(local.next(at as u32))];
            let touches = ends.iter().any(|&end| end < 4);
            local.sharpness[at] = match local.opposite[at] {
                BORDER => f32::INFINITY,
                _ if touches => cage.sharpness[corner as usize],
                _ => 0.0,
            };
        }
        for (own, &vertex) in local.corners.iter_mut().zip(&self.vertices).take(4) {
            *own = cage.corners[vertex as usize];
        }
        local
    }
}

/// The four corners of a quad, from one of them on.
fn around(cage: &Cage, corner: u32) -> [u32; 4] {
    let second = cage.next(corner);
    let third = cage.next(second);
    [corner, second, third, cage.next(third)]
}

impl Shapes {
    /// The shape of a quad's neighbourhood.
    pub(crate) fn of(&mut self, cage: &Cage, around: &Neighbourhood) -> ShapeId {
        let local = around.cage(cage);
        let sharp = local.sharpness.iter().chain(&local.corners[..4]);
        let key: Vec<u32> = local.vertices.iter().copied().chain(sharp.map(|s| s.to_bits())).collect();
        if let Some(&shape) = self.known.get(&key) {
            return shape;
        }
        // In range: there are fewer shapes than quads.
        let shape = self.shapes.len() as ShapeId;
        self.known.insert(key, shape);
        // Known before its children are: one of them may have this very shape.
        self.shapes.push(Shape::Regular(BezierRows::default()));
        self.shapes[shape as usize] = match control_points(&local) {
            Some(rows) => Shape::Regular(BezierRows::of_b_spline(&rows, around.vertices.len())),
            None => self.irregular(&local, shape),
        };
        shape
    }

    pub(crate) fn get(&self, shape: ShapeId) -> &Shape {
        &self.shapes[shape as usize]
    }

    fn irregular(&mut self, local: &Cage, shape: ShapeId) -> Shape {
        let (refined, rows) = local.refined();
        let children = [0, 1, 2, 3].map(|corner| {
            // The quads of a step stand in the order of the corners.
            let around = Neighbourhood::of(&refined, corner);
            (rows.picked(&around.vertices), self.of(&refined, &around))
        });
        let limits = [0, 1, 2, 3].map(|corner| Limit::of(local, corner));
        let patches = children.each_ref().map(|(step, child)| (step, self.patch(*child)));
        let mut bytes = self.bytes;
        let rings = Rings::new((patches, local.corners.len()), children[0].1 == shape, &mut bytes);
        self.bytes = bytes;
        Shape::Irregular { children: Box::new(children), rings, limits: Box::new(limits) }
    }

    /// The rows of a shape that is regular. One that is being made has none yet.
    fn patch(&self, shape: ShapeId) -> Option<&BezierRows> {
        match self.get(shape) {
            Shape::Regular(rows) => Some(rows).filter(|rows| !rows.is_empty()),
            Shape::Irregular { .. } => None,
        }
    }
}

/// How the surface meets a vertex of a quad.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Meeting {
    Inside,
    Edge,
    Corner,
}

/// How the surface meets a corner of the first face; `None` where it is no B-spline there.
fn meeting(local: &Cage, corner: u32) -> Option<Meeting> {
    let spokes = local.spokes(&local.fan(corner, Cage::across));
    let own = local.corners[local.vertex(corner) as usize];
    let endless = |s: f32| s == 0.0 || s == f32::INFINITY;
    if !(spokes.iter().all(|spoke| endless(spoke.1)) && endless(own)) {
        return None;
    }
    let faces = local.fan(corner, Cage::across_smooth).len();
    let open = local.across_smooth(corner).is_none() || local.across_smooth(local.before(corner)).is_none();
    match (Cage::rule(&spokes, own), faces, open) {
        (Rule::Smooth, 4, false) if spokes.iter().all(|spoke| spoke.1 == 0.0) => Some(Meeting::Inside),
        (Rule::Crease, 2, true) => Some(Meeting::Edge),
        (Rule::Corner, 1, true) => Some(Meeting::Corner),
        _ => None,
    }
}

/// The control points of the B-spline over the first face; `None` where it is none.
fn control_points(local: &Cage) -> Option<Rows> {
    let meetings = [0, 1, 2, 3].map(|corner| meeting(local, corner));
    if meetings.contains(&None) {
        return None;
    }
    let mut grid: [Option<Vec<(u32, f64)>>; 16] = std::array::from_fn(|_| None);
    // The corners stand at (1, 1), (2, 1), (2, 2), (1, 2).
    let places: [[i32; 2]; 4] = [[1, 1], [2, 1], [2, 2], [1, 2]];
    let at = |[i, j]: [i32; 2]| (4 * j + i) as usize;
    let step = |[i, j]: [i32; 2], [di, dj]: [i32; 2]| [i + di, j + dj];
    for (corner, place) in (0_u32..).zip(places) {
        grid[at(place)] = Some(vec![(local.vertex(corner), 1.0)]);
    }
    // Outward across side k, which leads from corner k to the next.
    let outward: [[i32; 2]; 4] = [[0, -1], [1, 0], [0, 1], [-1, 0]];
    let mirrored = |grid: &[Option<Vec<(u32, f64)>>; 16], place: [i32; 2], [di, dj]: [i32; 2]| {
        let twice = grid[at(step(place, [-di, -dj]))].iter().flatten().map(|&(v, w)| (v, 2.0 * w));
        let less = grid[at(step(place, [-2 * di, -2 * dj]))].iter().flatten().map(|&(v, w)| (v, -w));
        Some(twice.chain(less).collect())
    };
    for side in 0..4_usize {
        let [first, second] = [places[side], places[(side + 1) % 4]].map(|place| step(place, outward[side]));
        match local.across_smooth(side as u32) {
            Some(back) => {
                let beyond = local.next(local.next(back));
                grid[at(first)] = Some(vec![(local.vertex(beyond), 1.0)]);
                grid[at(second)] = Some(vec![(local.vertex(local.next(beyond)), 1.0)]);
            }
            None => {
                grid[at(first)] = mirrored(&grid, first, outward[side]);
                grid[at(second)] = mirrored(&grid, second, outward[side]);
            }
        }
    }
    for corner in 0..4_usize {
        let (out, before) = (outward[corner], outward[(corner + 3) % 4]);
        let place = step(step(places[corner], out), before);
        grid[at(place)] = match (local.across_smooth(corner as u32), meetings[corner]) {
            (Some(back), Some(Meeting::Inside)) => {
                // The face across, its next side, the face across that: the farthest of its vertices.
                let diagonal = local.across_smooth(local.next(back))?;
                Some(vec![(local.vertex(local.before(diagonal)), 1.0)])
            }
            (Some(_), _) => mirrored(&grid, place, before),
            (None, _) => mirrored(&grid, place, out),
        };
    }
    let mut rows = Rows::default();
    for row in grid {
        rows.push(row?);
    }
    Some(rows)
}
