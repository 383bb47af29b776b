//! Shading normals: those of the file, interpolated over a triangle, or the triangle's own.
//!
//! n = Σ w_k n_k over its length, with the barycentric weights w_k. The normals n_k are taken at the length that the file
//! gives them.
//!
//! Based on: Bui Tuong Phong, "Illumination for Computer Generated Pictures", 1975.

use glam::DVec3;
use umbel_core::{Hit, Ray, TriangleId, Triangles};

use crate::scene::{NO_INDEX, Scene};

impl Scene {
    /// The shading normal at barycentric weights (of a, b, c): of unit length, interpolated where all three corners have
    /// normals, else (b − a)×(c − a). Where those of the file cancel, it is the latter too. Zero for a triangle without area
    /// and normals.
    ///
    /// `geometry` is that of this scene. Normals are not turned: where those of the file contradict the order of the corners,
    /// [`Triangles::side_toward`] this normal is the back.
    ///
    /// # Panics
    /// When there is no such triangle, or an index of a normal is out of range.
    #[must_use]
    pub fn shading_normal(&self, geometry: &Triangles<'_>, id: TriangleId, weights: [f64; 3]) -> DVec3 {
        self.interpolated_normal(id, || weights).unwrap_or_else(|| geometry.normal(id))
    }

    /// The shading normal and the triangle's own where a ray hits, both turned to where the ray comes from.
    pub(crate) fn normals_toward(&self, geometry: &Triangles<'_>, ray: &Ray, hit: &Hit) -> [DVec3; 2] {
        let viewer = -ray.direction.normalize_or_zero();
        let flat = geometry.normal(hit.id);
        let flat = if flat.dot(viewer) < 0.0 { -flat } else { flat };
        let normal = self
            .interpolated_normal(hit.id, || geometry.barycentrics(hit.id, ray))
            .map_or(flat, |n| if n.dot(flat) < 0.0 { -n } else { n });
        // Seen from behind its own surface, an interpolated normal says nothing.
        [if normal.dot(viewer) > 0.0 { normal } else { flat }, flat]
    }

    /// The file's normals at the corners, weighted; `None` where it has none or where they cancel. Weights are made on demand.
    pub(crate) fn interpolated_normal(
        &self,
        id: TriangleId,
        weights: impl FnOnce() -> [f64; 3],
    ) -> Option<DVec3> {
        let corners = self.normal_indices.get(id.0 as usize)?;
        if corners.contains(&NO_INDEX) {
            return None;
        }
        let weights = weights();
        let normals = corners.map(|index| DVec3::from_array(self.normals[index as usize].map(f64::from)));
        (normals[0] * weights[0] + normals[1] * weights[1] + normals[2] * weights[2]).try_normalize()
    }
}
