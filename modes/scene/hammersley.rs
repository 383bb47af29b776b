//! The sub-positions of pixels and texels.
//!
//! Point k of n is ((k + ½)/n, φ(k)·(1 − 1/n) + ½/n), where φ(k) mirrors the bits of k at the binary point. One point alone
//! is the centre.
//!
//! Jittered, point k lies anywhere within its strata, [k, k + 1)/n and [r, r + 1)/n, where φ(k) is the r-th of the n numbers.
//!
//! Based on: John Michael Hammersley, "Monte Carlo Methods for Solving Multivariable Problems", 1960; Robert Cook, "Stochastic
//! Sampling in Computer Graphics", 1986 (jitter).

use crate::bake::sample_sets::{mix, uniform};

/// Point k of n, k < n: two numbers in (0, 1).
pub(crate) fn hammersley(k: u32, n: u32) -> [f64; 2] {
    let reversed = f64::from(k.reverse_bits()) / f64::from(u32::MAX);
    let n = f64::from(n);
    [(f64::from(k) + 0.5) / n, reversed * (1.0 - 1.0 / n) + 0.5 / n]
}

/// Point k of n, k < n, jittered by a seed: two numbers in [0, 1).
pub(crate) fn jittered(k: u32, n: u32, seed: u64) -> [f64; 2] {
    // In range: it is less than n.
    let rank = (0..n).filter(|other| other.reverse_bits() < k.reverse_bits()).count() as u32;
    let state = mix(mix(seed) ^ u64::from(k));
    let at = |stratum: u32, state: u64| (f64::from(stratum) + uniform(state)) / f64::from(n);
    [at(k, mix(state)), at(rank, mix(mix(state)))]
}
