//! Segments: is one point seen from another? Exact, without distances, biases or epsilons.
//!
//! The segment l → p is blocked iff some triangle, other than the one that p lies on, has l and p strictly on opposite
//! sides of its plane, and the line covers it. All of that are orientations of given points: e = (p − l)·((a − l)×(b −
//! l)) = orient3d(a, b, p, l). A zero e takes the sign of the first non-zero component of (a − l)×(b − l), as for rays
//! from l.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997; Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990.

use glam::DVec3;

use crate::error::Error;
use crate::exact::filter::Sign;
use crate::exact::predicates::{orientation, tie_sign};
use crate::geometry::aabb::U;
use crate::geometry::ray::Ray;
use crate::geometry::ray::{Ties, check_origin};
use crate::geometry::triangles::Triangle;
use crate::geometry::triangles::TriangleId;

/// The open segment from a light (or an eye) to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Where light comes from: in the range of [`Ray::origin`].
    pub from: DVec3,
    /// The point that may be in shadow: in the same range.
    pub to: DVec3,
    /// The triangle that `to` lies on, which does not block.
    pub receiver: Option<TriangleId>,
}

impl Segment {
    /// Refuses end points for which the exact stage could underflow or overflow.
    pub(crate) fn check(&self) -> Result<(), Error> {
        check_origin(self.from)?;
        check_origin(self.to)
    }

    /// The segment as a ray 0 < t < 1, for culling only: its direction is rounded. The end is rounded up.
    pub(crate) fn as_ray(&self) -> Ray {
        Ray { t_max: 1.0 + 4.0 * U, ..Ray::new(self.from, self.to - self.from) }
    }

    /// Whether a triangle blocks the segment, exactly.
    pub(crate) fn is_blocked_by(&self, id: u32, triangle: &Triangle) -> bool {
        if self.receiver == Some(TriangleId(id)) {
            return false;
        }
        let Triangle { a, b, c } = *triangle;
        let (l, p) = (self.from, self.to);
        let side = orientation(a, b, c, l);
        if side == Sign::Zero || orientation(a, b, c, p) != side.negated() {
            return false;
        }
        triangle.edges().iter().all(|&(a, b)| {
            let sign = match orientation(a, b, p, l) {
                Sign::Zero => tie_sign(&Ray::new(l, DVec3::ZERO), a, b, Ties::Direction),
                sign => sign,
            };
            sign == side
        })
    }
}
