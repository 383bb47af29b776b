//! Value noise over the plane, and the range of it over a rectangle: `noise.rs` with one axis less, and faster for many points.
//!
//! A noise of the plane has octaves k = 0, 1, 2 ... with 2ᵏ cells per unit, each with values in [0, 1]. Points of a grid mostly share
//! the cells of the coarse octaves, so a [`Cursor`] keeps the lattice values of the cell it was in last.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985.

use crate::noise::{ROUNDING, weight};
use crate::sample_sets::{mix, uniform};

/// A rectangle of the plane: the least and the greatest x, the least and the greatest z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) x: [f64; 2],
    pub(crate) z: [f64; 2],
}

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
    cells: [([f64; 2], [f64; 4]); OCTAVES],
}

impl PlaneNoise {
    /// A cursor, in no cell.
    pub(crate) fn cursor<const OCTAVES: usize>(&self) -> Cursor<OCTAVES> {
        Cursor { noise: *self, cells: [([f64::NAN; 2], [0.0; 4]); OCTAVES] }
    }

    /// A coordinate in cells of an octave. Monotone; a shift keeps lattice points of octaves apart.
    fn on_lattice(&self, octave: u32, x: f64) -> f64 {
        x * (self.frequency * (1_u64 << octave) as f64) + 0.387_219_6 * f64::from(octave)
    }

    /// The values at the corners of a cell.
    fn values(&self, octave: u32, [x, z]: [f64; 2]) -> [f64; 4] {
        let key = mix(self.seed ^ (u64::from(octave) << 56));
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[dx, dz]| lattice(key, [x + dx, z + dz]))
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
        for z in [first[1], last[1]] {
            for x in [first[0], last[0]] {
                let values = self.values(octave, [x, z]);
                for (px, pz) in [(x0, z0), (x1, z0), (x0, z1), (x1, z1)] {
                    let place = [px.clamp(x, x + 1.0) - x, pz.clamp(z, z + 1.0) - z];
                    let value = blend(&values, place);
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
        let known = &mut self.cells[octave as usize];
        if known.0 != cell {
            *known = (cell, self.noise.values(octave, cell));
        }
        blend(&known.1, [place[0] - cell[0], place[1] - cell[1]])
    }
}

/// The value of a lattice point, in [0, 1).
fn lattice(key: u64, place: [f64; 2]) -> f64 {
    // The casts saturate.
    let [x, z] = place.map(|x| x as i64 as u64);
    let sum = x.wrapping_mul(0xd1b5_4a32_d192_ed03).wrapping_add(z.wrapping_mul(0xabc9_8388_fb8f_ac03));
    uniform(mix(key.wrapping_add(sum)))
}

/// The values at the corners of a cell, interpolated.
fn blend(values: &[f64; 4], place: [f64; 2]) -> f64 {
    let [s, t] = place.map(weight);
    let (near, far) = (values[0] + (values[1] - values[0]) * s, values[2] + (values[3] - values[2]) * s);
    near + (far - near) * t
}
