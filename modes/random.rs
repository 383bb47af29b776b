//! Numbers that look random and are functions of their arguments alone, and points that fill a square evenly.
//!
//! *SplitMix64* mixes the bits of a number so well that a counter becomes a random stream.
//!
//! *Hammersley points*, the sub-positions of pixels and texels: point k of n is ((k + ½)/n, φ(k)·(1 − 1/n) + ½/n), where φ(k)
//! mirrors the bits of k at the binary point. One point alone is the centre. *Jittered*, point k lies anywhere within its
//! strata, [k, k + 1)/n and [r, r + 1)/n, where φ(k) is the r-th of the n numbers.
//!
//! Based on: Guy Steele, Doug Lea and Christine Flood, "Fast Splittable Pseudorandom Number Generators", 2014 (the mixing
//! function); John Michael Hammersley, "Monte Carlo Methods for Solving Multivariable Problems", 1960; Robert Cook, "Stochastic
//! Sampling in Computer Graphics", 1986 (jitter).

/// Number k of a stream, in [0, 1): a function of its arguments alone.
pub(crate) fn random(seed: u64, stream: u64, k: u64) -> f64 {
    uniform(mix(mix(seed ^ mix(stream)).wrapping_add(k)))
}

/// A number in [0, 1) from the upper bits of another.
pub(crate) fn uniform(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// SplitMix64: the number that follows z.
pub(crate) fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

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
