//! A ray as slab tests want it: with the inverse of its direction, so that no test divides.
//!
//! **Slack.** The exact distance of a plane is (b − o)/d. Computed as (b − o)·r, r = 1/d, it has four roundings: of the
//! difference, of r, of the product, and of d, which may be a rounded difference. Widening it rounds twice more: at
//! most 6u and terms of second order in all; 8u pay for it. Nothing overflows or underflows: origins are multiples of
//! 2⁻¹⁴⁹ below 2¹²⁹, so b − o is 0 or in [2⁻¹⁴⁹, 2¹³⁰]; components of d are 0 or in [2⁻²⁴⁰, 2¹⁹⁰], so r is in [2⁻¹⁹⁰,
//! 2²⁴⁰].
//!
//! Based on: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes", 1986 (slabs); Thiago Ize, "Robust BVH Ray
//! Traversal", 2013 (rounding).

use std::cmp::Ordering;

use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::U;
use crate::geometry::ray::Ray;

/// Bounds the relative error of a slab distance, see the head of this file.
const SLAB_SLACK: f64 = 8.0 * U;

/// What the slab test needs of a ray.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slabs {
    origin: DVec3,
    /// 1/d per axis: infinite where d is 0.
    inverse: DVec3,
    t_min: f64,
}

impl Slabs {
    pub(crate) fn new(ray: &Ray) -> Self {
        Self { origin: ray.origin, inverse: ray.direction.recip(), t_min: ray.t_min }
    }

    /// Whether the ray's coordinate grows with t.
    pub(crate) fn ascends(&self, axis: usize) -> bool {
        self.inverse[axis] > 0.0
    }

    /// Whether the ray may meet the box at some t in \[t_min, t_max\].
    ///
    /// May keep what is missed, never drops what is hit. Every drop is a strict comparison of rounded-outward bounds,
    /// so NaN keeps the box.
    #[inline]
    pub(crate) fn may_meet(&self, bounds: &Aabb, t_max: f64) -> bool {
        let (lo, hi) = bounds.corners();
        let (mut enter, mut leave) = (self.t_min, t_max);
        for k in 0..3 {
            let (o, r) = (self.origin[k], self.inverse[k]);
            if r.is_infinite() {
                if o < lo[k] || o > hi[k] {
                    return false;
                }
                continue;
            }
            let (first, second) = if r > 0.0 { (lo[k], hi[k]) } else { (hi[k], lo[k]) };
            let near = (first - o) * r;
            let far = (second - o) * r;
            let near = near - near.abs() * SLAB_SLACK;
            let far = far + far.abs() * SLAB_SLACK;
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
        }
        enter.partial_cmp(&leave) != Some(Ordering::Greater)
    }
}
