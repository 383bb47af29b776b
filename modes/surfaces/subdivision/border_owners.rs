//! Who finds the points of a border between quads of a cage.
//!
//! Two quads find the points of their border from different vertices, so their last bits may differ. Therefore the quad with the
//! least index at an edge, and around a vertex, finds them for all: the others turn their parameter into that quad's, s or 1 − s,
//! both exact, and ask.
//!
//! Based on: John McDonald and Mark Kilgard, "Crack-Free Point-Normal Triangles using Adjacent Edge Normals", 2010 (dominant edges
//! and corners).

use std::collections::HashMap;

use crate::surfaces::subdivision::cage::Cage;
use crate::surfaces::subdivision::quad_cage::QuadCage;

/// The rulers of all borders and vertices.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rulers {
    /// The least corner at each vertex, or at another at the same place.
    corners: Vec<u32>,
    /// The least half-edge between the same two vertices, where that is no neighbour, and whether it runs the other way.
    edges: HashMap<u32, (u32, bool)>,
}

impl Rulers {
    /// Those of a cage.
    pub(crate) fn new(quads: &QuadCage) -> Self {
        Self { corners: corners(quads), edges: edges(quads) }
    }

    /// The quad that finds the point at parameters of another, and its parameters.
    pub(crate) fn of(&self, cage: &Cage, quad: u32, place: [f64; 2]) -> (u32, [f64; 2]) {
        let [u, v] = place;
        let (side, s) = match (u == 0.0 || u == 1.0, v == 0.0 || v == 1.0) {
            (false, false) => return (quad, place),
            (true, true) => {
                let corner =
                    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].iter().position(|&c| c == place);
                let vertex = cage.vertex(4 * quad + corner.unwrap_or(0) as u32);
                let ruler = self.corners[vertex as usize];
                return (ruler / 4, on_side(ruler % 4, 0.0));
            }
            (false, true) => {
                if v == 0.0 {
                    (0, u)
                } else {
                    (2, 1.0 - u)
                }
            }
            (true, false) => {
                if u == 1.0 {
                    (1, v)
                } else {
                    (3, 1.0 - v)
                }
            }
        };
        let edge = 4 * quad + side;
        let (ruler, turned) = match self.edges.get(&edge) {
            Some(&odd) => odd,
            None => {
                let back = cage.across(edge).filter(|&back| back < edge);
                back.map_or((edge, false), |back| (back, true))
            }
        };
        (ruler / 4, on_side(ruler % 4, if turned { 1.0 - s } else { s }))
    }
}

/// A place on a side of a quad, from corner `side` to the next.
fn on_side(side: u32, s: f64) -> [f64; 2] {
    match side {
        0 => [s, 0.0],
        1 => [1.0, s],
        2 => [1.0 - s, 1.0],
        _ => [0.0, 1.0 - s],
    }
}

/// The least corner at each vertex and its twins.
fn corners(quads: &QuadCage) -> Vec<u32> {
    let mut least = vec![u32::MAX; quads.points.len()];
    for (corner, &vertex) in (0_u32..).zip(&quads.cage.vertices) {
        let twin = quads.twins[vertex as usize] as usize;
        least[twin] = least[twin].min(corner);
    }
    quads.twins.iter().map(|&twin| least[twin as usize]).collect()
}

/// For borders that lie on each other: the least of them.
fn edges(quads: &QuadCage) -> HashMap<u32, (u32, bool)> {
    let cage = &quads.cage;
    let mut first: HashMap<[u32; 2], (u32, u32)> = HashMap::new();
    let mut odd = HashMap::new();
    for corner in (0..cage.vertices.len() as u32).filter(|&corner| cage.across(corner).is_none()) {
        let [from, to] = [corner, cage.next(corner)].map(|corner| quads.twins[cage.vertex(corner) as usize]);
        let &mut (ruler, start) = first.entry([from.min(to), from.max(to)]).or_insert((corner, from));
        if ruler != corner {
            odd.insert(corner, (ruler, start != from));
        }
    }
    odd
}
