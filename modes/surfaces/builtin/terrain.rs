//! `builtin:terrain`: mountains without a finest scale.
//!
//! The height is a ridged multifractal of 24 octaves of noise n_k: h = H·Σ w_k·2⁻ᵏ·r_k with ridges r_k = (1 − |2·n_k − 1|)², w_0 = 1
//! and w_{k+1} = min(1, 2·w_k·r_k). So crests are rough and valleys smooth. The finest octave has a wavelength of a tenth of a
//! millimetre and the amplitude of a grain of dust; more would not show in f32.
//!
//! An octave whose waves are too short for the rays to tell apart has its r_k multiplied with [`Detail::share`], so that those after
//! the last one that is seen are never computed: in a picture about half of them. How far apart rays are is that of the whole column
//! above a place, so that it follows from the place alone.
//!
//! Bounds follow the same steps with ranges: those of the noise are tight (`noise/plane.rs`), r is monotone on either side of ½, and
//! sums and products of numbers ≥ 0 are monotone.
//!
//! Based on: Ken Musgrave, Craig Kolb and Robert Mace, "The Synthesis and Rendering of Eroded Fractal Terrains", 1989; Ramon Moore,
//! "Interval Analysis", 1966.

use fearless_simd::prelude::*;
use glam::DVec3;
use umbel_core::{Aabb, Detail, Domain, OnDemand};

use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LANES, LaneMap, Lanes, PointLanes, map_points};
use crate::surfaces::noise::lattice::{ends, share};
use crate::surfaces::noise::plane::{Cursor, PlaneNoise, Rectangle};

/// Octaves of the noise.
const OCTAVES: usize = 24;
/// Half of the side of the land, in metres.
const HALF_SIDE: f64 = 4096.0;
/// Patches along each side: 512 metres each.
const PATCHES: u32 = 16;
/// The side of one.
const SIDE: f64 = 2.0 * HALF_SIDE / PATCHES as f64;
/// What the sum of octaves is multiplied with, in metres.
const HEIGHT: f64 = 380.0;
/// No height is above this: twice that of the first octave.
const GREATEST: f64 = 2.0 * HEIGHT;
/// The noise: the first octave has cells of 2048 metres.
const NOISE: PlaneNoise = PlaneNoise { seed: 0x7e44a1, frequency: 1.0 / 2048.0 };

/// Fractal mountains, 8192 metres to each side around the origin, y upwards. Hits report the index of a patch of 512 metres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Terrain;

impl Terrain {
    /// The height above the plane y = 0 at (x, z).
    #[must_use]
    pub fn height(&self, x: f64, z: f64) -> f64 {
        height(&mut NOISE.cursor(), [x, z])
    }
}

/// The height at (x, z).
fn height(noise: &mut Cursor<OCTAVES>, place: [f64; 2]) -> f64 {
    let (mut sum, mut amplitude, mut weight) = (0.0, 1.0, 1.0);
    for octave in 0..OCTAVES as u32 {
        let ridge = ridge(noise.at(octave, place));
        let signal = ridge * weight;
        sum += signal * amplitude;
        weight = (2.0 * signal).min(1.0);
        amplitude *= 0.5;
        // Nothing more can come.
        if weight == 0.0 {
            break;
        }
    }
    sum * HEIGHT
}

fn ridge(noise: f64) -> f64 {
    let crest = 1.0 - (2.0 * noise - 1.0).abs();
    crest * crest
}

/// The range of heights over a rectangle where rays are at least and at most so far apart.
fn range(rectangle: &Rectangle, spacing: [f64; 2]) -> [f64; 2] {
    let (mut sum, mut amplitude, mut weight) = ([0.0; 2], 1.0, [1.0; 2]);
    for octave in 0..OCTAVES as u32 {
        let [most, share] = spacing.map(|spacing| Detail::share(NOISE.wavelength(octave), spacing));
        // Nothing more can come.
        if most == 0.0 {
            break;
        }
        let [least, greatest] = NOISE.range(octave, rectangle);
        // A noise may leave [0, 1] by the room for its rounding.
        let ends = [ridge(least.clamp(0.0, 1.0)), ridge(greatest.clamp(0.0, 1.0))];
        let top = if least <= 0.5 && greatest >= 0.5 { 1.0 } else { ends[0].max(ends[1]) };
        let signal = [ends[0].min(ends[1]) * weight[0] * share, top * weight[1] * most];
        sum = [sum[0] + signal[0] * amplitude, sum[1] + signal[1] * amplitude];
        weight = signal.map(|signal| (2.0 * signal).min(1.0));
        amplitude *= 0.5;
    }
    // The room that the noise leaves in an octave reaches those after it, doubled each time, while amplitudes halve.
    const SLACK: f64 = 1e-10;
    [(sum[0] - SLACK) * HEIGHT, (sum[1] + SLACK) * HEIGHT]
}

