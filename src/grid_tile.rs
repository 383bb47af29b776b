//! The leaf of Reyes: a grid of micropolygons against the rays of a tile.
//!
//! 1. Project the points of the grid to columns and rows, counted from the first ray of the tile, and to depth keys: once
//!    each, eight at a time.
//! 2. Eight quadrilaterals of a row at a time: those that lie around no ray are dropped, most of them.
//! 3. The rays that are left are tested with the edges of both triangles, on the film. Where rounding leaves doubt, the
//!    exact stage decides.
//!
//! A place on the film errs by at most δ = 2⁻¹⁹ + 2⁻²²m, m its magnitude: 2⁻²⁰ + 2⁻³⁰m of a regular point, see
//! [`crate::footprints`], and 2⁻²⁴m of rounding to f32. An edge function (a_x − x)(b_y − y) − (a_y − y)(b_x − x) of a ray
//! within δ of the box of the triangle, D the sum of the box's sides, has factors of at most D + 2δ that err by 2δ each:
//! less than 8δ(D + 2δ) in all, roundings included. Irregular points are put at [`IRREGULAR`].
//!
//! The depth key of a ray lies between those of the corners, see [`crate::tile_keys`]: micropolygons are small, so the exact
//! order is asked rarely.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Kayvon
//! Fatahalian et al., "Data-Parallel Rasterization of Micropolygons with Defocus and Motion Blur", 2009.

use fearless_simd::prelude::*;

use crate::footprints::Pixels;
use crate::frustum::Frustum;
use crate::gather::transposed_points;
use crate::grid_samples::GridSamples;
use crate::hierarchical_z::HierarchicalZ;
use crate::lanes::{LANES, Lanes, Narrow, NarrowMask, Points, bits, narrow, widen};
use crate::pencil::Origin;
use crate::tile_keys::SIDE;
use crate::window::Rect;
use crate::{Aabb, GridFilm};

/// The column of points that have none, and of those too far away to say.
const IRREGULAR: f32 = 1e20;
/// Keys beyond this are as good as infinite.
const KEY_LIMIT: f64 = 1e37;
/// δ = PLACE_ERROR + PLACE_ERROR_PART·m.
const PLACE_ERROR: f32 = 1.0 / (1 << 19) as f32;
const PLACE_ERROR_PART: f32 = 1.0 / (1 << 22) as f32;
/// The error of edge functions, over δ(D + 2δ).
const EDGE_ERROR: f32 = 8.0;
/// The error of a key, as a part of it: rounding it to f32, and that of a regular point.
const KEY_ERROR: f32 = 1.0 / (1 << 22) as f32;
/// Quadrilaterals around more columns or rows than this are tested by themselves.
const MOST_SIDE: f32 = 16.0;

/// The points of a grid on a tile.
#[derive(Debug, Default)]
pub(crate) struct PlacedGrid {
    /// Quadrilaterals along u and v.
    pub(crate) size: [usize; 2],
    columns: Vec<f32>,
    rows: Vec<f32>,
    keys: Vec<f32>,
    /// The error of the keys beside that of rounding.
    key_error: f32,
}

impl PlacedGrid {
    /// Bytes of the buffers.
    pub(crate) fn bytes(&self) -> usize {
        (self.columns.capacity() + self.rows.capacity() + self.keys.capacity()) * size_of::<f32>()
    }

    /// Projects the points of a grid within `bounds`. Tells whether any of them is irregular.
    #[inline(always)]
    pub(crate) fn place<S: Simd>(
        &mut self,
        simd: S,
        (points, size): (&[[f32; 3]], [usize; 2]),
        pixels: &Pixels,
        bounds: &Aabb,
    ) -> bool {
        let [least_t, error_t] = pixels.regular_from(bounds.reach(pixels.base));
        self.size = size;
        // One more: the error is rounded to f32.
        self.key_error = error_t as f32 * 2.0 + f32::MIN_POSITIVE;
        let base = Points::splat(simd, pixels.base);
        // Eight lanes are read from any quadrilateral on, and the points beside it.
        let room = points.len().next_multiple_of(LANES) + 2 * LANES;
        for places in [&mut self.columns, &mut self.rows, &mut self.keys] {
            places.resize(room.max(places.len()), 0.0);
        }
        let irregular = Narrow::simd_from(simd, IRREGULAR);
        let mut all = u64::MAX;
        for (first, points) in (0..).step_by(LANES).zip(points.chunks(LANES)) {
            let mut eight = [points[0]; LANES];
            eight[..points.len()].copy_from_slice(points);
            let [x, y, z] = transposed_points(simd, &eight);
            let points = Points { x: widen(x), y: widen(y), z: widen(z) }.minus(base);
            let ([x, y], key, regular) = pixels.place(simd, points, least_t);
            let limit = f64::from(IRREGULAR);
            let regular =
                regular & key.abs().simd_lt(KEY_LIMIT) & x.abs().simd_lt(limit) & y.abs().simd_lt(limit);
            let regular = regular.to_bitmask();
            all &= regular | !0xFF;
            let regular = NarrowMask::from_bitmask(simd, regular);
            regular.select(narrow(x), irregular).store_slice(&mut self.columns[first..first + LANES]);
            regular.select(narrow(y), irregular).store_slice(&mut self.rows[first..first + LANES]);
            narrow(key).store_slice(&mut self.keys[first..first + LANES]);
        }
        all != u64::MAX
    }

