//! What packets of rays cover of a tile, and how far their rays reach: compared eight at a time with what a triangle
//! covers.
//!
//! Based on: Kirill Garanzha, Charles Loop, "Fast Ray Sorting and Breadth-First Packet Traversal for GPU Ray Tracing",
//! 2010 (bounds of packets in a hierarchy).

use fearless_simd::prelude::*;

use crate::simd::lanes::{LANES, Narrow, least_of};

/// The rectangles of packets or blocks, eight by eight: \[first column, first row, last column, last row\], and the
/// least of their points' keys.
#[derive(Debug)]
pub(crate) struct Bounds<const N: usize> {
    sides: [[[f32; LANES]; N]; 4],
    pub(crate) far: [[f32; LANES]; N],
}

impl<const N: usize> Bounds<N> {
    /// Of nothing.
    pub(crate) const EMPTY: Self = Self {
        sides: [
            [[f32::INFINITY; LANES]; N],
            [[f32::INFINITY; LANES]; N],
            [[f32::NEG_INFINITY; LANES]; N],
            [[f32::NEG_INFINITY; LANES]; N],
        ],
        far: [[f32::INFINITY; LANES]; N],
    };

    /// Those of eight, as bits, that meet a rectangle of columns and rows and are not nearer than `key`.
    #[inline(always)]
    pub(crate) fn meeting<S: Simd>(&self, simd: S, eight: usize, rect: &[f32; 4], key: f32) -> u64 {
        let [x0, y0, x1, y1] = &self.sides;
        let met = Narrow::load_array_ref(simd, &x0[eight]).simd_le(rect[2])
            & Narrow::load_array_ref(simd, &y0[eight]).simd_le(rect[3])
            & Narrow::load_array_ref(simd, &x1[eight]).simd_ge(rect[0])
            & Narrow::load_array_ref(simd, &y1[eight]).simd_ge(rect[1])
            & Narrow::load_array_ref(simd, &self.far[eight]).simd_le(key);
        met.to_bitmask()
    }

    /// The sides of eight, and the least of their keys.
    #[inline(always)]
    pub(crate) fn eight<S: Simd>(&self, simd: S, eight: usize) -> ([Narrow<S>; 4], Narrow<S>) {
        let [x0, y0, x1, y1] = &self.sides;
        let load = |lanes: &[f32; LANES]| Narrow::load_array_ref(simd, lanes);
        ([load(&x0[eight]), load(&y0[eight]), load(&x1[eight]), load(&y1[eight])], load(&self.far[eight]))
    }

    /// The sides around eight, and the least of their keys.
    #[inline(always)]
    pub(crate) fn union<S: Simd>(&self, simd: S, eight: usize) -> ([f32; 4], f32) {
        let [x0, y0, x1, y1] = &self.sides;
        let load = |lanes: &[f32; LANES]| Narrow::load_array_ref(simd, lanes);
        let lo = [least_of(load(&x0[eight])), least_of(load(&y0[eight]))];
        let hi = [-least_of(-load(&x1[eight])), -least_of(-load(&y1[eight]))];
        ([lo[0], lo[1], hi[0], hi[1]], least_of(load(&self.far[eight])))
    }

    /// Keeps the sides and the least key of one.
    #[inline(always)]
    pub(crate) fn set(&mut self, index: usize, sides: [f32; 4], far: f32) {
        for (all, side) in self.sides.iter_mut().zip(sides) {
            all[index / LANES][index % LANES] = side;
        }
        self.far[index / LANES][index % LANES] = far;
    }
}
