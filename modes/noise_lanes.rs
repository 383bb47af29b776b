//! Lattice noise for eight points at a time: the values at the corners of their cells.
//!
//! Where all eight lie in one cell, as they mostly do for coarse octaves, the values of that cell are kept for the next eight;
//! else all lanes hash. Both are `noise.rs` and `plane_noise.rs` to the bit.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985; Guy Steele, Doug Lea and Christine Flood, "Fast Splittable Pseudorandom
//! Number Generators", 2014 (the hash).

use fearless_simd::{i64x8, prelude::*, u64x8};

use crate::point_lanes::Lanes;

/// The cell that was used last and the values at its corners, of noise with so many dimensions and corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell<const D: usize, const CORNERS: usize> {
    place: [f64; D],
    values: [f64; CORNERS],
}

impl<const D: usize, const CORNERS: usize> Cell<D, CORNERS> {
    /// No cell.
    pub(crate) const NONE: Self = Self { place: [f64::NAN; D], values: [0.0; CORNERS] };

    /// The values at the corners of this cell.
    #[inline(always)]
    pub(crate) fn known(
        &mut self,
        place: [f64; D],
        values: impl FnOnce() -> [f64; CORNERS],
    ) -> &[f64; CORNERS] {
        if self.place != place {
            *self = Self { place, values: values() };
        }
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
    let far: i64x8<S> = (cell + 1.0).to_int_precise();
    [near.bitcast::<u64x8<S>>() * factor, far.bitcast::<u64x8<S>>() * factor]
}

/// `sample_sets::mix`.
#[inline(always)]
fn mix<S: Simd>(z: u64x8<S>) -> u64x8<S> {
    let z = z + 0x9e37_79b9_7f4a_7c15;
    let z = (z ^ (z >> 30)) * 0xbf58_476d_1ce4_e5b9;
    let z = (z ^ (z >> 27)) * 0x94d0_49bb_1331_11eb;
    z ^ (z >> 31)
}

/// The values of lattice points by what was added for them: in [0, 1).
#[inline(always)]
pub(crate) fn values<S: Simd>(sums: u64x8<S>) -> Lanes<S> {
    let bits = mix(sums) >> 11;
    let numbers: Lanes<S> = bits.to_float();
    // A power of two: exact, as the quotient is.
    numbers * (1.0 / (1_u64 << 53) as f64)
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
