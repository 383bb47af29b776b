//! The space in which arbitrary rays are culled: f32, with one absolute slack for all errors.
//!
//! p' = (p − c)·s, with c the centre of the scene's box and s a power of two, brings the scene into the cube [−1, 1]³.
//! A ray is cut to where it meets that cube and its direction is scaled to |d'|∞ = 1, so t' = t·m − t₀ with m = |d·s|∞;
//! a ray then ends within t' ≤ [`T_END`].
//!
//! Boxes are widened by [`SLACK`] = 2⁻²⁰. Positions that this has to cover, per axis, in units of 2⁻²⁵: rounding o' 2
//! (it may lie a little outside the cube), the corner of a box 1 and widening it 2; t'·d' with d' rounded, 2.1; b'·i −
//! o'·i with i = 1/d' rounded, 4 (in proportion to b' − o', of a size of up to 2), each product 2, their difference 4:
//! together 19 < 32. Then b₀ ≤ o + t·d ≤ b₁ for the true ray implies that the computed slab distances enclose t'. A
//! product and a sum may be fused, which rounds less: here numbers only decide what is looked at, so not all
//! instruction sets need the same bits. Where |d'| < 2⁻⁶⁰ its inverse is taken as ±2⁶⁰: over the ray's length that
//! moves nothing by more than the slack, and a start within the widened slab is far inside it by that measure.
//!
//! Based on: Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes", 1986 (slabs); Thiago Ize, "Robust BVH Ray
//! Traversal", 2013 (conservative bounds).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::ray::Ray;
use crate::intersect::bundle::eight_rays::EightRays;
use crate::objects::boxes::Boxes;
use crate::simd::lanes::{LANES, Lanes, Narrow, Points, narrow};

/// Octants of directions.
pub(crate) const OCTANTS: usize = 8;
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

/// A ray in the cube, cut to it: a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct CulledRay {
    pub(crate) origin: [f32; 3],
    /// 1/d'.
    pub(crate) inverse: [f32; 3],
    /// o'/d'.
    origin_by_inverse: [f32; 3],
    /// d', its largest component ±1.
    pub(crate) direction: [f32; 3],
    /// 1/(d'·d').
    pub(crate) per_length: f32,
    /// The upper end of t'; negative for a ray that is settled.
    pub(crate) t_max: f32,
    /// Whose ray it is.
    pub(crate) number: u32,
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

/// Eight rays in the cube.
#[derive(Debug)]
pub(crate) struct CutRays {
    /// The rays, as bits, that meet the cube.
    pub(crate) meeting: u64,
    /// The rays, as bits, that begin too far away for this space.
    pub(crate) far: u64,
    origin: [[f32; LANES]; 3],
    inverse: [[f32; LANES]; 3],
    origin_by_inverse: [[f32; LANES]; 3],
    direction: [[f32; LANES]; 3],
    per_length: [f32; LANES],
    t_max: [f32; LANES],
    m: [f64; LANES],
    t0: [f64; LANES],
}

impl CutRays {
    /// A ray that meets the cube, and whose it is.
    #[inline]
    pub(crate) fn get(&self, lane: usize, number: u32) -> (CulledRay, Parameter) {
        let point = |p: &[[f32; LANES]; 3]| [p[0][lane], p[1][lane], p[2][lane]];
        let ray = CulledRay {
            origin: point(&self.origin),
            inverse: point(&self.inverse),
            origin_by_inverse: point(&self.origin_by_inverse),
            direction: point(&self.direction),
            per_length: self.per_length[lane],
            t_max: self.t_max[lane],
            number,
        };
        (ray, Parameter { m: self.m[lane], t0: self.t0[lane] })
    }
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

