//! Closed surfaces: which triangles belong to one, and what that tells of rays.
//!
//! A set of triangles is *closed* where its oriented edges cancel: each edge, between two positions, is passed as often
//! one way as the other. Vertices are the same where their positions are. Triangles that share edges form a component;
//! a component whose edges cancel is closed as a whole, and so is the set C of all such. Nothing else is asked of it: C
//! may intersect itself, be inside out, be nested, touch or repeat itself, and triangles without area may stitch
//! T-junctions.
//!
//! # The rule
//!
//! Ambient rays without a limit that leave a receiver p into the half space above its own triangle T₀. **Let no
//! triangle of C but T₀ contain p, and, where T₀ is of C, let p not lie strictly below T₀. If one ray meets no triangle
//! of C, then each of the others meets C iff it meets a triangle of C from the front, d·N < 0.**
//!
//! So a receiver that has one such ray need not look at the back faces of C any more. The first ray that meets no front
//! face is the one to ask: it is tested with back faces as well. Half of all triangles need no test then, and with them
//! nearly all of the receiver's own neighbourhood, which turns its back on the rays that leave it.
//!
//! # Proof
//!
//! A ray is (p, d), d·N₀ > 0 on the receiver's side. Ties are those of parallel rays: p is thought to be shifted by e =
//! (ε, ε², ε³). A triangle T is met iff the shifted line crosses it, d·N ≠ 0, and t > 0 for the plane through T and p
//! unshifted.
//!
//! 1. *The shifted line is generic.* Across d, an edge is a segment or, if parallel to d, a point. An edge function is
//!    a polynomial in ε that vanishes for none but the latter, so the line meets the carriers of no other edges. A
//!    point is an end of other edges, or its triangle has no area: those are never met, and generic lines do not cross
//!    them. So the line crosses C in the interior of triangles with d·N ≠ 0 only.
//! 2. *The hits of a ray are the crossings of one that starts at q(d) = p + τd + e*, with ε ≪ τ ≪ 1. The plane of a
//!    triangle that the line crosses is met at t + O(ε). Where t > 0 that is beyond τ; where t < 0 before it; and where
//!    t = 0, which is no hit, it is O(ε) < τ: before it as well. T₀, which never counts, is not crossed from q(d) on
//!    either: p is above its plane, or in it, and d leads upward.
//! 3. *Crossings count the winding number.* Closed chains of triangles intersect closed curves zero times, counted with
//!    signs. For a generic ray from q let w(q) = #(d·N > 0) − #(d·N < 0) over its crossings with C. Two rays from one
//!    q, joined far outside, are a closed curve: w(q) does not depend on d. A path from q to q′ that does not meet C
//!    joins their rays to a closed curve as well: w(q) = w(q′).
//! 4. *All rays of a receiver have one w.* C has finitely many closed triangles; those but T₀ are some distance away
//!    from p. If T₀ does not contain p, a ball around p does not meet C. If it does, p lies in its plane, and the open
//!    half of such a ball above that plane does not meet C. Either holds q(d) for all d of the receiver, and is convex.
//! 5. A ray that meets no triangle of C has w = 0 − 0. So all rays of the receiver have as many back as front hits, and
//!    those without a front hit have no hit at all. ∎
//!
//! Only C counts here: triangles that do not belong to it are tested from both sides, always. A limit breaks the rule,
//! as the hits beyond it would have to be known.
//!
//! Based on: Alec Jacobson, Ladislav Kavan, Olga Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized
//! Winding Numbers", 2013 (winding numbers of triangle soups); Herbert Edelsbrunner and Ernst Mücke, "Simulation of
//! Simplicity", 1990. The rule itself was found here.

use crate::geometry::triangles::Triangles;

/// For each triangle, whether it belongs to a closed component.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct ClosedTriangles {
    /// 64 triangles to a word.
    words: Vec<u64>,
    any: bool,
}

/// An edge as seen from its lower vertex: the other one, the triangle, and which way it is passed.
#[derive(Debug, Clone, Copy, Default)]
struct HalfEdge {
    other: u32,
    /// Twice the triangle, and 1 if the edge leads to the lower vertex.
    passed: u32,
}

