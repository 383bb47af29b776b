//! Where rays hit: points and distances from a hit, which keeps t alone.
//!
//! A point is the triangle's corners weighted by its barycentric coordinates, so that it lies on the triangle. A Euclidean
//! distance is t·|d|; where t is at an end of the range of f32, and so no rounded distance any more, it is that of the point.

use glam::DVec3;
use umbel_core::{Hit, Ray, Triangles};

/// The Euclidean distance from the start of a ray to what it sees, at most [`f32::MAX`]: +∞ is a miss.
pub(crate) fn distance(triangles: &Triangles<'_>, ray: &Ray, hit: &Hit) -> f32 {
    // At the ends of its range t is no longer a rounded distance.
    let length = if hit.t.is_normal() && hit.t < f32::MAX {
        f64::from(hit.t) * ray.direction.length()
    } else {
        (point(triangles, ray, hit) - ray.origin).length()
    };
    if length < f64::from(f32::MAX) { length as f32 } else { f32::MAX }
}

/// The point that a ray sees, in the frame of the file, rounded.
pub(crate) fn position(triangles: &Triangles<'_>, offset: DVec3, ray: &Ray, hit: &Hit) -> [f32; 3] {
    in_frame_of_file(point(triangles, ray, hit), offset).to_array().map(|x| x as f32)
}

/// A place plus what was taken from the positions of its file; near the origin the place itself, −0 as well.
pub(crate) fn in_frame_of_file(place: DVec3, offset: DVec3) -> DVec3 {
    if offset == DVec3::ZERO { place } else { place + offset }
}

/// The point that a ray sees: the corners weighted, so that it lies on the triangle.
fn point(triangles: &Triangles<'_>, ray: &Ray, hit: &Hit) -> DVec3 {
    let weights = triangles.barycentrics(hit.id, ray);
    let corners = triangles.corners(hit.id);
    DVec3::from_array([0, 1, 2].map(|k| {
        let weighted = |corner: usize| weights[corner] * f64::from(corners[corner][k]);
        weighted(0) + weighted(1) + weighted(2)
    }))
}

/// The Euclidean distance at t of a ray, finite.
pub(crate) fn surface_distance(ray: &Ray, t: f32) -> f32 {
    (ray.direction.length() * f64::from(t)).min(f64::from(f32::MAX)) as f32
}
