//! Integers of fixed size: the exact stage where 64 bits do not hold the inputs.
//!
//! Every finite f64 is an integer times a power of two. Coordinates are multiples of 2⁻¹⁴⁹ below 2¹²⁹: at most 278 bits on a
//! common grid, 279 with a difference. Directions have components from 2⁻²⁴⁰ to 2¹⁹⁰ with 53 bits each: at most 483 bits. So
//! (a − o)·((b − a)×(c − a)) has at most 3·279 + 3 = 840 bits, d·((b − a)×(c − a)) at most 483 + 2·279 + 3 = 1044, and the
//! product of two such 1884: 30 limbs. Nothing is ever allocated, and the time is bounded: a product of 14 and 17 limbs is 238
//! multiplications. Most numbers are far shorter, and time goes with their length.
//!
//! Based on: Donald Knuth, "The Art of Computer Programming", volume 2, section 4.3.1 (algorithms A, S and M).

use std::cmp::Ordering;

use crate::exact::filter::Sign;

/// 2048 bits.
const LIMBS: usize = 32;

/// 2⁶⁴.
pub(crate) const LIMB: f64 = 18_446_744_073_709_551_616.0;

/// value·2^exponent, where no f64 need be as large or as small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaled {
    pub(crate) value: f64,
    pub(crate) exponent: i32,
}

impl Scaled {
    pub(crate) const ZERO: Self = Self { value: 0.0, exponent: 0 };

    /// The exponent e of a size from 2^(e − 1) to 2^e, of what is not zero.
    pub(crate) fn magnitude(&self) -> i32 {
        parts(self.value).map_or(i32::MIN, |(_, exponent)| exponent + 53 + self.exponent)
    }

    /// The number times 2^power, where that is a normal number or zero.
    pub(crate) fn times_power(&self, power: i32) -> f64 {
        let Some((mantissa, exponent)) = parts(self.value) else { return 0.0 };
        let field = exponent + self.exponent + power + 1075;
        // In range: a mantissa of 53 bits without the first, and the exponent of a normal number.
        let bits = u64::from(field.unsigned_abs()) << 52 | mantissa & ((1 << 52) - 1);
        f64::from_bits(bits).copysign(self.value)
    }
}

/// An integer below 2²⁰⁴⁸ in size: sign and magnitude.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wide {
    negative: bool,
    /// The limbs that count: the last of them is not zero.
    len: usize,
    /// The least significant one first; zero beyond `len`.
    limbs: [u64; LIMBS],
}

impl Wide {
    pub(crate) const ZERO: Self = Self { negative: false, len: 0, limbs: [0; LIMBS] };

    /// x / 2^`lowest`, where that is an integer.
    pub(crate) fn of(x: f64, lowest: i32) -> Self {
        let Some((mantissa, exponent)) = parts(x) else { return Self::ZERO };
        let shift = exponent - lowest;
        let mut number = Self::ZERO;
        number.negative = x < 0.0;
        if shift < 0 {
            // What is shifted out is zero.
            number.limbs[0] = mantissa >> -shift;
            number.len = 1;
            return number;
        }
        number.limbs[0] = mantissa;
        number.len = 1;
        number.shifted(shift.unsigned_abs())
    }

    /// A magnitude, least significant limb first.
    pub(crate) fn of_limbs<const N: usize>(limbs: [u64; N]) -> Self {
        let mut number = Self::ZERO;
        number.limbs[..N].copy_from_slice(&limbs);
        number.shortened(N)
    }

    pub(crate) fn sign(&self) -> Sign {
        match (self.len, self.negative) {
            (0, _) => Sign::Zero,
            (_, true) => Sign::Negative,
            (_, false) => Sign::Positive,
        }
    }

    /// The number, rounded: limbs below the three that lead count less than 2⁻¹²⁸.
    pub(crate) fn scaled(&self) -> Scaled {
        let first = self.len.saturating_sub(3);
        let size =
            self.limbs[first..self.len].iter().rev().fold(0.0, |size, &limb| size * LIMB + limb as f64);
        // In range: at most 2048 bits.
        Scaled { value: if self.negative { -size } else { size }, exponent: 64 * first as i32 }
    }

