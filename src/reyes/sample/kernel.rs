//! The leaf of Reyes: a grid of micropolygons against the rays of a tile.
//!
//! 1. Project the points of the grid to columns and rows, counted from the first ray of the tile, and to depth keys: once
//!    each, eight at a time. See [`crate::reyes::sample::projected`].
//! 2. Eight quadrilaterals of a row at a time: those that lie around no ray are dropped, most of them.
//! 3. The rays that are left are tested with the edges of both triangles, on the film. Where rounding leaves doubt, the
//!    exact stage decides.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Kayvon
//! Fatahalian et al., "Data-Parallel Rasterization of Micropolygons with Defocus and Motion Blur", 2009.

use fearless_simd::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::intersect::grid::hierarchical_z::HierarchicalZ;
use crate::intersect::pencil::rect::Rect;
use crate::reyes::sample::grid_tile::GridTile;
use crate::reyes::sample::projected::{IRREGULAR, KEY_ERROR, PLACE_ERROR, PLACE_ERROR_PART, PlacedGrid};
use crate::reyes::sample::winners::GridSamples;
use crate::simd::lanes::{LANES, Lanes, Narrow, Points, bits};

/// Quadrilaterals around more columns or rows than this are tested by themselves.
const MOST_SIDE: f32 = 16.0;

/// The least and the greatest of some numbers.
fn ends(numbers: [f64; LANES]) -> (f64, f64) {
    let least = numbers.into_iter().fold(f64::INFINITY, |least, x| if x < least { x } else { least });
    let greatest = numbers.into_iter().fold(f64::NEG_INFINITY, |most, x| if x > most { x } else { most });
    (least, greatest)
}

impl GridTile<'_> {
    /// Whether what lies in a box is hidden from all rays that it may meet. Its keys are at most `greatest`.
    #[inline(always)]
    pub(crate) fn hides<S: Simd>(
        &self,
        simd: S,
        blocks: &HierarchicalZ,
        (bounds, greatest): (Aabb, f64),
    ) -> bool {
        if blocks.hides(greatest) {
            return true;
        }
        let (lo, hi) = bounds.corners();
        let [x, y, z] = [0, 1, 2].map(|k| {
            let corner = |place: usize| if place >> k & 1 == 0 { lo[k] } else { hi[k] };
            Lanes::load_array(simd, [0, 1, 2, 3, 4, 5, 6, 7].map(corner))
        });
        let corners = Points { x, y, z }.minus(Points::splat(simd, self.pixels.base));
        let [least_t, error_t] = self.pixels.regular_from(bounds.reach(self.pixels.base));
        let ([x, y], key, regular) = self.pixels.place(simd, corners, least_t);
        let near = x.abs().max(y.abs()).simd_lt(f64::from(IRREGULAR));
        if regular.to_bitmask() & near.to_bitmask() != 0xFF {
            return false;
        }
        let sides = [(x, self.rect.width()), (y, self.rect.height())].map(|(places, size)| {
            let (least, greatest) = ends(places.to_array());
            let slack =
                f64::from(PLACE_ERROR) + least.abs().max(greatest.abs()) * f64::from(PLACE_ERROR_PART);
            let last = f64::from(size - 1);
            ((least - slack).ceil().clamp(0.0, last), (greatest + slack).floor().clamp(-1.0, last))
        });
        let [(x0, x1), (y0, y1)] = sides;
        if x1 < x0 || y1 < y0 {
            // Between the rays.
            return true;
        }
        let rect = Rect { x0: x0 as u32, y0: y0 as u32, x1: x1 as u32 + 1, y1: y1 as u32 + 1 };
        let (_, key) = ends(key.to_array());
        let key = (key + error_t) as f32;
        blocks.hides_in_rect(simd, rect, key + (key.abs() * KEY_ERROR + f32::MIN_POSITIVE))
    }

    /// Tests the quadrilaterals of a grid against the rays.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, simd: S, grid: &PlacedGrid, samples: &mut GridSamples<'_>) {
        let [across, along] = grid.size;
        for v in 0..along {
            for u in (0..across).step_by(LANES) {
                let lanes = u64::MAX >> (u64::BITS as usize - LANES.min(across - u));
                self.sample_eight(simd, (grid, v * (across + 1) + u, lanes), samples);
            }
        }
    }

    /// Eight of them, or less.
    #[inline(always)]
    fn sample_eight<S: Simd>(
        &self,
        simd: S,
        (grid, first, lanes): (&PlacedGrid, usize, u64),
        samples: &mut GridSamples<'_>,
    ) {
        let quads = grid.quads(simd, first);
        let [[x_lo, x_hi], [y_lo, y_hi]] = quads.range;
        let (zero, delta) = (Narrow::simd_from(simd, 0.0), quads.place_error());
        let last = [self.rect.width(), self.rect.height()].map(|side| (side - 1) as f32);
        let x0 = (x_lo - delta).ceil().max(zero);
        let x1 = (x_hi + delta).floor().min(zero + last[0]);
        let y0 = (y_lo - delta).ceil().max(zero);
        let y1 = (y_hi + delta).floor().min(zero + last[1]);
        let irregular = (x_hi.simd_ge(IRREGULAR) | y_hi.simd_ge(IRREGULAR)).to_bitmask() & lanes;
        let mut met = (x0.simd_le(x1) & y0.simd_le(y1)).to_bitmask() & lanes & !irregular;
        if met | irregular == 0 {
            return;
        }
        let large = ((x1 - x0).max(y1 - y0)).simd_gt(MOST_SIDE).to_bitmask() & met;
        met &= !large;
        for lane in bits(large) {
            let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(|side| side.to_array()[lane] as u32);
            samples.test_all(self, first + lane, Rect { x0, y0, x1: x1 + 1, y1: y1 + 1 });
        }
        for lane in bits(irregular) {
            let (x1, y1) = (self.rect.width(), self.rect.height());
            samples.test_all(self, first + lane, Rect { x0: 0, y0: 0, x1, y1 });
        }
        if met == 0 {
            return;
        }
        let error = quads.edge_error(delta);
        let keys = quads.keys.map(|key| key.to_array());
        // Every lane goes through its own columns and rows.
        let (mut y, mut in_rows) = (y0, met);
        while in_rows != 0 {
            let (mut x, mut inside) = (x0, in_rows);
            while inside != 0 {
                let found = quads.covered([x, y], error);
                if (found[0][1] | found[1][1]) & inside != 0 {
                    let places = [x.to_array(), y.to_array()];
                    self.offer(samples, first, (places, keys), found.map(|[s, m]| [s & inside, m & inside]));
                }
                x += 1.0;
                inside &= x.simd_le(x1).to_bitmask();
            }
            y += 1.0;
            in_rows &= y.simd_le(y1).to_bitmask();
        }
    }

    /// Offers what eight rays hit, certainly or perhaps.
    #[inline(always)]
    fn offer(
        &self,
        samples: &mut GridSamples<'_>,
        first: usize,
        ([x, y], [lo, hi]): ([[f32; LANES]; 2], [[f32; LANES]; 2]),
        found: [[u64; 2]; 2],
    ) {
        for (second, [certain, possible]) in [false, true].into_iter().zip(found) {
            for lane in bits(possible) {
                let ray = [x[lane] as u32, y[lane] as u32];
                let certain = certain >> lane & 1 == 1;
                samples.offer(self, (first + lane, second), ray, [lo[lane], hi[lane]], certain);
            }
        }
    }
}
