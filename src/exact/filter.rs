//! The f64 filter: values that know their error, so that most decisions need no exact arithmetic.
//!
//! Every decision of the engine is the sign of a triple product x·(y×z), or of a difference of products of two such.
//! With u = 2⁻⁵³ and factors that are exact or the rounded difference of exact numbers,
//!
//! |computed − true| ≤ γ·Σ|x_k|(|y_i z_j| + |y_j z_i|).
//!
//! Each term passes at most three roundings of differences, two of products, one of the inner subtraction and two of the
//! outer sum: 8 roundings. A factor may also be a sum (p − a) + (p − b); it then passes one more, and its magnitude in the
//! bound is |p − a| + |p − b|. With two such factors there are 10. The bound itself takes at most 7 roundings per term. Nothing underflows: factors
//! are 0 or at least 2⁻²⁹², and at most two f32-like factors meet one direction.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997; Nicholas Higham, "Accuracy and Stability of Numerical Algorithms", 2002 (γₙ = nu/(1 − nu)).

use std::cmp::Ordering;

use glam::DVec3;

use crate::geometry::aabb::U;

/// 10 roundings of the value, 7 of the bound: (1 + u)¹⁷ − 1 < 18u.
pub(crate) const TRIPLE_PRODUCT_ERROR: f64 = 18.0 * U;

/// Products of two triple products may be subnormal, where the relative bound does not hold: a few spacings of 2⁻¹⁰⁷⁴ more.
const UNDERFLOW: f64 = f64::from_bits(16);

/// The sign of a number that was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sign {
    Negative,
    Zero,
    Positive,
}

impl Sign {
    /// The sign of a number that is exact, or whose sign is.
    #[inline]
    pub(crate) fn of(x: f64) -> Self {
        if x > 0.0 {
            Self::Positive
        } else if x < 0.0 {
            Self::Negative
        } else {
            Self::Zero
        }
    }

    /// The sign of x − y, from their order.
    pub(crate) fn of_order(order: Ordering) -> Self {
        match order {
            Ordering::Less => Self::Negative,
            Ordering::Equal => Self::Zero,
            Ordering::Greater => Self::Positive,
        }
    }

    /// The sign of x·y.
    pub(crate) fn times(self, other: Self) -> Self {
        match (self, other) {
            (Self::Zero, _) | (_, Self::Zero) => Self::Zero,
            _ if self == other => Self::Positive,
            _ => Self::Negative,
        }
    }

    /// The sign of −x.
    #[inline]
    pub(crate) fn negated(self) -> Self {
        match self {
            Self::Negative => Self::Positive,
            Self::Zero => Self::Zero,
            Self::Positive => Self::Negative,
        }
    }
}

/// A computed value and a bound of its error: |true − value| ≤ error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Approx {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Approx {
    /// The sign of the true value, where the bound leaves no doubt. Never `Zero`; NaN is doubt.
    #[inline(always)]
    pub(crate) fn sign(self) -> Option<Sign> {
        if self.value > self.error {
            Some(Sign::Positive)
        } else if self.value < -self.error {
            Some(Sign::Negative)
        } else {
            None
        }
    }

    /// Whether the true value is zero for certain: every product was zero, and nothing was rounded. Common where planes lie across axes.
    #[inline(always)]
    pub(crate) fn is_zero(self) -> bool {
        self.value == 0.0 && self.error == 0.0
    }

    /// The sign of the true value, where the bound leaves no doubt, zero where that is evident.
    #[inline(always)]
    pub(crate) fn sign_or_zero(self) -> Option<Sign> {
        if self.is_zero() { Some(Sign::Zero) } else { self.sign() }
    }

    /// The product. With true factors (a + α)(b + β), |α| ≤ ea and |β| ≤ eb, the error is |a|eb + |b|ea + ea·eb and
    /// one rounding; five roundings of the bound are paid for by the factor.
    #[inline]
    pub(crate) fn times(self, other: Self) -> Self {
        let value = self.value * other.value;
        let error =
            self.value.abs() * other.error + other.value.abs() * self.error + self.error * other.error;
        Self { value, error: (error + value.abs() * U) * (1.0 + 8.0 * U) + UNDERFLOW }
    }

    /// The difference, with its one rounding.
    #[inline]
    pub(crate) fn minus(self, other: Self) -> Self {
        let value = self.value - other.value;
        let error = self.error + other.error;
        Self { value, error: (error + value.abs() * U) * (1.0 + 4.0 * U) }
    }
}

/// y×z and, per component, the sum of the magnitudes of its two products: the "permanent" that bounds its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cross {
    pub(crate) value: DVec3,
    pub(crate) permanent: DVec3,
}

impl Cross {
    /// y×z for vectors that are exact or rounded once.
    #[inline(always)]
    pub(crate) fn of(y: DVec3, z: DVec3) -> Self {
        Self::sized(y, y.abs(), z)
    }

    /// y×z for a sum y of two vectors whose magnitudes add up to `size`.
    #[inline(always)]
    pub(crate) fn sized(y: DVec3, size: DVec3, z: DVec3) -> Self {
        let w = z.abs();
        Self {
            value: y.yzx() * z.zxy() - y.zxy() * z.yzx(),
            permanent: size.yzx() * w.zxy() + size.zxy() * w.yzx(),
        }
    }

    /// x·(y×z) for a vector x that is exact or rounded once.
    #[inline(always)]
    pub(crate) fn dot(&self, x: DVec3) -> Approx {
        self.dot_sized(x, x.abs())
    }

    /// x·(y×z) for a sum x of two vectors whose magnitudes add up to `size`.
    #[inline(always)]
    pub(crate) fn dot_sized(&self, x: DVec3, size: DVec3) -> Approx {
        let value = x.x * self.value.x + x.y * self.value.y + x.z * self.value.z;
        let m = size * self.permanent;
        Approx { value, error: TRIPLE_PRODUCT_ERROR * (m.x + m.y + m.z) }
    }
}

/// The two cyclic shifts that a cross product is made of.
trait Shifted {
    fn yzx(self) -> Self;
    fn zxy(self) -> Self;
}

impl Shifted for DVec3 {
    fn yzx(self) -> Self {
        Self::new(self.y, self.z, self.x)
    }

    fn zxy(self) -> Self {
        Self::new(self.z, self.x, self.y)
    }
}
