//! What sixteen triangles are to a beam: affine functions that are positive where they block a ray.
//!
//! Places (u, v) are those of [`crate::intersect::beam::direction`]; all coordinates count from the middle of the
//! parcel. For an edge w from x, with σ the sign of n = w_u(ab) w_v(ac) − w_v(ab) w_u(ac), which is d·N over d_k,
//!
//! e(p) = σ(w_u (v_p − v_x) − w_v (u_p − u_x)), f(p) = σ·sgn(d_k)·N·(a − p), g(p) = |n| T − f(p), N = (b − a)×(c − a):
//!
//! the ray meets the triangle iff all three e are positive and f is, and within its limit iff g is as well (x_k changes
//! by f/|n|, at most by T). None needs a division by n, so that triangles seen edge-on are no exception.
//!
//! # Errors
//!
//! With u = 2⁻²⁴, R the greatest coordinate of receivers, A that of a plus the sides m₁ = |b − a|∞ and m₂ = |c − a|∞, D
//! = A + R and slopes at most 1: a coordinate is rounded once, a slope once, u and v take a product and a sum. So (u,
//! v) of a vector of size m err by 6um, and those of a point by 6u of its coordinates; 8u for b and for c − b, which
//! are sums.
//!
//! An edge function with L = |w_u| + |w_v|, in units of uD: 4·6m from w (4·8m for c − b) ; 8L from places; 4L from the
//! constant; 2L from scaling; 16L from the value at the middle of a rectangle plus or minus what it changes to its
//! sides. Together 30L + 32m.
//!
//! The plane with M = |N_i| + |N_j| + |n|: components of N err by 8u m₁m₂, n by 42. In units of uD, 74 m₁m₂ from these,
//! and 30M from places, the constant, scaling and the value. Where there is a limit, D is A + R + T: that pays for n T
//! as well.
//!
//! Each function is divided by such a bound, [`EDGE`] and [`PLANE`] with room for terms in u², for 2⁻¹⁰⁰ that stands
//! for all that underflows, and for a rough reciprocal. More than 1 is certainly positive then, less than −1 certainly
//! negative. NaN is neither.
//!
//! Based on: Sven Woop, Carsten Benthin, Ingo Wald, "Watertight Ray/Triangle Intersection", 2013 (the shear); Nicholas
//! Higham, "Accuracy and Stability of Numerical Algorithms", 2002.

use fearless_simd::prelude::*;

use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::objects::Run;
use crate::simd::lanes::{WIDTH, Wide};

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

