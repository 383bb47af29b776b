//! The sub-positions of pixels and texels.
//!
//! Point k of n is ((k + ½)/n, φ(k)·(1 − 1/n) + ½/n), where φ(k) mirrors the bits of k at the binary point. One point alone
//! is the centre.
//!
//! Based on: John Michael Hammersley, "Monte Carlo Methods for Solving Multivariable Problems", 1960.

/// Point k of n, k < n: two numbers in (0, 1).
pub(crate) fn hammersley(k: u32, n: u32) -> [f64; 2] {
    let reversed = f64::from(k.reverse_bits()) / f64::from(u32::MAX);
    let n = f64::from(n);
    [(f64::from(k) + 0.5) / n, reversed * (1.0 - 1.0 / n) + 0.5 / n]
}
