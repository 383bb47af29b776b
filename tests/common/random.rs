//! Random numbers from seeds: the same on every machine.
//!
//! Based on: Guy Steele, Doug Lea, Christine Flood, "Fast Splittable Pseudorandom Number Generators", 2014 (SplitMix64).

use umbel::glam::DVec3;

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// An integer in 0..n.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// An integer in -n..=n.
    pub fn around(&mut self, n: usize) -> f64 {
        self.below(2 * n + 1) as f64 - n as f64
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number in [-1, 1] with 53 bits.
    pub fn signed(&mut self) -> f64 {
        (self.bits() >> 10) as f64 / (1_u64 << 53) as f64 - 1.0
    }

    /// A point in [-1, 1]^3.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A lattice point in [-n, n]^3.
    pub fn lattice(&mut self, n: usize) -> DVec3 {
        DVec3::new(self.around(n), self.around(n), self.around(n))
    }

    /// One of the items.
    pub fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// True once in n times.
    pub fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }
}
