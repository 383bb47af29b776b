//! Directions of ambient rays: sets that receivers share, and random ones of a receiver's own.
//!
//! Based on: Alvaro González, "Measurement of Areas on a Sphere Using Fibonacci and Latitude–Longitude Lattices", 2010;
//! Tom Duff et al., "Building an Orthonormal Basis, Revisited", 2017; Guy Steele, Doug Lea, Christine Flood, "Fast
//! Splittable Pseudorandom Number Generators", 2014 (SplitMix64).

use std::f64::consts::TAU;

use umbel::glam::DVec3;

use crate::subjects::morton;

/// The fractional part of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Directions that are spread evenly over the whole sphere, about half of them above any surface. Each has the length 1 up
/// to rounding; neighbours mostly follow each other.
pub(crate) fn sphere(count: usize) -> Vec<[f32; 3]> {
    let direction = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (radius, angle) = ((1.0 - z * z).sqrt(), TAU * (k as f64 * GOLDEN).fract());
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z).as_vec3().to_array()
    };
    let directions: Vec<[f32; 3]> = (0..count).map(direction).collect();
    morton::order(&directions).into_iter().map(|k| directions[k as usize]).collect()
}

/// Three axes at right angles, of length 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axes([[f32; 3]; 3]);

impl Axes {
    /// The last one points along a normal of length 1.
    pub(crate) fn around(normal: [f32; 3]) -> Self {
        let [x, y, z] = normal;
        let sign = 1.0_f32.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        Self([[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], normal])
    }

    /// A vector with these components along the axes.
    pub(crate) fn vector(&self, components: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| (0..3).map(|axis| self.0[axis][k] * components[axis]).sum())
    }

    /// A direction around the last axis with a probability in proportion to the cosine, from two numbers in [0, 1).
    pub(crate) fn cosine(&self, [u, v]: [f32; 2]) -> [f32; 3] {
        let (radius, (sine, cosine)) = (u.sqrt(), (std::f32::consts::TAU * v).sin_cos());
        self.vector([radius * cosine, radius * sine, (1.0 - u).sqrt()])
    }
}

/// Random numbers with a seed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Random(u64);

impl Random {
    /// Different seeds give numbers that have nothing to do with each other.
    pub(crate) fn new(seed: u64) -> Self {
        let mut scrambled = Self(seed);
        Self(scrambled.bits())
    }

    /// 64 random bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Two numbers in [0, 1).
    pub(crate) fn pair(&mut self) -> [f32; 2] {
        let bits = self.bits();
        [bits >> 40, bits >> 16 & 0xFF_FFFF].map(|x| x as f32 / 16_777_216.0)
    }

    /// A whole number below `end`, which is far below 2³².
    pub(crate) fn below(&mut self, end: usize) -> usize {
        (((self.bits() >> 32) * end as u64) >> 32) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_sphere_is_above() {
        let sphere = sphere(128);
        for normal in [[0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [-0.48, 0.6, 0.64_f32]] {
            let height = |d: &[f32; 3]| d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
            let above = sphere.iter().filter(|&d| height(d) > 0.0).count();
            assert!((61..=67).contains(&above), "{above}");
        }
    }

    /// The mean of the cosine is 2/3 then.
    #[test]
    fn cosine_directions_lie_above() {
        let (axes, mut random) = (Axes::around([0.48, -0.6, -0.64]), Random::new(7));
        let height = |d: [f32; 3]| f64::from(d[0]) * 0.48 - f64::from(d[1]) * 0.6 - f64::from(d[2]) * 0.64;
        let heights: Vec<f64> = (0..10_000).map(|_| height(axes.cosine(random.pair()))).collect();
        assert!(heights.iter().all(|&h| h > -1e-6));
        assert!((heights.iter().sum::<f64>() / 1e4 - 2.0 / 3.0).abs() < 0.01);
    }
}
