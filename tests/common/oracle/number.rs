//! The oracle's exact numbers: dyadic rationals m 2^x, quotients of two of them, and the correctly
//! rounded f32 of such a quotient.
//!
//! Every finite float is m 2^x with an integer m. Sums, differences and products of such numbers are
//! such numbers again, so that nothing is ever rounded, except by [`round_t`] and
//! [`Dyadic::rounded_to`], which round once, to nearest, ties to even.
//!
//! Based on: IEEE 754-2019, sections 3.4 (formats) and 4.3.1 (roundTiesToEven).

use std::cmp::Ordering;

use num_bigint::{BigInt, Sign};

/// An integer type in which the oracle computes.
pub trait Whole: Clone {
    /// mantissa * 2^shift.
    fn from_shifted(mantissa: i64, shift: usize) -> Self;
    /// The exact sum.
    fn plus(&self, other: &Self) -> Self;
    /// The exact difference.
    fn minus(&self, other: &Self) -> Self;
    /// The exact product.
    fn times(&self, other: &Self) -> Self;
    /// -1, 0 or 1.
    fn sign(&self) -> i32;
    /// The same integer, whatever its size.
    fn into_big(self) -> BigInt;
}

impl Whole for i128 {
    fn from_shifted(mantissa: i64, shift: usize) -> Self {
        Self::from(mantissa) << shift
    }
    fn plus(&self, other: &Self) -> Self {
        self + other
    }
    fn minus(&self, other: &Self) -> Self {
        self - other
    }
    fn times(&self, other: &Self) -> Self {
        self * other
    }
    fn sign(&self) -> i32 {
        i32::from(*self > 0) - i32::from(*self < 0)
    }
    fn into_big(self) -> BigInt {
        BigInt::from(self)
    }
}

impl Whole for BigInt {
    fn from_shifted(mantissa: i64, shift: usize) -> Self {
        Self::from(mantissa) << shift
    }
    fn plus(&self, other: &Self) -> Self {
        self + other
    }
    fn minus(&self, other: &Self) -> Self {
        self - other
    }
    fn times(&self, other: &Self) -> Self {
        self * other
    }
    fn sign(&self) -> i32 {
        match BigInt::sign(self) {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }
    fn into_big(self) -> BigInt {
        self
    }
}

/// x = mantissa * 2^exponent with an odd mantissa, or (0, 0). Panics unless x is finite.
fn split(x: f64) -> (i64, i64) {
    assert!(x.is_finite(), "not a number of the specification: {x}");
    let bits = x.to_bits();
    let field = i64::try_from((bits >> 52) & 0x7ff).expect("11 bits");
    let fraction = i64::try_from(bits & ((1 << 52) - 1)).expect("52 bits");
    // Subnormals have no hidden bit, and the exponent of the smallest normals.
    let magnitude = if field == 0 { fraction } else { fraction | 1 << 52 };
    if magnitude == 0 {
        return (0, 0);
    }
    let zeros = magnitude.trailing_zeros();
    let odd = magnitude >> zeros;
    let exponent = field.max(1) - 1075 + i64::from(zeros);
    (if x < 0.0 { -odd } else { odd }, exponent)
}

/// N floats over one common power of two: value = integer * 2^exponent.
pub struct Scaled<const N: usize> {
    parts: [(i64, i64); N],
    /// The common exponent.
    pub exponent: i64,
    /// Every integer is below 2^bits in size; 0 if all are zero.
    pub bits: usize,
}

impl<const N: usize> Scaled<N> {
    /// Scales finite numbers to integers with one exponent.
    pub fn new(values: [f64; N]) -> Self {
        let parts = values.map(split);
        let live = || parts.iter().filter(|(m, _)| *m != 0);
        let exponent = live().map(|&(_, x)| x).min().unwrap_or(0);
        let top = live().map(|&(m, x)| x + i64::from(m.unsigned_abs().ilog2()) + 1).max();
        let bits = usize::try_from(top.unwrap_or(exponent) - exponent).expect("top >= bottom");
        Self { parts, exponent, bits }
    }

    /// The integers. `T` must hold `bits` bits and a sign.
    pub fn integers<T: Whole>(&self) -> [T; N] {
        self.parts.map(|(m, x)| {
            let shift = if m == 0 { 0 } else { x - self.exponent };
            T::from_shifted(m, usize::try_from(shift).expect("the least exponent"))
        })
    }
}

/// mantissa * 2^exponent, not reduced.
#[derive(Clone, Debug)]
pub struct Dyadic {
    /// The integer m of m·2^x.
    pub mantissa: BigInt,
    /// The exponent x of m·2^x.
    pub exponent: i64,
}

impl Dyadic {
    /// The value of a finite number.
    pub fn from_f64(x: f64) -> Self {
        let (m, exponent) = split(x);
        Self { mantissa: BigInt::from(m), exponent }
    }

    /// The value of an integer.
    pub fn from_i64(n: i64) -> Self {
        Self { mantissa: BigInt::from(n), exponent: 0 }
    }

    /// The absolute value.
    pub fn abs(&self) -> Self {
        Self { mantissa: BigInt::from(self.mantissa.magnitude().clone()), ..*self }
    }

    /// The exact sum.
    pub fn plus(&self, other: &Self) -> Self {
        let (a, b, exponent) = self.aligned(other);
        Self { mantissa: a + b, exponent }
    }

    /// The exact product.
    pub fn times(&self, other: &Self) -> Self {
        Self { mantissa: &self.mantissa * &other.mantissa, exponent: self.exponent + other.exponent }
    }

