//! The oracle: which triangle a ray hits, in exact integer arithmetic, one triangle after the other.
//!
//! It shares no idea with the engine. There are no edge functions, no signs of edge normals and no
//! floating-point filters. A ray `o + t d` meets the plane of a triangle where
//! `o + t d = a + u (b - a) + v (c - a)`, three linear equations in `u, v, t`. Cramer's rule gives
//!
//! ```text
//! D = det(x, y, -d)    U = det(r, y, -d)    V = det(x, r, -d)    T = det(x, y, r)
//! x = b - a,  y = c - a,  r = o - a;   u = U/D,  v = V/D,  t = T/D,  W = D - U - V
//! ```
//!
//! and the ray hits iff `U, V, W, T` all have the sign of `D`. Where one of `U, V, W` is zero the ray
//! is really moved, by `(e, e^2, e^3)` with `e = 2^-K`, and the three are computed again: `d` moves if
//! the rays share a point, the start `o` if they share a direction. `U, V, W` are linear in what
//! moves and all else is an integer, so a coefficient is zero or at least 1 in size; none exceeds
//! `2^(K-1)`. Hence no term outweighs an earlier one, and every smaller `e` gives the same signs.
//! (Rays are scaled to integers first: a factor on `e, e^2, e^3` changes no sign either.)
//! `T` and `D` are those of the ray that was not moved.
//!
//! Every input is a dyadic rational `m 2^x`. Points get one common exponent, the direction another,
//! and the rest is integers: `i128` where a bound on the bits shows that all fits, else [`BigInt`].
//! Both run the same generic code. Before that, [`apart`] drops triangles strictly on one side of
//! one of three planes through the ray: this saves time and decides nothing else.
//!
//! Based on: H. Edelsbrunner and E. P. Muecke, "Simulation of simplicity: a technique to cope with
//! degenerate cases in geometric algorithms", 1990; G. Cramer's rule.

use std::cmp::Ordering;

use num_bigint::BigInt;

mod number;

pub use number::{Dyadic, Quotient, Scaled, Whole, round_t};

/// What moves by `(e, e^2, e^3)` when a ray meets an edge or a vertex exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ties {
    /// Rays share a point (w = 1): the direction moves.
    Direction,
    /// Rays share a direction (w = 0): the start point moves.
    Origin,
}

/// A ray as the specification gives it; every number is taken as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleRay {
    /// The start: o (w = 1) or p (w = 0).
    pub origin: [f64; 3],
    /// The direction: d (w = 1) or D (w = 0); not all zero.
    pub direction: [f64; 3],
    /// Hits have t > t_min, in units of |direction|; finite.
    pub t_min: f64,
    /// Hits have t < t_max, in units of |direction|; may be +inf.
    pub t_max: f64,
    /// Which perturbation decides ties.
    pub ties: Ties,
}

/// Whether the ray hits the triangle at some t > 0, whatever `t_min` and `t_max` say.
pub fn covers(tri: [[f32; 3]; 3], ray: &OracleRay) -> bool {
    hit(tri, ray).is_some()
}

/// The nearest hit with t_min < t < t_max: by exact t, then by id. Returns (id, rounded t).
pub fn closest(positions: &[[f32; 3]], triangles: &[[u32; 3]], ray: &OracleRay) -> Option<(u32, f32)> {
    let mut best: Option<(u32, Quotient)> = None;
    for (id, &triangle) in (0..).zip(triangles) {
        let Some(t) = hit_between(positions, triangle, ray) else {
            continue;
        };
        // Ids rise, so that only a strictly smaller t wins.
        if best.as_ref().is_none_or(|(_, b)| t.compare(b).is_lt()) {
            best = Some((id, t));
        }
    }
    best.map(|(id, t)| (id, round_t(&t.numerator, &t.denominator)))
}

/// Whether any triangle is hit with t_min < t < t_max.
pub fn any(positions: &[[f32; 3]], triangles: &[[u32; 3]], ray: &OracleRay) -> bool {
    let mut triangles = triangles.iter();
    triangles.any(|&triangle| hit_between(positions, triangle, ray).is_some())
}

