//! The faces of a scene as a surface: polygons over welded vertices, with one normal per vertex.
//!
//! Vertices at one position, bit by bit, are one, whatever the file makes of them: where it splits vertices for the sake of texture
//! coordinates or normals the surface is not split. The normal of a vertex is the sum over its corners of the area of a triangle
//! times the file's unit normal there, or that of the triangle where the file has none. All faces around a vertex share it, so that
//! displacement opens no cracks.
//!
//! A face that the reader has cut into n − 2 triangles is put together again: its border are the edges that one triangle alone has.
//! A face that names a vertex twice cannot be told from its triangles, and stays cut.
//!
//! Based on: Henri Gouraud, "Continuous Shading of Curved Surfaces", 1971 (normals of vertices).

use std::collections::HashMap;

use glam::DVec3;
use umbel_core::TriangleId;

use crate::scene::{NO_INDEX, Scene};
use crate::surfaces::extent::widened;

/// Polygons.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Polygons {
    pub(crate) positions: Vec<[f32; 3]>,
    /// Of unit length, or 0 where all around cancels.
    pub(crate) normals: Vec<[f32; 3]>,
    /// The first corner of each face, and behind the last the number of corners.
    pub(crate) firsts: Vec<u32>,
    /// The vertex of each corner.
    pub(crate) corners: Vec<u32>,
    /// The texture coordinates of each corner, v running down; empty where the scene has none.
    pub(crate) uvs: Vec<[f32; 2]>,
    /// The first triangle of each face.
    pub(crate) triangles: Vec<u32>,
}

impl Polygons {
    /// The faces of a scene.
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut polygons = Self { firsts: vec![0], ..Self::default() };
        let welded = polygons.weld(scene);
        let mut triangle = 0;
        let mut take = |polygons: &mut Self, corners: u32| {
            polygons.take_face(scene, &welded, triangle..triangle + corners - 2);
            triangle += corners - 2;
        };
        if scene.face_corners.is_empty() {
            (0..scene.triangles.len()).for_each(|_| take(&mut polygons, 3));
        } else {
            scene.face_corners.iter().for_each(|&corners| take(&mut polygons, corners));
        }
        polygons.normals = normals(scene, &welded, polygons.positions.len());
        polygons
    }

    /// How many faces there are.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The corners of a face.
    pub(crate) fn corners_of(&self, face: u32) -> std::ops::Range<usize> {
        self.firsts[face as usize] as usize..self.firsts[face as usize + 1] as usize
    }

    /// Takes one vertex per position that triangles use. Returns the vertex of each position.
    fn weld(&mut self, scene: &Scene) -> Vec<u32> {
        let mut welded = vec![NO_INDEX; scene.positions.len()];
        let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
        for &index in scene.triangles.iter().flatten() {
            if welded[index as usize] != NO_INDEX {
                continue;
            }
            // −0 is 0.
            let position = scene.positions[index as usize].map(|x| x + 0.0);
            // In range: there are no more vertices than indices.
            let next = self.positions.len() as u32;
            welded[index as usize] = *vertices.entry(position.map(f32::to_bits)).or_insert_with(|| {
                self.positions.push(position);
                next
            });
        }
        welded
    }

    /// Adds the face that some triangles make up, or those triangles.
    fn take_face(&mut self, scene: &Scene, welded: &[u32], triangles: std::ops::Range<u32>) {
        if let Some(border) = border(scene, triangles.clone()) {
            self.push(scene, welded, triangles.start, &border);
            return;
        }
        for triangle in triangles {
            self.push(scene, welded, triangle, &[0, 1, 2].map(|corner| (triangle, corner)));
        }
    }

    /// Adds one face, whose corners are corners of triangles.
    fn push(&mut self, scene: &Scene, welded: &[u32], triangle: u32, corners: &[(u32, usize)]) {
        let vertices = corners.iter().map(|&(t, k)| welded[scene.triangles[t as usize][k] as usize]);
        self.corners.extend(vertices);
        if !scene.uv_indices.is_empty() {
            let uv = |&(t, k): &(u32, usize)| {
                let [u, v] = scene.uv_corners(TriangleId(t)).map_or([0.0; 2], |uvs| uvs[k]);
                [u, if scene.uv_v_down { v } else { 1.0 - v }]
            };
            self.uvs.extend(corners.iter().map(uv));
        }
        // In range: there are at most three corners per triangle, and fewer than 2³² indices of corners.
        self.firsts.push(self.corners.len() as u32);
        self.triangles.push(triangle);
    }
}

/// The corners around a face as corners of its triangles; `None` where they are no single round.
fn border(scene: &Scene, triangles: std::ops::Range<u32>) -> Option<Vec<(u32, usize)>> {
    if triangles.len() == 1 {
        return Some([0, 1, 2].map(|corner| (triangles.start, corner)).to_vec());
    }
    let edges = || {
        triangles.clone().flat_map(|t| {
            let corners = scene.triangles[t as usize];
            [0, 1, 2].map(|k| ((t, k), corners[k], corners[(k + 1) % 3]))
        })
    };
    let all: std::collections::HashSet<(u32, u32)> = edges().map(|(_, from, to)| (from, to)).collect();
    let outer: HashMap<u32, ((u32, usize), u32)> = edges()
        .filter(|&(_, from, to)| !all.contains(&(to, from)))
        .map(|(corner, from, to)| (from, (corner, to)))
        .collect();
    let start =
        scene.triangles[triangles.start as usize].into_iter().find(|vertex| outer.contains_key(vertex))?;
    let (mut round, mut vertex) = (Vec::new(), start);
    while round.len() < triangles.len() + 2 {
        let &(corner, next) = outer.get(&vertex)?;
        round.push(corner);
        vertex = next;
        if vertex == start {
            break;
        }
    }
    (vertex == start && round.len() == triangles.len() + 2).then_some(round)
}

/// The normals of the vertices.
fn normals(scene: &Scene, welded: &[u32], count: usize) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; count];
    for (triangle, corners) in scene.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|index| widened(scene.positions[index as usize]));
        let normal = (b - a).cross(c - a);
        let own = scene.normal_indices.get(triangle).copied().unwrap_or([NO_INDEX; 3]);
        for (corner, index) in corners.iter().zip(own) {
            let unit = scene.normals.get(index as usize).and_then(|&n| widened(n).try_normalize());
            sums[welded[*corner as usize] as usize] += unit.map_or(normal, |unit| unit * normal.length());
        }
    }
    sums.into_iter().map(|sum| sum.normalize_or_zero().to_array().map(|x| x as f32)).collect()
}
