//! The filter of the leaf of bundles: one ray against eight triangles in f32. What it lets pass is tested exactly.
//!
//! The ray's origin is moved along it to o'' near the triangles' middle: then everything is small. With T = o'' − a, P
//! = d×E₂, Q = T×E₁ (Möller and Trumbore): u = T·P, v = d·Q, w = E₁·P − u − v have one sign, or are all zero, where the
//! ray's line meets the triangle.
//!
//! Errors, for lines that meet a triangle, so that o'' is within 3.5 of the middle. Let ε = 2⁻²³. Per axis T is off by
//! at most η = 7ε: o' ε/2, t·d with d rounded 0.9ε, fl(t·d) ε, its sum with o' 2ε, a ε/4, the difference 2ε. Corners
//! are rounded, so E₁ and E₂ are off by ε. With 1-norms τ = |T| and E = |E₁| + |E₂| ≤ 12, each |Eᵢ| ≤ 6, and |d|∞ = 1:
//!
//! - |Δu| ≤ 2η|E₂| + 2ετ + 2.75ε·τ|E₂| (the last is d rounded and five roundings of the products and sums); so for v
//!   with E₁. As |Eᵢ| ≤ 6, both are below 19ετ + 14εE < 2⁻¹⁸(τ + E), where 2⁻¹⁸ = 32ε.
//! - E₁·P is off by at most 2εE + 2.75ε|E₁||E₂| < 11εE, and w by the sum of all and its own two roundings: below
//!   3·2⁻¹⁸(τ + E).
//! - E₂·Q is off by at most ηE²/4 + 2ετE + 2.75ε·3τE < 11ε(τ + E)E. With the line's end at s beyond o'' and |E₂·Q/E₁·P|
//!   ≤ τ + E, a hit before the end has ±E₂·Q − |E₁·P|s < 11ε(τ + E)E + 11ε(τ + E + |s|)E < 2⁻¹⁸(τ + E + |s|)E,
//!   whichever sign E₁·P is computed to have.
//!
//! A product and a sum may be fused, which rounds less.
//!
//! Based on: Tomas Möller and Ben Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.

use fearless_simd::{prelude::*, u32x8};

use crate::intersect::bundle::cull_space::CulledRay;
use crate::intersect::bundle::lazy_bvh::EightTriangles;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::{LANES, Narrow};

/// Error of u and v per unit of |T| + E.
const ERROR: f32 = 1.0 / (1 << 18) as f32;

/// Eight triangles in the culling space.
pub(crate) struct EightLoaded<S: Simd> {
    a: [Narrow<S>; 3],
    e1: [Narrow<S>; 3],
    e2: [Narrow<S>; 3],
    /// |E₁| + |E₂|.
    size: Narrow<S>,
    /// A point near all.
    middle: [f32; 3],
    /// Their ids, and which of them there are.
    pub(crate) ids: u32x8<S>,
    present: u64,
}

impl<S: Simd> EightLoaded<S> {
    /// The triangles around a point.
    #[inline(always)]
    pub(crate) fn new(simd: S, eight: &EightTriangles, middle: [f32; 3]) -> Self {
        let load = |p: &[[f32; LANES]; 3]| {
            [
                Narrow::load_array_ref(simd, &p[0]),
                Narrow::load_array_ref(simd, &p[1]),
                Narrow::load_array_ref(simd, &p[2]),
            ]
        };
        let (a, e1, e2) = (load(&eight.a), load(&eight.e1), load(&eight.e2));
        let ([x1, y1, z1], [x2, y2, z2]) = (e1, e2);
        let size = x1.abs() + y1.abs() + z1.abs() + (x2.abs() + y2.abs() + z2.abs());
        let ids = u32x8::load_array_ref(simd, &eight.ids);
        let present = !ids.simd_eq(u32x8::splat(simd, NO_TRIANGLE));
        Self { a, e1, e2, size, middle, ids, present: present.to_bitmask() }
    }

