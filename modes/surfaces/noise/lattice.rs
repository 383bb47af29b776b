//! Lattice noise for eight points at a time: the values at the corners of their cells.
//!
//! Where all eight lie in one cell, as they mostly do for coarse octaves, the values of that cell are kept for the next eight;
//! else all lanes hash. Both are `modes/surfaces/noise/mod.rs` and
//! `modes/surfaces/noise/plane.rs` to the bit.
//!
//! Lattice values are kept and interpolated as whole numbers up to 2⁵³, and multiplied with 2⁻⁵³ at the end: a power of two
//! changes no rounding.
//!
//! A hash of two products and three shifts took a displaced mesh 1.18 times as long with AVX2, 1.07 times with AVX-512, and was no
//! better: see the tests.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985; Donald Knuth, "The Art of Computer Programming", volume 3, 1973, section 6.4
//! (multiplicative hashing).

use fearless_simd::{i64x8, prelude::*, u64x8};

use crate::surfaces::lanes::{LANES, Lanes};

/// The unit of lattice values.
pub(crate) const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;

/// What hashes are multiplied with.
const MIX: u64 = 0xd6e8_feb8_6659_fd93;

/// The cell that was used last and the values at its corners, of noise with so many dimensions and corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell<const D: usize, const CORNERS: usize> {
    place: [f64; D],
    values: [f64; CORNERS],
}

impl<const D: usize, const CORNERS: usize> Cell<D, CORNERS> {
    /// No cell.
    pub(crate) const NONE: Self = Self { place: [f64::NAN; D], values: [0.0; CORNERS] };

    /// A cell with the values at its corners, in units.
    #[inline(always)]
    pub(crate) fn of(place: [f64; D], values: [f64; CORNERS]) -> Self {
        Self { place, values }
    }

    /// Whether it is this one.
    #[inline(always)]
    pub(crate) fn is(&self, place: [f64; D]) -> bool {
        self.place == place
    }

    /// The values at its corners, in units.
    #[inline(always)]
    pub(crate) fn values(&self) -> &[f64; CORNERS] {
        &self.values
    }
}

/// The cell in which all eight places lie, if it is one.
#[inline(always)]
pub(crate) fn common<S: Simd, const D: usize>(cells: &[Lanes<S>; D]) -> Option<[f64; D]> {
    let mut place = [0.0; D];
    for (place, cells) in place.iter_mut().zip(cells) {
        *place = cells.as_array()[0];
        if !cells.simd_eq(*place).all_true() {
            return None;
        }
    }
    Some(place)
}

/// What each axis adds to the hash at the nearer and the farther side of each cell.
#[inline(always)]
pub(crate) fn sides<S: Simd>(cell: Lanes<S>, factor: u64) -> [u64x8<S>; 2] {
    let near: i64x8<S> = cell.to_int_precise();
    let near = near.bitcast::<u64x8<S>>() * factor;
    [near, near + factor]
}

/// What each lane adds for its corner, the bits of its number being the sides along each axis.
pub(crate) const fn corner_sums<const D: usize>(factors: [u64; D]) -> [u64; LANES] {
    let (mut sums, mut k) = ([0_u64; LANES], 0);
    while k < LANES * D {
        if (k / D) >> (k % D) & 1 == 1 {
            sums[k / D] = sums[k / D].wrapping_add(factors[k % D]);
        }
        k += 1;
    }
    sums
}

/// The value of a lattice point by the sum of its key and of what each axis adds: in units, below 2⁵³. The sums of neighbours differ by
/// constants; the upper bits of one product of half as many mixed bits show nothing of that.
pub(crate) fn lattice_value(sum: u64) -> f64 {
    ((sum ^ (sum >> 32)).wrapping_mul(MIX) >> 11) as f64
}

/// The same of eight points.
#[inline(always)]
pub(crate) fn lattice_values<S: Simd>(sums: u64x8<S>) -> Lanes<S> {
    (((sums ^ (sums >> 32)) * MIX) >> 11).to_float()
}

/// `Detail::share` of waves of some length for eight distances between rays.
#[inline(always)]
pub(crate) fn share<S: Simd>(wavelength: f64, spacing: Lanes<S>) -> Lanes<S> {
    (wavelength / (2.0 * spacing) - 1.0).max(0.0).min(1.0)
}

/// The least and the greatest of eight numbers.
#[inline(always)]
pub(crate) fn ends<S: Simd>(numbers: Lanes<S>) -> [f64; 2] {
    let numbers = numbers.as_array();
    let mut ends = [numbers[0]; 2];
    for &number in numbers {
        ends = [
            if number < ends[0] { number } else { ends[0] },
            if number > ends[1] { number } else { ends[1] },
        ];
    }
    ends
}

/// `noise::weight`.
#[inline(always)]
pub(crate) fn weight<S: Simd>(t: Lanes<S>) -> Lanes<S> {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// From a to b by t.
#[inline(always)]
pub(crate) fn lerp<S: Simd>(a: Lanes<S>, b: Lanes<S>, t: Lanes<S>) -> Lanes<S> {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of neighbours, a cell or a few apart along any axes, are spread evenly and have nothing to do with each other.
    #[test]
    fn lattice_values_are_even_and_independent() {
        const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];
        let value = |key: u64, place: [u64; 3]| {
            let sums = place.iter().zip(FACTORS).map(|(x, factor)| x.wrapping_mul(factor));
            lattice_value(sums.fold(key, u64::wrapping_add)) * UNIT - 0.5
        };
        // 40³ points: a correlation of 0.02 is five times what chance makes.
        for (key, apart) in [(0, [1, 0, 0]), (7, [0, 1, 0]), (u64::MAX / 3, [0, 0, 1]), (1, [1, 1, 0])]
            .into_iter()
            .chain([(2, [2, 0, 0]), (3, [1, 1, 1]), (4, [0, 3, 1])])
        {
            let (mut mean, mut square, mut product) = (0.0, 0.0, 0.0);
            for k in 0..64_000_u64 {
                let place = [k % 40, k / 40 % 40, k / 1600].map(|x| x.wrapping_sub(20));
                let next = [0, 1, 2].map(|axis| place[axis].wrapping_add(apart[axis]));
                let (one, other) = (value(key, place), value(key, next));
                (mean, square, product) = (mean + one, square + one * one, product + one * other);
            }
            let [mean, square, product] = [mean, square, product].map(|sum| sum / 64_000.0);
            assert!(mean.abs() < 0.006, "{mean}");
            assert!((square * 12.0 - 1.0).abs() < 0.02, "{square}");
            assert!((product * 12.0).abs() < 0.02, "{apart:?}: {product}");
        }
    }
}
