//! Up to 128 samples side by side: their directions in f32, and sets of them as bits.
//!
//! Directions are divided by their greatest component, so that a component is at most 1 and rounding to f32 moves it by at
//! most 2⁻²⁴; distances along them change accordingly. Neighbours on an octahedron's unfolded faces follow each other, so that
//! eight in a row make a narrow bundle.
//!
//! Based on: Quirin Meyer et al., "On Floating-Point Normal Vectors", 2010 (octahedral map); Guy Morton, "A Computer Oriented
//! Geodetic Data Base", 1966.

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::rays::hemisphere::RaySample;
use crate::simd::lanes::{LANES, Narrow};

/// The most samples of a set: as many as an integer has bits.
pub(crate) const SAMPLES: usize = u128::BITS as usize;
/// Cells along a side of the octahedral map.
const OCTAHEDRAL_CELLS: f64 = 256.0;

/// Samples in the order of their directions.
#[derive(Debug)]
pub(crate) struct SampleDirections {
    count: usize,
    /// d and |d|, component by component; beyond the last one zero.
    d: [[f32; SAMPLES]; 3],
    size: [[f32; SAMPLES]; 3],
    /// The samples as given, each with its place among those.
    given: Vec<(usize, RaySample)>,
}

impl SampleDirections {
    /// Of at most [`SAMPLES`] samples.
    pub(crate) fn new(samples: &[RaySample]) -> Self {
        let mut given: Vec<(usize, RaySample)> = samples.iter().copied().enumerate().collect();
        given.sort_by_key(|(index, sample)| (octahedral_cell(sample.direction), *index));
        let (mut d, mut size) = ([[0.0; SAMPLES]; 3], [[0.0; SAMPLES]; 3]);
        for (slot, (_, sample)) in given.iter().enumerate() {
            let scaled = sample.direction / sample.direction.abs().max_element();
            for (k, x) in scaled.as_vec3().to_array().into_iter().enumerate() {
                (d[k][slot], size[k][slot]) = (x, x.abs());
            }
        }
        Self { count: given.len(), d, size, given }
    }

    /// How many.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// One of them, with its place among the samples as given.
    pub(crate) fn given(&self, slot: usize) -> (usize, RaySample) {
        self.given[slot]
    }

    /// The direction of one, in f32.
    #[inline(always)]
    pub(crate) fn one(&self, slot: usize) -> [f32; 3] {
        let [x, y, z] = &self.d;
        [x[slot % SAMPLES], y[slot % SAMPLES], z[slot % SAMPLES]]
    }

    /// The limit of one in units of its direction in f32.
    #[inline(always)]
    pub(crate) fn t_max(&self, slot: usize) -> f64 {
        let sample = self.given[slot].1;
        f64::from(sample.t_max) * sample.direction.abs().max_element()
    }

    /// The longest distance that any of them asks for, rounded up.
    pub(crate) fn longest(&self) -> f32 {
        let length = |sample: &RaySample| {
            f64::from(sample.t_max)
                * sample.direction.dot(sample.direction).sqrt()
                * (1.0 + f64::from(f32::EPSILON))
        };
        let longest = self.given.iter().map(|(_, sample)| length(sample)).fold(0.0, f64::max);
        (longest as f32).next_up()
    }

    /// The directions of eight from one on, and the magnitudes of their components.
    #[inline(always)]
    pub(crate) fn eight<S: Simd>(&self, simd: S, first: usize) -> ([Narrow<S>; 3], [Narrow<S>; 3]) {
        let ([x, y, z], [u, v, w]) = (&self.d, &self.size);
        let load = |numbers: &[f32; SAMPLES]| Narrow::from_slice(simd, &numbers[first..first + LANES]);
        ([load(x), load(y), load(z)], [load(u), load(v), load(w)])
    }
}

/// The number of a direction's cell along the curve over the octahedral map.
fn octahedral_cell(d: DVec3) -> u32 {
    let sum = d.x.abs() + d.y.abs() + d.z.abs();
    let (x, y) = (d.x / sum, d.y / sum);
    // The lower half is folded outward.
    let fold = |x: f64, y: f64| (1.0 - y.abs()) * if x < 0.0 { -1.0 } else { 1.0 };
    let (x, y) = if d.z < 0.0 { (fold(x, y), fold(y, x)) } else { (x, y) };
    let cell = |x: f64| ((x * 0.5 + 0.5) * (OCTAHEDRAL_CELLS - 1.0)) as u32;
    let (x, y) = (cell(x), cell(y));
    (0..8).fold(0, |number, bit| number | (x >> bit & 1) << (2 * bit + 1) | (y >> bit & 1) << (2 * bit))
}
