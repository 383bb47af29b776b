//! Eight points side by side: how surfaces on demand find the points of a grid.
//!
//! A surface says once how it maps eight pairs of parameters to eight points, with vectors of eight f64; here the parameters
//! are taken apart, the points put together, and the machine's instructions chosen. Only + − × ÷ √, comparisons and whole
//! numbers are used, in the order of the scalar code beside each map, so every instruction set gives the same bits.
//!
//! Closures over vectors would be compiled without the instruction set of their surroundings: hence loops, and plain calls of
//! `#[inline(always)]` functions.

use fearless_simd::{Level, dispatch, f32x8, f64x8, prelude::*};
use glam::DVec3;

/// Lanes of a vector.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
pub(crate) type Lanes<S> = f64x8<S>;

/// The coordinates of eight points.
pub(crate) type PointLanes<S> = [Lanes<S>; 3];

/// A map from parameters to points.
pub(crate) trait LaneMap {
    /// The points at eight pairs of parameters. Must be `#[inline(always)]`.
    fn points<S: Simd>(&mut self, simd: S, parameters: [Lanes<S>; 2]) -> PointLanes<S>;
}

/// Appends the points at some parameters, as the engine takes them.
pub(crate) fn map_points(
    map: &mut impl LaneMap,
    parameters: &[[f64; 2]],
    level: Level,
    points: &mut Vec<[f32; 3]>,
) {
    dispatch!(level, simd => map_all(simd, map, parameters, points));
}

#[inline(always)]
fn map_all<S: Simd>(simd: S, map: &mut impl LaneMap, parameters: &[[f64; 2]], points: &mut Vec<[f32; 3]>) {
    let first = points.len();
    points.resize(first + parameters.len(), [0.0; 3]);
    let (some, rest) = parameters.as_chunks::<LANES>();
    let (to, to_rest) = points[first..].as_chunks_mut::<LANES>();
    for (some, to) in some.iter().zip(to) {
        *to = map_eight(simd, map, some);
    }
    if let Some(&last) = rest.last() {
        let mut eight = [last; LANES];
        eight[..rest.len()].copy_from_slice(rest);
        to_rest.copy_from_slice(&map_eight(simd, map, &eight)[..rest.len()]);
    }
}

#[inline(always)]
fn map_eight<S: Simd>(simd: S, map: &mut impl LaneMap, parameters: &[[f64; 2]; LANES]) -> [[f32; 3]; LANES] {
    let [mut u, mut v] = [[0.0; LANES]; 2];
    for (lane, parameters) in parameters.iter().enumerate() {
        [u[lane], v[lane]] = *parameters;
    }
    rounded_lanes(map.points(simd, [Lanes::load_array(simd, u), Lanes::load_array(simd, v)]))
}

/// Points as the engine takes them: `extent::rounded`, eight at a time.
#[inline(always)]
pub(crate) fn rounded_lanes<S: Simd>(points: PointLanes<S>) -> [[f32; 3]; LANES] {
    let mut eight = [[0.0; 3]; LANES];
    for (k, numbers) in points.into_iter().enumerate() {
        let (low, high) = numbers.split();
        let numbers: f32x8<S> = low.narrow(high);
        let numbers = numbers.max(f32::MIN).min(f32::MAX) + 0.0;
        for (lane, &number) in numbers.as_array().iter().enumerate() {
            eight[lane][k] = number;
        }
    }
    eight
}

/// The same point eight times.
#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, p: DVec3) -> PointLanes<S> {
    [Lanes::splat(simd, p.x), Lanes::splat(simd, p.y), Lanes::splat(simd, p.z)]
}

/// p·q, summed in the order of `DVec3::dot`.
#[inline(always)]
pub(crate) fn dot<S: Simd>(p: PointLanes<S>, q: PointLanes<S>) -> Lanes<S> {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// p×q, in the order of `DVec3::cross`.
#[inline(always)]
pub(crate) fn cross<S: Simd>(p: PointLanes<S>, q: PointLanes<S>) -> PointLanes<S> {
    [p[1] * q[2] - q[1] * p[2], p[2] * q[0] - q[2] * p[0], p[0] * q[1] - q[0] * p[1]]
}
