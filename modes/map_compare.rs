//! How often a cube map is wrong: its answers against exact shadows, receiver by receiver.
//!
//! Both kinds of error are counted apart. *Acne* is a receiver that the light reaches and the map calls shadowed; a *leak*
//! is one in shadow that the map calls lit. Receivers that turn away from the light are no question to a map: whatever
//! shades them knows.
//!
//! Based on: Lance Williams, "Casting Curved Shadows on Curved Surfaces", 1978 (both errors, and their cause).

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Origin, Triangles};

use crate::CubeMap;
use crate::shadow::{SeenReceiver, turns_to};

/// What a cube map gets wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapErrors {
    /// Receivers in all.
    pub receivers: usize,
    /// Receivers that turn to the light: those for which the map was asked.
    pub asked: usize,
    /// Lit ones that the map calls shadowed.
    pub acne: usize,
    /// Shadowed ones that the map calls lit.
    pub leaks: usize,
    /// The median of the biases that were needed, in world units; 0 where none was asked.
    pub median_bias: f64,
    /// The greatest of them.
    pub greatest_bias: f64,
}

/// Asks a cube map about each receiver and compares with the exact answers, those of [`crate::lit`].
///
/// # Panics
/// When there are not as many answers as receivers.
#[must_use]
pub fn compare_maps(
    triangles: &Triangles<'_>,
    map: &CubeMap,
    receivers: &[SeenReceiver],
    lit: &[bool],
) -> MapErrors {
    assert_eq!(receivers.len(), lit.len());
    let light = Origin::Point(map.light());
    let asked = receivers.par_iter().zip(lit).filter(|(receiver, _)| turns_to(triangles, light, receiver));
    let answer = |(receiver, &lit): (&SeenReceiver, &bool)| {
        let point = DVec3::from_array(receiver.point.map(f64::from));
        let normal = triangles.normal(receiver.id);
        (lit, map.is_lit(point, normal), map.bias(point, normal))
    };
    let answers: Vec<(bool, bool, f64)> = asked.map(answer).collect();
    let count = |exact: bool| answers.iter().filter(|a| a.0 == exact && a.1 != exact).count();
    let mut biases: Vec<f64> = answers.iter().map(|a| a.2).collect();
    biases.sort_unstable_by(f64::total_cmp);
    MapErrors {
        receivers: receivers.len(),
        asked: answers.len(),
        acne: count(true),
        leaks: count(false),
        median_bias: biases.get(biases.len() / 2).copied().unwrap_or(0.0),
        greatest_bias: biases.last().copied().unwrap_or(0.0),
    }
}
