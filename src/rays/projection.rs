//! Where rays pierce a plane of coordinates.
//!
//! Rays from a point o pierce a face of a cube around o: with k the axis of the face and w = ±A_k, what lies at o + A, w > 0,
//! is seen at (A_i, A_j)/w. Parallel rays pierce the plane of the coordinates i and j, where k is the axis of the largest
//! component of D: what lies at p is seen at (p_i, p_j) − p_k·(D_i, D_j)/D_k.
//!
//! Based on: Ned Greene, "Environment Mapping and Other Applications of World Projections", 1986 (cube maps).

use glam::DVec3;

use crate::exact::filter::Approx;
use crate::geometry::aabb::U;
use crate::rays::origin::Origin;

/// A place in the plane is a quotient of differences, or a difference less a product with a quotient: at most four
/// roundings. As many again pay for adding the errors up.
const PLACE_SLACK: f64 = 8.0 * U;

/// The plane that rays pierce.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) origin: Origin,
    /// k.
    axis: usize,
    /// Whether w = −A_k.
    negative: bool,
}

impl Plane {
    /// The plane that the ray through a sample pierces.
    pub(crate) fn of(origin: Origin, sample: DVec3) -> Self {
        let direction = match origin {
            Origin::Point(_) => sample,
            Origin::Infinity(direction) => direction,
        };
        let axis = largest_axis(direction);
        Self { origin, axis, negative: direction[axis] < 0.0 }
    }

    /// The plane with a number, see [`Plane::face`].
    pub(crate) fn numbered(origin: Origin, face: usize) -> Self {
        Self { origin, axis: face / 2, negative: face % 2 == 1 }
    }

    /// The number of the plane among those of one origin.
    pub(crate) fn face(&self) -> u64 {
        2 * self.axis as u64 + u64::from(self.negative)
    }

    /// The axis k, pointing to where rays go, and the two that span the plane.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let ahead = DVec3::AXES[self.axis];
        let [right, up] = [1, 2].map(|k| DVec3::AXES[(self.axis + k) % 3]);
        [if self.negative { -ahead } else { ahead }, right, up]
    }

    /// w of a vector from the origin.
    pub(crate) fn ahead(&self, v: DVec3) -> f64 {
        if self.negative { -v[self.axis] } else { v[self.axis] }
    }

    /// Where a vector is seen: from the origin, or from zero for parallel rays. For a point as origin, w > 0.
    pub(crate) fn place(&self, v: DVec3) -> [Approx; 2] {
        let k = self.axis;
        [(k + 1) % 3, (k + 2) % 3].map(|i| match self.origin {
            Origin::Point(_) => {
                let value = v[i] / self.ahead(v);
                Approx { value, error: value.abs() * PLACE_SLACK }
            }
            Origin::Infinity(d) => {
                // |D_i/D_k| ≤ 1.
                let value = v[i] - v[k] * (d[i] / d[k]);
                Approx { value, error: (v[i].abs() + v[k].abs()) * PLACE_SLACK }
            }
        })
    }
}

/// The axis of the largest component.
fn largest_axis(v: DVec3) -> usize {
    let [x, y, z] = v.abs().to_array();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}
