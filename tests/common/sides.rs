//! Sides of planes and blocked segments in the oracle's integers: nothing here is rounded, and nothing is the engine's.
//!
//! The side of p is the sign of (b − a)×(c − a)·(p − a), all four over one common power of two. A segment l → p is blocked
//! by a triangle iff l and p are strictly on opposite sides of its plane, and the three determinants of d with two corners
//! seen from l agree, where d is p − l moved by (e, e², e³), e = 2⁻ᴷ: too small to outweigh any that is not zero.
//!
//! Based on: section 5 of the design; Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990.

use num_bigint::BigInt;
use umbel::glam::DVec3;

use crate::oracle::{Scaled, Whole};

/// The side of p: 1 where the normal points to, −1 behind, 0 on the plane.
pub fn side([a, b, c]: [DVec3; 3], p: DVec3) -> i32 {
    let scaled = scaled([a, b, c, p]);
    // A determinant of differences of b + 1 bits has 3(b + 1) + 3.
    if 3 * scaled.bits + 6 < 127 { side_in::<i128>(&scaled) } else { side_in::<BigInt>(&scaled) }
}

/// The side that a direction leaves to: the sign of (b − a)×(c − a)·d.
pub fn facing([a, b, c]: [DVec3; 3], d: DVec3) -> i32 {
    let [a, b, c, _] = points::<BigInt, _, _>(&scaled([a, b, c, a]));
    determinant(&minus(&b, &a), &minus(&c, &a), &Scaled::new(d.to_array()).integers())
}

/// Whether the corners lie on one line.
pub fn is_flat([a, b, c]: [DVec3; 3]) -> bool {
    DVec3::AXES.iter().all(|&d| facing([a, b, c], d) == 0)
}

/// Whether any triangle but `receiver` blocks the open segment from `from` to `to`.
pub fn segment_blocked(
    triangles: impl IntoIterator<Item = [DVec3; 3]>,
    receiver: Option<u32>,
    [from, to]: [DVec3; 2],
) -> bool {
    let others = (0..).zip(triangles).filter(|&(id, _)| receiver != Some(id));
    others.into_iter().any(|(_, corners)| is_blocked_by(corners, from, to))
}

/// Whether one triangle blocks the segment.
fn is_blocked_by(corners: [DVec3; 3], from: DVec3, to: DVec3) -> bool {
    let sides = [from, to].map(|p| side(corners, p));
    sides[0] * sides[1] == -1 && line_meets(corners, from, to)
}

/// Whether the line from `from` to just beside `to` passes between the three edges.
fn line_meets([a, b, c]: [DVec3; 3], from: DVec3, to: DVec3) -> bool {
    let scaled = Scaled::<15>::new(flat([a, b, c, from, to]));
    let [a, b, c, l, p] = points::<BigInt, _, _>(&scaled);
    // Coefficients of the shift are below 2^(2 bits + 3).
    let k = 2 * scaled.bits + 8;
    let shift = [2 * k, k, 0].map(|n| BigInt::from(1) << n);
    let mut d = minus(&p, &l);
    d.iter_mut().zip(shift).for_each(|(n, s)| *n = (&*n << (3 * k)) + s);
    let [a, b, c] = [a, b, c].map(|p| minus(&p, &l));
    let signs = [(&a, &b), (&b, &c), (&c, &a)].map(|(a, b)| determinant(&d, a, b));
    signs == [1; 3] || signs == [-1; 3]
}

fn side_in<T: Whole>(scaled: &Scaled<12>) -> i32 {
    let [a, b, c, p] = points::<T, _, _>(scaled);
    determinant(&minus(&b, &a), &minus(&c, &a), &minus(&p, &a))
}

fn scaled(points: [DVec3; 4]) -> Scaled<12> {
    Scaled::new(flat(points))
}

/// The coordinates of N points in a row; M = 3N.
fn flat<const N: usize, const M: usize>(points: [DVec3; N]) -> [f64; M] {
    std::array::from_fn(|k| points[k / 3][k % 3])
}

/// The points of M = 3N coordinates.
fn points<T: Whole, const N: usize, const M: usize>(scaled: &Scaled<M>) -> [[T; 3]; N] {
    let n = scaled.integers::<T>();
    std::array::from_fn(|i| std::array::from_fn(|k| n[3 * i + k].clone()))
}

fn minus<T: Whole>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    std::array::from_fn(|k| a[k].minus(&b[k]))
}

/// The sign of the determinant of three columns.
fn determinant<T: Whole>(a: &[T; 3], b: &[T; 3], c: &[T; 3]) -> i32 {
    let term = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[k].times(&b[i].times(&c[j]).minus(&b[j].times(&c[i])))
    };
    term(0).plus(&term(1)).plus(&term(2)).sign()
}