/// The direction of pixel (i, j) of a grid film of a point (w = 1):
/// d = F + X R + Y U, X = 2i + 1 - W, Y = H - 1 - 2j, with F, R, U rounded to multiples of
/// q = 2^(ceil(log2 M) - 52), M = max_k(|F_k| + W |R_k| + H |U_k|), to nearest, ties to even.
///
/// # Panics
/// If F, R and U are all zero, or d is not exact in f64 (section 5 promises that it is).
pub fn grid_ray(f: [f64; 3], r: [f64; 3], u: [f64; 3], width: u32, height: u32, i: u32, j: u32) -> [f64; 3] {
    grid_point([f, r, u], [width, height], [i, j], i64::MIN)
}

/// The start p of pixel (i, j) of a grid film of a direction (w = 0): as [`grid_ray`], but q >= 2^-149.
pub fn grid_start(
    f: [f64; 3],
    r: [f64; 3],
    u: [f64; 3],
    width: u32,
    height: u32,
    i: u32,
    j: u32,
) -> [f64; 3] {
    grid_point([f, r, u], [width, height], [i, j], -149)
}

/// F + X R + Y U for [`grid_ray`] and [`grid_start`]; q is at least 2^`lowest`.
fn grid_point(fru: [[f64; 3]; 3], size: [u32; 2], pixel: [u32; 2], lowest: i64) -> [f64; 3] {
    let [f, r, u] = fru.map(|v| v.map(Dyadic::from_f64));
    let [w, h] = size.map(|n| Dyadic::from_i64(i64::from(n)));
    let reach = (0..3)
        .map(|k| f[k].abs().plus(&w.times(&r[k].abs())).plus(&h.times(&u[k].abs())))
        .max_by(Dyadic::compare)
        .expect("three axes");
    let q = lowest.max(reach.ceil_log2() - 52);
    let x = Dyadic::from_i64(2 * i64::from(pixel[0]) + 1 - i64::from(size[0]));
    let y = Dyadic::from_i64(i64::from(size[1]) - 1 - 2 * i64::from(pixel[1]));
    [0, 1, 2].map(|k| {
        let [f, r, u] = [&f[k], &r[k], &u[k]].map(|v| v.rounded_to(q));
        f.plus(&x.times(&r)).plus(&y.times(&u)).exact_f64()
    })
}

/// The exact t of a hit with t_min < t < t_max.
fn hit_between(positions: &[[f32; 3]], triangle: [u32; 3], ray: &OracleRay) -> Option<Quotient> {
    assert!(ray.t_min.is_finite() && !ray.t_max.is_nan(), "{ray:?}");
    let corner = |v: u32| positions[usize::try_from(v).expect("an index fits")];
    let t = hit(triangle.map(corner), ray)?;
    let above = t.compare_f64(ray.t_min) == Ordering::Greater;
    let below =
        ray.t_max == f64::INFINITY || ray.t_max.is_finite() && t.compare_f64(ray.t_max) == Ordering::Less;
    (above && below).then_some(t)
}

/// The exact t > 0 of the ray in the triangle, if it covers it.
fn hit(tri: [[f32; 3]; 3], ray: &OracleRay) -> Option<Quotient> {
    let [ox, oy, oz] = ray.origin;
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = tri.map(|p| p.map(f64::from));
    let points = Scaled::new([ox, oy, oz, ax, ay, az, bx, by, bz, cx, cy, cz]);
    let direction = Scaled::new(ray.direction);
    assert!(direction.bits > 0, "a ray without a direction: {ray:?}");
    // A difference of points has b + 1 bits, a sum of two or three products one or two more.
    let (b, d) = (points.bits + 1, direction.bits);
    if b + d < 126 && apart::<i128>(&points, &direction) {
        return None;
    }
    if 2 * b + d.max(b) + 5 < 127 {
        hit_in::<i128>(&points, &direction, ray.ties)
    } else {
        hit_in::<BigInt>(&points, &direction, ray.ties)
    }
}

/// Whether all corners are strictly on one side of a plane that contains the ray and an axis:
/// then the triangle is not covered, and a small enough shift of the ray changes nothing.
fn apart<T: Whole>(points: &Scaled<12>, direction: &Scaled<3>) -> bool {
    let [o, corners @ ..] = triples(&points.integers::<T>());
    let d: [T; 3] = direction.integers();
    [(1, 2), (2, 0), (0, 1)].iter().any(|&(i, j)| {
        let [a, b, c] = corners.each_ref().map(|v| {
            let [vi, vj] = [v[i].minus(&o[i]), v[j].minus(&o[j])];
            d[i].times(&vj).minus(&d[j].times(&vi)).sign()
        });
        a != 0 && a == b && b == c
    })
}

