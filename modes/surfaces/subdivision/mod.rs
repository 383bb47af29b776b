//! Catmull-Clark subdivision surfaces, displaced or not, to be made on demand.
//!
//! The cage is that of the scene, after one step where it has faces that are no quads. Nothing finer is stored: the limit surface
//! over a quad is found from its neighbourhood (`limit.rs`) whenever it is asked for.
//!
//! Points of a border are found by one of the quads that meet there (`border_owners.rs`), its normals and texture coordinates are
//! that quad's, too.
//!
//! Based on: Edwin Catmull and James Clark, "Recursively Generated B-Spline Surfaces on Arbitrary Topological Meshes", 1978; Matthias
//! Nießner, Charles Loop, Mark Meyer and Tony DeRose, "Feature-Adaptive GPU Rendering of Catmull-Clark Subdivision Surfaces", 2012.

pub(crate) mod bezier_rows;
pub(crate) mod border_owners;
pub(crate) mod cage;
pub(crate) mod limit;
pub(crate) mod limit_masks;
pub(crate) mod neighbourhood;
pub(crate) mod quad_cage;

use std::collections::HashMap;

use fearless_simd::{Level, dispatch, prelude::*};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use umbel_core::{Aabb, Detail, Domain, OnDemand};

use crate::scene::{Creases, Scene};
use crate::surfaces::displacement::{Displacement, UvBox, unit_normals, uv_box};
use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LANES, Lanes, rounded_lanes};
use crate::surfaces::noise::{Cells, NO_CELLS};
use crate::surfaces::patch_tree::{Node, PatchTree};
use crate::surfaces::polygons::Polygons;
use crate::surfaces::subdivision::border_owners::Rulers;
use crate::surfaces::subdivision::limit::{LimitQuad, Place, Sample};
use crate::surfaces::subdivision::neighbourhood::{Neighbourhood, ShapeId, Shapes};
use crate::surfaces::subdivision::quad_cage::{QuadCage, Sharpness};

/// A Catmull-Clark surface. Hits report the index of the face of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SubdivisionSurface {
    quads: QuadCage,
    shapes: Shapes,
    /// The shape of each quad.
    shape: Vec<ShapeId>,
    /// The vertices of each quad's neighbourhood, quad by quad, and where each quad's begin.
    around: Vec<u32>,
    first_around: Vec<usize>,
    rulers: Rulers,
    displacement: Displacement,
    first_triangles: Vec<u32>,
    tree: PatchTree,
}

/// From here on a crease never ends: the bound of OpenSubdiv.
const ENDLESS: f32 = 10.0;

impl SubdivisionSurface {
    /// The limit surface of the faces of a scene, displaced along its normals. Where heights go by texture coordinates, corners
    /// without any have (0, 0); texture coordinates are interpolated linearly over each face.
    #[must_use]
    pub fn new(scene: &Scene, creases: &Creases, displacement: Displacement) -> Self {
        let polygons = Polygons::new(scene);
        let sharpness = sharpness(scene, &polygons, creases);
        let quads = QuadCage::new(&polygons, &sharpness);
        let mut shapes = Shapes::default();
        // In range: quads and corners are counted in 32 bits.
        let count = quads.parents.len() as u32;
        let (mut shape, mut around, mut first_around) = (Vec::new(), Vec::new(), vec![0]);
        for quad in 0..count {
            let neighbourhood = Neighbourhood::of(&quads.cage, quad);
            shape.push(shapes.of(&quads.cage, &neighbourhood));
            around.extend(neighbourhood.vertices);
            first_around.push(around.len());
        }
        let rulers = Rulers::new(&quads);
        let tree = PatchTree::new(&[]);
        let mut surface = Self {
            quads,
            shapes,
            shape,
            around,
            first_around,
            rulers,
            displacement,
            first_triangles: polygons.triangles,
            tree,
        };
        let boxes: Vec<Aabb> =
            (0..count).into_par_iter().map(|quad| surface.quad_bounds(quad, Domain::UNIT, None)).collect();
        surface.tree = PatchTree::new(&boxes);
        surface
    }

    /// The first triangle of each face in its scene.
    #[must_use]
    pub fn first_triangles(&self) -> &[u32] {
        &self.first_triangles
    }