impl OnDemand for Terrain {
    type Object = u32;

    fn roots(&self) -> Vec<u32> {
        (0..PATCHES * PATCHES).collect()
    }

    fn bounds(&self, object: &u32, domain: Domain, detail: &Detail) -> Aabb {
        let [lo, hi] = [0, 1].map(|k| place(*object, [domain.u[k], domain.v[k]]));
        // v runs against z.
        let rectangle = Rectangle { x: [lo[0], hi[0]], z: [hi[1], lo[1]] };
        let column = [DVec3::new(lo[0], 0.0, hi[1]), DVec3::new(hi[0], GREATEST, lo[1])];
        let [least, greatest] = range(&rectangle, detail.spacing(column));
        let corners = [DVec3::new(lo[0], least, hi[1]), DVec3::new(hi[0], greatest, lo[1])];
        Extent::of(corners).outward()
    }

    fn expand(&self, _object: &u32, _spacing: f64, _detail: &Detail, _parts: &mut Vec<u32>) -> bool {
        false
    }

    fn evaluate(&self, patch: &u32, parameters: &[[f64; 2]], detail: &Detail, points: &mut Vec<[f32; 3]>) {
        let mut land = Land { patch: *patch, noise: NOISE.cursor(), detail };
        map_points(&mut land, parameters, detail.level(), points);
    }

    fn id(&self, patch: &u32) -> u32 {
        *patch
    }
}

/// A patch, to be asked for points.
struct Land<'a> {
    patch: u32,
    noise: Cursor<OCTAVES>,
    detail: &'a Detail,
}

impl LaneMap for Land<'_> {
    #[inline(always)]
    fn points<S: Simd>(&mut self, simd: S, [u, v]: [Lanes<S>; 2]) -> PointLanes<S> {
        // The steps of `place` and `height`.
        let (column, row) = (f64::from(self.patch % PATCHES), f64::from(self.patch / PATCHES));
        let (x, z) = ((u + column) * SIDE - HALF_SIDE, HALF_SIDE - (v + row) * SIDE);
        let (mut sum, mut weight) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (mut amplitude, mut apart) = (1.0, false);
        let (x_array, z_array) = (x.as_array(), z.as_array());
        let column = [&[*x_array, [0.0; LANES], *z_array], &[*x_array, [GREATEST; LANES], *z_array]];
        let spacing = Lanes::load_array(simd, self.detail.spacings(column));
        let [least, greatest] = ends(spacing);
        for octave in 0..OCTAVES as u32 {
            let wavelength = NOISE.wavelength(octave);
            if wavelength <= 2.0 * least {
                break;
            }
            let noise = self.noise.lanes(simd, octave, [x, z], &mut apart);
            let crest = 1.0 - (2.0 * noise - 1.0).abs();
            let mut signal = crest * crest * weight;
            if wavelength < 4.0 * greatest {
                signal *= share(wavelength, spacing);
            }
            sum += signal * amplitude;
            weight = (2.0 * signal).min(1.0);
            amplitude *= 0.5;
        }
        [x, sum * HEIGHT, z]
    }
}

/// Where parameters of a patch lie: exact, so that patches meet.
fn place(patch: u32, [u, v]: [f64; 2]) -> [f64; 2] {
    let (column, row) = (f64::from(patch % PATCHES), f64::from(patch / PATCHES));
    [(column + u) * SIDE - HALF_SIDE, HALF_SIDE - (row + v) * SIDE]
}
