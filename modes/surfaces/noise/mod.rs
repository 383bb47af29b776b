//! Fractal value noise, and the exact range of it over a box.
//!
//! A lattice point has a value in [0, 1) by a hash of its coordinates. Between lattice points values are interpolated linearly in
//! the weights w(t) = t³(t(6t − 15) + 10) per axis; w is monotone. So over a box within one cell the noise is linear in each weight,
//! and its least and greatest values are at corners of the box: the range is found by evaluating corners, cell by cell, with room
//! for rounding. Octave k has the frequency f·2ᵏ and the amplitude gᵏ; the sum is divided by that of the amplitudes, so that noise
//! lies in [0, 1].
//!
//! Coordinates are mapped to the lattice by one rounded product and one rounded sum, which are monotone: a point within a box lies
//! within it on the lattice, too.
//!
//! An octave whose waves, two cells long, are too short for the rays to tell apart is replaced by its mean, ½, as far as
//! [`Detail::share`] says: half of the octaves of a picture need not be computed.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985 and "Improving Noise", 2002 (lattices, hashes, w); Wolfgang Heidrich, Philipp
//! Slusallek and Hans-Peter Seidel, "Sampling Procedural Shaders Using Affine Arithmetic", 1998 (ranges of procedures over boxes).

pub(crate) mod lattice;
pub(crate) mod plane;

use fearless_simd::{Level, dispatch, prelude::*, u64x8};
use glam::DVec3;
use umbel_core::Detail;

use crate::random::mix;
use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{Lanes, PointLanes};
use crate::surfaces::noise::lattice::weight as weight_lanes;
use crate::surfaces::noise::lattice::{
    Cell, UNIT, common, corner_sums, ends, lattice_value, lattice_values, lerp, share, sides,
};

/// Room for the rounding of one octave, whose values are sums of eight products of weights and numbers below 1.
pub(crate) const ROUNDING: f64 = 1e-13;

/// A shift per octave, in cells, so that lattice points of octaves do not fall onto each other at the origin.
const SHIFT: DVec3 = DVec3::new(0.387_219_6, 0.713_628_1, 0.291_770_3);

/// What coordinates of lattice points are multiplied with before they are hashed.
const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];

/// What corners add to the hash of their cell.
const CORNER_SUMS: [u64; 8] = corner_sums(FACTORS);

/// Octaves whose cells are kept.
const MOST_OCTAVES: u32 = 12;

/// The cells that were used last.
pub(crate) type Cells = [Cell<3, 8>; MOST_OCTAVES as usize];

/// None.
pub(crate) const NO_CELLS: Cells = [Cell::NONE; MOST_OCTAVES as usize];

/// The most cells along one axis in which corners are evaluated; over more, an octave is taken to have any value.
const CELLS: f64 = 2.0;

/// Fractal noise over space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Cells of the first octave per world unit, positive.
    pub frequency: f64,
    /// Chooses among the noises.
    pub seed: u64,
    /// How many octaves are added, at least 1.
    pub octaves: u32,
    /// The amplitude of each octave in that of the one before, in (0, 1].
    pub gain: f64,
}

impl Noise {
    /// Noise with the usual sum: six octaves, each half as high as the one before.
    #[must_use]
    pub const fn new(frequency: f64, seed: u64) -> Self {
        Self { frequency, seed, octaves: 6, gain: 0.5 }
    }

    /// The noise at eight points where rays are so far apart.
    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(
        &self,
        simd: S,
        (point, spacing): (PointLanes<S>, Lanes<S>),
        cells: &mut Cells,
    ) -> Lanes<S> {
        let (mut sum, mut amplitude, mut total) = (Lanes::splat(simd, 0.0), 1.0, 0.0);
        let [least, greatest] = ends(spacing);
        // Points that an octave has apart are apart in finer ones, too, as good as always: then nobody asks.
        let mut apart = false;
        for k in 0..self.octaves {
            let wavelength = self.wavelength(k);
            if wavelength > 2.0 * least {
                let cell = cells.get_mut(k as usize).filter(|_| !apart);
                let (mut octave, together) = self.octave_lanes(simd, k, point, cell);
                apart = !together;
                if wavelength < 4.0 * greatest {
                    octave = (octave - 0.5) * share(wavelength, spacing) + 0.5;
                }
                sum += octave * amplitude;
            } else {
                sum += 0.5 * amplitude;
            }
            total += amplitude;
            amplitude *= self.gain;
        }
        sum / total
    }

