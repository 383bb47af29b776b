//! Orders triangles along a space-filling curve, in linear time, where the order of the file is poor.
//!
//! A triangle counts by its first corner. Cells of 32³ over the box of all positions are numbered along Lebesgue's (Morton's) curve. One counting sort brings the
//! triangles into the order of cells; inside a cell a comparison sort by the finer 10-bit-per-axis code and the id finishes.
//! Memory: 4 bytes per triangle for the permutation, which stays, and 2 for the cells, which do not.
//!
//! The order changes time only, never a hit: (t, id) is a total order.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966; Christian Lauterbach et al., "Fast BVH
//! Construction on GPUs", 2009 (Morton order of triangles).

use rayon::prelude::*;

use crate::{Aabb, Triangles};

/// Bits per axis of a cell number: 15 bits fit the u16 that is kept per triangle.
const CELL_BITS: u32 = 5;
/// Bits per axis of the finer code within a cell.
const FINE_BITS: u32 = 10;

/// The triangles in the order of the curve.
pub(crate) fn along_curve(triangles: &Triangles<'_>) -> Vec<u32> {
    let grid = Grid::over(&triangles.position_bounds());
    // In range: there are fewer than 2³² triangles.
    let count = triangles.len() as u32;
    let cells: Vec<u16> = (0..count).into_par_iter().map(|id| grid.cell(triangles, id)).collect();

    // Count, sum up, and send every triangle to its cell's place.
    let mut starts = vec![0_usize; (1 << (3 * CELL_BITS)) + 1];
    for &cell in &cells {
        starts[usize::from(cell) + 1] += 1;
    }
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let mut next = starts.clone();
    let mut order = vec![0; triangles.len()];
    for (id, &cell) in (0_u32..).zip(&cells) {
        let place = &mut next[usize::from(cell)];
        order[*place] = id;
        *place += 1;
    }
    drop(cells);

    sort_within_cells(&mut order, &starts, |id| grid.fine(triangles, id));
    order
}

/// Sorts each cell's triangles by (code, id), in parallel over disjoint cells.
fn sort_within_cells(order: &mut [u32], starts: &[usize], code: impl Fn(u32) -> u32 + Sync) {
    let mut rest = order;
    let mut slices = Vec::new();
    for pair in starts.windows(2) {
        let (cell, after) = rest.split_at_mut(pair[1] - pair[0]);
        rest = after;
        if cell.len() > 1 {
            slices.push(cell);
        }
    }
    slices.into_par_iter().with_min_len(16).for_each_init(Vec::new, |keys: &mut Vec<u64>, cell| {
        keys.clear();
        keys.extend(cell.iter().map(|&id| u64::from(code(id)) << 32 | u64::from(id)));
        keys.sort_unstable();
        // The low half is the id.
        cell.iter_mut().zip(keys.iter()).for_each(|(id, &key)| *id = key as u32);
    });
}

/// Cubic cells over a box.
struct Grid {
    lo: [f64; 3],
    cells_per_unit: f64,
}

impl Grid {
    /// 2^(CELL_BITS + FINE_BITS) cells along the longest side.
    fn over(bounds: &Aabb) -> Self {
        let longest = bounds.extent()[bounds.longest_axis()];
        let cells = f64::from(1_u32 << (CELL_BITS + FINE_BITS));
        Self {
            lo: bounds.lo.map(f64::from),
            cells_per_unit: if longest > 0.0 { cells / longest } else { 0.0 },
        }
    }

    /// The cell coordinates of a triangle's first corner, CELL_BITS + FINE_BITS bits each.
    fn place(&self, triangles: &Triangles<'_>, id: u32) -> [u32; 3] {
        let corner = triangles.first_corner(id);
        let last = (1 << (CELL_BITS + FINE_BITS)) - 1;
        // The cast saturates, and the minimum keeps the far side inside.
        [0, 1, 2].map(|k| (((f64::from(corner[k]) - self.lo[k]) * self.cells_per_unit) as u32).min(last))
    }

    /// The number of a triangle's cell along the curve.
    fn cell(&self, triangles: &Triangles<'_>, id: u32) -> u16 {
        // In range: 15 bits.
        interleave(self.place(triangles, id).map(|x| x >> FINE_BITS)) as u16
    }

    /// The finer code of a triangle within its cell.
    fn fine(&self, triangles: &Triangles<'_>, id: u32) -> u32 {
        interleave(self.place(triangles, id).map(|x| x & ((1 << FINE_BITS) - 1)))
    }
}

/// The Morton code of three 10-bit numbers.
fn interleave([x, y, z]: [u32; 3]) -> u32 {
    spread(x) << 2 | spread(y) << 1 | spread(z)
}

/// Bit k of a 10-bit number moves to bit 3k.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interleaves_bits() {
        for k in 0..10 {
            assert_eq!(interleave([1 << k, 0, 0]), 1 << (3 * k + 2));
            assert_eq!(interleave([0, 1 << k, 0]), 1 << (3 * k + 1));
            assert_eq!(interleave([0, 0, 1 << k]), 1 << (3 * k));
        }
    }

    #[test]
    fn order_is_a_permutation() {
        let positions: Vec<[f32; 3]> =
            (0..999_u16).map(|i| [f32::from(i * 37 % 101), f32::from(i % 7), 0.0]).collect();
        let indices: Vec<[u32; 3]> = (0..997).map(|i| [i, i + 1, i + 2]).collect();
        let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
        let mut order = along_curve(&triangles);
        order.sort_unstable();
        assert!(order.into_iter().eq(0..997));
    }
}
