//! From polygons to a cage of quads: who borders on whom, creases, and one step of subdivision where a face is no quad.
//!
//! Two faces are neighbours where one has the edge (a, b) and the other (b, a), and no third has either. Edges of three faces, or of
//! two that run the same way, become borders. A vertex at which faces meet that are no neighbours, directly or by others in between,
//! becomes one vertex for each such fan, all of them corners: so the fans still meet.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::surfaces::extent::widened;
use crate::surfaces::polygons::Polygons;
use crate::surfaces::subdivision::cage::{BORDER, Cage};

/// A cage of quads with what is given at its vertices and corners.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct QuadCage {
    pub(crate) cage: Cage,
    pub(crate) points: Vec<DVec3>,
    /// The face of the scene that each quad is, or is a part of.
    pub(crate) parents: Vec<u32>,
    /// Texture coordinates of the corners, v running down; empty where the scene has none.
    pub(crate) uvs: Vec<[f32; 2]>,
    /// Where a vertex stands for another that was at the same place: the least such, for all vertices.
    pub(crate) twins: Vec<u32>,
}

/// Sharpness of edges, by their vertices in ascending order, and of vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sharpness {
    pub(crate) edges: HashMap<[u32; 2], f32>,
    pub(crate) vertices: HashMap<u32, f32>,
}

impl QuadCage {
    /// The cage that polygons make up.
    pub(crate) fn new(polygons: &Polygons, sharpness: &Sharpness) -> Self {
        let mut cage = Cage::empty(polygons.positions.len());
        // In range: faces have 32-bit ids.
        for face in 0..polygons.len() as u32 {
            cage.push_face(polygons.corners[polygons.corners_of(face)].iter().copied());
        }
        connect(&mut cage, sharpness);
        let mut quads = Self {
            points: polygons.positions.iter().map(|&p| widened(p)).collect(),
            parents: (0..polygons.len() as u32).collect(),
            uvs: polygons.uvs.clone(),
            twins: (0..polygons.positions.len() as u32).collect(),
            cage,
        };
        quads.split_fans();
        quads.sharpen(sharpness);
        let is_quad = |face: u32| quads.cage.corners_of(face).len() == 4;
        if (0..polygons.len() as u32).all(is_quad) { quads } else { quads.refined() }
    }

    /// Gives each fan of faces around a vertex a vertex of its own.
    fn split_fans(&mut self) {
        let mut taken = vec![false; self.cage.vertices.len()];
        let mut seen = vec![false; self.points.len()];
        for corner in 0..taken.len() as u32 {
            if taken[corner as usize] {
                continue;
            }
            let vertex = self.cage.vertex(corner);
            let fan = self.cage.fan(corner, Cage::across);
            fan.iter().for_each(|&corner| taken[corner as usize] = true);
            if !std::mem::replace(&mut seen[vertex as usize], true) {
                continue;
            }
            // In range: there are no more vertices than corners.
            let other = self.points.len() as u32;
            self.points.push(self.points[vertex as usize]);
            self.twins.push(vertex);
            self.cage.corners[vertex as usize] = f32::INFINITY;
            self.cage.corners.push(f32::INFINITY);
            fan.iter().for_each(|&corner| self.cage.vertices[corner as usize] = other);
        }
    }

    /// Makes vertices sharp: those that were asked for, and borders' corners with a single face.
    fn sharpen(&mut self, sharpness: &Sharpness) {
        for (vertex, own) in (0_u32..).zip(&mut self.cage.corners) {
            let asked = sharpness.vertices.get(&self.twins[vertex as usize]);
            *own = own.max(asked.copied().unwrap_or(0.0));
        }
        for corner in 0..self.cage.vertices.len() as u32 {
            let before = self.cage.before(corner);
            if self.cage.across(corner).is_none() && self.cage.across(before).is_none() {
                let vertex = self.cage.vertex(corner);
                self.cage.corners[vertex as usize] = f32::INFINITY;
            }
        }
    }

    /// The cage after one step, with texture coordinates interpolated linearly.
    fn refined(&self) -> Self {
        let (cage, rows) = self.cage.refined();
        let old = &self.cage;
        let parents = old.faces.iter().map(|&face| self.parents[face as usize]).collect();
        let uv = |corner: u32| DVec2::from_array(self.uvs[corner as usize].map(f64::from));
        let narrow = |uv: DVec2| uv.to_array().map(|x| x as f32);
        let of_corner = |corner: u32| {
            let around = old.corners_of(old.faces[corner as usize]);
            let count = around.len() as f64;
            let middle = around.fold(DVec2::ZERO, |sum, k| sum + uv(k)) / count;
            let [next, before] = [old.next(corner), old.before(corner)].map(|k| (uv(corner) + uv(k)) * 0.5);
            [uv(corner), next, middle, before].map(narrow)
        };
        let uvs = if self.uvs.is_empty() {
            Vec::new()
        } else {
            (0..old.vertices.len() as u32).flat_map(of_corner).collect()
        };
        // In range, as above.
        let mut twins: Vec<u32> = (0..rows.len() as u32).collect();
        twins[..self.twins.len()].copy_from_slice(&self.twins);
        // Borders that lie on each other have their middles at one place.
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for corner in (0..old.vertices.len() as u32).filter(|&corner| old.across(corner).is_none()) {
            let [from, to] = [corner, old.next(corner)].map(|corner| self.twins[old.vertex(corner) as usize]);
            let middle = cage.vertices[4 * corner as usize + 1];
            twins[middle as usize] = *middles.entry([from.min(to), from.max(to)]).or_insert(middle);
        }
        Self { points: rows.apply(&self.points), cage, parents, uvs, twins }
    }
}

/// Finds the half-edges that run back, and takes over the sharpness of edges.
fn connect(cage: &mut Cage, sharpness: &Sharpness) {
    // The half-edge from the first to the second vertex, or BORDER once there were two.
    let mut found: HashMap<[u32; 2], u32> = HashMap::new();
    let corners = 0..cage.vertices.len() as u32;
    let ends = |cage: &Cage, corner: u32| [cage.vertex(corner), cage.vertex(cage.next(corner))];
    for corner in corners.clone() {
        found.entry(ends(cage, corner)).and_modify(|other| *other = BORDER).or_insert(corner);
    }
    for corner in corners {
        let [from, to] = ends(cage, corner);
        let own = found.get(&[from, to]).copied().unwrap_or(BORDER);
        let back = found.get(&[to, from]).copied().unwrap_or(BORDER);
        if own == BORDER || back == BORDER || from == to {
            continue;
        }
        cage.opposite[corner as usize] = back;
        let asked = sharpness.edges.get(&[from.min(to), from.max(to)]).copied();
        cage.sharpness[corner as usize] = asked.unwrap_or(0.0);
    }
}
