//! Determinants of f64, exactly: as integers of 64 bits on a common grid, or of any size that the inputs can need.
//!
//! **Short numbers.** Where coordinates have at most 15 bits on a common grid, and directions 18, f64 itself is exact: differences have 16
//! bits, their products of two 33 with a difference, and a triple product at most 51 or 53. Such are lattices: rooms on round numbers,
//! block worlds, symmetric machines, most of what coincides.
//!
//! **Small numbers.** Points whose coordinates are multiples of 2^(e − 61), where 2^e exceeds them all, become integers below 2⁶¹ in size, and so do
//! directions on a grid of their own. Differences are below 2⁶², their products of two below 2¹²⁵ with a difference, and triple
//! products below 3·2¹⁸⁷ < 2¹⁹¹: i64, i128 and 192 bits hold them, and no step rounds. That is enough for f32 coordinates that differ by a
//! factor of 2³⁷, and for most origins in f64. What does not fit goes to [`crate::exact::wide`].
//!
//! The sign does not depend on the grid. Where two numbers are compared, both come from one grid.
//!
//! Based on: Steven Fortune and Christopher Van Wyk, "Static Analysis Yields Efficient Exact Integer Arithmetic for
//! Computational Geometry", 1996.

use std::cmp::Ordering;

use glam::DVec3;

use crate::exact::expansion::{two_product, two_sum};
use crate::exact::filter::Sign;
use crate::exact::wide::{LIMB, Scaled, Wide, lowest_exponent, parts};

/// Integers of the first stage are below 2^this in size.
const SMALL_BITS: i32 = 61;

/// Bits of short numbers.
pub(crate) const SHORT_POINT: i32 = 15;
pub(crate) const SHORT_DIRECTION: i32 = 18;

/// Coordinates on a grid, and what differences and triple products of them are.
pub(crate) trait Number: Sized {
    /// A triple product.
    type Triple: Triple;

    /// x − y.
    fn minus(&self, other: &Self) -> Self;

    /// The sign of x·y − z·w.
    fn sign_of_minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Sign;

    /// x·y − z·w.
    fn minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Self::Triple;

    /// x·(y×z).
    fn triple(x: &[Self; 3], y: &[Self; 3], z: &[Self; 3]) -> Self::Triple;
}

/// A triple product.
pub(crate) trait Triple {
    fn sign(&self) -> Sign;

    /// |x·y| against |z·w|.
    fn compare_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Ordering;

    /// x·y − z·w for triple products x, z and triple products or minors y, w, rounded: it errs by no more than 8u of itself.
    fn difference_of_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Scaled;
}

/// a − b for three coordinates.
pub(crate) fn difference<N: Number>(a: &[N; 3], b: &[N; 3]) -> [N; 3] {
    [a[0].minus(&b[0]), a[1].minus(&b[1]), a[2].minus(&b[2])]
}

/// Points, if f64 is exact for them.
#[inline]
pub(crate) fn short_points<const N: usize>(points: &[DVec3; N]) -> Option<[[f64; 3]; N]> {
    numbers_are_short(points, SHORT_POINT).then(|| points.map(|p| p.to_array()))
}

/// A direction, if f64 is exact for it and such points.
#[inline]
pub(crate) fn short_direction(direction: DVec3) -> Option<[f64; 3]> {
    numbers_are_short(&[direction], SHORT_DIRECTION).then(|| direction.to_array())
}

/// One and a half times 2⁵² grid steps of 2^(1 − bits): a sum of a number below 2 with that is rounded to the grid.
#[inline]
pub(crate) const fn steps_of(bits: i32) -> f64 {
    1.5 * f64::from_bits(((53 - bits + 1023).unsigned_abs() as u64) << 52)
}

/// Whether all numbers have at most so many bits on a common grid.
#[inline]
pub(crate) fn numbers_are_short<const N: usize>(vectors: &[DVec3; N], bits: i32) -> bool {
    let greatest = vectors.iter().fold(DVec3::ZERO, |greatest, v| greatest.max(v.abs())).max_element();
    // 2^e ≤ greatest < 2^(e + 1); zero stays zero, and is short.
    let power = f64::from_bits(greatest.to_bits() & (0x7FF << 52));
    let steps = power * steps_of(bits);
    let rounded = |v: &DVec3| (*v + DVec3::splat(steps)) - DVec3::splat(steps);
    vectors.iter().fold(true, |short, v| short & (rounded(v) == *v))
}

