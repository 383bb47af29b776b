//! The vertices of a scene as receivers.
//!
//! A vertex is baked on one of its triangles, its *owner*: the one with the largest angle there, of equal ones that with
//! the smallest id, never one without area. Rays start at the owner's corner, as [`Triangles::leave`] has it.
//!
//! The shading normal is the file's at that corner. Without one it is the mean of the normals of the vertex's faces, each
//! weighted with its angle; of those only that lie within 30° of the owner's, the usual limit of smooth shading: rays leave
//! into the half space above the owner, so that a normal that leans over an edge of a cube would find half of it dark.
//! Rays leave to the side of the owner that the normal points to.
//!
//! Based on: Grit Thürmer and Charles Wüthrich, "Computing Vertex Normals from Polygonal Facets", 1998.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Above, Hemisphere, NO_TRIANGLE, Receiver, Side, TriangleId, Triangles};

use crate::bake::receivers::BakeReceivers;
use crate::error::Error;
use crate::scene::Scene;

/// The cosine of the greatest angle between faces that are shaded smoothly, 30°.
const COS_SMOOTH: f64 = 0.866_025_403_784_438_6;
/// Triangles whose angles are computed together.
const BLOCK: usize = 1 << 16;

/// The vertices of a scene, ready to become receivers.
#[derive(Debug, Clone)]
pub struct VertexReceivers<'a> {
    scene: &'a Scene,
    triangles: Triangles<'a>,
    /// The owner of each vertex, or [`NO_TRIANGLE`].
    owners: Vec<u32>,
    /// The shading normal of each.
    normals: Vec<[f32; 3]>,
}

impl Scene {
    /// Finds an owner and a normal for each vertex. O(n).
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn vertex_receivers(&self) -> Result<VertexReceivers<'_>, Error> {
        let triangles = self.geometry()?;
        let owners = owners(self, &triangles);
        let flat = |&owner: &u32| {
            if owner == NO_TRIANGLE { DVec3::ZERO } else { triangles.normal(TriangleId(owner)) }
        };
        let flat: Vec<DVec3> = owners.par_iter().map(flat).collect();
        let smooth = smooth_normals(self, &triangles, &flat);
        let normal = |(vertex, (&owner, smooth)): (usize, (&u32, DVec3))| {
            let normal = file_normal(self, owner, vertex as u32).unwrap_or(smooth);
            normal.to_array().map(|x| x as f32)
        };
        let normals = owners.par_iter().zip(smooth).enumerate().map(normal).collect();
        Ok(VertexReceivers { scene: self, triangles, owners, normals })
    }
}

impl VertexReceivers<'_> {
    /// The receivers among the vertices of a range: their numbers are those of the vertices. Vertices that no triangle with an area
    /// uses are none.
    #[must_use]
    pub fn range(&self, vertices: Range<usize>) -> BakeReceivers {
        let used: Vec<usize> = vertices.filter(|&vertex| self.owners[vertex] != NO_TRIANGLE).collect();
        BakeReceivers {
            hemispheres: used.par_iter().map(|&vertex| self.hemisphere(vertex)).collect(),
            normals: used.iter().map(|&vertex| self.normals[vertex]).collect(),
            // Indices of triangles are u32, and these vertices have one.
            indices: used.iter().map(|&vertex| vertex as u32).collect(),
        }
    }

    /// Where rays leave a vertex that has an owner.
    fn hemisphere(&self, vertex: usize) -> Hemisphere {
        let triangle = TriangleId(self.owners[vertex]);
        let corners = self.scene.triangles[triangle.0 as usize];
        let weights = corners.map(|corner| if corner as usize == vertex { 1.0 } else { 0.0 });
        let normal = DVec3::from_array(self.normals[vertex].map(f64::from));
        let side = self.triangles.side_toward(triangle, normal).unwrap_or(Side::Front);
        let point = self.triangles.leave(triangle, weights, side);
        Hemisphere { receiver: Receiver { point, triangle }, above: Above::Side(side) }
    }
}

/// The angles of a triangle; `None` for one without area.
fn angles(triangles: &Triangles<'_>, id: TriangleId) -> Option<[f64; 3]> {
    if triangles.is_degenerate(id) {
        return None;
    }
    let corners = triangles.corners(id).map(|p| DVec3::from_array(p.map(f64::from)));
    Some([0, 1, 2].map(|k| {
        let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        let cross = u.cross(v);
        libm::atan2(dot(cross, cross).sqrt(), dot(u, v))
    }))
}

/// Hands each corner of a triangle with an area to `take`, in the order of ids: the triangle, the vertex and the angle.
fn for_each_corner(scene: &Scene, triangles: &Triangles<'_>, mut take: impl FnMut(TriangleId, usize, f64)) {
    for first in (0..scene.triangles.len()).step_by(BLOCK) {
        let block = first..scene.triangles.len().min(first + BLOCK);
        // Ids are u32: the scene has been checked.
        let ids = block.into_par_iter().map(|id| TriangleId(id as u32));
        let found: Vec<_> = ids.map(|id| (id, angles(triangles, id))).collect();
        for (id, angles) in found {
            let corners = scene.triangles[id.0 as usize].into_iter().zip(angles.into_iter().flatten());
            corners.for_each(|(vertex, angle)| take(id, vertex as usize, angle));
        }
    }
}

/// The triangle with the largest angle at each vertex.
fn owners(scene: &Scene, triangles: &Triangles<'_>) -> Vec<u32> {
    let mut owners = vec![NO_TRIANGLE; scene.positions.len()];
    let mut largest = vec![0.0; owners.len()];
    for_each_corner(scene, triangles, |id, vertex, angle| {
        if owners[vertex] == NO_TRIANGLE || angle > largest[vertex] {
            (owners[vertex], largest[vertex]) = (id.0, angle);
        }
    });
    owners
}

/// The mean normal of the faces around each vertex that lie near `flat`, the normal of its owner.
fn smooth_normals(scene: &Scene, triangles: &Triangles<'_>, flat: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; flat.len()];
    for_each_corner(scene, triangles, |id, vertex, angle| {
        let normal = triangles.normal(id);
        if dot(normal, flat[vertex]) >= COS_SMOOTH {
            sums[vertex] += normal * angle;
        }
    });
    // The sum holds the owner's own.
    sums.into_iter().map(|sum| unit(sum).unwrap_or(DVec3::ZERO)).collect()
}

/// The file's normal at a corner, of unit length, where it has one.
fn file_normal(scene: &Scene, triangle: u32, vertex: u32) -> Option<DVec3> {
    let corner = scene.triangles.get(triangle as usize)?.iter().position(|&corner| corner == vertex)?;
    let index = scene.normal_indices.get(triangle as usize)?[corner];
    unit(DVec3::from_array(scene.normals.get(index as usize)?.map(f64::from)))
}

/// v over its length; `None` for zero and for what is not finite.
pub(crate) fn unit(v: DVec3) -> Option<DVec3> {
    let size = v.abs().max_element();
    if !(v.is_finite() && size > 0.0) {
        return None;
    }
    let v = v / size;
    Some(v / dot(v, v).sqrt())
}

/// One fixed sequence.
fn dot(u: DVec3, v: DVec3) -> f64 {
    u.x * v.x + u.y * v.y + u.z * v.z
}
