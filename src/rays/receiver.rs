//! Shadows: which points a light does not see. Exact, without distances, biases or epsilons.
//!
//! A receiver is a point p on a triangle, as [`Triangles::leave`] makes it. For a light at l it is in shadow iff a
//! triangle blocks the segment l → p, see [`Segment`]; for a light in the direction −D, from where its rays travel
//! along D, iff a triangle covers the ray (p, −D), t > 0, with the ties of parallel rays. The receiver's own triangle
//! never does.
//!
//! [`Triangles::leave`]: crate::geometry::triangles::Triangles::leave
//!
//! Based on: Lance Williams, "Casting Curved Shadows on Curved Surfaces", 1978 (visibility from the light); Gregory
//! Johnson et al., "The Irregular Z-Buffer", 2005 (at the points that are asked for).

use glam::DVec3;

use crate::error::Error;
use crate::exact::predicates::covers;
use crate::geometry::aabb::widen;
use crate::geometry::ray::{Ray, Ties, check_direction, check_origin};
use crate::geometry::triangles::{Triangle, TriangleId};
use crate::rays::origin::Origin;
use crate::rays::segment::Segment;

/// A point that may lie in shadow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Where it lies: finite.
    pub point: [f32; 3],
    /// The triangle that it lies on, which does not block; or [`NO_TRIANGLE`](crate::rays::hits::NO_TRIANGLE).
    pub triangle: TriangleId,
}

impl Receiver {
    /// The segment from a light.
    fn segment(&self, light: DVec3) -> Segment {
        Segment { from: light, to: widen(self.point), receiver: Some(self.triangle) }
    }
}

/// Refuses lights and receivers for which the exact stage could underflow or overflow.
pub(crate) fn check(light: Origin, receivers: &[Receiver]) -> Result<(), Error> {
    match light {
        Origin::Point(point) => check_origin(point)?,
        Origin::Infinity(direction) => check_direction(direction)?,
    }
    // Every finite f32 is an origin.
    let is_infinite = |receiver: &&Receiver| !receiver.point.iter().all(|x| x.is_finite());
    receivers.iter().find(is_infinite).map_or(Ok(()), |receiver| check_origin(widen(receiver.point)))
}

/// What stands for a receiver in a light's pencil: a direction, or a start point.
pub(crate) fn sample(light: Origin, receiver: &Receiver) -> DVec3 {
    match light {
        Origin::Point(light) => widen(receiver.point) - light,
        Origin::Infinity(_) => widen(receiver.point),
    }
}

/// A ray on which every triangle between a light and a receiver lies: for culling only.
pub(crate) fn culling_ray(light: Origin, receiver: &Receiver) -> Ray {
    match light {
        Origin::Point(point) => receiver.segment(point).as_ray(),
        Origin::Infinity(direction) => Ray::new(widen(receiver.point), -direction),
    }
}

/// Whether a triangle keeps the light from the receiver, exactly.
pub(crate) fn blocks(
    light: Origin,
    receiver: &Receiver,
    (id, triangle): (u32, &Triangle),
    ambiguous: &mut u64,
) -> bool {
    match light {
        Origin::Point(point) => receiver.segment(point).is_blocked_by(id, triangle),
        Origin::Infinity(direction) => {
            let ray = Ray::new(widen(receiver.point), -direction);
            receiver.triangle.0 != id && covers(&ray, triangle, Ties::Origin, ambiguous)
        }
    }
}
