//! Directions that many receivers share, and how points are seen along one.
//!
//! With k the axis of the largest component of d, and i and j those that follow it, a point is seen along d at
//!
//! u = x_i + s_i x_k, v = x_j + s_j x_k, s = −(d_i, d_j)/d_k:
//!
//! the same along the whole ray. x_k, turned so that it grows along the ray, tells how far. Slopes are at most 1.
//!
//! Based on: Quirin Meyer et al., "On Floating-Point Normal Vectors", 2010 (octahedral map); Guy Morton, "A Computer
//! Oriented Geodetic Data Base", 1966.

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::intersect::beam::objects::Scale;
use crate::rays::hemisphere::RaySample;
use crate::simd::lanes::{WIDTH, Wide};

/// Cells along a side of the octahedral map.
const OCTAHEDRAL_CELLS: f64 = 256.0;

/// A direction of rays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direction {
    /// Its place among the samples as given, and the sample.
    pub(crate) index: usize,
    pub(crate) sample: RaySample,
    /// d over its greatest component, rounded.
    pub(crate) scaled: [f32; 3],
    /// k, i and j.
    pub(crate) axes: [usize; 3],
    /// s_i and s_j, rounded.
    pub(crate) slopes: [f32; 2],
    /// The sign of d_k.
    pub(crate) turn: f32,
    /// How much x_k may change along a ray, scaled.
    pub(crate) limit: f32,
}

impl Direction {
    pub(crate) fn new(index: usize, sample: RaySample, scale: Scale) -> Self {
        let d = sample.direction;
        let size = d.abs();
        let k = (1..3).fold(0, |k, axis| if size[axis] > size[k] { axis } else { k });
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        Self {
            index,
            sample,
            scaled: (d / size[k]).as_vec3().to_array(),
            axes: [k, i, j],
            slopes: [i, j].map(|axis| (-d[axis] / d[k]) as f32),
            turn: if d[k] < 0.0 { -1.0 } else { 1.0 },
            limit: scale.of_distance(f64::from(sample.t_max) * size[k]),
        }
    }

    /// u and v of sixteen points or vectors, given their coordinates k, i and j.
    #[inline(always)]
    pub(crate) fn across<S: Simd>(&self, simd: S, [k, i, j]: [Wide<S>; 3]) -> [Wide<S>; 2] {
        let [s, t] = self.slopes;
        [k.mul_add(Wide::splat(simd, s), i), k.mul_add(Wide::splat(simd, t), j)]
    }

    /// Coordinates k, i and j of sixteen points.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, points: &[[f32; WIDTH]; 3]) -> [Wide<S>; 3] {
        let [k, i, j] = self.axes;
        [
            Wide::load_array_ref(simd, &points[k]),
            Wide::load_array_ref(simd, &points[i]),
            Wide::load_array_ref(simd, &points[j]),
        ]
    }
}

/// Directions in an order in which neighbours are alike.
pub(crate) fn in_order(samples: &[RaySample], scale: Scale) -> Vec<Direction> {
    let mut directions: Vec<Direction> =
        samples.iter().enumerate().map(|(index, &sample)| Direction::new(index, sample, scale)).collect();
    directions.sort_by_key(|direction| (octahedral_cell(direction.sample.direction), direction.index));
    directions
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
