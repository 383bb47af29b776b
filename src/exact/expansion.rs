//! Exact arithmetic: a number as the unevaluated sum of f64 that do not overlap.
//!
//! Terms stand by growing magnitude and none is zero, so the last one has the sign of the sum. Sums and products are
//! exact as long as nothing overflows or underflows; the ranges at the door see to that (degree 6 stays in
//! [2⁻¹⁰³⁷, 2⁸⁴⁴]). This stage is rare: clarity before speed.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997 (Two-Sum, Two-Product, Grow-Expansion, Scale-Expansion, Compress); Theodorus Dekker, "A Floating-Point Technique
//! for Extending the Available Precision", 1971 (splitting).

use crate::exact::filter::Sign;

/// 2²⁷ + 1: splits 53 bits into two halves of 26.
const SPLITTER: f64 = 134_217_729.0;

/// An exact number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expansion(Vec<f64>);

impl Expansion {
    /// The number x.
    pub(crate) fn of(x: f64) -> Self {
        Self(if x == 0.0 { Vec::new() } else { vec![x] })
    }

    /// a − b.
    pub(crate) fn difference(a: f64, b: f64) -> Self {
        let (sum, tail) = two_sum(a, -b);
        Self([tail, sum].into_iter().filter(|&x| x != 0.0).collect())
    }

    /// The sign.
    pub(crate) fn sign(&self) -> Sign {
        Sign::of(self.0.last().copied().unwrap_or(0.0))
    }

    /// −x.
    pub(crate) fn negated(mut self) -> Self {
        self.0.iter_mut().for_each(|x| *x = -*x);
        self
    }

    /// x + y. O(mn) for m and n terms.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut sum = self.clone();
        for &term in &other.0 {
            sum.grow(term);
        }
        sum
    }

    /// x − y.
    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.plus(&other.clone().negated())
    }

    /// x·y.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self(Vec::new());
        for &factor in &other.0 {
            product = product.plus(&self.scaled(factor)).compressed();
        }
        product
    }

    /// x·f for one f64.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let mut product = Self(Vec::new());
        for &term in &self.0 {
            let (high, low) = two_product(term, factor);
            product.grow(low);
            product.grow(high);
        }
        product
    }

    /// Adds one f64.
    fn grow(&mut self, x: f64) {
        let mut carry = x;
        for term in &mut self.0 {
            (carry, *term) = two_sum(carry, *term);
        }
        self.0.push(carry);
        self.0.retain(|&term| term != 0.0);
    }

    /// The same number in as few terms as 53-bit pieces allow.
    fn compressed(self) -> Self {
        let mut terms = self.0;
        let Some(mut carry) = terms.pop() else {
            return Self(terms);
        };
        // Downwards: pull everything up into the leading term.
        let mut high_to_low = Vec::with_capacity(terms.len() + 1);
        for &term in terms.iter().rev() {
            let (sum, tail) = two_sum(carry, term);
            if tail == 0.0 {
                carry = sum;
            } else {
                high_to_low.push(sum);
                carry = tail;
            }
        }
        // Upwards: what was pushed out may still combine.
        terms.clear();
        for &term in high_to_low.iter().rev() {
            let (sum, tail) = two_sum(term, carry);
            if tail != 0.0 {
                terms.push(tail);
            }
            carry = sum;
        }
        if carry != 0.0 {
            terms.push(carry);
        }
        Self(terms)
    }
}

/// a + b as the rounded sum and its exact error.
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

/// a·b as the rounded product and its exact error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    (product, error)
}

/// x as a sum of two numbers of at most 26 bits.
fn split(x: f64) -> (f64, f64) {
    let scaled = SPLITTER * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

/// The exact determinant x·(y×z) of three exact vectors.
pub(crate) fn triple_product(x: &[Expansion; 3], y: &[Expansion; 3], z: &[Expansion; 3]) -> Expansion {
    let mut sum = Expansion::of(0.0);
    for (k, x) in x.iter().enumerate() {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let minor = y[i].times(&z[j]).minus(&y[j].times(&z[i]));
        sum = sum.plus(&x.times(&minor));
    }
    sum.compressed()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An interpreter takes its time.
    const ROUNDS: usize = if cfg!(miri) { 20 } else { 2_000 };

    /// Sums of products of small integers scaled far apart: i128 is the oracle.
    #[test]
    fn agrees_with_integers() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (i128::from(state >> 40) - (1 << 23)) << (state >> 20 & 15)
        };
        for _ in 0..ROUNDS {
            let [a, b, c, d] = [next(), next(), next(), next()];
            let [x, y, z, w] = [a, b, c, d].map(|i| Expansion::of(i as f64));
            let product = x.times(&y).minus(&z.times(&w));
            let integer = a * b - c * d;
            assert_eq!(product.sign(), Sign::of(integer.signum() as f64));
            // Leaves no remainder: subtracting the same number in 40-bit pieces gives zero.
            let pieces = [integer >> 40 << 40, integer & ((1 << 40) - 1)];
            let rest = pieces.iter().fold(product, |sum, &p| sum.minus(&Expansion::of(p as f64)));
            assert_eq!(rest.sign(), Sign::Zero, "{a} {b} {c} {d}");
        }
    }
}
