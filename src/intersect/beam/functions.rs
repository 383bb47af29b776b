//! What sixteen triangles are to a beam: affine functions that are positive where they block a ray.
//!
//! Places (u, v) are those of [`crate::intersect::beam::direction`]; all coordinates count from the middle of the parcel. For an edge w from x, with
//! σ the sign of n = w_u(ab) w_v(ac) − w_v(ab) w_u(ac), which is d·N over d_k,
//!
//! e(p) = σ(w_u (v_p − v_x) − w_v (u_p − u_x)), f(p) = σ·sgn(d_k)·N·(a − p), g(p) = |n| T − f(p), N = (b − a)×(c − a):
//!
//! the ray meets the triangle iff all three e are positive and f is, and within its limit iff g is as well (x_k changes by f/|n|, at most by T). None
//! needs a division by n, so that triangles seen edge-on are no exception.
//!
//! # Errors
//!
//! With u = 2⁻²⁴, R the greatest coordinate of receivers, A that of a plus the sides m₁ = |b − a|∞ and m₂ = |c − a|∞, D = A + R and slopes at most
//! 1: a coordinate is rounded once, a slope once, u and v take a product and a sum. So (u, v) of a vector of size m err by 6um, and those of a point by 6u
//! of its coordinates; 8u for b and for c − b, which are sums.
//!
//! An edge function with L = |w_u| + |w_v|, in units of uD: 4·6m from w (4·8m for c − b) ; 8L from places; 4L from the constant; 2L from
//! scaling; 16L from the value at the middle of a rectangle plus or minus what it changes to its sides. Together 30L + 32m.
//!
//! The plane with M = |N_i| + |N_j| + |n|: components of N err by 8u m₁m₂, n by 42. In units of uD, 74 m₁m₂ from these, and 30M from places, the constant,
//! scaling and the value. Where there is a limit, D is A + R + T: that pays for n T as well.
//!
//! Each function is divided by such a bound, [`EDGE`] and [`PLANE`] with room for terms in u², for 2⁻¹⁰⁰ that stands for all that underflows, and for a rough
//! reciprocal. More than 1 is certainly positive then, less than −1 certainly negative. NaN is neither.
//!
//! Based on: Sven Woop, Carsten Benthin, Ingo Wald, "Watertight Ray/Triangle Intersection", 2013 (the shear); Nicholas Higham, "Accuracy and
//! Stability of Numerical Algorithms", 2002.

use fearless_simd::prelude::*;

use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::objects::Run;
use crate::intersect::beam::{WIDTH, Wide};

const U: f32 = 1.0 / (1 << 24) as f32;
/// Errors of edge functions, in uD: by L and by m.
const EDGE: [f32; 2] = [32.0 * U, 34.0 * U];
/// Errors of the plane, in uD: by M and by m₁m₂.
const PLANE: [f32; 2] = [32.0 * U, 80.0 * U];
/// |n| is certain beyond this times m₁m₂.
const FACING: f32 = 48.0 * U;
/// 2⁻¹⁰⁰.
const UNDERFLOW: f32 = f32::from_bits((127 - 100) << 23);
/// Reciprocals err by less than 2⁻⁸: with this factor none is too large.
const BELOW: f32 = 1.0 - 1.0 / 128.0;

/// Functions c₀ + c₁u + c₂v of the three edges; c₀ + c₁u + c₂v + c₃x_k of the plane; and |n|T, for one triangle or sixteen.
#[derive(Clone, Copy)]
pub(crate) struct Functions<S: Simd> {
    pub(crate) edges: [[Wide<S>; 3]; 3],
    pub(crate) plane: [Wide<S>; 4],
    pub(crate) limit: Wide<S>,
}

/// Their coefficients in memory.
pub(crate) type Coefficients = [[f32; WIDTH]; 14];

