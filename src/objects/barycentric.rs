//! What follows from a hit: where on the triangle it lies.
//!
//! The weights of the corners are proportional to the edge functions: w_a : w_b : w_c = e_bc : e_ca : e_ab. One fixed
//! f64 sequence computes them from the exact ray, so they are the same on every machine.
//!
//! Based on: August Ferdinand Möbius, "Der barycentrische Calcul", 1827.

use glam::DVec3;

use crate::exact::filter::Cross;
use crate::exact::predicates::collinear;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangle;
use crate::geometry::triangles::{TriangleId, Triangles};

impl Triangles<'_> {
    /// The barycentric weights of a, b and c where the ray meets the triangle's plane: each in \[0, 1\], their sum
    /// within 2 ulp of 1. Meant for a triangle that the ray hits.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn barycentrics(&self, id: TriangleId, ray: &Ray) -> [f64; 3] {
        let Triangle { a, b, c } = self.triangle(id.0);
        let edge = |from: DVec3, to: DVec3| Cross::of(from - ray.origin, to - from).dot(ray.direction).value;
        let weights = [edge(b, c), edge(c, a), edge(a, b)];
        let sum = weights[0] + weights[1] + weights[2];
        // Rounding can leave a weight on the wrong side of zero: it lies on the edge.
        let weights = weights.map(|w| if (w > 0.0) == (sum > 0.0) { w.abs() } else { 0.0 });
        let sum = weights[0] + weights[1] + weights[2];
        if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
    }

    /// Whether a triangle has no area: its corners are exactly collinear, or coincide. No ray hits it.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn is_degenerate(&self, id: TriangleId) -> bool {
        collinear(&self.triangle(id.0))
    }

    /// The normal (b − a)×(c − a), of unit length; zero for a triangle without area.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn normal(&self, id: TriangleId) -> DVec3 {
        let Triangle { a, b, c } = self.triangle(id.0);
        unit(Cross::of(unit_scale(b - a), unit_scale(c - a)).value)
    }
}

/// v over its largest component, so that products of two such neither overflow nor vanish; zero stays zero.
fn unit_scale(v: DVec3) -> DVec3 {
    let size = v.abs().max_element();
    if size > 0.0 { v / size } else { v }
}

/// v over its length; zero stays zero.
fn unit(v: DVec3) -> DVec3 {
    let v = unit_scale(v);
    let length = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
    if length > 0.0 { v / length } else { v }
}