    /// The number of bits of the magnitude.
    pub(crate) fn bits(&self) -> u32 {
        let Some(last) = self.len.checked_sub(1) else { return 0 };
        // In range: at most 2048.
        self.len as u32 * u64::BITS - self.limbs[last].leading_zeros()
    }

    /// x·2^`shift`.
    pub(crate) fn shifted(&self, shift: u32) -> Self {
        let (whole, part) = ((shift / u64::BITS) as usize, shift % u64::BITS);
        let mut shifted = Self { negative: self.negative, ..Self::ZERO };
        let mut carry = 0;
        for place in 0..self.len {
            let limb = u128::from(self.limbs[place]) << part;
            shifted.limbs[place + whole] = limb as u64 | carry;
            carry = (limb >> u64::BITS) as u64;
        }
        shifted.len = self.len + whole;
        if carry != 0 {
            shifted.limbs[shifted.len] = carry;
            shifted.len += 1;
        }
        if self.len == 0 { Self::ZERO } else { shifted }
    }

    /// x + y.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        self.sum(other, other.negative)
    }

    /// x − y.
    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.sum(other, !other.negative)
    }

    /// The sum with a number of the other's magnitude and a sign.
    fn sum(&self, other: &Self, negative: bool) -> Self {
        if self.negative == negative {
            return Self { negative, ..self.added(other) };
        }
        match self.compare_sizes(other) {
            Ordering::Less => Self { negative, ..other.subtracted(self) },
            Ordering::Equal => Self::ZERO,
            Ordering::Greater => Self { negative: self.negative, ..self.subtracted(other) },
        }
    }

    /// |x| + |y|.
    fn added(&self, other: &Self) -> Self {
        let len = self.len.max(other.len);
        let (mut sum, mut carry) = (Self::ZERO, false);
        for place in 0..len {
            let (partial, one) = self.limbs[place].overflowing_add(other.limbs[place]);
            let (limb, two) = partial.overflowing_add(u64::from(carry));
            (sum.limbs[place], carry) = (limb, one | two);
        }
        sum.len = len;
        if carry {
            sum.limbs[len] = 1;
            sum.len += 1;
        }
        sum
    }

    /// |x| − |y| for |x| > |y|.
    fn subtracted(&self, other: &Self) -> Self {
        let (mut difference, mut borrow) = (Self::ZERO, false);
        for place in 0..self.len {
            let (partial, one) = self.limbs[place].overflowing_sub(other.limbs[place]);
            let (limb, two) = partial.overflowing_sub(u64::from(borrow));
            (difference.limbs[place], borrow) = (limb, one | two);
        }
        difference.shortened(self.len)
    }

    /// x·y.
    pub(crate) fn times(&self, other: &Self) -> Self {
        let mut product = Self { negative: self.negative != other.negative, ..Self::ZERO };
        for (place, &limb) in self.limbs[..self.len].iter().enumerate() {
            let mut carry = 0;
            for (other_place, &other_limb) in other.limbs[..other.len].iter().enumerate() {
                let target = &mut product.limbs[place + other_place];
                // At most (2⁶⁴ − 1)² + 2(2⁶⁴ − 1) = 2¹²⁸ − 1.
                let sum = u128::from(limb) * u128::from(other_limb) + u128::from(*target) + u128::from(carry);
                (*target, carry) = (sum as u64, (sum >> u64::BITS) as u64);
            }
            if carry != 0 {
                product.limbs[place + other.len] = carry;
            }
        }
        product.shortened(self.len + other.len)
    }

    /// Leaves out leading zeros, given that there are at most `len` limbs.
    fn shortened(mut self, len: usize) -> Self {
        let last = self.limbs[..len.min(LIMBS)].iter().rposition(|&limb| limb != 0);
        self.len = last.map_or(0, |last| last + 1);
        self.negative &= self.len > 0;
        self
    }

    /// |x| against |y|.
    pub(crate) fn compare_sizes(&self, other: &Self) -> Ordering {
        let by_limb = || self.limbs[..self.len].iter().rev().cmp(other.limbs[..other.len].iter().rev());
        self.len.cmp(&other.len).then_with(by_limb)
    }
}