    /// One octave at eight points, and whether they share a cell, as far as that was asked.
    #[inline(always)]
    fn octave_lanes<S: Simd>(
        &self,
        simd: S,
        octave: u32,
        point: PointLanes<S>,
        known: Option<&mut Cell<3, 8>>,
    ) -> (Lanes<S>, bool) {
        let (scale, shift) = (self.scale(octave), SHIFT * f64::from(octave));
        let mut cell = point;
        let mut w = point;
        for k in 0..3 {
            let place = point[k] * scale + shift[k];
            cell[k] = place.floor();
            w[k] = weight_lanes(place - cell[k]);
        }
        let mut values = [w[0]; 8];
        let place = if known.is_some() { common(&cell) } else { None };
        if let (Some(place), Some(known)) = (place, known) {
            if !known.is(place) {
                *known = Cell::of(place, self.corner_values(simd, octave, place));
            }
            for (values, &corner) in values.iter_mut().zip(known.values()) {
                *values = Lanes::splat(simd, corner);
            }
        } else {
            let [x, y, z] =
                [sides(cell[0], FACTORS[0]), sides(cell[1], FACTORS[1]), sides(cell[2], FACTORS[2])];
            let key = self.key(octave);
            let z = [z[0] + key, z[1] + key];
            let yz = [y[0] + z[0], y[1] + z[0], y[0] + z[1], y[1] + z[1]];
            for (k, values) in values.iter_mut().enumerate() {
                *values = lattice_values(x[k & 1] + yz[k >> 1]);
            }
        }
        (blend_lanes(values, w) * UNIT, place.is_some())
    }

    /// The values at the corners of a cell, in units.
    #[inline(always)]
    fn corner_values<S: Simd>(&self, simd: S, octave: u32, [x, y, z]: [f64; 3]) -> [f64; 8] {
        // The casts saturate.
        let place = (x as i64 as u64)
            .wrapping_mul(FACTORS[0])
            .wrapping_add((y as i64 as u64).wrapping_mul(FACTORS[1]))
            .wrapping_add((z as i64 as u64).wrapping_mul(FACTORS[2]));
        let first = place.wrapping_add(self.key(octave));
        *lattice_values(u64x8::load_array(simd, CORNER_SUMS) + first).as_array()
    }

    /// The noise at a point, in [0, 1].
    #[must_use]
    pub fn at(&self, point: DVec3) -> f64 {
        let (mut sum, mut amplitude, mut total) = (0.0, 1.0, 0.0);
        for k in 0..self.octaves {
            sum += self.octave(k, self.on_lattice(k, point)) * amplitude;
            total += amplitude;
            amplitude *= self.gain;
        }
        sum / total
    }

    /// A range that holds the noise at all points of a box, and little else where the box is smaller than a cell. Rays are at
    /// least and at most so far apart at these points.
    pub(crate) fn range(&self, extent: &Extent, spacing: [f64; 2], level: Level) -> [f64; 2] {
        let [lo, hi] = dispatch!(level, simd => self.range_lanes(simd, extent, spacing));
        [(lo - ROUNDING).max(0.0), (hi + ROUNDING).min(1.0)]
    }

    /// The weighted mean of the ranges of the octaves.
    #[inline(always)]
    fn range_lanes<S: Simd>(&self, simd: S, extent: &Extent, spacing: [f64; 2]) -> [f64; 2] {
        let (mut sum, mut amplitude, mut total) = ([0.0; 2], 1.0, 0.0);
        for k in 0..self.octaves {
            let [most, least] = spacing.map(|spacing| Detail::share(self.wavelength(k), spacing));
            let [lo, hi] = if most > 0.0 { self.octave_range(simd, k, extent) } else { [0.5; 2] };
            // Nearest to the mean where the share is least, except on the other side of it.
            let faded = |end: f64, share: f64| (end - 0.5) * share + 0.5;
            let lo = faded(lo, if lo < 0.5 { most } else { least });
            let hi = faded(hi, if hi > 0.5 { most } else { least });
            sum = [sum[0] + lo * amplitude, sum[1] + hi * amplitude];
            total += amplitude;
            amplitude *= self.gain;
        }
        sum.map(|sum| sum / total)
    }

    /// A point in cells of an octave.
    fn on_lattice(&self, octave: u32, point: DVec3) -> DVec3 {
        point * self.scale(octave) + SHIFT * f64::from(octave)
    }

    /// Cells per unit of an octave.
    fn scale(&self, octave: u32) -> f64 {
        self.frequency * (1_u64 << octave.min(60)) as f64
    }

    /// The length of an octave's waves: two cells.
    fn wavelength(&self, octave: u32) -> f64 {
        2.0 / self.scale(octave)
    }

