//! The points of a grid on a tile: columns, rows and depth keys.
//!
//! A place on the film errs by at most δ = 2⁻¹⁹ + 2⁻²²m, m its magnitude: 2⁻²⁰ + 2⁻³⁰m of a regular point, see
//! [`crate::intersect::pencil::screen_bounds`], and 2⁻²⁴m of rounding to f32. An edge function (a_x − x)(b_y − y) −
//! (a_y − y)(b_x − x) of a ray within δ of the box of the triangle, D the sum of the box's sides, has factors of at
//! most D + 2δ that err by 2δ each: less than 8δ(D + 2δ) in all, roundings included. Irregular points are put at
//! [`IRREGULAR`].
//!
//! The depth key of a ray lies between those of the corners, see [`crate::intersect::grid::tile_keys`]: micropolygons
//! are small, so the exact order is asked rarely.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (edge functions); Kayvon Fatahalian et
//! al., "Data-Parallel Rasterization of Micropolygons with Defocus and Motion Blur", 2009.

use fearless_simd::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::intersect::pencil::screen_bounds::Pixels;
use crate::objects::gather::transposed_points;
use crate::simd::lanes::{LANES, Narrow, NarrowMask, Points, narrow, widen};

/// The column of points that have none, and of those too far away to say.
pub(crate) const IRREGULAR: f32 = 1e20;
/// Keys beyond this are as good as infinite.
const KEY_LIMIT: f64 = 1e37;
/// δ = PLACE_ERROR + PLACE_ERROR_PART·m.
pub(crate) const PLACE_ERROR: f32 = 1.0 / (1 << 19) as f32;
pub(crate) const PLACE_ERROR_PART: f32 = 1.0 / (1 << 22) as f32;
/// The error of edge functions, over δ(D + 2δ).
const EDGE_ERROR: f32 = 8.0;
/// The error of a key, as a part of it: rounding it to f32, and that of a regular point.
pub(crate) const KEY_ERROR: f32 = 1.0 / (1 << 22) as f32;

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
    pub(crate) fn quads<S: Simd>(&self, simd: S, first: usize) -> Quads<S> {
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
pub(crate) struct Quads<S: Simd> {
    /// Column and row of the corners, in order around.
    corners: [[Narrow<S>; 2]; 4],
    /// The least and the greatest column, and row.
    pub(crate) range: [[Narrow<S>; 2]; 2],
    /// Bounds of their keys.
    pub(crate) keys: [Narrow<S>; 2],
}

impl<S: Simd> Quads<S> {
    /// δ.
    #[inline(always)]
    pub(crate) fn place_error(&self) -> Narrow<S> {
        let [[x0, x1], [y0, y1]] = self.range;
        let size = x0.abs().max(x1.abs()).max(y0.abs().max(y1.abs()));
        size * PLACE_ERROR_PART + PLACE_ERROR
    }

    /// The error of edge functions of rays within the box.
    #[inline(always)]
    pub(crate) fn edge_error(&self, delta: Narrow<S>) -> Narrow<S> {
        let [[x0, x1], [y0, y1]] = self.range;
        ((x1 - x0) + (y1 - y0) + delta * 2.0) * delta * EDGE_ERROR
    }

    /// Which of the lanes the rays at some columns and rows hit, as bits: each triangle for certain, and perhaps.
    #[inline(always)]
    pub(crate) fn covered(&self, ray: [Narrow<S>; 2], error: Narrow<S>) -> [[u64; 2]; 2] {
        let [a, b, c, d] = self.corners;
        let [a, b, c, d] = [minus(a, ray), minus(b, ray), minus(c, ray), minus(d, ray)];
        let (ab, bc, ca) = (edge(a, b), edge(b, c), edge(c, a));
        let (cd, da) = (edge(c, d), edge(d, a));
        [agree([ab, bc, ca], error), agree([-ca, cd, da], error)]
    }
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