/// Functions c₀ + c₁u + c₂v of the three edges; c₀ + c₁u + c₂v + c₃x_k of the plane; and |n|T, for one triangle or
/// sixteen.
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

    /// Over boxes with some middles and half sides: the least value of the least function, and the least of the
    /// greatest values.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::distance::{Distance, within_interval};
    use crate::exact::filter::Sign;
    use crate::exact::predicates::{covers, facing};
    use crate::geometry::aabb::Aabb;
    use crate::geometry::ray::{Ray, Ties};
    use crate::geometry::triangles::Triangles;
    use crate::intersect::beam::objects::Scale;
    use crate::rays::hemisphere::RaySample;
    use crate::simd::isa::Isa;
    use crate::stats::Stats;
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;

    /// Numbers in [0, 1).
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 7_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// Sixteen triangles near some points and large or thin, sixteen points, and a direction through a corner or an
    /// edge.
    fn scene(next: &mut impl FnMut() -> f64, size: f64, shift: f64) -> (Vec<[f32; 3]>, Vec<[f32; 3]>, DVec3) {
        let mut corner = |spread: f64| {
            let p = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5) * spread * size;
            (p + DVec3::splat(shift)).to_array().map(|x| x as f32)
        };
        let points: Vec<[f32; 3]> = (0..WIDTH).map(|_| corner(0.02)).collect();
        let positions: Vec<[f32; 3]> = (0..3 * WIDTH).map(|k| corner([0.02, 1.0, 0.1][k / 16])).collect();
        let wide = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        let (a, b) = (wide(positions[0]), wide(positions[1]));
        let along = if next() < 0.5 { 0.0 } else { next() };
        (points.clone(), positions, a + (b - a) * along - wide(points[0]))
    }

    /// The values of all pairs, packet by packet of the points, and of boxes around the points.
    fn values(
        level: Level,
        direction: &Direction,
        run: &Run,
        points: &[[f32; 3]],
    ) -> ([[f32; WIDTH]; WIDTH], [[f32; WIDTH]; 2], u16) {
        let bounds = Aabb::of_points(points.iter().copied());
        let middle = [0, 1, 2].map(|k| bounds.lo[k] * 0.5 + bounds.hi[k] * 0.5);
        let at = [0, 1, 2].map(|k| std::array::from_fn::<f32, WIDTH, _>(|lane| points[lane][k] - middle[k]));
        let reach = at.iter().flatten().fold(0.0_f32, |reach, x| reach.max(x.abs()));
        let limited = direction.limit < f32::INFINITY;
        dispatch!(level, simd => {
            let set_up = SetUp::new(simd, direction, run, (middle, reach));
            let mut stored = [[0.0; WIDTH]; 14];
            set_up.functions.store(&mut stored);
            let [k, i, j] = direction.load(simd, &at);
            let [u, v] = direction.across(simd, [k, i, j]);
            let mut values = [[0.0; WIDTH]; WIDTH];
            let (mut lo, mut hi) = ([0.0; 3], [0.0; 3]);
            for (axis, x) in [u, v, k].into_iter().enumerate() {
                (lo[axis], hi[axis]) = (x.reduce_min(), x.reduce_max());
            }
            let slack = reach * (8.0 / (1 << 24) as f32);
            let middles = splat(simd, [0, 1, 2].map(|k| (lo[k] + hi[k]) * 0.5));
            let halves = splat(simd, [0, 1, 2].map(|k| (hi[k] - lo[k]) * 0.5 + slack));
            let [least, most] = set_up.functions.extremes(limited, &middles, &halves);
            for (lane, values) in values.iter_mut().enumerate() {
                Functions::of_one(simd, &stored, lane).least(limited, u, v, k).store_slice(values);
            }
            (values, [least.to_array(), most.to_array()], set_up.away & !set_up.edge_on)
        })
    }

    #[test]
    fn what_is_certain_is_true() {
        let mut next = numbers();
        let (mut certain, mut total) = (0, 0);
        for isa in [Isa::Auto, Isa::Sse2] {
            let Ok(level) = isa.level() else { continue };
            for round in 0..3_000 {
                let (size, shift) =
                    [(1.0, 0.0), (1e-20, 0.0), (1e20, 0.0), (1.0, 1e5), (1.0, 0.3)][round % 5];
                let (points, positions, direction) = scene(&mut next, size, shift);
                if direction == DVec3::ZERO {
                    continue;
                }
                let indices: Vec<[u32; 3]> = (0..16).map(|k| [k, k + 16, k + 32]).collect();
                let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
                let scale = Scale::of(&Aabb::of_points(positions.iter().chain(&points).copied()));
                let t_max = if round % 3 == 0 { 1.0 + next() as f32 } else { f32::INFINITY };
                let direction = Direction::new(0, RaySample { direction, t_min: 0.0, t_max }, scale);
                let ids = std::array::from_fn(|lane| lane as u32);
                let run = Run::of(&triangles, &ids, scale, |_| true);
                let scaled: Vec<[f32; 3]> = points.iter().map(|p| p.map(|x| scale.of_length(x))).collect();
                let (values, [least, most], away) = values(level, &direction, &run, &scaled);
                for (lane, values) in values.iter().enumerate() {
                    let triangle = triangles.triangle(lane as u32);
                    for (&value, &point) in values.iter().zip(&points) {
                        let origin = DVec3::from_array(point.map(f64::from));
                        let ray =
                            Ray { t_max: f64::from(t_max), ..Ray::new(origin, direction.sample.direction) };
                        let stats = &mut Stats::default();
                        let meets = covers(&ray, &triangle, Ties::Origin, stats)
                            && within_interval(&ray, &Distance::new(&ray, &triangle), stats);
                        assert!(
                            !(value > 1.0 || least[lane] > 1.0) || meets,
                            "{ray:?} misses {triangle:?}: {value}"
                        );
                        assert!(
                            !(value < -1.0 || most[lane] < -1.0) || !meets,
                            "{ray:?} meets {triangle:?}: {value}"
                        );
                        assert!(away >> lane & 1 == 0 || facing(ray.direction, &triangle) == Sign::Positive);
                        certain += u32::from(value.abs() > 1.0);
                        total += 1;
                    }
                }
            }
        }
        assert!(certain * 10 > total * 9, "{certain} of {total} pairs are certain");
    }
}