    /// What an octave adds to its hashes.
    fn key(&self, octave: u32) -> u64 {
        mix(self.seed ^ (u64::from(octave) << 56))
    }

    /// One octave at a point of its lattice.
    fn octave(&self, octave: u32, place: DVec3) -> f64 {
        let cell = place.floor();
        blend(&self.values(octave, cell), place - cell) * UNIT
    }

    /// The values at the corners of a cell, in units.
    fn values(&self, octave: u32, cell: DVec3) -> [f64; 8] {
        // The casts saturate.
        let [x, y, z] = cell.to_array().map(|x| x as i64 as u64);
        let sum = x
            .wrapping_mul(FACTORS[0])
            .wrapping_add(y.wrapping_mul(FACTORS[1]))
            .wrapping_add(z.wrapping_mul(FACTORS[2]));
        let first = self.key(octave).wrapping_add(sum);
        CORNER_SUMS.map(|corner| lattice_value(first.wrapping_add(corner)))
    }

    /// The range of one octave over a box.
    #[inline(always)]
    fn octave_range<S: Simd>(&self, simd: S, octave: u32, extent: &Extent) -> [f64; 2] {
        let (lo, hi) = (self.on_lattice(octave, extent.lo), self.on_lattice(octave, extent.hi));
        let (first, last) = (lo.floor(), hi.floor());
        // NaN, from a box without end, is no number of cells.
        let few = (last - first).max_element() < CELLS;
        if !few {
            return [0.0, 1.0];
        }
        let (mut least, mut greatest) =
            (Lanes::splat(simd, f64::INFINITY), Lanes::splat(simd, f64::NEG_INFINITY));
        // One or two along each axis.
        let [nx, ny, nz] = (last - first).to_array().map(|apart| apart as u32 + 1);
        for place in 0..nx * ny * nz {
            let at = [place % nx, place / nx % ny, place / (nx * ny)].map(f64::from);
            let cell = first + DVec3::from_array(at);
            let (from, to) = (lo.max(cell) - cell, hi.min(cell + 1.0) - cell);
            let found = self.corners(simd, octave, cell, [from, to]);
            (least, greatest) = (least.min(found), greatest.max(found));
        }
        let (mut range, least, greatest) = ([1.0_f64, 0.0_f64], least.as_array(), greatest.as_array());
        for (&least, &greatest) in least.iter().zip(greatest) {
            range = [
                if least < range[0] { least } else { range[0] },
                if greatest > range[1] { greatest } else { range[1] },
            ];
        }
        [range[0] - ROUNDING, range[1] + ROUNDING]
    }

    /// One octave at the corners of a box within a cell.
    #[inline(always)]
    fn corners<S: Simd>(&self, simd: S, octave: u32, cell: DVec3, [from, to]: [DVec3; 2]) -> Lanes<S> {
        let mut places = [[0.0; 8]; 3];
        for (k, places) in places.iter_mut().enumerate() {
            for (corner, place) in places.iter_mut().enumerate() {
                *place = if corner >> k & 1 == 0 { from[k] } else { to[k] };
            }
        }
        let [x, y, z] = places;
        let mut w = [Lanes::load_array(simd, x), Lanes::load_array(simd, y), Lanes::load_array(simd, z)];
        for w in &mut w {
            *w = weight_lanes(*w);
        }
        let mut values = [w[0]; 8];
        for (values, corner) in values.iter_mut().zip(self.corner_values(simd, octave, cell.to_array())) {
            *values = Lanes::splat(simd, corner);
        }
        blend_lanes(values, w) * UNIT
    }
}

/// The values at the corners of a cell, interpolated at a place within it.
fn blend(values: &[f64; 8], place: DVec3) -> f64 {
    let w = place.to_array().map(weight);
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |k: usize| lerp(values[k], values[k + 1], w[0]);
    let sheet = |k: usize| lerp(row(k), row(k + 2), w[1]);
    lerp(sheet(0), sheet(4), w[2])
}

/// The same for eight places at a time, given by their weights.
#[inline(always)]
fn blend_lanes<S: Simd>([a, b, c, d, e, f, g, h]: [Lanes<S>; 8], w: [Lanes<S>; 3]) -> Lanes<S> {
    let near = lerp(lerp(a, b, w[0]), lerp(c, d, w[0]), w[1]);
    let far = lerp(lerp(e, f, w[0]), lerp(g, h, w[0]), w[1]);
    lerp(near, far, w[2])
}

/// The weight of the farther lattice point, from 0 to 1.
pub(crate) fn weight(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}