/// Vectors as integers below 2⁶¹ on a common grid, and the exponent of its unit; `None` where there is no such grid.
#[inline]
pub(crate) fn small<const N: usize>(vectors: &[DVec3; N]) -> Option<([[i64; 3]; N], i32)> {
    let greatest = vectors.iter().fold(DVec3::ZERO, |greatest, v| greatest.max(v.abs())).max_element();
    // 2^e > greatest.
    let e = parts(greatest).map_or(0, |(_, exponent)| exponent + 53);
    // A power of two: every product is exact. Numbers in range leave it normal.
    let scale = f64::from_bits(u64::from((SMALL_BITS - e + 1023).unsigned_abs()) << 52);
    let (mut integers, mut exact) = ([[0; 3]; N], true);
    for (integers, vector) in integers.iter_mut().zip(vectors) {
        for (integer, x) in integers.iter_mut().zip(vector.to_array()) {
            let scaled = x * scale;
            // Below 2⁶¹, so the cast cuts off the fraction and no more.
            *integer = scaled as i64;
            exact &= *integer as f64 == scaled;
        }
    }
    exact.then_some((integers, e - SMALL_BITS))
}

/// Vectors as integers on a common grid, and the exponent of its unit.
#[cold]
pub(crate) fn wide<const N: usize>(vectors: &[DVec3; N]) -> ([[Wide; 3]; N], i32) {
    let lowest = lowest_exponent(vectors.iter().flat_map(|v| v.to_array()));
    (vectors.map(|v| v.to_array().map(|x| Wide::of(x, lowest))), lowest)
}

impl Number for i64 {
    type Triple = I192;

    #[inline]
    fn minus(&self, other: &Self) -> Self {
        self - other
    }

    #[inline]
    fn sign_of_minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Sign {
        Sign::of_order((i128::from(*x) * i128::from(*y)).cmp(&(i128::from(*z) * i128::from(*w))))
    }

    #[inline]
    fn minor(x: &Self, y: &Self, z: &Self, w: &Self) -> I192 {
        I192::of(i128::from(*x) * i128::from(*y) - i128::from(*z) * i128::from(*w))
    }

    #[inline]
    fn triple(x: &[Self; 3], y: &[Self; 3], z: &[Self; 3]) -> I192 {
        let minor =
            |i: usize, j: usize| i128::from(y[i]) * i128::from(z[j]) - i128::from(y[j]) * i128::from(z[i]);
        I192::product(minor(1, 2), x[0])
            .plus(I192::product(minor(2, 0), x[1]))
            .plus(I192::product(minor(0, 1), x[2]))
    }
}

impl Number for f64 {
    type Triple = Self;

    #[inline]
    fn minus(&self, other: &Self) -> Self {
        self - other
    }

    #[inline]
    fn sign_of_minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Sign {
        Sign::of(x * y - z * w)
    }

    #[inline]
    fn minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Self {
        x * y - z * w
    }

    #[inline]
    fn triple(x: &[Self; 3], y: &[Self; 3], z: &[Self; 3]) -> Self {
        let minor = |i: usize, j: usize| y[i] * z[j] - y[j] * z[i];
        x[0] * minor(1, 2) + x[1] * minor(2, 0) + x[2] * minor(0, 1)
    }
}

impl Triple for f64 {
    #[inline]
    fn sign(&self) -> Sign {
        Sign::of(*self)
    }

    #[inline]
    fn compare_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Ordering {
        // Rounding is monotonic and the tails are exact, so the first difference decides.
        let [one, other] = [(x, y), (z, w)].map(|(a, b)| two_product(a.abs(), b.abs()));
        one.partial_cmp(&other).unwrap_or(Ordering::Equal)
    }

    /// Products have at most 104 bits: tails are whole numbers of the unit below 2⁵², and so is what they add up to.
    #[inline]
    fn difference_of_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Scaled {
        let [(one, one_tail), (other, other_tail)] = [two_product(*x, *y), two_product(*z, *w)];
        let (high, low) = two_sum(one, -other);
        Scaled { value: high + (low + (one_tail - other_tail)), exponent: 0 }
    }
}

impl Number for Wide {
    type Triple = Self;

    fn minus(&self, other: &Self) -> Self {
        Self::minus(self, other)
    }

    fn sign_of_minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Sign {
        x.times(y).minus(&z.times(w)).sign()
    }

    fn minor(x: &Self, y: &Self, z: &Self, w: &Self) -> Self {
        x.times(y).minus(&z.times(w))
    }

    fn triple(x: &[Self; 3], y: &[Self; 3], z: &[Self; 3]) -> Self {
        let term = |k: usize, i: usize, j: usize| x[k].times(&y[i].times(&z[j]).minus(&y[j].times(&z[i])));
        term(0, 1, 2).plus(&term(1, 2, 0)).plus(&term(2, 0, 1))
    }
}