impl ClosedTriangles {
    /// Finds them. O(n) for n triangles, with edges of a vertex sorted.
    pub(crate) fn new(triangles: &Triangles<'_>) -> Self {
        // Half edges have 31 bits for the triangle. More triangles than that count as open.
        if triangles.is_empty() || triangles.len() > u32::MAX as usize / 2 {
            return Self { words: vec![0; triangles.len().div_ceil(64)], any: false };
        }
        let vertices = welded(triangles.positions());
        let (ends, mut edges) = edges_by_vertex(triangles, &vertices);
        let mut components = Components::new(triangles.len());
        let mut open = vec![false; triangles.len()];
        let mut first = 0;
        for end in ends {
            let of_vertex = &mut edges[first..end as usize];
            first = end as usize;
            of_vertex.sort_unstable_by_key(|edge| edge.other);
            for edge in of_vertex.chunk_by(|one, other| one.other == other.other) {
                let triangle = edge[0].passed / 2;
                let mut balance = 0_i64;
                for &HalfEdge { passed, .. } in edge {
                    components.unite(triangle, passed / 2);
                    balance += 1 - 2 * i64::from(passed % 2);
                }
                open[triangle as usize] |= balance != 0;
            }
        }
        components.flag(&open)
    }

    /// Whether a triangle belongs to a closed component.
    #[inline(always)]
    pub(crate) fn contains(&self, id: u32) -> bool {
        self.words[id as usize / 64] >> (id % 64) & 1 == 1
    }

    /// Whether there is a closed component.
    pub(crate) fn has_any(&self) -> bool {
        self.any
    }

    /// Bytes of it.
    pub(crate) fn bytes(&self) -> usize {
        self.words.capacity() * size_of::<u64>()
    }

    /// Bytes that finding them takes at its peak.
    pub(crate) fn bytes_to_find(triangles: &Triangles<'_>) -> usize {
        let vertices = triangles.positions().len();
        let table = table_size(vertices) * size_of::<u32>();
        let of_triangle = 3 * size_of::<HalfEdge>() + size_of::<u32>() + 2 * size_of::<bool>();
        let edges = vertices * size_of::<u32>() + triangles.len() * of_triangle;
        vertices * size_of::<u32>() + table.max(edges)
    }
}

/// Places of a table of vertices: a third stays empty at least.
fn table_size(vertices: usize) -> usize {
    (vertices + vertices / 2).next_power_of_two().max(2)
}

/// For each vertex the first one at the same position. O(n): a table with open addressing.
fn welded(positions: &[[f32; 3]]) -> Vec<u32> {
    const EMPTY: u32 = u32::MAX;
    let size = table_size(positions.len());
    let mut table = vec![EMPTY; size];
    // Zero has two signs and is one position.
    let bits = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
    let shift = u64::BITS - size.trailing_zeros();
    let mut first = Vec::with_capacity(positions.len());
    for (vertex, &position) in (0_u32..).zip(positions) {
        let [x, y, z] = bits(position);
        let mixed = (u64::from(x) << 32 | u64::from(y)).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(z);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mut place = (mixed >> shift) as usize;
        while table[place] != EMPTY && bits(positions[table[place] as usize]) != [x, y, z] {
            place = (place + 1) % size;
        }
        if table[place] == EMPTY {
            table[place] = vertex;
        }
        first.push(table[place]);
    }
    first
}

/// The edges of all triangles by their lower vertex, and where those of each vertex end. Edges between one position and
/// itself are left out.
fn edges_by_vertex(triangles: &Triangles<'_>, vertices: &[u32]) -> (Vec<u32>, Vec<HalfEdge>) {
    let edges_of = |id: u32| {
        let [a, b, c] = triangles.vertices(id).map(|vertex| vertices[vertex as usize]);
        [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from != to)
    };
    // In range: checked by the caller.
    let ids = 0..triangles.len() as u32;
    let mut ends = vec![0_u32; vertices.len()];
    for (from, to) in ids.clone().flat_map(edges_of) {
        ends[from.min(to) as usize] += 1;
    }
    let mut next = 0;
    for end in &mut ends {
        next += std::mem::replace(end, next);
    }
    let mut edges = vec![HalfEdge::default(); next as usize];
    for id in ids {
        for (from, to) in edges_of(id) {
            let place = &mut ends[from.min(to) as usize];
            edges[*place as usize] = HalfEdge { other: from.max(to), passed: 2 * id + u32::from(to < from) };
            *place += 1;
        }
    }
    (ends, edges)
}

/// Sets of triangles that are united step by step.
struct Components {
    /// Another triangle of the same set, or the triangle itself.
    parents: Vec<u32>,
}

impl Components {
    /// Each triangle by itself.
    fn new(triangles: usize) -> Self {
        // In range: checked by the caller.
        Self { parents: (0..triangles as u32).collect() }
    }

