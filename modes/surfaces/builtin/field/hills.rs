//! The ground of `builtin:field`: hills of a few octaves of noise, in square patches.
//!
//! Based on: Ken Perlin, "An Image Synthesizer", 1985; Ramon Moore, "Interval Analysis", 1966 (the range over a rectangle).

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;
use umbel_core::Domain;

use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LANES, LaneMap, Lanes, PointLanes, map_points};
use crate::surfaces::noise::plane::{Cursor, PlaneNoise, Rectangle};

/// Half of the side of the field, in metres.
pub(crate) const HALF_SIDE: f64 = 1024.0;
/// Patches of the ground along each side.
pub(crate) const PATCHES: u32 = 16;
/// Octaves and amplitude, in metres, of the hills.
const HILLS: (usize, f64) = (5, 26.0);
const NOISE: PlaneNoise = PlaneNoise { seed: 0xf1e1d, frequency: 1.0 / 256.0 };

/// The height at (x, z).
pub(crate) fn height(x: f64, z: f64) -> f64 {
    let mut noise = NOISE.cursor::<{ HILLS.0 }>();
    hills(|octave| [noise.at(octave, [x, z]); 2])[0]
}

/// The hills: octaves, each with a least and a greatest value, 0.4 times as high as the one before.
fn hills(mut octave: impl FnMut(u32) -> [f64; 2]) -> [f64; 2] {
    let (mut sum, mut amplitude) = ([0.0; 2], HILLS.1);
    for k in 0..HILLS.0 as u32 {
        let value = octave(k);
        sum = [sum[0] + value[0] * amplitude, sum[1] + value[1] * amplitude];
        amplitude *= 0.4;
    }
    sum
}

/// The least and the greatest height over a rectangle.
pub(crate) fn range(rectangle: &Rectangle) -> [f64; 2] {
    hills(|octave| NOISE.range(octave, rectangle))
}

/// The heights at eight places, x and z.
pub(crate) fn heights(places: [[f64; LANES]; 2], level: Level) -> [f64; LANES] {
    dispatch!(level, simd => heights_lanes(simd, places))
}

#[inline(always)]
fn heights_lanes<S: Simd>(simd: S, [x, z]: [[f64; LANES]; 2]) -> [f64; LANES] {
    let place = [Lanes::load_array(simd, x), Lanes::load_array(simd, z)];
    *hills_lanes(simd, &mut NOISE.cursor(), place).as_array()
}

/// `hills` at eight places.
#[inline(always)]
fn hills_lanes<S: Simd>(simd: S, noise: &mut Cursor<{ HILLS.0 }>, place: [Lanes<S>; 2]) -> Lanes<S> {
    let (mut sum, mut amplitude, mut apart) = (Lanes::splat(simd, 0.0), HILLS.1, false);
    for k in 0..HILLS.0 as u32 {
        sum += noise.lanes(simd, k, place, &mut apart) * amplitude;
        amplitude *= 0.4;
    }
    sum
}

/// A box around a part of a patch.
pub(crate) fn patch_extent(patch: u32, domain: Domain) -> Extent {
    let (from, to) =
        (on_ground(patch, [domain.u[0], domain.v[0]]), on_ground(patch, [domain.u[1], domain.v[1]]));
    let rectangle = Rectangle { x: [from[0], to[0]], z: [to[1], from[1]] };
    let [least, greatest] = range(&rectangle);
    let ends = [DVec3::new(from[0], least, to[1]), DVec3::new(to[0], greatest, from[1])];
    Extent::of(ends).with_slack(HILLS.1)
}

/// Appends points of a patch.
pub(crate) fn patch_points(patch: u32, parameters: &[[f64; 2]], level: Level, points: &mut Vec<[f32; 3]>) {
    map_points(&mut Ground { patch, noise: NOISE.cursor() }, parameters, level, points);
}

/// A patch of the ground, to be asked for points.
struct Ground {
    patch: u32,
    noise: Cursor<{ HILLS.0 }>,
}

impl LaneMap for Ground {
    #[inline(always)]
    fn points<S: Simd>(&mut self, simd: S, [u, v]: [Lanes<S>; 2]) -> PointLanes<S> {
        // The steps of `on_ground`.
        let side = 2.0 * HALF_SIDE / f64::from(PATCHES);
        let (column, row) = (f64::from(self.patch % PATCHES), f64::from(self.patch / PATCHES));
        let (x, z) = ((u + column) * side - HALF_SIDE, HALF_SIDE - (v + row) * side);
        [x, hills_lanes(simd, &mut self.noise, [x, z]), z]
    }
}

/// A place on the ground: exact, so that patches meet. v runs against z.
fn on_ground(patch: u32, [u, v]: [f64; 2]) -> [f64; 2] {
    let side = 2.0 * HALF_SIDE / f64::from(PATCHES);
    let (column, row) = (f64::from(patch % PATCHES), f64::from(patch / PATCHES));
    [(column + u) * side - HALF_SIDE, HALF_SIDE - (row + v) * side]
}
