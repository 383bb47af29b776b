//! A shaft: one bound for rays with neither a common origin nor a common direction.
//!
//! It holds the box of the origins and that of the inverse directions, all of one octant. For a box, interval
//! arithmetic bounds the slab distances of all rays at once; where even these bounds do not overlap, no ray meets it.
//!
//! Based on: Eric Haines and John Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity", 1991; Solomon Boulos, Ingo
//! Wald, Peter Shirley, "Geometric and Arithmetic Culling Methods for Entire Ray Packets", 2006.

use fearless_simd::prelude::*;

use crate::intersect::bundle::cull_space::{CulledRay, SLACK};
use crate::objects::boxes::Boxes;
use crate::simd::lanes::{LANES, Narrow};

/// A bound for rays of one octant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shaft {
    /// The least and the greatest origin.
    origins: [[f32; 3]; 2],
    /// The inverse directions of least and of greatest size.
    inverses: [[f32; 3]; 2],
    /// Nothing beyond matters to any ray.
    t_max: f32,
    /// The mean of the directions, not normalised.
    along: [f32; 3],
}

impl Shaft {
    /// The bound of rays of an octant.
    pub(crate) fn around(rays: &[CulledRay], octant: usize) -> Self {
        let mut shaft = Self {
            origins: [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]],
            inverses: [[f32::INFINITY; 3], [0.0; 3]],
            t_max: 0.0,
            along: [0.0; 3],
        };
        for ray in rays {
            for k in 0..3 {
                let (origin, inverse) = (ray.origin[k], ray.inverse[k].abs());
                shaft.origins[0][k] = shaft.origins[0][k].min(origin);
                shaft.origins[1][k] = shaft.origins[1][k].max(origin);
                shaft.inverses[0][k] = shaft.inverses[0][k].min(inverse);
                shaft.inverses[1][k] = shaft.inverses[1][k].max(inverse);
                shaft.along[k] += ray.direction[k];
            }
            shaft.t_max = shaft.t_max.max(ray.t_max);
        }
        for k in 0..3 {
            if octant >> k & 1 == 1 {
                shaft.inverses.iter_mut().for_each(|inverse| inverse[k] = -inverse[k]);
            }
        }
        shaft
    }

    /// The boxes, as bits, that some ray may meet.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, simd: S, [near, far]: &[[Narrow<S>; 3]; 2]) -> u64 {
        let zero = Narrow::simd_from(simd, 0.0);
        let (mut first, mut last) = (zero - SLACK, zero + self.t_max);
        for k in 0..3 {
            let [small, great] = self.inverses.map(|inverse| inverse[k]);
            let backward = usize::from(small < 0.0);
            // The distances of the planes from the origins that come last and first, in units of the direction's sign.
            let [from_first, from_last] = [self.origins[backward][k], self.origins[1 - backward][k]];
            let (least, greatest) = (near[k] - from_last, far[k] - from_first);
            // Before the origin a greater inverse makes the product smaller, beyond it a smaller one does.
            let beyond = (least * small).simd_ge(zero);
            first = first.max(beyond.select(least * small, least * great));
            let beyond = (greatest * small).simd_ge(zero);
            last = last.min(beyond.select(greatest * great, greatest * small));
        }
        first.simd_le(last).to_bitmask()
    }

    /// The boxes that any ray may meet, by the numbers of those rays: those first whose middles lie first along the
    /// mean direction.
    pub(crate) fn near_first(&self, boxes: &Boxes, rays: &[usize; LANES]) -> ([usize; LANES], usize) {
        let (mut near_first, mut kept) = ([0; LANES], 0);
        let mut keys = [0.0; LANES];
        for lane in 0..LANES {
            if rays[lane] > 0 {
                keys[lane] = (0..3).map(|k| self.along[k] * (boxes.lo[k][lane] + boxes.hi[k][lane])).sum();
                near_first[kept] = lane;
                kept += 1;
            }
        }
        near_first[..kept].sort_unstable_by(|&one, &other| keys[one].total_cmp(&keys[other]));
        (near_first, kept)
    }
}