/// Sixteen triangles.
pub(crate) struct SetUp<S: Simd> {
    pub(crate) functions: Functions<S>,
    /// The rectangles around them: the least and the greatest u, and v.
    pub(crate) sides: [[Wide<S>; 2]; 2],
    /// Triangles with d·N > 0, and those of which that is not certain.
    pub(crate) away: u16,
    pub(crate) edge_on: u16,
}

/// The largest component of sixteen vectors.
#[inline(always)]
fn size<S: Simd>([x, y, z]: [Wide<S>; 3]) -> Wide<S> {
    x.abs().max(y.abs()).max(z.abs())
}

impl<S: Simd> SetUp<S> {
    /// Of a run, seen from the middle of receivers with some reach.
    #[inline(always)]
    pub(crate) fn new(simd: S, direction: &Direction, run: &Run, (middle, reach): ([f32; 3], f32)) -> Self {
        let [k, i, j] = direction.axes;
        let [ak, ai, aj] = direction.load(simd, &run.a);
        let a = [ak - middle[k], ai - middle[i], aj - middle[j]];
        let (ab, ac) = (direction.load(simd, &run.ab), direction.load(simd, &run.ac));
        let (m1, m2) = (size(ab), size(ac));
        let mut around = size(a) + m1 + m2 + reach;
        if direction.limit < f32::INFINITY {
            around += direction.limit;
        }
        let [ua, va] = direction.across(simd, a);
        let [u1, v1] = direction.across(simd, ab);
        let [u2, v2] = direction.across(simd, ac);
        // N in the order i, j, k, and n.
        let ni = ab[2].mul_sub(ac[0], ab[0] * ac[2]);
        let nj = ab[0].mul_sub(ac[1], ab[1] * ac[0]);
        let nk = ab[1].mul_sub(ac[2], ab[2] * ac[1]);
        let [s, t] = direction.slopes;
        let n = nk - ni * s - nj * t;
        let one = Wide::splat(simd, 1.0);
        let sign = n.simd_lt(0.0).select(-one, one);
        let (ub, vb) = (ua + u1, va + v1);
        let (uc, vc) = (ua + u2, va + v2);
        let edges = [
            edge(sign, around, [ua, va], [u1, v1], m1),
            edge(sign, around, [ub, vb], [u2 - u1, v2 - v1], m1 + m2),
            edge(sign, around, [ua, va], [-u2, -v2], m2),
        ];
        let areas = m1 * m2;
        let sum = ni.abs() + nj.abs() + n.abs();
        let bound = (sum * PLANE[0] + areas * PLANE[1]) * around + UNDERFLOW;
        let scale = bound.approximate_recip() * BELOW;
        let limit = if direction.limit < f32::INFINITY { n.abs() * scale * direction.limit } else { one };
        let scale = scale * sign * direction.turn;
        let constant = n.mul_add(a[0], nj.mul_add(va, ni * ua));
        let plane = [constant * scale, -(ni * scale), -(nj * scale), -(n * scale)];
        let flips = if direction.turn < 0.0 { !0 } else { 0 };
        Self {
            functions: Functions { edges, plane, limit },
            sides: [[ua.min(ub).min(uc), ua.max(ub).max(uc)], [va.min(vb).min(vc), va.max(vb).max(vc)]],
            // In range: sixteen bits. NaN is not certain.
            away: n.simd_gt(0.0).to_bitmask() as u16 ^ flips,
            edge_on: !(n.abs().simd_gt(areas * FACING + UNDERFLOW).to_bitmask() as u16),
        }
    }
}

/// The function of an edge w from x, of a vector of some size.
#[inline(always)]
fn edge<S: Simd>(
    sign: Wide<S>,
    around: Wide<S>,
    [ux, vx]: [Wide<S>; 2],
    [uw, vw]: [Wide<S>; 2],
    size: Wide<S>,
) -> [Wide<S>; 3] {
    let bound = ((uw.abs() + vw.abs()) * EDGE[0] + size * EDGE[1]) * around + UNDERFLOW;
    let scale = bound.approximate_recip() * BELOW * sign;
    [vw.mul_sub(ux, uw * vx) * scale, -(vw * scale), uw * scale]
}