    /// Compares the values exactly.
    pub fn compare(&self, other: &Self) -> Ordering {
        let (a, b, _) = self.aligned(other);
        a.cmp(&b)
    }

    /// Both mantissas over the smaller exponent.
    fn aligned(&self, other: &Self) -> (BigInt, BigInt, i64) {
        let exponent = self.exponent.min(other.exponent);
        let [a, b] = [self, other].map(|n| &n.mantissa << (n.exponent - exponent));
        (a, b, exponent)
    }

    /// The least n with self <= 2^n. Panics unless self > 0.
    pub fn ceil_log2(&self) -> i64 {
        assert!(self.mantissa > BigInt::ZERO, "the logarithm of {self:?}");
        // m <= 2^n iff m - 1 has at most n bits.
        self.exponent + bit_length(&(&self.mantissa - 1))
    }

    /// The multiple of 2^q nearest to self, ties to the even multiple.
    pub fn rounded_to(&self, q: i64) -> Self {
        if self.exponent >= q {
            return self.clone();
        }
        let unit = BigInt::from(1) << (q - self.exponent);
        Self { mantissa: nearest_even(&self.mantissa, &unit), exponent: q }
    }

    /// self as f64. Panics unless that is exact.
    pub fn exact_f64(&self) -> f64 {
        if self.mantissa == BigInt::ZERO {
            return 0.0;
        }
        let zeros = self.mantissa.trailing_zeros().expect("not zero");
        let odd = i64::try_from(&self.mantissa >> zeros).expect("at most 53 bits");
        let exponent = self.exponent + i64::try_from(zeros).expect("a small number");
        assert!(odd.unsigned_abs() >> 53 == 0, "more than 53 bits: {self:?}");
        // Two exact steps, since 2^exponent alone may be subnormal in f64 when self is not.
        let half = exponent / 2;
        let x = odd as f64 * power_of_two(half) * power_of_two(exponent - half);
        assert_eq!(split(x), (odd, exponent), "outside the range of f64: {self:?}");
        x
    }
}

/// numerator / denominator, denominator > 0.
#[derive(Clone, Debug)]
pub struct Quotient {
    /// What is divided.
    pub numerator: Dyadic,
    /// What divides; positive.
    pub denominator: Dyadic,
}

impl Quotient {
    /// numerator * 2^exponent / denominator, for a denominator that is not zero.
    pub fn new(numerator: BigInt, denominator: BigInt, exponent: i64) -> Self {
        let flip = BigInt::from(Whole::sign(&denominator));
        let numerator = Dyadic { mantissa: numerator * &flip, exponent };
        let denominator = Dyadic { mantissa: denominator * &flip, exponent: 0 };
        Self { numerator, denominator }
    }

    /// Compares the values exactly.
    pub fn compare(&self, other: &Self) -> Ordering {
        let left = self.numerator.times(&other.denominator);
        left.compare(&other.numerator.times(&self.denominator))
    }

    /// Compares the value with a finite number exactly.
    pub fn compare_f64(&self, x: f64) -> Ordering {
        self.numerator.compare(&Dyadic::from_f64(x).times(&self.denominator))
    }
}

/// numerator / denominator rounded to the nearest f32, ties to even, saturated to
/// [2^-149, f32::MAX]. Panics unless both are positive.
pub fn round_t(numerator: &Dyadic, denominator: &Dyadic) -> f32 {
    let (n, d) = (&numerator.mantissa, &denominator.mantissa);
    assert!(*n > BigInt::ZERO && *d > BigInt::ZERO, "t <= 0");
    let exponent = numerator.exponent - denominator.exponent;
    // n/d is in (2^(l-1), 2^(l+1)): its leading bit is 2^l or 2^(l-1).
    let l = bit_length(n) - bit_length(d);
    let leading = if (n << (-l).max(0)) >= (d << l.max(0)) { l } else { l - 1 };
    // The last bit of an f32 with that leading bit.
    let last = (leading + exponent - 23).max(-149);
    let shift = exponent - last;
    let units = nearest_even(&(n << shift.max(0)), &(d << (-shift).max(0)));
    // units <= 2^24, so that only a value of 2^128 or more does not fit.
    let value = if last <= 104 {
        i64::try_from(units).expect("24 bits") as f64 * power_of_two(last)
    } else {
        f64::INFINITY
    };
    // Exact, but for the saturation: `value` has 24 bits and is a multiple of 2^-149.
    value.clamp(power_of_two(-149), f64::from(f32::MAX)) as f32
}

/// n / d to the nearest integer, ties to even, for d > 0.
fn nearest_even(n: &BigInt, d: &BigInt) -> BigInt {
    let one = BigInt::from(1);
    // BigInt divides towards zero.
    let truncated = n / d;
    let floor = if &truncated * d > *n { truncated - &one } else { truncated };
    let twice_rest: BigInt = (n - &floor * d) << 1;
    match twice_rest.cmp(d) {
        Ordering::Less => floor,
        Ordering::Greater => floor + one,
        Ordering::Equal if floor.bit(0) => floor + one,
        Ordering::Equal => floor,
    }
}

/// The number of bits of |n|; 0 for 0.
fn bit_length(n: &BigInt) -> i64 {
    i64::try_from(n.bits()).expect("a small number")
}

/// 2^n as f64, for n in -1022..=1023.
fn power_of_two(n: i64) -> f64 {
    f64::from_bits(u64::try_from(1023 + n).expect("a normal exponent") << 52)
}
