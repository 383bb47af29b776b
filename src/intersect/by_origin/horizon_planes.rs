//! Horizons: what cannot rise above the surfaces that some receivers lie on, and so occludes none of their rays.
//!
//! Rays from p go strictly above the plane through p with the normal N of the surface. The receiver's triangle lies in that plane or below it,
//! where the point was made as [`crate::objects::offset`] makes it, so a triangle with no corner strictly above the plane of the receiver's is never hit.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997 (static
//! filters).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::exact::filter::{Cross, Sign};
use crate::exact::predicates::orientation;
use crate::geometry::aabb::widen as widen_point;
use crate::geometry::triangles::Triangle;
use crate::intersect::by_origin::{CROSS_ERROR, PacketQuery};
use crate::objects::offset::Side;
use crate::rays::hemisphere::{Above, Hemisphere};
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::{LANES, Points, bits};

/// The planes above which rays of a packet go.
pub(crate) struct Planes {
    count: usize,
    planes: [Plane; LANES],
}

#[derive(Clone, Copy, PartialEq)]
struct Plane {
    /// The normal upward, and what bounds the error of its components.
    normal: DVec3,
    permanent: DVec3,
    /// A point of it.
    at: DVec3,
    /// The triangle in it, as seen from above.
    triangle: Option<Triangle>,
}

impl Planes {
    /// Of some receivers: one for each triangle that they lie on.
    pub(crate) fn of(query: PacketQuery<'_>, ids: &[u32]) -> Self {
        let none = Plane { normal: DVec3::ZERO, permanent: DVec3::ZERO, at: DVec3::ZERO, triangle: None };
        let mut planes = Self { count: 0, planes: [none; LANES] };
        for &id in ids.iter().filter(|id| **id != NO_TRIANGLE) {
            let Hemisphere { receiver, above } = query.occlusion.hemispheres[id as usize];
            let point = widen_point(receiver.point);
            let plane = match above {
                Above::Normal(normal) => {
                    let normal = widen_point(normal);
                    Plane { normal, permanent: normal.abs(), at: point, triangle: None }
                }
                Above::Side(side) => {
                    let Triangle { a, b, c } = query.triangles.triangle(receiver.triangle.0);
                    let (b, c) = if side == Side::Front { (b, c) } else { (c, b) };
                    let cross = Cross::of(b - a, c - a);
                    // A point that was not made by leaving the triangle may lie below it. orient3d is positive there.
                    let is_below = orientation(a, b, c, point) == Sign::Positive;
                    let (at, triangle) =
                        if is_below { (point, None) } else { (a, Some(Triangle { a, b, c })) };
                    Plane { normal: cross.value, permanent: cross.permanent, at, triangle }
                }
            };
            if planes.count > 0 && planes.planes[planes.count - 1] == plane {
                continue;
            }
            planes.planes[planes.count] = plane;
            planes.count += 1;
        }
        planes
    }

    /// Those of eight triangles that have a corner strictly above some plane; those in doubt are decided, or kept.
    #[inline(always)]
    pub(crate) fn rising<S: Simd>(&self, simd: S, corners: &[Points<S>; 3], lanes: u64) -> u64 {
        let mut rising = 0;
        for plane in &self.planes[..self.count] {
            let at = Points::splat(simd, plane.at);
            let mut doubtful = 0;
            for corner in corners {
                let relative = corner.minus(at);
                let height = relative.dot(plane.normal);
                let error = relative.magnitudes().dot(plane.permanent) * CROSS_ERROR;
                let above = height.simd_gt(error).to_bitmask();
                rising |= above;
                doubtful |= !(above | height.simd_lt(-error).to_bitmask());
            }
            for lane in bits(doubtful & lanes & !rising) {
                let [a, b, c] = corners;
                let corner = |p: &Points<S>| {
                    DVec3::new(p.x.to_array()[lane], p.y.to_array()[lane], p.z.to_array()[lane])
                };
                let rises = [corner(a), corner(b), corner(c)].into_iter().any(|p| plane.is_below(p));
                rising |= u64::from(rises) << lane;
            }
        }
        rising & lanes
    }
}

impl Plane {
    /// Whether a point may lie strictly above: exactly, where there is a triangle.
    #[cold]
    fn is_below(&self, point: DVec3) -> bool {
        let Some(Triangle { a, b, c }) = self.triangle else { return true };
        let same = |k: usize| a[k] == b[k] && b[k] == c[k] && c[k] == point[k];
        if point == a || point == b || point == c || same(0) || same(1) || same(2) {
            return false;
        }
        // orient3d is positive for points on the back.
        orientation(a, b, c, point) == Sign::Negative
    }
}
