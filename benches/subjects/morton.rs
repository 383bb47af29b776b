//! Points in an order in which neighbours mostly follow each other: along Morton's curve.
//!
//! Based on: G. M. Morton, "A Computer Oriented Geodetic Data Base and a New Technique in File Sequencing", 1966.

use rayon::prelude::*;
use umbel::engine::Aabb;

/// Bits of a coordinate's cell.
const BITS: u32 = 21;

/// The indices of points along the curve through their box. Points in one cell keep their order.
pub(crate) fn order(points: &[[f32; 3]]) -> Vec<u32> {
    let bounds = Aabb::of_points(points.iter().copied());
    let (lo, extent) = (bounds.lo, bounds.extent().into_iter().fold(f64::MIN_POSITIVE, f64::max));
    let scale = f64::from((1_u32 << BITS) - 1) / extent;
    let key = |&k: &u32| {
        let point = points[k as usize];
        let cell = |axis: usize| ((f64::from(point[axis]) - f64::from(lo[axis])) * scale) as u64;
        spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2
    };
    // In range: a subject has fewer than 2³² points.
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_by_cached_key(key);
    order
}

/// The low 21 bits, each followed by two zeros.
fn spread(x: u64) -> u64 {
    let x = x & 0x1F_FFFF;
    let x = (x | x << 32) & 0x001F_0000_0000_FFFF;
    let x = (x | x << 16) & 0x001F_0000_FF00_00FF;
    let x = (x | x << 8) & 0x100F_00F0_0F00_F00F;
    let x = (x | x << 4) & 0x10C3_0C30_C30C_30C3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_a_cube_follow_the_curve() {
        let corner = |k: u32| [0, 1, 2].map(|axis| (k >> axis & 1) as f32);
        let points: Vec<[f32; 3]> = (0..8).rev().map(corner).collect();
        assert_eq!(order(&points), [7, 6, 5, 4, 3, 2, 1, 0]);
    }
}
