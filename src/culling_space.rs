//! The space in which arbitrary rays are culled: f32, with one absolute slack for all errors.
//!
//! p' = (p − c)·s, with c the centre of the scene's box and s a power of two, brings the scene into the cube [−1, 1]³. A ray is
//! cut to where it meets that cube and its direction is scaled to |d'|∞ = 1, so t' = t·m − t₀ with m = |d·s|∞; a ray then ends
//! within t' ≤ [`T_END`].
//!
//! Boxes are widened by [`SLACK`] = 2⁻²⁰. Positions that this has to cover, per axis, in units of 2⁻²⁵: rounding o' 2 (it may lie a
//! little outside the cube), the corner of a box 1 and widening it 2; t'·d' with d' rounded, 2.1; forming b' − o', of a size of up to 2,
//! 4, and multiplying it by 1/d' with two roundings, 8: together 19 < 32. Then b₀ ≤ o + t·d ≤ b₁ for the true ray implies that
//! the computed slab distances enclose t'.
//! Where |d'| < 2⁻⁶⁰ its inverse is taken as ±2⁶⁰: over the ray's length that moves nothing by more than the slack, and a start
//! within the widened slab is far inside it by that measure.
//!
//! Based on: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes", 1986 (slabs); Thiago Ize, "Robust BVH Ray
//! Traversal", 2013 (conservative bounds).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::lanes::{Boxes, Narrow};
use crate::{Aabb, Ray};

/// What boxes are widened by on each side.
pub(crate) const SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Where all rays have left the cube: its side, and the slack of cutting them.
const T_END: f64 = 2.125;
/// Half the side of the cube that rays are cut to.
const CUBE: f64 = 1.0 + 1.0 / 1024.0;
/// Origins farther away than this, in units of the cube, would lose what the slack covers.
const FAR: f64 = (1 << 20) as f64;
/// Scales beyond this could overflow with the largest directions.
const GREATEST_SCALE: f64 = f64::from_bits((1023 + 100) << 52);
/// The inverse of a direction of zero.
const INVERSE_OF_ZERO: f32 = (1_u64 << 60) as f32;

/// The map from the world to the cube.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullingSpace {
    centre: [f32; 3],
    scale: f32,
}

/// A ray in the cube, cut to it, and beside it the ray that it was: two lines of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct CulledRay {
    pub(crate) origin: [f32; 3],
    /// 1/d'.
    pub(crate) inverse: [f32; 3],
    /// d', its largest component ±1.
    pub(crate) direction: [f32; 3],
    /// 1/(d'·d').
    pub(crate) per_length: f32,
    /// The upper end of t'; negative for a ray that is settled.
    pub(crate) t_max: f32,
    /// Whose ray it is.
    pub(crate) probe: u32,
    /// The ray itself.
    pub(crate) ray: Ray,
}

/// How t of a ray becomes t' = t·m − t₀.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parameter {
    pub(crate) m: f64,
    pub(crate) t0: f64,
}

impl Parameter {
    /// An upper bound of t' for t ≤ `t`.
    pub(crate) fn upper(self, t: f64) -> f32 {
        let t = t * self.m - self.t0 + f64::from(SLACK);
        // NaN, from 0·∞, is no bound.
        if t < T_END { t as f32 } else { T_END as f32 }
    }
}

/// What becomes of a ray in the cube.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Cut {
    /// It does not meet the cube.
    Outside,
    /// It begins too far away for this space.
    Far,
    /// Its part within the cube.
    Ray(CulledRay, Parameter),
}

impl CullingSpace {
    /// The space of a scene; none where numbers are too large or too small for it.
    pub(crate) fn over(bounds: &Aabb) -> Option<Self> {
        let centre = bounds.centre().map(|x| x as f32);
        let reach = |k: usize| {
            let (lo, hi) = (f64::from(bounds.lo[k]), f64::from(bounds.hi[k]));
            let centre = f64::from(centre[k]);
            if hi - centre > centre - lo { hi - centre } else { centre - lo }
        };
        let half = reach(0).max(reach(1)).max(reach(2));
        if half == 0.0 {
            return Some(Self { centre, scale: 1.0 });
        }
        // The power of two below 1/half: its exponent, and a mantissa of zero.
        let scale = f64::from_bits((1.0 / half).to_bits() & !((1 << 52) - 1));
        let fits = (1.0 / GREATEST_SCALE..=GREATEST_SCALE).contains(&scale);
        fits.then_some(Self { centre, scale: scale as f32 })
    }