impl<S: Simd> Functions<S> {
    /// Writes their coefficients.
    #[inline(always)]
    pub(crate) fn store(&self, coefficients: &mut Coefficients) {
        let [e, f, g] = self.edges;
        let [p, q, r, s] = self.plane;
        let all = [e[0], e[1], e[2], f[0], f[1], f[2], g[0], g[1], g[2], p, q, r, s, self.limit];
        for (stored, coefficient) in coefficients.iter_mut().zip(all) {
            coefficient.store_slice(stored);
        }
    }

    /// Those of one triangle.
    #[inline(always)]
    pub(crate) fn of_one(simd: S, coefficients: &Coefficients, lane: usize) -> Self {
        let lane = lane % WIDTH;
        let edge = |first: usize| [0, 1, 2].map(|k| coefficients[first + k][lane]);
        let [e, f, g] = [edge(0), edge(3), edge(6)];
        let (rest, limit) = (edge(10), coefficients[13][lane]);
        let plane = Wide::splat(simd, coefficients[9][lane]);
        let [q, r, s] = splat(simd, rest);
        Self {
            edges: [splat(simd, e), splat(simd, f), splat(simd, g)],
            plane: [plane, q, r, s],
            limit: Wide::splat(simd, limit),
        }
    }

    /// The least of all functions, at sixteen points or for sixteen triangles.
    #[inline(always)]
    pub(crate) fn least(&self, limited: bool, u: Wide<S>, v: Wide<S>, k: Wide<S>) -> Wide<S> {
        let [e, f, g] = self.edges;
        let plane = self.at_plane(u, v, k);
        let least = value(e, u, v).min(value(f, u, v)).min(value(g, u, v).min(plane));
        if limited { least.min(self.limit - plane) } else { least }
    }

    /// Over boxes with some middles and half sides: the least value of the least function, and the least of the greatest values.
    #[inline(always)]
    pub(crate) fn extremes(&self, limited: bool, middle: &[Wide<S>; 3], half: &[Wide<S>; 3]) -> [Wide<S>; 2] {
        let [u, v, k] = *middle;
        let [e, f, g] = self.edges;
        let (x, y, z) = (value(e, u, v), value(f, u, v), value(g, u, v));
        let (dx, dy, dz) = (change(e, half), change(f, half), change(g, half));
        let plane = self.at_plane(u, v, k);
        let [_, q, r, s] = self.plane;
        let change = q.abs().mul_add(half[0], r.abs().mul_add(half[1], s.abs() * half[2]));
        let least = (x - dx).min(y - dy).min(z - dz).min(plane - change);
        let most = (x + dx).min(y + dy).min(z + dz).min(plane + change);
        if limited {
            let left = self.limit - plane;
            [least.min(left - change), most.min(left + change)]
        } else {
            [least, most]
        }
    }

    #[inline(always)]
    fn at_plane(&self, u: Wide<S>, v: Wide<S>, k: Wide<S>) -> Wide<S> {
        let [p, q, r, s] = self.plane;
        q.mul_add(u, r.mul_add(v, s.mul_add(k, p)))
    }
}

/// An edge function.
#[inline(always)]
fn value<S: Simd>([c, cu, cv]: [Wide<S>; 3], u: Wide<S>, v: Wide<S>) -> Wide<S> {
    cu.mul_add(u, cv.mul_add(v, c))
}

/// How much it changes from the middle of a rectangle to its sides.
#[inline(always)]
fn change<S: Simd>([_, cu, cv]: [Wide<S>; 3], half: &[Wide<S>; 3]) -> Wide<S> {
    cu.abs().mul_add(half[0], cv.abs() * half[1])
}

/// Three numbers, sixteen times each.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [Wide<S>; 3] {
    [Wide::splat(simd, x), Wide::splat(simd, y), Wide::splat(simd, z)]
}