    /// Calls `take` with the limit quad of a quad.
    fn with_limit<T>(&self, quad: u32, level: Level, take: impl FnOnce(LimitQuad<'_>) -> T) -> T {
        let around = &self.around[self.first_around[quad as usize]..self.first_around[quad as usize + 1]];
        let points: Vec<DVec3> = around.iter().map(|&v| self.quads.points[v as usize]).collect();
        let shape = self.shape[quad as usize];
        take(LimitQuad { shapes: &self.shapes, shape, points: &points, depth: 0, level })
    }

    /// A box around the displaced surface over a part of a quad, with the borders that other quads find, for some detail or any.
    fn quad_bounds(&self, quad: u32, domain: Domain, detail: Option<&Detail>) -> Aabb {
        let mut all = self.inner_extent(quad, domain, detail);
        if !self.displacement.is_none() {
            for (ruler, part) in self.ruled_parts(quad, domain) {
                all = all.union(self.inner_extent(ruler, part, detail));
            }
        }
        all.outward()
    }

    /// A box around what a quad finds over a part of itself.
    fn inner_extent(&self, quad: u32, domain: Domain, detail: Option<&Detail>) -> Extent {
        // One range of heights for all parts: near an extraordinary vertex they are many, and small.
        let (mut points, mut units) = (Extent::EMPTY, Extent::EMPTY);
        self.with_limit(quad, detail.map_or_else(Level::new, Detail::level), |limit| {
            limit.extents(domain, &mut |of_part, normals| {
                points = points.union(of_part);
                if !self.displacement.is_none() {
                    units = units.union(unit_normals(normals));
                }
            });
        });
        self.displacement.extent((points, units), || self.uv_box(quad, domain), detail)
    }

    /// Borders of a part that other quads find, as thin parts of those: on creases and seams they may have other normals and
    /// texture coordinates.
    fn ruled_parts(&self, quad: u32, Domain { u, v }: Domain) -> Vec<(u32, Domain)> {
        let sides = [
            ([u[0], v[0]], [u[1], v[0]]),
            ([u[1], v[0]], [u[1], v[1]]),
            ([u[0], v[1]], [u[1], v[1]]),
            ([u[0], v[0]], [u[0], v[1]]),
        ];
        let mut parts = Vec::new();
        for (from, to) in sides {
            let middle = [(from[0] + to[0]) * 0.5, (from[1] + to[1]) * 0.5];
            let (ruler, place) = self.rulers.of(&self.quads.cage, quad, middle);
            if ruler != quad {
                // The ruler's parameter runs along the border as fast as the quad's.
                let half = (to[0] - from[0] + to[1] - from[1]) * 0.5;
                parts.push((ruler, around(place, half)));
            }
            for end in [from, to] {
                let (ruler, place) = self.rulers.of(&self.quads.cage, quad, end);
                if ruler != quad && place.iter().all(|&t| t == 0.0 || t == 1.0) {
                    parts.push((ruler, around(place, 0.0)));
                }
            }
        }
        parts
    }

    /// Puts samples of a quad where they belong, displaced.
    #[inline(always)]
    fn displace<S: Simd>(
        &self,
        simd: S,
        quad: u32,
        (places, samples): (&[Place], &[Sample]),
        points: &mut [[f32; 3]],
        (detail, cells): (&Detail, &mut Cells),
    ) {
        for some in places.chunks(LANES) {
            let (mut found, mut uvs) = ([[0.0; LANES]; 6], [[0.0; 2]; LANES]);
            for (lane, &(index, place)) in some.iter().enumerate() {
                let Sample { point, normal } = samples[index];
                for k in 0..3 {
                    (found[k][lane], found[3 + k][lane]) = (point[k], normal[k]);
                }
                if self.displacement.needs_uvs() {
                    uvs[lane] = self.uv(quad, place);
                }
            }
            let [a, b, c, d, e, f] = found;
            let point = [Lanes::load_array(simd, a), Lanes::load_array(simd, b), Lanes::load_array(simd, c)];
            let normal = [Lanes::load_array(simd, d), Lanes::load_array(simd, e), Lanes::load_array(simd, f)];
            let asked = (detail, &mut *cells);
            let moved = rounded_lanes(self.displacement.displaced_lanes(simd, (point, normal), &uvs, asked));
            for (&(index, _), point) in some.iter().zip(moved) {
                points[index] = point;
            }
        }
    }

    /// The texture coordinates at parameters of a quad.
    fn uv(&self, quad: u32, [u, v]: [f64; 2]) -> [f64; 2] {
        let first = quad as usize * 4;
        let Some(corners) = self.quads.uvs.get(first..first + 4) else {
            return [0.0; 2];
        };
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| DVec2::from_array(corners[k].map(f64::from)));
        let (lower, upper) = (a * (1.0 - u) + b * u, d * (1.0 - u) + c * u);
        (lower * (1.0 - v) + upper * v).to_array()
    }

