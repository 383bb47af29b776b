//! Displaced polygons: triangles, quads or any other faces, each corner with a bilinear patch of its own.
//!
//! The patch of corner A of a face has the corners A, M, G, M': the middle of the edge to the next corner, the middle of the face
//! (the mean of its corners), and the middle of the edge to the corner before. Positions, normals and texture coordinates are
//! bilinear over it; a triangle's patches together are the triangle with linear interpolation. Positions and normals at A, M and G
//! depend on the vertices alone and (A + B)/2 on no order, so patches that meet have equal numbers at the two ends of their border,
//! and (1 − t)·a + t·b gives equal bits between. Displacement follows in `displacement.rs`.
//!
//! Texture coordinates may differ between the faces at an edge or around a vertex. There the face with the least index rules: all
//! patches take the coordinates that it has. What lies inside a patch does not change, so that a seam is a steep wall of one
//! micropolygon's width instead of a crack.
//!
//! Based on: John McDonald and Mark Kilgard, "Crack-Free Point-Normal Triangles using Adjacent Edge Normals", 2010 (dominant edges
//! and corners).

use std::collections::HashMap;

use fearless_simd::prelude::*;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use umbel_core::{Aabb, Detail, Domain, OnDemand};

use crate::scene::Scene;
use crate::surfaces::displacement::{Displacement, UvBox, unit_normals, uv_box};
use crate::surfaces::extent::{Extent, widened};
use crate::surfaces::lanes::{LANES, LaneMap, Lanes, PointLanes, map_points, splat};
use crate::surfaces::noise::{Cells, NO_CELLS};
use crate::surfaces::patch_tree::{Node, PatchTree};
use crate::surfaces::polygons::Polygons;

/// A mesh whose faces are displaced. Hits report the index of the face.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplacedMesh {
    polygons: Polygons,
    displacement: Displacement,
    tree: PatchTree,
    seams: Seams,
}

/// What [`DisplacedMesh`] consists of: groups of faces, faces, and the patches of their corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceObject {
    /// A group of faces, or one face.
    Faces(Node),
    /// The patch of one corner.
    Corner {
        /// The face.
        face: u32,
        /// The corner, counted through all faces.
        corner: u32,
    },
}

/// Texture coordinates where faces disagree.
#[derive(Debug, Clone, PartialEq, Default)]
struct Seams {
    /// At the corner itself, by corner.
    corners: HashMap<u32, [f32; 2]>,
    /// At the ends of the edge that begins at a corner, by corner.
    edges: HashMap<u32, [[f32; 2]; 2]>,
}

/// A bilinear patch: its corners at (0, 0), (1, 0), (1, 1), (0, 1).
struct Bilinear<T>([T; 4]);

impl<T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>> Bilinear<T> {
    fn at(&self, [u, v]: [f64; 2]) -> T {
        let [a, b, c, d] = self.0;
        lerp(lerp(a, b, u), lerp(d, c, u), v)
    }

    /// The corners of a part.
    fn part(&self, Domain { u, v }: Domain) -> [T; 4] {
        [[u[0], v[0]], [u[1], v[0]], [u[1], v[1]], [u[0], v[1]]].map(|place| self.at(place))
    }
}

/// (1 − t)·a + t·b: the same bits from either end, and exact at both.
fn lerp<T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>>(a: T, b: T, t: f64) -> T {
    a * (1.0 - t) + b * t
}

impl DisplacedMesh {
    /// The faces of a scene, displaced. Where heights go by texture coordinates, corners without any have (0, 0).
    #[must_use]
    pub fn new(scene: &Scene, displacement: Displacement) -> Self {
        let polygons = Polygons::new(scene);
        let seams = if displacement.needs_uvs() { Seams::new(&polygons) } else { Seams::default() };
        let mut mesh = Self { polygons, displacement, tree: PatchTree::new(&[]), seams };
        // In range: faces have 32-bit ids.
        let boxes: Vec<Aabb> = (0..mesh.polygons.len() as u32)
            .into_par_iter()
            .map(|face| {
                let corners = mesh.polygons.corners_of(face);
                // In range: corners are counted in 32 bits.
                let patches =
                    corners.map(|corner| mesh.patch_bounds(face, corner as u32, Domain::UNIT, None));
                patches.fold(Aabb::EMPTY, Aabb::union)
            })
            .collect();
        mesh.tree = PatchTree::new(&boxes);
        mesh
    }

    /// The first triangle of each face in its scene.
    #[must_use]
    pub fn first_triangles(&self) -> &[u32] {
        &self.polygons.triangles
    }

