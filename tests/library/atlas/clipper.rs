//! The oracle of coverage: a polygon clipper in rational numbers. A square touches a triangle iff clipping leaves a point.
//!
//! Based on: Ivan Sutherland and Gary Hodgman, "Reentrant Polygon Clipping", 1974.

use num_bigint::BigInt;
use num_rational::BigRational;

type Point = [BigRational; 2];

/// Texels (column, line) of a size x size texture, lines rising with v, that a closed triangle touches.
pub(crate) fn touched(uv: [[f32; 2]; 3], size: u32) -> Vec<[u32; 2]> {
    let scale = BigRational::from_integer(size.into());
    let exact = |x: f32| BigRational::from_float(x).expect("finite") * &scale;
    let corners = uv.map(|[u, v]| [exact(u), exact(v)]);
    if (0..2).any(|axis| misses_open_interval(&corners, axis, &scale)) {
        return Vec::new();
    }
    let mut found = Vec::new();
    for line in 0..size {
        // Clipped to the line once: its squares share that.
        let row = clip(&clip(&corners, 1, line, false), 1, line + 1, true);
        for column in 0..size {
            if !clip(&clip(&row, 0, column, false), 0, column + 1, true).is_empty() {
                found.push([column, line]);
            }
        }
    }
    found
}

/// Whether the extent along an axis meets neither the open interval (0, size) nor is a point of the closed one.
fn misses_open_interval(corners: &[Point], axis: usize, size: &BigRational) -> bool {
    let zero = BigRational::from_integer(BigInt::ZERO);
    let below = corners.iter().all(|p| p[axis] <= zero);
    let above = corners.iter().all(|p| p[axis] >= *size);
    let is_point = corners.iter().all(|p| p[axis] == corners[0][axis]);
    let is_border = corners[0][axis] == zero || corners[0][axis] == *size;
    (below || above) && !(is_point && is_border)
}

/// The part of a convex polygon, without area too, where the coordinate is at least, or at most, a limit.
fn clip(polygon: &[Point], axis: usize, limit: u32, at_most: bool) -> Vec<Point> {
    let limit = BigRational::from_integer(limit.into());
    let inside = |p: &Point| if at_most { p[axis] <= limit } else { p[axis] >= limit };
    let mut kept = Vec::new();
    for (k, a) in polygon.iter().enumerate() {
        let b = &polygon[(k + 1) % polygon.len()];
        if inside(a) {
            kept.push(a.clone());
        }
        if inside(a) != inside(b) {
            let t = (&limit - &a[axis]) / (&b[axis] - &a[axis]);
            kept.push([0, 1].map(|k| &a[k] + (&b[k] - &a[k]) * &t));
        }
    }
    kept
}