    /// The places of eight points from one on.
    #[inline(always)]
    fn eight<S: Simd>(simd: S, places: &[f32], first: usize) -> Narrow<S> {
        Narrow::from_slice(simd, &places[first..first + LANES])
    }

    /// The box of four points and their greatest and least keys.
    #[inline(always)]
    fn quads<S: Simd>(&self, simd: S, first: usize) -> Quads<S> {
        let width = self.size[0] + 1;
        let corners = [first, first + 1, first + width + 1, first + width];
        let mut seen = [[Narrow::simd_from(simd, 0.0); 2]; 4];
        for (seen, corner) in seen.iter_mut().zip(corners) {
            *seen = [Self::eight(simd, &self.columns, corner), Self::eight(simd, &self.rows, corner)];
        }
        let [a, b, c, d] = seen;
        let mut range = [[a[0]; 2], [a[1]; 2]];
        for (axis, range) in range.iter_mut().enumerate() {
            *range = [
                a[axis].min(b[axis]).min(c[axis].min(d[axis])),
                a[axis].max(b[axis]).max(c[axis].max(d[axis])),
            ];
        }
        let [a, b, c, d] = corners.map(|corner| Self::eight(simd, &self.keys, corner));
        let (least, greatest) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        let lo = least - (least.abs() * KEY_ERROR + self.key_error);
        let hi = greatest + (greatest.abs() * KEY_ERROR + self.key_error);
        Quads { corners: seen, range, keys: [lo, hi] }
    }
}

/// Eight quadrilaterals on the film.
struct Quads<S: Simd> {
    /// Column and row of the corners, in order around.
    corners: [[Narrow<S>; 2]; 4],
    /// The least and the greatest column, and row.
    range: [[Narrow<S>; 2]; 2],
    /// Bounds of their keys.
    keys: [Narrow<S>; 2],
}

impl<S: Simd> Quads<S> {
    /// δ.
    #[inline(always)]
    fn place_error(&self) -> Narrow<S> {
        let [[x0, x1], [y0, y1]] = self.range;
        let size = x0.abs().max(x1.abs()).max(y0.abs().max(y1.abs()));
        size * PLACE_ERROR_PART + PLACE_ERROR
    }

    /// Which of the lanes the rays at some columns and rows hit, as bits: each triangle for certain, and perhaps.
    #[inline(always)]
    fn covered(&self, ray: [Narrow<S>; 2], error: Narrow<S>) -> [[u64; 2]; 2] {
        let [a, b, c, d] = self.corners;
        let [a, b, c, d] = [minus(a, ray), minus(b, ray), minus(c, ray), minus(d, ray)];
        let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
        let (cd, da) = (edge(c, d), edge(d, a));
        [agree([ab, bc, ca], error), agree([-ca, cd, da], error)]
    }
}

/// The least and the greatest of some numbers.
fn ends(numbers: [f64; LANES]) -> (f64, f64) {
    let least = numbers.into_iter().fold(f64::INFINITY, |least, x| if x < least { x } else { least });
    let greatest = numbers.into_iter().fold(f64::NEG_INFINITY, |most, x| if x > most { x } else { most });
    (least, greatest)
}

/// p − q.
#[inline(always)]
fn minus<S: Simd>(p: [Narrow<S>; 2], q: [Narrow<S>; 2]) -> [Narrow<S>; 2] {
    [p[0] - q[0], p[1] - q[1]]
}

/// p×q.
#[inline(always)]
fn edge<S: Simd>(p: [Narrow<S>; 2], q: [Narrow<S>; 2]) -> Narrow<S> {
    p[0] * q[1] - p[1] * q[0]
}

/// The lanes, as bits, whose three edge functions agree in sign for certain, and those where they may.
#[inline(always)]
fn agree<S: Simd>([one, two, three]: [Narrow<S>; 3], error: Narrow<S>) -> [u64; 2] {
    let (least, greatest) = (one.min(two).min(three), one.max(two).max(three));
    let certain = least.simd_gt(error) | greatest.simd_lt(-error);
    let impossible = least.simd_lt(-error) & greatest.simd_gt(error);
    [certain.to_bitmask(), !impossible.to_bitmask() & 0xFF]
}

/// What a tile is to its leaf.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GridTile<'a> {
    pub(crate) origin: Origin,
    pub(crate) film: &'a GridFilm,
    pub(crate) rect: Rect,
    pub(crate) frustum: Frustum,
    /// Columns and rows from the first ray of the tile.
    pub(crate) pixels: Pixels,
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
        if regular.to_bitmask() != 0xFF {
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
        let error = ((x_hi - x_lo) + (y_hi - y_lo) + delta * 2.0) * delta * EDGE_ERROR;
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
                x = x + 1.0;
                inside &= x.simd_le(x1).to_bitmask();
            }
            y = y + 1.0;
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

const _: () = assert!(SIDE < 1 << 8, "columns are small whole numbers");
