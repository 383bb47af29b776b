//! How often a cube map is wrong: its answers against exact shadows, receiver by receiver.
//!
//! Both kinds of error are counted apart. *Acne* is a receiver that the light reaches and the map calls shadowed; a *leak*
//! is one in shadow that the map calls lit. What turns away from the light is no question to a map, and no receiver: whatever
//! shades it knows.
//!
//! Based on: Lance Williams, "Casting Curved Shadows on Curved Surfaces", 1978 (both errors, and their cause).

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Receiver, Triangles};

use crate::shadow::lookup::CubeMap;

/// What a cube map gets wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapErrors {
    /// The receivers for which the map was asked.
    pub receivers: usize,
    /// Lit ones that the map calls shadowed.
    pub acne: usize,
    /// Shadowed ones that the map calls lit.
    pub leaks: usize,
    /// The median of the biases that were needed, in world units; 0 where none was asked.
    pub median_bias: f64,
    /// The greatest of them.
    pub greatest_bias: f64,
}

/// Asks a cube map about each receiver of its light and compares with the exact answers, those of
/// [`Frame::shadowed`](crate::Frame::shadowed).
///
/// # Panics
/// When there are not as many answers as receivers.
#[must_use]
pub fn compare_maps(
    triangles: &Triangles<'_>,
    map: &CubeMap,
    receivers: &[Receiver],
    shadowed: &[bool],
) -> MapErrors {
    assert_eq!(receivers.len(), shadowed.len());
    let answer = |(receiver, &shadowed): (&Receiver, &bool)| {
        let point = DVec3::from_array(receiver.point.map(f64::from));
        let normal = triangles.normal(receiver.triangle);
        (!shadowed, map.is_lit(point, normal), map.bias(point, normal))
    };
    let answers: Vec<(bool, bool, f64)> = receivers.par_iter().zip(shadowed).map(answer).collect();
    let count = |exact: bool| answers.iter().filter(|a| a.0 == exact && a.1 != exact).count();
    let mut biases: Vec<f64> = answers.iter().map(|a| a.2).collect();
    biases.sort_unstable_by(f64::total_cmp);
    MapErrors {
        receivers: receivers.len(),
        acne: count(true),
        leaks: count(false),
        median_bias: biases.get(biases.len() / 2).copied().unwrap_or(0.0),
        greatest_bias: biases.last().copied().unwrap_or(0.0),
    }
}