    /// Eight rays in the cube.
    #[inline(always)]
    pub(crate) fn cut<S: Simd>(&self, simd: S, rays: &[&Ray; LANES]) -> CutRays {
        let splat = |x: f64| Lanes::simd_from(simd, x);
        let rays = EightRays::new(simd, rays);
        let scale = f64::from(self.scale);
        let centre = Points::splat(simd, DVec3::from_array(self.centre.map(f64::from)));
        let origin = rays.origin.minus(centre).times(splat(scale));
        let direction = rays.direction.times(splat(scale));
        let m = direction.greatest();
        // A segment without length has nothing between its ends.
        let has_length = m.simd_gt(splat(0.0));
        let direction = direction.times(splat(1.0) / has_length.select(m, splat(1.0)));
        let far = origin.greatest().simd_gt(splat(FAR));

        let (mut t0, mut t1) = (splat(0.0), splat(f64::INFINITY));
        let mut meeting = has_length;
        for (o, d) in [(origin.x, direction.x), (origin.y, direction.y), (origin.z, direction.z)] {
            let is_along = d.abs().simd_lt(splat(f64::from(1.0 / INVERSE_OF_ZERO)));
            meeting &= !is_along | o.abs().simd_le(splat(CUBE));
            let inverse = splat(1.0) / is_along.select(splat(1.0), d);
            let (one, other) = ((splat(-CUBE) - o) * inverse, (splat(CUBE) - o) * inverse);
            t0 = is_along.select(t0, t0.max(one.min(other)));
            t1 = is_along.select(t1, t1.min(one.max(other)));
        }
        let end = rays.t_max * m - t0 + f64::from(SLACK);
        // NaN, from 0·∞, is no bound.
        let end = end.simd_lt(splat(T_END)).select(end, splat(T_END));
        let meeting = meeting & t0.simd_le(t1) & end.simd_ge(splat(0.0));

        let start = origin.plus(direction.times(t0));
        let o = [narrow(start.x), narrow(start.y), narrow(start.z)];
        let d = [narrow(direction.x), narrow(direction.y), narrow(direction.z)];
        let [mut inverse, mut origin_by_inverse] = [[[0.0; LANES]; 3]; 2];
        for k in 0..3 {
            let most = Narrow::simd_from(simd, INVERSE_OF_ZERO);
            let exact = Narrow::simd_from(simd, 1.0) / d[k];
            let i = exact.abs().simd_lt(most).select(exact, most.copysign(d[k]));
            (inverse[k], origin_by_inverse[k]) = (i.to_array(), (o[k] * i).to_array());
        }
        let [x, y, z] = d;
        CutRays {
            meeting: meeting.to_bitmask(),
            far: (far & has_length).to_bitmask(),
            origin: [o[0].to_array(), o[1].to_array(), o[2].to_array()],
            inverse,
            origin_by_inverse,
            direction: [x.to_array(), y.to_array(), z.to_array()],
            per_length: (Narrow::simd_from(simd, 1.0) / (x * x + y * y + z * z)).to_array(),
            t_max: narrow(end).to_array(),
            m: m.to_array(),
            t0: t0.to_array(),
        }
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
    /// The boxes, as bits, that the ray may meet before its end.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, [near, far]: &[[Narrow<S>; 3]; 2]) -> u64 {
        let [ix, iy, iz] = self.inverse;
        let [px, py, pz] = self.origin_by_inverse;
        let first = near[0].mul_sub(ix, px).max(near[1].mul_sub(iy, py)).max(near[2].mul_sub(iz, pz));
        let last = far[0].mul_sub(ix, px).min(far[1].mul_sub(iy, py)).min(far[2].mul_sub(iz, pz));
        first.max(-SLACK).simd_le(last.min(self.t_max)).to_bitmask()
    }
}

/// The octant of a direction: bit k for axis k, set where it runs backward.
#[inline]
pub(crate) fn octant(direction: DVec3) -> usize {
    // The signs, that of a zero as well.
    (direction.to_array().into_iter().rev())
        .fold(0, |octant, x| octant << 1 | usize::from(x.is_sign_negative()))
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
pub(crate) mod tests {
    use super::*;
    use crate::simd::isa::Isa;
    use fearless_simd::dispatch;

    /// Numbers in [0, 1), the same in every run.
    pub(crate) fn numbers() -> impl FnMut() -> f64 {
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
                let ray = Ray::new(start, direction);
                let cut = dispatch!(level, simd => space.cut(simd, &[&ray; LANES]));
                assert_eq!(cut.meeting, 255, "{ray:?} misses the scene");
                let (culled, _) = cut.get(3, 0);
                let mut boxes = Boxes::EMPTY;
                let aabb = Aabb { lo: ends.map(|end| end[0]), hi: ends.map(|end| end[1]) };
                boxes.set(3, &space.aabb(&aabb));
                let met = dispatch!(level, simd => culled.meets(&planes(simd, &boxes, octant(direction))));
                assert_eq!(met, 1 << 3, "{start} {direction} {aabb:?}");
            }
        }
    }
}
