//! Reads the corners of triangles into vectors.
//!
//! All vertex numbers are looked up before any position, so that cache misses overlap (koala, one thread: 28 to 19 ms).
//! Positions are read four floats at a time and transposed in registers: vectors that are put together in memory from
//! single floats cannot be forwarded to a load. Boxes take the four floats as they are: a third fewer instructions than
//! coordinate by coordinate.

use fearless_simd::{f32x4, prelude::*};

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::simd::lanes::{LANES, Narrow, Points, widen};

/// The corners a, b and c of eight triangles.
#[inline(always)]
pub(crate) fn corners<S: Simd>(simd: S, triangles: &Triangles<'_>, ids: &[u32; LANES]) -> [Points<S>; 3] {
    let mut vertices = [[0; 3]; LANES];
    for (vertices, &id) in vertices.iter_mut().zip(ids) {
        *vertices = triangles.vertices(id);
    }
    [
        corner(simd, triangles, &vertices, 0),
        corner(simd, triangles, &vertices, 1),
        corner(simd, triangles, &vertices, 2),
    ]
}

/// The corners a, b and c of eight triangles, as x, y and z in f32.
pub(crate) type EightCorners = [[[f32; LANES]; 3]; 3];

/// The corners of eight triangles, to be read often.
#[inline(always)]
pub(crate) fn eight_corners<S: Simd>(simd: S, triangles: &Triangles<'_>, ids: &[u32; LANES]) -> EightCorners {
    let mut vertices = [[0; 3]; LANES];
    for (vertices, &id) in vertices.iter_mut().zip(ids) {
        *vertices = triangles.vertices(id);
    }
    let mut read = [[[0.0; LANES]; 3]; 3];
    for (k, corner) in read.iter_mut().enumerate() {
        for (stored, x) in corner.iter_mut().zip(positions(simd, triangles, &vertices, k)) {
            x.store_slice(stored);
        }
    }
    read
}

/// x, y and z of eight points.
#[inline(always)]
pub(crate) fn transposed_points<S: Simd>(simd: S, points: &[[f32; 3]; LANES]) -> [Narrow<S>; 3] {
    let mut read = [f32x4::simd_from(simd, 0.0); LANES];
    for (read, [x, y, z]) in read.iter_mut().zip(points) {
        *read = f32x4::load_array(simd, [*x, *y, *z, 0.0]);
    }
    eight_transposed(read)
}

/// x, y and z of up to eight points, told by their lanes; the last one is repeated.
#[inline(always)]
pub(crate) fn points_by_lane<S: Simd>(
    simd: S,
    count: usize,
    point: impl Fn(usize) -> [f32; 3],
) -> [Narrow<S>; 3] {
    let mut points = [[0.0; 3]; LANES];
    for (lane, read) in points.iter_mut().enumerate() {
        *read = point(lane.min(count - 1));
    }
    transposed_points(simd, &points)
}

/// The box of some triangles.
#[inline(always)]
pub(crate) fn bounds<S: Simd, const N: usize>(simd: S, triangles: &Triangles<'_>, ids: &[u32; N]) -> Aabb {
    let mut vertices = [[0; 3]; N];
    for (vertices, &id) in vertices.iter_mut().zip(ids) {
        *vertices = triangles.vertices(id);
    }
    let mut lo = f32x4::simd_from(simd, f32::INFINITY);
    let mut hi = -lo;
    for &vertex in vertices.as_flattened() {
        let position = f32x4::load_array(simd, triangles.four_from(vertex));
        (lo, hi) = (lo.min(position), hi.max(position));
    }
    let ([x0, y0, z0, _], [x1, y1, z1, _]) = (lo.to_array(), hi.to_array());
    Aabb { lo: [x0, y0, z0], hi: [x1, y1, z1] }
}

/// The first corners, as x, y and z, of eight consecutive triangles; the last triangle's are repeated.
#[inline(always)]
pub(crate) fn first_corners<S: Simd>(simd: S, triangles: &Triangles<'_>, first: u32) -> [Narrow<S>; 3] {
    let last = triangles.len() - 1;
    let mut vertices = [[0; 3]; LANES];
    for (lane, vertices) in vertices.iter_mut().enumerate() {
        // In range: there are fewer than 2³² triangles.
        *vertices = triangles.vertices((first as usize + lane).min(last) as u32);
    }
    positions(simd, triangles, &vertices, 0)
}

/// One corner of each triangle.
#[inline(always)]
fn corner<S: Simd>(simd: S, triangles: &Triangles<'_>, vertices: &[[u32; 3]; LANES], k: usize) -> Points<S> {
    let [x, y, z] = positions(simd, triangles, vertices, k);
    Points { x: widen(x), y: widen(y), z: widen(z) }
}

/// The same in f32.
#[inline(always)]
fn positions<S: Simd>(
    simd: S,
    triangles: &Triangles<'_>,
    vertices: &[[u32; 3]; LANES],
    k: usize,
) -> [Narrow<S>; 3] {
    let mut read = [f32x4::simd_from(simd, 0.0); LANES];
    for (read, vertices) in read.iter_mut().zip(vertices) {
        *read = f32x4::load_array(simd, triangles.four_from(vertices[k]));
    }
    eight_transposed(read)
}

/// First, second and third elements of eight vectors.
#[inline(always)]
fn eight_transposed<S: Simd>([a, b, c, d, e, f, g, h]: [f32x4<S>; LANES]) -> [Narrow<S>; 3] {
    let (low, high) = (transposed(a, b, c, d), transposed(e, f, g, h));
    [low[0].combine(high[0]), low[1].combine(high[1]), low[2].combine(high[2])]
}

/// First, second and third elements of four vectors.
#[inline(always)]
fn transposed<S: Simd>(a: f32x4<S>, b: f32x4<S>, c: f32x4<S>, d: f32x4<S>) -> [f32x4<S>; 3] {
    let (ac, bd) = (a.zip_low(c), b.zip_low(d));
    let (last_ac, last_bd) = (a.zip_high(c), b.zip_high(d));
    [ac.zip_low(bd), ac.zip_high(bd), last_ac.zip_low(last_bd)]
}
