//! The vertices of a scene as receivers.
//!
//! A vertex is baked on its triangles, as [`crate::bake::receivers::fans`] has it. One of them is its *owner*: of the plane that has the
//! largest angle there, the triangle with the largest angle; of equal ones the first in the file, never one without area. Rays start at
//! the owner's corner, as [`Triangles::leave`] has it, those that point below its plane at the corner of another one.
//!
//! The shading normal is the file's at that corner. Without one it is the mean of the normals of all faces of the vertex, each
//! weighted with its angle. A file that wants a hard edge has two vertices there.
//! Rays leave to the side of the owner that the normal points to.
//!
//! Based on: Grit Thürmer and Charles Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Above, Hemisphere, NO_TRIANGLE, Receiver, Side, TriangleId, Triangles};

use crate::bake::receivers::BakeReceivers;
use crate::bake::receivers::angles::unit;
use crate::bake::receivers::fans::{Around, Fans};
use crate::error::Error;
use crate::scene::Scene;

/// The vertices of a scene, ready to become receivers.
#[derive(Debug, Clone)]
pub struct VertexReceivers<'a> {
    scene: &'a Scene,
    triangles: Triangles<'a>,
    /// The triangles that use each vertex, ascending: those of vertex k end at `ends[k]`.
    ends: Vec<u32>,
    faces: Vec<u32>,
}

impl Scene {
    /// Finds the triangles around each vertex. O(n), 16 bytes for each triangle and vertex.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn vertex_receivers(&self) -> Result<VertexReceivers<'_>, Error> {
        let triangles = self.geometry()?;
        let mut ends = vec![0_u32; self.positions.len()];
        // In range: ids are 32 bits wide, so corners are too, up to a third of all ids.
        self.triangles.iter().flatten().for_each(|&vertex| ends[vertex as usize] += 1);
        let mut before = 0;
        for end in &mut ends {
            (before, *end) = (before + *end, before);
        }
        // Each end is the place of its next face until all of them have one.
        let mut faces = vec![0; before as usize];
        for (id, corners) in (0_u32..).zip(&self.triangles) {
            for &vertex in corners {
                let end = &mut ends[vertex as usize];
                faces[*end as usize] = id;
                *end += 1;
            }
        }
        Ok(VertexReceivers { scene: self, triangles, ends, faces })
    }
}

impl VertexReceivers<'_> {
    /// The receivers among the vertices of a range: their numbers are those of the vertices. Vertices that no triangle with an area
    /// uses are none.
    #[must_use]
    pub fn range(&self, vertices: Range<usize>) -> BakeReceivers {
        let around = |vertex: usize| (vertex, self.around(vertex));
        let found: Vec<(usize, Around)> = vertices.into_par_iter().map(around).collect();
        let used = || found.iter().filter(|(_, around)| around.owner != NO_TRIANGLE);
        let mut receivers = BakeReceivers::default();
        for (vertex, around) in used() {
            // Indices of triangles are u32, and these vertices have one.
            let index = *vertex as u32;
            let normal = file_normal(self.scene, around.owner, index).unwrap_or(around.normal);
            let normal = normal.to_array().map(|x| x as f32);
            receivers.push(self.hemisphere(index, around.owner, normal), normal, index);
        }
        receivers.fans =
            Fans::of(found.into_iter().filter(|(_, a)| a.owner != NO_TRIANGLE).map(|(_, a)| a.fan));
        receivers
    }

    fn around(&self, vertex: usize) -> Around {
        let first = vertex.checked_sub(1).map_or(0, |before| self.ends[before] as usize);
        // Indices of vertices are 32 bits wide.
        Around::vertex(
            self.scene,
            &self.triangles,
            vertex as u32,
            &self.faces[first..self.ends[vertex] as usize],
        )
    }

    /// Where rays leave a vertex that has an owner.
    fn hemisphere(&self, vertex: u32, owner: u32, normal: [f32; 3]) -> Hemisphere {
        let triangle = TriangleId(owner);
        let weights =
            self.scene.triangles[owner as usize].map(|corner| if corner == vertex { 1.0 } else { 0.0 });
        let normal = DVec3::from_array(normal.map(f64::from));
        let side = self.triangles.side_toward(triangle, normal).unwrap_or(Side::Front);
        let point = self.triangles.leave(triangle, weights, side);
        Hemisphere { receiver: Receiver { point, triangle }, above: Above::Side(side) }
    }
}

/// The file's normal at a corner, of unit length, where it has one.
fn file_normal(scene: &Scene, triangle: u32, vertex: u32) -> Option<DVec3> {
    let corner = scene.triangles.get(triangle as usize)?.iter().position(|&corner| corner == vertex)?;
    let index = scene.normal_indices.get(triangle as usize)?[corner];
    unit(DVec3::from_array(scene.normals.get(index as usize)?.map(f64::from)))
}