    /// The triangles, as bits, that the ray's line may meet.
    #[inline(always)]
    pub(crate) fn candidates(&self, ray: &CulledRay) -> u64 {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
        let [mx, my, mz] = self.middle;
        let t = ((mx - ox) * dx + (my - oy) * dy + (mz - oz) * dz) * ray.per_length;
        let (ox, oy, oz) = (ox + t * dx, oy + t * dy, oz + t * dz);
        let ([ax, ay, az], [e1x, e1y, e1z], [e2x, e2y, e2z]) = (self.a, self.e1, self.e2);
        // T = o'' − a, P = d×E₂, Q = T×E₁.
        let (tx, ty, tz) = (-ax + ox, -ay + oy, -az + oz);
        let px = e2z.mul_sub(dy, e2y * dz);
        let py = e2x.mul_sub(dz, e2z * dx);
        let pz = e2y.mul_sub(dx, e2x * dy);
        let qx = ty.mul_sub(e1z, tz * e1y);
        let qy = tz.mul_sub(e1x, tx * e1z);
        let qz = tx.mul_sub(e1y, ty * e1x);
        let u = tz.mul_add(pz, ty.mul_add(py, tx * px));
        let v = qz.mul_add(dz, qy.mul_add(dy, qx * dx));
        let determinant = e1z.mul_add(pz, e1y.mul_add(py, e1x * px));
        let w = (determinant - u - v) * (1.0 / 3.0);
        let error = (tx.abs() + ty.abs() + tz.abs() + self.size) * ERROR;
        let (least, greatest) = (u.min(v).min(w), u.max(v).max(w));
        let meets = least.simd_ge(-error) | greatest.simd_le(error);
        // The hit lies E₂·Q/E₁·P beyond o''; the sign of E₁·P is not known, so both sides are multiplied by it.
        let ahead = ray.t_max - t;
        let along = e2z.mul_add(qz, e2y.mul_add(qy, e2x * qx));
        let beyond = (along - determinant * ahead) * determinant;
        let beyond_error = (error + ahead.abs() * ERROR) * self.size * determinant.abs();
        (meets & beyond.simd_le(beyond_error)).to_bitmask() & self.present
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ray::Ray;
    use crate::geometry::triangles::Triangles;
    use crate::intersect::bundle::cull_space::CullingSpace;
    use crate::intersect::bundle::cull_space::tests::numbers;
    use crate::objects::split::Item;
    use crate::simd::isa::Isa;
    use fearless_simd::dispatch;
    use glam::DVec3;

    #[test]
    fn no_triangle_that_a_ray_meets_is_dropped() {
        let level = Isa::Auto.level().expect("every machine has one");
        let mut next = numbers();
        for scale in [1e-20, 1e-3, 1.0, 1e7, 1e20] {
            for _ in 0..20_000 {
                // A triangle of any size up to the scene's, slivers among them, and the corners of the scene.
                let size = next().powi(12);
                let thin = if next() < 0.3 { 1e-6 } else { 1.0 };
                let mut corner =
                    |spread: f64| DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * (spread * scale);
                let first = corner(1.0) * (1.0 - size);
                let second = first + corner(size);
                let third = first + (second - first) * 0.3 + corner(size * thin);
                let mut positions = [first, second, third].map(|p| p.to_array().map(|x| x as f32)).to_vec();
                positions.extend([[scale as f32; 3], [-scale as f32; 3]]);
                let triangles = Triangles::new(&positions, &[[0, 1, 2]]).expect("valid triangles");
                let space = CullingSpace::over(&triangles.position_bounds()).expect("a space");
                // A ray through it, often through an edge or a corner, that may end right behind it.
                let mut weights = [next(), next(), next()];
                for weight in &mut weights {
                    *weight *= if next() < 0.3 { 0.0 } else { 1.0 };
                }
                let sum: f64 = weights.iter().sum();
                let weights = if sum > 0.0 { weights.map(|w| w / sum) } else { [1.0, 0.0, 0.0] };
                let corners = [0, 1, 2].map(|k| DVec3::from_array(positions[k].map(f64::from)));
                let point = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
                let direction = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
                let away = scale * 3.0 * next().powi(6);
                let end = if next() < 0.5 { away * (1.0 + 1e-12) } else { f64::INFINITY };
                let ray = Ray { t_max: end, ..Ray::new(point - direction * away, direction) };
                if away == 0.0 {
                    continue;
                }
                let cut = dispatch!(level, simd => space.cut(simd, &[&ray; LANES]));
                assert_eq!(cut.meeting, 255, "{ray:?} misses the scene");
                let (culled, _) = cut.get(3, 0);
                let candidates = dispatch!(level, simd => {
                    let eight = EightTriangles::new(simd, &triangles, &space, &[Item::new(&space.aabb(&triangles.bounds(0)), 0)]);
                    let middle = [0, 1, 2].map(|k| eight.a[k][0]);
                    EightLoaded::new(simd, &eight, middle).candidates(&culled)
                });
                assert_eq!(candidates & 1, 1, "{ray:?} {positions:?}");
            }
        }
    }
}