/// [`hit`] in the integers `T`, which must be wide enough (see there).
pub fn hit_in<T: Whole>(points: &Scaled<12>, direction: &Scaled<3>, ties: Ties) -> Option<Quotient> {
    let corners = triples(&points.integers::<T>());
    let d: [T; 3] = direction.integers();
    let [o, a, b, c] = &corners;
    let (x, y, r) = (difference(b, a), difference(c, a), difference(o, a));
    let minus_d = d.each_ref().map(|k| T::from_shifted(0, 0).minus(k));
    let distance = determinant(&x, &y, &r);
    let denominator = determinant(&x, &y, &minus_d);
    // Seen edge-on, or degenerate.
    let dropped = match ties {
        Ties::Direction => distance.sign() == 0,
        Ties::Origin => denominator.sign() == 0,
    };
    // t > 0, strictly; a zero denominator leaves no sign to agree with.
    let side = denominator.sign();
    if dropped || side == 0 || distance.sign() != side {
        return None;
    }
    let signs = weights(&corners, &d).map(|w| w.sign());
    if signs.contains(&-side) {
        return None;
    }
    if signs.contains(&0) && moved_signs(points, direction, ties) != [side; 3] {
        return None;
    }
    // The points' unit is to the third power in T, and to the second in D.
    let unit = points.exponent - direction.exponent;
    Some(Quotient::new(distance.into_big(), denominator.into_big(), unit))
}

/// The numerators [U, V, W] of the weights of b, c and a.
fn weights<T: Whole>([o, a, b, c]: &[[T; 3]; 4], d: &[T; 3]) -> [T; 3] {
    let (x, y, r) = (difference(b, a), difference(c, a), difference(o, a));
    let minus_d = d.each_ref().map(|k| T::from_shifted(0, 0).minus(k));
    let u = determinant(&r, &y, &minus_d);
    let v = determinant(&x, &r, &minus_d);
    let w = determinant(&x, &y, &minus_d).minus(&u).minus(&v);
    [u, v, w]
}

/// The signs of [U, V, W] after the move by (e, e^2, e^3), e = 2^-K, all multiplied by 2^3K.
fn moved_signs(points: &Scaled<12>, direction: &Scaled<3>, ties: Ties) -> [i32; 3] {
    let mut corners = triples(&points.integers::<BigInt>());
    let mut d: [BigInt; 3] = direction.integers();
    // A coefficient of U or V is a minor of two differences, or of one and d; W adds three of them.
    let k = 2 * (points.bits + direction.bits) + 8;
    let shift = [2 * k, k, 0].map(|n| BigInt::from(1) << n);
    let scale = |v: &mut [BigInt; 3]| v.iter_mut().for_each(|n| *n <<= 3 * k);
    let target = match ties {
        Ties::Direction => {
            scale(&mut d);
            &mut d
        }
        Ties::Origin => {
            corners.iter_mut().for_each(scale);
            &mut corners[0]
        }
    };
    target.iter_mut().zip(shift).for_each(|(n, s)| *n += s);
    weights(&corners, &d).map(|w| Whole::sign(&w))
}

/// Four points from twelve coordinates.
fn triples<T: Clone>(n: &[T; 12]) -> [[T; 3]; 4] {
    [0, 3, 6, 9].map(|i| [n[i].clone(), n[i + 1].clone(), n[i + 2].clone()])
}

fn difference<T: Whole>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [0, 1, 2].map(|k| a[k].minus(&b[k]))
}

/// The determinant of the matrix with columns a, b, c.
fn determinant<T: Whole>(a: &[T; 3], b: &[T; 3], c: &[T; 3]) -> T {
    let minor = |i: usize, j: usize| b[i].times(&c[j]).minus(&b[j].times(&c[i]));
    let [x, y, z] = [(0, 1, 2), (1, 2, 0), (2, 0, 1)].map(|(k, i, j)| a[k].times(&minor(i, j)));
    x.plus(&y).plus(&z)
}
