//! Sums of a few f64, exactly: a number as the unevaluated sum of f64 that do not overlap.
//!
//! Terms stand by growing magnitude, so the last one that is not zero has the sign of the sum. Sums are exact as long as nothing
//! overflows, and products as long as nothing underflows either. A fixed number of terms is all that is ever asked for: determinants are
//! integers, see [`crate::exact::integer`].
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997 (Two-Sum, Two-Product, Grow-Expansion); Theodorus Dekker, "A Floating-Point Technique for Extending the Available
//! Precision", 1971 (splitting).

use crate::exact::filter::Sign;

/// 2²⁷ + 1: splits 53 bits into two halves of 26.
const SPLITTER: f64 = 134_217_729.0;

/// Three products, and two numbers more.
const TERMS: usize = 8;

/// An exact number: the sum of at most [`TERMS`] that were added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expansion {
    terms: [f64; TERMS],
    len: usize,
}

impl Expansion {
    /// The number x.
    pub(crate) fn of(x: f64) -> Self {
        let mut terms = [0.0; TERMS];
        terms[0] = x;
        Self { terms, len: 1 }
    }

    /// x + y.
    #[must_use]
    pub(crate) fn plus(mut self, y: f64) -> Self {
        let mut carry = y;
        for term in &mut self.terms[..self.len] {
            (carry, *term) = two_sum(carry, *term);
        }
        self.terms[self.len] = carry;
        self.len += 1;
        self
    }

    /// x + y·z.
    #[must_use]
    pub(crate) fn plus_product(self, y: f64, z: f64) -> Self {
        let (product, tail) = two_product(y, z);
        self.plus(tail).plus(product)
    }

    /// The sign.
    pub(crate) fn sign(&self) -> Sign {
        Sign::of(self.terms[..self.len].iter().rev().copied().find(|&term| term != 0.0).unwrap_or(0.0))
    }
}

/// a + b as the rounded sum and its exact error.
#[inline]
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

/// a·b as the rounded product and its exact error.
#[inline]
pub(crate) fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    (product, error)
}

/// x as a sum of two numbers of at most 26 bits.
#[inline]
fn split(x: f64) -> (f64, f64) {
    let scaled = SPLITTER * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An interpreter takes its time.
    const ROUNDS: usize = if cfg!(miri) { 20 } else { 2_000 };

    /// Sums of products of integers scaled far apart: i128 is the oracle.
    #[test]
    fn agrees_with_integers() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (i128::from(state >> 40) - (1 << 23)) << (state >> 20 & 15)
        };
        for _ in 0..ROUNDS {
            let [a, b, c, d] = [next(), next(), next(), next()];
            let [x, y, z, w] = [a, b, c, d].map(|i| i as f64);
            let sum = Expansion::of(0.0).plus_product(x, y).plus_product(-z, w);
            let integer = a * b - c * d;
            assert_eq!(sum.sign(), Sign::of(integer.signum() as f64));
            // Leaves no remainder: subtracting the same number in 40-bit pieces gives zero.
            let pieces = [integer >> 40 << 40, integer & ((1 << 40) - 1)];
            let rest = pieces.iter().fold(sum, |sum, &piece| sum.plus(-(piece as f64)));
            assert_eq!(rest.sign(), Sign::Zero, "{a} {b} {c} {d}");
        }
    }
}
