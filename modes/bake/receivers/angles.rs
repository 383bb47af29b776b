//! Angles of triangles, and vectors of unit length: each one fixed sequence of operations, the same on every machine.

use glam::DVec3;
use umbel_core::{TriangleId, Triangles};

/// The angles of a triangle; `None` for one without area.
pub(crate) fn angles(triangles: &Triangles<'_>, id: TriangleId) -> Option<[f64; 3]> {
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
pub(crate) fn dot(u: DVec3, v: DVec3) -> f64 {
    u.x * v.x + u.y * v.y + u.z * v.z
}
