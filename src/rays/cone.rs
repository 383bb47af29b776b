//! Cones: one test of a box for a whole sub-pencil of directions that lie anywhere.
//!
//! A cone has an apex o, a unit axis and a half angle α. A ball with centre o + A and radius r lies outside iff its
//! distance from the cone, |A×axis|·cos α − (A·axis)·sin α, exceeds r (for α < 90°). The box is tested through its
//! ball.
//!
//! The promise: *may keep what is missed, may never drop what is hit*.
//!
//! Based on: Solomon Boulos, Ingo Wald, Peter Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray
//! Packets", 2006; Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011 (cones for common origins).

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::U;

/// Each quantity of the test is at most |A| + r and passes fewer than 16 roundings; the axis is of unit length within
/// 4u.
const CONE_SLACK: f64 = 32.0 * U;

/// A cone of directions from an apex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// The common origin.
    pub apex: DVec3,
    /// The axis, of unit length.
    pub axis: DVec3,
    /// The cosine of the half angle: −1 holds all directions, 1 only the axis. Rounded down.
    pub cos_half_angle: f64,
    /// The sine of the half angle, for half angles up to 90°.
    sin_half_angle: f64,
    /// The greatest length of a direction. Rounded up.
    longest: f64,
}

impl Cone {
    /// A cone that holds all directions: of any length, none zero.
    #[must_use]
    pub fn around(apex: DVec3, directions: &[DVec3]) -> Self {
        let unit = |d: DVec3| {
            // The largest component first, so that no square overflows or vanishes.
            let scaled = d / d.abs().max_element();
            scaled / scaled.length()
        };
        let sum = directions.iter().fold(DVec3::ZERO, |sum, &d| sum + unit(d));
        let axis = if sum == DVec3::ZERO { DVec3::X } else { unit(sum) };
        let cos = directions.iter().map(|&d| unit(d).dot(axis)).fold(1.0, f64::min) - CONE_SLACK;
        let longest = directions.iter().map(|d| {
            let size = d.abs().max_element();
            (*d / size).length() * size
        });
        Self {
            apex,
            axis,
            cos_half_angle: cos,
            sin_half_angle: (1.0 - cos * cos).max(0.0).sqrt(),
            longest: longest.fold(0.0, f64::max) * (1.0 + CONE_SLACK),
        }
    }

    /// A lower bound of t on the rays within the box, or `None` when the box lies strictly outside.
    #[must_use]
    pub fn enter(&self, bounds: &Aabb) -> Option<f64> {
        let (lo, hi) = bounds.corners();
        let a = (lo + hi) * 0.5 - self.apex;
        let (distance, radius) = (a.length(), (hi - lo).length() * 0.5);
        let slack = (distance + radius + self.apex.length()) * CONE_SLACK;
        let along = a.dot(self.axis);
        let across = a.cross(self.axis).length();
        let outside = across * self.cos_half_angle - along * self.sin_half_angle;
        if self.cos_half_angle > 0.0 && outside > radius + slack {
            return None;
        }
        let nearest = (distance - radius - slack) / self.longest;
        Some(if nearest > 0.0 { nearest * (1.0 - 2.0 * U) } else { 0.0 })
    }
}