    /// The patches of a face.
    fn patches(&self, face: u32) -> impl Iterator<Item = FaceObject> {
        // In range: corners are counted in 32 bits.
        self.polygons.corners_of(face).map(move |corner| FaceObject::Corner { face, corner: corner as u32 })
    }

    /// What is given at corners, bilinear over the patch of one: `of` takes a corner.
    fn bilinear<T>(&self, face: u32, corner: u32, of: impl Fn(usize) -> T) -> Bilinear<T>
    where
        T: Copy + std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        let corners = self.polygons.corners_of(face);
        let (here, last) = (corner as usize, corners.end - 1);
        let next = if here == last { corners.start } else { here + 1 };
        let before = if here == corners.start { last } else { here - 1 };
        let middle = |other: usize| (of(here) + of(other)) * 0.5;
        let sum = (corners.start + 1..corners.end).fold(of(corners.start), |sum, k| sum + of(k));
        Bilinear([of(here), middle(next), sum * (1.0 / corners.len() as f64), middle(before)])
    }

    /// A box around a part of a patch, for some detail or any.
    fn patch_bounds(&self, face: u32, corner: u32, domain: Domain, detail: Option<&Detail>) -> Aabb {
        let points = self.bilinear(face, corner, |k| self.position(k));
        let reach = Extent::of(points.0).reach();
        let points = Extent::of(points.part(domain)).with_slack(reach);
        let normals = self.bilinear(face, corner, |k| self.normal(k));
        let normals = Extent::of(normals.part(domain)).with_slack(1.0);
        let uvs = || self.uv_box(face, corner, domain);
        self.displacement.extent((points, unit_normals(normals)), uvs, detail).outward()
    }

    fn position(&self, corner: usize) -> DVec3 {
        widened(self.polygons.positions[self.polygons.corners[corner] as usize])
    }

    fn normal(&self, corner: usize) -> DVec3 {
        widened(self.polygons.normals[self.polygons.corners[corner] as usize])
    }

    fn uv(&self, corner: usize) -> DVec2 {
        self.polygons.uvs.get(corner).map_or(DVec2::ZERO, |&uv| wide_uv(uv))
    }

    /// The texture coordinates at parameters, by the face that rules there.
    fn ruling_uv(&self, face: u32, corner: u32, own: &Bilinear<DVec2>, [u, v]: [f64; 2]) -> [f64; 2] {
        let ruled = match (u == 0.0, v == 0.0) {
            (true, true) => self.seams.corners.get(&corner).map(|&uv| wide_uv(uv)),
            (false, true) => self.seams.edges.get(&corner).map(|&[here, next]| along_edge(here, next, u)),
            (true, false) => {
                let edge = self.seams.edges.get(&self.before(face, corner));
                edge.map(|&[before, here]| along_edge(here, before, v))
            }
            (false, false) => None,
        };
        ruled.unwrap_or_else(|| own.at([u, v])).to_array()
    }

    /// The corner before another, around its face.
    fn before(&self, face: u32, corner: u32) -> u32 {
        let corners = self.polygons.corners_of(face);
        // In range: corners are counted in 32 bits.
        if corner as usize == corners.start { corners.end as u32 - 1 } else { corner - 1 }
    }

    /// A box around the texture coordinates of a part, its borders included.
    fn uv_box(&self, face: u32, corner: u32, domain: Domain) -> UvBox {
        let own = self.bilinear(face, corner, |k| self.uv(k));
        let mut corners = own.part(domain).to_vec();
        if domain.v[0] == 0.0 {
            corners.extend(self.seams.edges.get(&corner).into_iter().flatten().map(|&uv| wide_uv(uv)));
        }
        if domain.u[0] == 0.0 {
            let before = self.before(face, corner);
            corners.extend(self.seams.edges.get(&before).into_iter().flatten().map(|&uv| wide_uv(uv)));
        }
        if domain.u[0] == 0.0 && domain.v[0] == 0.0 {
            corners.extend(self.seams.corners.get(&corner).map(|&uv| wide_uv(uv)));
        }
        uv_box(corners)
    }
}

/// The patch of a corner, to be asked for points.
struct Patch<'a> {
    mesh: &'a DisplacedMesh,
    face: u32,
    corner: u32,
    positions: Bilinear<DVec3>,
    normals: Bilinear<DVec3>,
    uvs: Bilinear<DVec2>,
    detail: &'a Detail,
    cells: Cells,
}