    /// The triangle that stands for a triangle's set.
    fn find(&mut self, mut id: u32) -> u32 {
        while self.parents[id as usize] != id {
            let parent = self.parents[id as usize];
            self.parents[id as usize] = self.parents[parent as usize];
            id = parent;
        }
        id
    }

    /// Unites two sets.
    fn unite(&mut self, one: u32, other: u32) {
        let (one, other) = (self.find(one), self.find(other));
        self.parents[one.max(other) as usize] = one.min(other);
    }

    /// The triangles of sets of which none is open.
    fn flag(mut self, open: &[bool]) -> ClosedTriangles {
        let mut open_sets = vec![false; open.len()];
        for (id, _) in (0..).zip(open).filter(|(_, open)| **open) {
            open_sets[self.find(id) as usize] = true;
        }
        let mut words = vec![0; open.len().div_ceil(64)];
        for id in 0..open.len() {
            // In range: checked by the caller.
            let is_closed = !open_sets[self.find(id as u32) as usize];
            words[id / 64] |= u64::from(is_closed) << (id % 64);
        }
        ClosedTriangles { any: words.iter().any(|&word| word != 0), words }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of a cube.
    fn cube() -> Vec<[f32; 3]> {
        (0..8_u8).map(|k| [0, 1, 2].map(|axis| f32::from(k >> axis & 1))).collect()
    }

    /// Its faces, outward.
    const FACES: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

    fn halves(face: [u32; 4]) -> [[u32; 3]; 2] {
        [[face[0], face[1], face[2]], [face[0], face[2], face[3]]]
    }

    /// Which of some triangles are closed.
    fn closed(positions: &[[f32; 3]], indices: &[[u32; 3]]) -> Vec<bool> {
        let triangles = Triangles::new(positions, indices).expect("valid triangles");
        let closed = ClosedTriangles::new(&triangles);
        let flags: Vec<bool> = (0..indices.len() as u32).map(|id| closed.contains(id)).collect();
        assert_eq!(closed.has_any(), flags.contains(&true));
        flags
    }

    #[test]
    fn a_cube_is_closed_however_its_vertices_are_shared() {
        let shared: Vec<[u32; 3]> = FACES.into_iter().flat_map(halves).collect();
        assert_eq!(closed(&cube(), &shared), [true; 12]);
        let apart: Vec<[f32; 3]> = shared.iter().flatten().map(|&v| cube()[v as usize]).collect();
        // Zero of either sign.
        let apart: Vec<[f32; 3]> = apart
            .iter()
            .enumerate()
            .map(|(k, p)| p.map(|x| if k % 2 == 0 { x } else { -x * -1.0 }))
            .collect();
        let own: Vec<[u32; 3]> = (0..12).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        assert_eq!(closed(&apart, &own), [true; 12]);
        let inverted: Vec<[u32; 3]> = shared.iter().map(|&[a, b, c]| [a, c, b]).collect();
        assert_eq!(closed(&cube(), &inverted), [true; 12]);
    }

    #[test]
    fn an_open_component_leaves_others_closed() {
        let mut positions = cube();
        positions.extend(cube().iter().map(|p| p.map(|x| x + 3.0)));
        let mut indices: Vec<[u32; 3]> = FACES.into_iter().flat_map(halves).collect();
        // A second cube without its last triangle.
        let second: Vec<[u32; 3]> = indices[..11].iter().map(|t| t.map(|v| v + 8)).collect();
        indices.extend(second);
        assert_eq!(closed(&positions, &indices), [[true; 12].as_slice(), &[false; 11]].concat());
        // One triangle the wrong way round opens it, though each edge is there twice.
        indices.truncate(12);
        indices[3].swap(0, 1);
        assert_eq!(closed(&positions, &indices), [false; 12]);
    }

    #[test]
    fn what_cancels_is_closed() {
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.0, 0.0]];
        // A triangle and its back; and with a T-junction that a triangle without area fills.
        assert_eq!(closed(&positions, &[[0, 1, 2], [0, 2, 1]]), [true; 2]);
        assert_eq!(closed(&positions, &[[0, 1, 2], [0, 1, 2]]), [false; 2]);
        let stitched = [[0, 1, 2], [3, 0, 2], [1, 3, 2], [0, 3, 1]];
        assert_eq!(closed(&positions, &stitched), [true; 4]);
        // Twice the same vertex: such edges are none.
        assert_eq!(closed(&positions, &[[0, 0, 0], [0, 0, 1]]), [true; 2]);
        assert_eq!(closed(&[], &[]), [false; 0]);
    }
}