impl From<I192> for Wide {
    fn from(x: I192) -> Self {
        Self::of_limbs(x.limbs())
    }
}

impl Triple for Wide {
    fn sign(&self) -> Sign {
        Self::sign(self)
    }

    fn compare_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Ordering {
        x.times(y).compare_sizes(&z.times(w))
    }

    fn difference_of_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Scaled {
        x.times(y).minus(&z.times(w)).scaled()
    }
}

/// An integer of 192 bits: high·2⁶⁴ + low.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct I192 {
    high: i128,
    low: u64,
}

impl I192 {
    /// The number m.
    #[inline]
    fn of(m: i128) -> Self {
        Self { high: m >> u64::BITS, low: m as u64 }
    }

    /// m·x for |m·x| < 2¹⁹¹.
    #[inline]
    fn product(m: i128, x: i64) -> Self {
        let (low, high) = (m as u64, m >> u64::BITS);
        // The low part is below 2⁶⁴·2⁶³, the high one below 2⁶³·2⁶³.
        let (low, high) = (i128::from(low) * i128::from(x), high * i128::from(x));
        Self { high: high + (low >> u64::BITS), low: low as u64 }
    }

    #[inline]
    fn plus(self, other: Self) -> Self {
        let (low, carry) = self.low.overflowing_add(other.low);
        Self { high: self.high + other.high + i128::from(carry), low }
    }

    /// The magnitude, least significant limb first.
    #[inline]
    fn limbs(&self) -> [u64; 3] {
        let (high, low) = match (self.high < 0, self.low) {
            (false, low) => (self.high, low),
            (true, 0) => (-self.high, 0),
            (true, low) => (!self.high, low.wrapping_neg()),
        };
        [low, high as u64, (high >> u64::BITS) as u64]
    }
}

impl Triple for I192 {
    #[inline]
    fn sign(&self) -> Sign {
        match self.high.cmp(&0) {
            Ordering::Equal if self.low != 0 => Sign::Positive,
            order => Sign::of_order(order),
        }
    }

    #[inline]
    fn compare_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Ordering {
        let [one, other] = [(x, y), (z, w)].map(|(a, b)| product(a.limbs(), b.limbs()));
        one.iter().rev().cmp(other.iter().rev())
    }

    /// Below 2³⁸³, so that f64 holds it.
    #[inline]
    fn difference_of_products(x: &Self, y: &Self, z: &Self, w: &Self) -> Scaled {
        let [one, other] = [(x, y), (z, w)].map(|(a, b)| product(a.limbs(), b.limbs()));
        let [of_one, of_other] = [(x, y), (z, w)].map(|(a, b)| (a.high < 0) != (b.high < 0));
        let (limbs, negative) = if of_one == of_other {
            match one.iter().rev().cmp(other.iter().rev()) {
                Ordering::Less => (subtracted(other, one), !of_one),
                _ => (subtracted(one, other), of_one),
            }
        } else {
            (added(one, other), of_one)
        };
        let size = limbs.iter().rev().fold(0.0, |size, &limb| size * LIMB + limb as f64);
        Scaled { value: if negative { -size } else { size }, exponent: 0 }
    }
}

/// The difference of two magnitudes, of which the first is no smaller.
#[inline]
fn subtracted(x: [u64; 6], y: [u64; 6]) -> [u64; 6] {
    let mut borrow = false;
    std::array::from_fn(|k| {
        let (partial, one) = x[k].overflowing_sub(y[k]);
        let (limb, two) = partial.overflowing_sub(u64::from(borrow));
        borrow = one | two;
        limb
    })
}

/// The sum of two magnitudes below 2³⁸³.
#[inline]
fn added(x: [u64; 6], y: [u64; 6]) -> [u64; 6] {
    let mut carry = false;
    std::array::from_fn(|k| {
        let (partial, one) = x[k].overflowing_add(y[k]);
        let (limb, two) = partial.overflowing_add(u64::from(carry));
        carry = one | two;
        limb
    })
}

/// The product of two magnitudes below 2¹⁹².
#[inline]
fn product(x: [u64; 3], y: [u64; 3]) -> [u64; 6] {
    let mut product = [0; 6];
    for (place, x) in x.into_iter().enumerate() {
        let mut carry = 0;
        for (other, y) in y.into_iter().enumerate() {
            // At most (2⁶⁴ − 1)² + 2(2⁶⁴ − 1) = 2¹²⁸ − 1.
            let sum = u128::from(x) * u128::from(y) + u128::from(product[place + other]) + u128::from(carry);
            (product[place + other], carry) = (sum as u64, (sum >> u64::BITS) as u64);
        }
        product[place + 3] = carry;
    }
    product
}
