//! Lattice noise for eight points at a time: the values at the corners of their cells.
//!
//! Where all eight lie in one cell, as they mostly do for coarse octaves, the values of that cell are kept for the next eight;
//! else all lanes hash. Both are `noise.rs` and `plane_noise.rs` to the bit.
//!
//! Lattice values are kept and interpolated as whole numbers up to 2⁵³, and multiplied with 2⁻⁵³ at the end: a power of two
//! changes no rounding.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985; Guy Steele, Doug Lea and Christine Flood, "Fast Splittable Pseudorandom
//! Number Generators", 2014 (the hash).

use fearless_simd::{i64x8, prelude::*, u64x8};

use crate::point_lanes::{LANES, Lanes};

/// The unit of lattice values.
pub(crate) const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;

/// The first step of `sample_sets::mix`.
const MIX_STEP: u64 = 0x9e37_79b9_7f4a_7c15;

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

/// What is added to the hashes with a key.
pub(crate) const fn first_sum(key: u64) -> u64 {
    key.wrapping_add(MIX_STEP)
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

/// `sample_sets::mix` after its first step.
#[inline(always)]
fn mix<S: Simd>(z: u64x8<S>) -> u64x8<S> {
    let z = (z ^ (z >> 30)) * 0xbf58_476d_1ce4_e5b9;
    let z = (z ^ (z >> 27)) * 0x94d0_49bb_1331_11eb;
    z ^ (z >> 31)
}

/// The values of lattice points by what was added for them, [`first_sum`] included: in units, below 2⁵³.
#[inline(always)]
pub(crate) fn values<S: Simd>(sums: u64x8<S>) -> Lanes<S> {
    (mix(sums) >> 11).to_float()
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