    /// A box around the texture coordinates of a part.
    fn uv_box(&self, quad: u32, Domain { u, v }: Domain) -> UvBox {
        let ends = [[u[0], v[0]], [u[1], v[0]], [u[1], v[1]], [u[0], v[1]]];
        uv_box(ends.map(|place| DVec2::from_array(self.uv(quad, place))))
    }
}

/// The thickness of a border, where a part of a quad stands for it.
const THIN: f64 = 1.0 / 1_048_576.0;

/// A thin part of a quad around a place on its border, so far to both sides along the border.
fn around(place: [f64; 2], half: f64) -> Domain {
    let span = |t: f64| match t {
        0.0 => [0.0, THIN],
        1.0 => [1.0 - THIN, 1.0],
        t => [(t - half).max(0.0), (t + half).min(1.0)],
    };
    Domain { u: span(place[0]), v: span(place[1]) }
}

/// The sharpness that was asked for, by welded vertices.
fn sharpness(scene: &Scene, polygons: &Polygons, creases: &Creases) -> Sharpness {
    if creases.edges.is_empty() && creases.corners.is_empty() {
        return Sharpness::default();
    }
    let vertices: HashMap<[u32; 3], u32> =
        polygons.positions.iter().map(|p| p.map(f32::to_bits)).zip(0..).collect();
    let welded = |index: u32| {
        let position = scene.positions.get(index as usize)?;
        vertices.get(&position.map(|x| (x + 0.0).to_bits())).copied()
    };
    let endless = |s: f32| if s >= ENDLESS { f32::INFINITY } else { s.max(0.0) };
    let edge = |&([a, b], s): &([u32; 2], f32)| {
        let (a, b) = (welded(a)?, welded(b)?);
        Some(([a.min(b), a.max(b)], endless(s)))
    };
    Sharpness {
        edges: creases.edges.iter().filter_map(edge).collect(),
        vertices: creases.corners.iter().filter_map(|&(v, s)| Some((welded(v)?, endless(s)))).collect(),
    }
}

impl OnDemand for SubdivisionSurface {
    type Object = Node;

    fn roots(&self) -> Vec<Node> {
        self.tree.roots()
    }

    fn bounds(&self, object: &Node, domain: Domain, detail: &Detail) -> Aabb {
        match self.tree.patch(*object) {
            Some(quad) if domain != Domain::UNIT => self.quad_bounds(quad, domain, Some(detail)),
            _ => self.tree.bounds(*object),
        }
    }

    fn expand(&self, object: &Node, _spacing: f64, _detail: &Detail, parts: &mut Vec<Node>) -> bool {
        parts.extend(self.tree.parts(*object));
        self.tree.patch(*object).is_none()
    }

    fn evaluate(&self, patch: &Node, parameters: &[[f64; 2]], detail: &Detail, points: &mut Vec<[f32; 3]>) {
        let Some(quad) = self.tree.patch(*patch) else {
            return;
        };
        let mut cells = NO_CELLS;
        let mut asked: Vec<(u32, Vec<Place>)> = vec![(quad, Vec::with_capacity(parameters.len()))];
        for (index, &place) in parameters.iter().enumerate() {
            let (ruler, place) = self.rulers.of(&self.quads.cage, quad, place);
            match asked.iter_mut().find(|(known, _)| *known == ruler) {
                Some((_, places)) => places.push((index, place)),
                None => asked.push((ruler, vec![(index, place)])),
            }
        }
        let none = Sample { point: DVec3::ZERO, normal: DVec3::ZERO };
        let (mut samples, first) = (vec![none; parameters.len()], points.len());
        points.resize(first + parameters.len(), [0.0; 3]);
        for (ruler, places) in asked.iter().filter(|(_, places)| !places.is_empty()) {
            self.with_limit(*ruler, detail.level(), |limit| {
                limit.samples(places, !self.displacement.is_none(), &mut samples);
            });
            let (from, to) = (&samples[..], &mut points[first..]);
            let asked = (detail, &mut cells);
            dispatch!(detail.level(), simd => self.displace(simd, *ruler, (places, from), to, asked));
        }
    }

    fn id(&self, patch: &Node) -> u32 {
        self.tree.patch(*patch).map_or(0, |quad| self.quads.parents[quad as usize])
    }
}