impl LaneMap for Patch<'_> {
    #[inline(always)]
    fn points<S: Simd>(&mut self, simd: S, [u, v]: [Lanes<S>; 2]) -> PointLanes<S> {
        let Self { mesh, face, corner, detail, cells, .. } = self;
        let mut uvs = [[0.0; 2]; LANES];
        if mesh.displacement.needs_uvs() {
            for (lane, uv) in uvs.iter_mut().enumerate() {
                *uv = mesh.ruling_uv(*face, *corner, &self.uvs, [u.as_array()[lane], v.as_array()[lane]]);
            }
        }
        let found = (self.positions.lanes(simd, [u, v]), self.normals.lanes(simd, [u, v]));
        mesh.displacement.displaced_lanes(simd, found, &uvs, (detail, cells))
    }
}

impl Bilinear<DVec3> {
    /// The points at eight parameters: the steps of `at`.
    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, [u, v]: [Lanes<S>; 2]) -> PointLanes<S> {
        let [a, b, c, d] = &self.0;
        let (s, t) = (1.0 - u, 1.0 - v);
        let mut points = splat(simd, DVec3::ZERO);
        for (k, points) in points.iter_mut().enumerate() {
            *points = (s * a[k] + u * b[k]) * t + (s * d[k] + u * c[k]) * v;
        }
        points
    }
}

/// From a corner, t = 0, to the middle of an edge: what `Bilinear` gives along the border there.
fn along_edge(here: [f32; 2], there: [f32; 2], t: f64) -> DVec2 {
    let (here, there) = (wide_uv(here), wide_uv(there));
    lerp(here, (here + there) * 0.5, t)
}

fn wide_uv(uv: [f32; 2]) -> DVec2 {
    DVec2::from_array(uv.map(f64::from))
}

impl Seams {
    /// Where the texture coordinates of faces disagree, and what the face with the least index has there.
    fn new(polygons: &Polygons) -> Self {
        let mut seams = Self::default();
        if polygons.uvs.is_empty() {
            return seams;
        }
        let mut ruler: HashMap<u32, [f32; 2]> = HashMap::new();
        let mut edges: HashMap<[u32; 2], [[f32; 2]; 2]> = HashMap::new();
        // In range: faces have 32-bit ids, and so have corners.
        for face in 0..polygons.len() as u32 {
            let corners = polygons.corners_of(face);
            for corner in corners.clone() {
                let next = if corner + 1 == corners.end { corners.start } else { corner + 1 };
                let (from, to) = (polygons.corners[corner], polygons.corners[next]);
                let (uv, next_uv) = (polygons.uvs[corner], polygons.uvs[next]);
                let ruling = *ruler.entry(from).or_insert(uv);
                if ruling != uv {
                    seams.corners.insert(corner as u32, ruling);
                }
                let (key, own) =
                    if from < to { ([from, to], [uv, next_uv]) } else { ([to, from], [next_uv, uv]) };
                let ruling = *edges.entry(key).or_insert(own);
                if ruling != own {
                    let ruling = if from < to { ruling } else { [ruling[1], ruling[0]] };
                    seams.edges.insert(corner as u32, ruling);
                }
            }
        }
        seams
    }
}

impl OnDemand for DisplacedMesh {
    type Object = FaceObject;

    fn roots(&self) -> Vec<FaceObject> {
        self.tree.roots().into_iter().map(FaceObject::Faces).collect()
    }

    fn bounds(&self, object: &FaceObject, domain: Domain, detail: &Detail) -> Aabb {
        match *object {
            FaceObject::Faces(node) => self.tree.bounds(node),
            FaceObject::Corner { face, corner } => self.patch_bounds(face, corner, domain, Some(detail)),
        }
    }

    fn expand(
        &self,
        object: &FaceObject,
        _spacing: f64,
        _detail: &Detail,
        parts: &mut Vec<FaceObject>,
    ) -> bool {
        let FaceObject::Faces(node) = *object else {
            return false;
        };
        match self.tree.patch(node) {
            Some(face) => parts.extend(self.patches(face)),
            None => parts.extend(self.tree.parts(node).map(FaceObject::Faces)),
        }
        true
    }

    fn evaluate(
        &self,
        patch: &FaceObject,
        parameters: &[[f64; 2]],
        detail: &Detail,
        points: &mut Vec<[f32; 3]>,
    ) {
        let FaceObject::Corner { face, corner } = *patch else {
            return;
        };
        let mut patch = Patch {
            mesh: self,
            face,
            corner,
            positions: self.bilinear(face, corner, |k| self.position(k)),
            normals: self.bilinear(face, corner, |k| self.normal(k)),
            uvs: self.bilinear(face, corner, |k| self.uv(k)),
            detail,
            cells: NO_CELLS,
        };
        map_points(&mut patch, parameters, detail.level(), points);
    }

    fn id(&self, patch: &FaceObject) -> u32 {
        match *patch {
            FaceObject::Corner { face, .. } => face,
            FaceObject::Faces(_) => 0,
        }
    }
}