    /// A ray in the cube.
    #[inline]
    pub(crate) fn cut(&self, ray: &Ray, probe: u32) -> Cut {
        let scale = f64::from(self.scale);
        let centre = DVec3::from_array(self.centre.map(f64::from));
        let (origin, direction) = ((ray.origin - centre) * scale, ray.direction * scale);
        let m = direction.abs().max_element();
        if m == 0.0 {
            // A segment without length has nothing between its ends.
            return Cut::Outside;
        }
        let direction = direction / m;
        if origin.abs().max_element() > FAR {
            return Cut::Far;
        }
        let (mut t0, mut t1) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let (o, d) = (origin[k], direction[k]);
            if d.abs() < f64::from(1.0 / INVERSE_OF_ZERO) {
                if o.abs() > CUBE {
                    return Cut::Outside;
                }
                continue;
            }
            let (one, other) = ((-CUBE - o) / d, (CUBE - o) / d);
            let (near, far) = if d > 0.0 { (one, other) } else { (other, one) };
            t0 = if near > t0 { near } else { t0 };
            t1 = if far < t1 { far } else { t1 };
        }
        let parameter = Parameter { m, t0 };
        let t_max = parameter.upper(ray.t_max);
        if t0 > t1 || t_max < 0.0 {
            return Cut::Outside;
        }
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        let (origin, direction) = (narrow(origin + direction * t0), narrow(direction));
        let inverse = direction.map(|d| {
            let inverse = 1.0 / d;
            if inverse.abs() < INVERSE_OF_ZERO { inverse } else { INVERSE_OF_ZERO.copysign(d) }
        });
        let [x, y, z] = direction;
        let per_length = 1.0 / (x * x + y * y + z * z);
        Cut::Ray(CulledRay { origin, inverse, direction, per_length, t_max, probe, ray: *ray }, parameter)
    }

    /// A box in the cube.
    pub(crate) fn aabb(&self, bounds: &Aabb) -> Aabb {
        let map = |p: [f32; 3]| [0, 1, 2].map(|k| (p[k] - self.centre[k]) * self.scale);
        Aabb { lo: map(bounds.lo), hi: map(bounds.hi) }
    }

    /// Coordinates of axis k in the cube.
    #[inline(always)]
    pub(crate) fn coordinate<S: Simd>(&self, x: Narrow<S>, k: usize) -> Narrow<S> {
        (x - self.centre[k]) * self.scale
    }
}

impl CulledRay {
    /// The octant of the direction: bit k for axis k, set where it runs backward.
    pub(crate) fn octant(&self) -> usize {
        let bit = |k: usize| usize::from(self.inverse[k].is_sign_negative()) << k;
        bit(0) | bit(1) | bit(2)
    }

    /// The boxes, as bits, that the ray may meet before its end.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, [near, far]: &[[Narrow<S>; 3]; 2]) -> u64 {
        let [ox, oy, oz] = self.origin;
        let [ix, iy, iz] = self.inverse;
        let first = ((near[0] - ox) * ix).max((near[1] - oy) * iy).max((near[2] - oz) * iz);
        let last = ((far[0] - ox) * ix).min((far[1] - oy) * iy).min((far[2] - oz) * iz);
        first.max(-SLACK).simd_le(last.min(self.t_max)).to_bitmask()
    }
}

/// The planes of eight boxes of the cube, widened, that rays of an octant meet first and last. Empty boxes stay empty.
#[inline(always)]
pub(crate) fn planes<S: Simd>(simd: S, boxes: &Boxes, octant: usize) -> [[Narrow<S>; 3]; 2] {
    let zero = Narrow::simd_from(simd, 0.0);
    let (mut near, mut far) = ([zero; 3], [zero; 3]);
    for (k, (near, far)) in near.iter_mut().zip(&mut far).enumerate() {
        let lo = Narrow::load_array_ref(simd, &boxes.lo[k]) - SLACK;
        let hi = Narrow::load_array_ref(simd, &boxes.hi[k]) + SLACK;
        (*near, *far) = if octant >> k & 1 == 0 { (lo, hi) } else { (hi, lo) };
    }
    [near, far]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Isa;
    use fearless_simd::dispatch;

    /// Numbers in [0, 1), the same in every run.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn no_box_that_a_ray_meets_is_dropped() {
        let level = Isa::Auto.level().expect("every machine has one");
        let mut next = numbers();
        for scale in [1e-20_f32, 1e-3, 1.0, 1e7, 1e20] {
            let bounds = Aabb { lo: [-3.0 * scale, 5.0 * scale, 0.0], hi: [scale, 6.0 * scale, 0.5 * scale] };
            let space = CullingSpace::over(&bounds).expect("a space");
            for _ in 0..20_000 {
                // A point of the scene, with a box that begins or ends in it, and a ray through it from anywhere.
                let [x, y, z] =
                    [0, 1, 2].map(|k| bounds.lo[k] + (bounds.hi[k] - bounds.lo[k]) * next() as f32);
                let size = scale * (next() as f32).powi(20);
                let ends = [x, y, z].map(|p| if next() < 0.5 { [p, p + size] } else { [p - size, p] });
                let point = DVec3::new(f64::from(x), f64::from(y), f64::from(z));
                let mut direction = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5);
                for k in 0..3 {
                    direction[k] *= if next() < 0.2 { 0.0 } else { 1.0 };
                }
                if direction == DVec3::ZERO {
                    continue;
                }
                let start = point - direction * (f64::from(scale) * 10.0 * next().powi(4));
                let Cut::Ray(ray, _) = space.cut(&Ray::new(start, direction), 0) else {
                    panic!("{start} {direction} misses the scene")
                };
                let mut boxes = Boxes::EMPTY;
                let aabb = Aabb { lo: ends.map(|end| end[0]), hi: ends.map(|end| end[1]) };
                boxes.set(3, &space.aabb(&aabb));
                let met = dispatch!(level, simd => ray.meets(&planes(simd, &boxes, ray.octant())));
                assert_eq!(met, 1 << 3, "{start} {direction} {aabb:?}");
            }
        }
    }
}
