//! Value noise over the plane, and the range of it over a rectangle: `modes/surfaces/noise/mod.rs` with one axis less, and faster
//! for many points.
//!
//! A noise of the plane has octaves k = 0, 1, 2 ... with 2ᵏ cells per unit, each with values in [0, 1]. Points of a grid mostly share
//! the cells of the coarse octaves, so a [`Cursor`] keeps the lattice values of the cell it was in last.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985.

use fearless_simd::prelude::*;

use crate::random::mix;
use crate::surfaces::lanes::Lanes;
use crate::surfaces::noise::lattice::weight as weight_lanes;
use crate::surfaces::noise::lattice::{
    Cell, UNIT, common, corner_sums, lattice_value, lattice_values, lerp, sides,
};
use crate::surfaces::noise::{ROUNDING, weight};

/// A rectangle of the plane: the least and the greatest x, the least and the greatest z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) x: [f64; 2],
    pub(crate) z: [f64; 2],
}

/// A shift per octave, in cells, so that lattice points of octaves do not fall onto each other at the origin.
const SHIFT: f64 = 0.387_219_6;

/// Octaves of noise by a seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaneNoise {
    pub(crate) seed: u64,
    /// Cells of octave 0 per world unit.
    pub(crate) frequency: f64,
}

/// The lattice values of the cells that were used last, one per octave.
pub(crate) struct Cursor<const OCTAVES: usize> {
    noise: PlaneNoise,
    cells: [Cell<2, 4>; OCTAVES],
}

/// What coordinates of lattice points are multiplied with before they are hashed.
const FACTORS: [u64; 2] = [0xd1b5_4a32_d192_ed03, 0xabc9_8388_fb8f_ac03];

/// What corners add to the hash of their cell.
const CORNER_SUMS: [u64; 8] = corner_sums(FACTORS);

impl PlaneNoise {
    /// A cursor, in no cell.
    pub(crate) fn cursor<const OCTAVES: usize>(&self) -> Cursor<OCTAVES> {
        Cursor { noise: *self, cells: [Cell::NONE; OCTAVES] }
    }

    /// A coordinate in cells of an octave. Monotone.
    fn on_lattice(&self, octave: u32, x: f64) -> f64 {
        x * self.scale(octave) + SHIFT * f64::from(octave)
    }

    /// Cells per unit of an octave.
    fn scale(&self, octave: u32) -> f64 {
        self.frequency * (1_u64 << octave) as f64
    }

    /// The length of an octave's waves: two cells.
    pub(crate) fn wavelength(&self, octave: u32) -> f64 {
        2.0 / self.scale(octave)
    }

    /// What an octave adds to its hashes.
    fn key(&self, octave: u32) -> u64 {
        mix(self.seed ^ (u64::from(octave) << 56))
    }

    /// The values at the corners of a cell, in units.
    fn values(&self, octave: u32, [x, z]: [f64; 2]) -> [f64; 4] {
        // The casts saturate.
        let [x, z] = [x, z].map(|x| x as i64 as u64);
        let sum = x.wrapping_mul(FACTORS[0]).wrapping_add(z.wrapping_mul(FACTORS[1]));
        let first = self.key(octave).wrapping_add(sum);
        [0, 1, 2, 3].map(|corner: usize| lattice_value(first.wrapping_add(CORNER_SUMS[corner])))
    }

    /// The range of one octave over a rectangle.
    pub(crate) fn range(&self, octave: u32, rectangle: &Rectangle) -> [f64; 2] {
        let [[x0, x1], [z0, z1]] =
            [rectangle.x, rectangle.z].map(|ends| ends.map(|x| self.on_lattice(octave, x)));
        let (first, last) = ([x0.floor(), z0.floor()], [x1.floor(), z1.floor()]);
        if !(last[0] - first[0] < 2.0 && last[1] - first[1] < 2.0) {
            return [0.0, 1.0];
        }
        let mut range = [1.0_f64, 0.0_f64];
        let cells = |k: usize| [first[k], last[k]].into_iter().take(if first[k] == last[k] { 1 } else { 2 });
        for z in cells(1) {
            for x in cells(0) {
                let values = self.values(octave, [x, z]);
                for (px, pz) in [(x0, z0), (x1, z0), (x0, z1), (x1, z1)] {
                    let place = [px.clamp(x, x + 1.0) - x, pz.clamp(z, z + 1.0) - z];
                    let value = blend(&values, place) * UNIT;
                    range = [range[0].min(value), range[1].max(value)];
                }
            }
        }
        [range[0] - ROUNDING, range[1] + ROUNDING]
    }
}

impl<const OCTAVES: usize> Cursor<OCTAVES> {
    /// One octave at a point.
    pub(crate) fn at(&mut self, octave: u32, [x, z]: [f64; 2]) -> f64 {
        let place = [self.noise.on_lattice(octave, x), self.noise.on_lattice(octave, z)];
        let cell = place.map(f64::floor);
        let known = self.known(octave, cell);
        blend(known, [place[0] - cell[0], place[1] - cell[1]]) * UNIT
    }

    /// The values at the corners of a cell, in units.
    #[inline(always)]
    fn known(&mut self, octave: u32, place: [f64; 2]) -> &[f64; 4] {
        let known = &mut self.cells[octave as usize];
        if !known.is(place) {
            *known = Cell::of(place, self.noise.values(octave, place));
        }
        known.values()
    }

    /// One octave at eight points. They are known to lie in several cells where they are `apart`; else that is found out. Points
    /// that an octave has apart are apart in finer ones, too, as good as always.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(
        &mut self,
        simd: S,
        octave: u32,
        point: [Lanes<S>; 2],
        apart: &mut bool,
    ) -> Lanes<S> {
        let (scale, shift) = (self.noise.scale(octave), SHIFT * f64::from(octave));
        let (mut cell, mut w) = (point, point);
        for k in 0..2 {
            let place = point[k] * scale + shift;
            cell[k] = place.floor();
            w[k] = weight_lanes(place - cell[k]);
        }
        let mut values = [w[0]; 4];
        let place = if *apart { None } else { common(&cell) };
        *apart = place.is_none();
        if let Some(place) = place {
            for (values, &known) in values.iter_mut().zip(self.known(octave, place)) {
                *values = Lanes::splat(simd, known);
            }
        } else {
            let [x, z] = [sides(cell[0], FACTORS[0]), sides(cell[1], FACTORS[1])];
            let key = self.noise.key(octave);
            let z = [z[0] + key, z[1] + key];
            for (k, values) in values.iter_mut().enumerate() {
                *values = lattice_values(x[k & 1] + z[k >> 1]);
            }
        }
        lerp(lerp(values[0], values[1], w[0]), lerp(values[2], values[3], w[0]), w[1]) * UNIT
    }
}

/// The values at the corners of a cell, interpolated.
fn blend(values: &[f64; 4], place: [f64; 2]) -> f64 {
    let [s, t] = place.map(weight);
    let (near, far) = (values[0] + (values[1] - values[0]) * s, values[2] + (values[3] - values[2]) * s);
    near + (far - near) * t
}
