//! The way of a beam through the implicit hierarchy of the objects.
//!
//! Sixteen boxes are compared with the beam at once: with its rectangle in u and v, with the third pair of sides of a
//! box's outline, s_j u − s_i v, and with how far rays begin and reach. Children stand in the order of their size, so
//! that large ones come first.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1.

use fearless_simd::prelude::*;

use crate::intersect::beam::closing::Beam;
use crate::intersect::beam::objects::NodeBoxes;
use crate::simd::lanes::{WIDTH, Wide};

/// More levels than four billion triangles have.
const LEVELS: usize = 12;

impl Beam<'_> {
    /// Closes the rays that something occludes.
    #[inline(always)]
    pub(crate) fn walk<S: Simd>(&mut self, simd: S) {
        let objects = self.query.objects;
        let fanouts = objects.fanouts.levels();
        // On each level the node, and its children that are left.
        let mut path = [(0_usize, 0_u64); LEVELS];
        path[0].1 = self.meeting(simd, &objects.levels[0][0]);
        let mut level = 0;
        loop {
            let (node, children) = &mut path[level];
            if *children == 0 {
                if level == 0 {
                    return;
                }
                level -= 1;
                continue;
            }
            let child = *node * fanouts[level] + children.trailing_zeros() as usize;
            *children &= *children - 1;
            if level + 1 == fanouts.len() {
                // In range: there are fewer runs than triangles.
                self.close_by(simd, child as u32, &objects.runs[child]);
                if self.count == 0 {
                    return;
                }
            } else {
                level += 1;
                path[level] = (child, self.meeting(simd, &objects.levels[level][child]));
            }
        }
    }

    /// The boxes that the beam may meet.
    #[inline(always)]
    fn meeting<S: Simd>(&mut self, simd: S, boxes: &NodeBoxes) -> u64 {
        self.stats.nodes += 1;
        self.stats.box_tests += WIDTH as u64;
        let direction = self.direction;
        let ([k, i, j], [s, t]) = (direction.axes, direction.slopes);
        let at = direction.load(simd, &boxes.middle);
        let middle = self.parcel.middle;
        let at = [at[0] - middle[k], at[1] - middle[i], at[2] - middle[j]];
        let half = direction.load(simd, &boxes.half);
        let [u, v] = direction.across(simd, at);
        let slack = self.query.slack;
        let (du, dv) = (u - self.middle[0], v - self.middle[1]);
        let (reach_u, reach_v) = (self.half[0] + slack, self.half[1] + slack);
        let hu = half[0].mul_add(Wide::splat(simd, s.abs()), half[1] + reach_u);
        let hv = half[0].mul_add(Wide::splat(simd, t.abs()), half[2] + reach_v);
        // A box spans s_j u − s_i v = s_j x_i − s_i x_j.
        let across = du * t - dv * s;
        let reach = reach_u * t.abs() + reach_v * s.abs() + slack;
        let width = half[1] * t.abs() + half[2] * s.abs() + reach;
        // How far the box lies along the rays, from where the first of them begins to where the last one ends.
        let ahead = at[0] * direction.turn;
        let begin = self.middle[2] * direction.turn - self.half[2] - slack;
        let mut meets = du.abs().simd_le(hu) & dv.abs().simd_le(hv) & across.abs().simd_le(width);
        meets &= (ahead + half[0]).simd_ge(begin);
        if direction.limit < f32::INFINITY {
            let end = self.middle[2] * direction.turn
                + self.half[2]
                + direction.limit * (1.0 + f32::EPSILON)
                + slack;
            meets &= (ahead - half[0]).simd_le(end);
        }
        meets.to_bitmask()
    }
}