/// |x| as an integer of 53 bits and the exponent of its unit; `None` for zero. x must be a normal number.
pub(crate) fn parts(x: f64) -> Option<(u64, i32)> {
    const MANTISSA: u64 = (1 << 52) - 1;
    // In range: eleven bits.
    let exponent = (x.to_bits() >> 52 & 0x7FF) as i32 - 1075;
    (x != 0.0).then_some((x.to_bits() & MANTISSA | (MANTISSA + 1), exponent))
}

/// The exponent of the least bit that is set in any of some numbers; 0 where all are zero.
pub(crate) fn lowest_exponent(numbers: impl Iterator<Item = f64>) -> i32 {
    let of_number = |x| parts(x).map(|(mantissa, exponent)| exponent + mantissa.trailing_zeros() as i32);
    numbers.filter_map(of_number).min().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An interpreter takes its time.
    const ROUNDS: usize = if cfg!(miri) { 20 } else { 5_000 };

    /// Numbers of up to `bits` bits in 53-bit pieces, in the same pieces as an i128.
    fn number(next: &mut impl FnMut() -> u64) -> (Wide, i128) {
        let sign = if next().is_multiple_of(2) { 1.0 } else { -1.0 };
        let [high, low] = [0; 2].map(|_| (next() >> (11 + next() % 53)) as f64 * sign);
        let wide = Wide::of(high, 0).shifted(8).plus(&Wide::of(low, 0));
        (wide, (high as i128 * 256) + low as i128)
    }

    #[test]
    fn agrees_with_integers() {
        let mut state = 1_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        for _ in 0..ROUNDS {
            let [(a, ia), (b, ib), (c, ic), (d, id)] = [0; 4].map(|_| number(&mut next));
            // 122 bits and one more.
            let difference = a.times(&b).minus(&c.times(&d));
            let expected = (ia * ib).checked_sub(ic * id).expect("in range");
            assert_eq!(difference.sign(), Sign::of(expected.signum() as f64));
            assert_eq!(difference.bits(), i128::BITS - expected.unsigned_abs().leading_zeros());
            assert_eq!(
                u128::from(difference.limbs[0]) | u128::from(difference.limbs[1]) << 64,
                expected.unsigned_abs()
            );
            assert_eq!(a.plus(&b).minus(&b).minus(&a).sign(), Sign::Zero);
            // (a + b)(c − d) = ac − ad + bc − bd.
            let product = a.plus(&b).times(&c.minus(&d));
            let sum = a.times(&c).minus(&a.times(&d)).plus(&b.times(&c)).minus(&b.times(&d));
            assert_eq!(product.minus(&sum).sign(), Sign::Zero);
            assert_eq!(product.compare_sizes(&sum), Ordering::Equal);
        }
    }

    /// The largest numbers there are: 2¹²⁹ and 2¹⁹⁰ on grids of 2⁻¹⁴⁹ and 2⁻²⁹².
    #[test]
    fn the_largest_fit() {
        let power = |e: i32| f64::from_bits(u64::from((e + 1023).unsigned_abs()) << 52);
        let point = Wide::of(power(129) - power(129 - 52), -149).plus(&Wide::of(power(129), -149));
        let direction = Wide::of(power(190) * 1.5, -292);
        let cross = point.times(&point).plus(&point.times(&point));
        let sum = |x: &Wide| x.plus(x).plus(x);
        let (numerator, denominator) = (sum(&point.times(&cross)), sum(&direction.times(&cross)));
        assert!(numerator.bits() <= 840 && denominator.bits() <= 1044);
        let product = numerator.times(&denominator);
        assert!(
            product.bits() <= 1884 && product.plus(&product).minus(&product).compare_sizes(&product).is_eq()
        );
    }

    #[test]
    fn floats_become_integers() {
        assert_eq!(Wide::of(-0.75, -2).bits(), 2);
        assert_eq!(Wide::of(-0.75, -2).sign(), Sign::Negative);
        assert_eq!(Wide::of(0.0, -2).sign(), Sign::Zero);
        assert_eq!(lowest_exponent([0.0, -0.75, 8.0].into_iter()), -2);
        assert_eq!(Wide::of(1.0, -149).bits(), 150);
    }
}
