//! Eight rays side by side.

use fearless_simd::prelude::*;

use crate::geometry::ray::Ray;
use crate::simd::lanes::{LANES, Lanes, Points};

/// Eight rays, coordinate by coordinate.
pub(crate) struct EightRays<S: Simd> {
    pub(crate) origin: Points<S>,
    pub(crate) direction: Points<S>,
    pub(crate) t_min: Lanes<S>,
    pub(crate) t_max: Lanes<S>,
}

impl<S: Simd> EightRays<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, rays: &[&Ray; LANES]) -> Self {
        let mut rows = [Lanes::simd_from(simd, 0.0); LANES];
        for (row, Ray { origin: o, direction: d, t_min, t_max }) in rows.iter_mut().zip(rays) {
            *row = Lanes::load_array(simd, [o.x, o.y, o.z, d.x, d.y, d.z, *t_min, *t_max]);
        }
        // Three perfect shuffles transpose.
        for _ in 0..3 {
            let [a, b, c, d, e, f, g, h] = rows;
            rows = [
                a.zip_low(e),
                a.zip_high(e),
                b.zip_low(f),
                b.zip_high(f),
                c.zip_low(g),
                c.zip_high(g),
                d.zip_low(h),
                d.zip_high(h),
            ];
        }
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = rows;
        Self {
            origin: Points { x: ox, y: oy, z: oz },
            direction: Points { x: dx, y: dy, z: dz },
            t_min,
            t_max,
        }
    }
}
