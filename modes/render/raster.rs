//! Primary visibility by tiny-skia: an independent rasterizer to check the engine against.
//!
//! Each triangle is clipped to the film with a margin, projected, and filled without antialiasing. Where it is covered, its
//! depth is t at that pixel; the nearest wins, then the smaller id.
//!
//! tiny-skia cuts vertices to 1/64 pixel, cuts the x of an edge's first row to 1/64 pixel again, and steps slopes in 16.16
//! fixed point. So an edge n·p = c (pixels) may be displaced by (|n_x| + |n_y|)/64 + |n_x|·(1/64 + rows·2⁻¹⁶), and by the
//! rounding of f32 coordinates: nothing else may differ.
//!
//! Based on: Ivan Sutherland and Gary Hodgman, "Reentrant Polygon Clipping", 1974; the fill rules of Skia.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use tiny_skia::{FillRule, Mask, Path, PathBuilder, Transform};
use umbel_core::{GridFilm, NO_TRIANGLE, Origin, TriangleId, Triangles};

/// Pixels around the film that clipped polygons keep.
const MARGIN: f64 = 8.0;
/// Rows per band: bands are filled in parallel.
const BAND: u32 = 64;

/// What tiny-skia sees on one film.
pub(crate) struct Raster {
    /// The triangle at each pixel, or [`NO_TRIANGLE`].
    pub(crate) ids: Vec<u32>,
}

/// From world space to the pixels of a film.
pub(crate) struct View<'a> {
    triangles: &'a Triangles<'a>,
    origin: Origin,
    film: &'a GridFilm,
    /// From x − base to film coordinates (X, Y, t).
    to_film: DMat3,
    base: DVec3,
}

impl<'a> View<'a> {
    pub(crate) fn new(triangles: &'a Triangles<'a>, origin: Origin, film: &'a GridFilm) -> Self {
        let [f, r, u] = film.span();
        let (base, v) = match origin {
            Origin::Point(point) => (point, f),
            Origin::Infinity(direction) => (f, direction),
        };
        Self { triangles, origin, film, to_film: DMat3::from_cols(r, u, v).inverse(), base }
    }

    /// Fills all triangles, nearest in front.
    pub(crate) fn rasterize(&self) -> Raster {
        let (width, height) = (self.film.width(), self.film.height());
        // In range: there are fewer than 2³² triangles.
        let polygons: Vec<(u32, Vec<DVec2>)> = (0..self.triangles.len() as u32)
            .into_par_iter()
            .map(|id| (id, self.polygon(TriangleId(id))))
            .filter(|(_, polygon)| polygon.len() >= 3)
            .collect();
        let bands: Vec<u32> = (0..height).step_by(BAND as usize).collect();
        let bands = bands.into_par_iter().map(|first| {
            let rows = BAND.min(height - first);
            Band::new(self, width, first, rows).map_or_else(Vec::new, |band| band.fill(&polygons))
        });
        Raster { ids: bands.flatten_iter().collect() }
    }

    /// The triangle clipped to the film and its margin, in pixels; empty when nothing is left.
    pub(crate) fn polygon(&self, id: TriangleId) -> Vec<DVec2> {
        let corners = self
            .triangles
            .corners(id)
            .map(|p| self.to_film * (DVec3::from_array(p.map(f64::from)) - self.base));
        let (w, h) = (f64::from(self.film.width()), f64::from(self.film.height()));
        let reach = [w + 2.0 * MARGIN, h + 2.0 * MARGIN];
        let perspective = matches!(self.origin, Origin::Point(_));
        let mut polygon = corners.to_vec();
        for (axis, limit) in [(0, reach[0]), (1, reach[1])] {
            for sign in [1.0, -1.0] {
                let inside = |p: &DVec3| limit * if perspective { p.z } else { 1.0 } - sign * p[axis];
                polygon = clip(&polygon, inside);
            }
        }
        if !perspective {
            polygon = clip(&polygon, |p| p.z);
        }
        let flat = polygon.iter().filter(|p| !perspective || p.z > 0.0).map(|p| {
            let p = if perspective { *p / p.z } else { *p };
            DVec2::new((p.x + w) * 0.5, (h - p.y) * 0.5)
        });
        flat.collect()
    }

    /// t of a triangle's plane at a pixel.
    fn depth(&self, id: u32, pixel: (u32, u32)) -> f64 {
        let [f, r, u] = self.film.span();
        let sample = f + r * self.film.x(pixel.0) + u * self.film.y(pixel.1);
        let (start, direction) = match self.origin {
            Origin::Point(point) => (point, sample),
            Origin::Infinity(direction) => (sample, direction),
        };
        let [a, b, c] = self.triangles.corners(TriangleId(id)).map(|p| DVec3::from_array(p.map(f64::from)));
        let normal = (b - a).cross(c - a);
        (a - start).dot(normal) / direction.dot(normal)
    }

    /// Where a pixel's centre lies with regard to a triangle, and how far away its plane is there. No triangle covers all
    /// pixels, infinitely far away.
    pub(crate) fn sight(&self, id: u32, pixel: (u32, u32)) -> Sight {
        if id == NO_TRIANGLE {
            return Sight { coverage: Coverage::Inside, depth: f64::INFINITY };
        }
        Sight { coverage: self.coverage(id, pixel), depth: self.depth(id, pixel) }
    }

    /// Where a pixel's centre lies with regard to a projected triangle.
    fn coverage(&self, id: u32, pixel: (u32, u32)) -> Coverage {
        let p = DVec2::new(f64::from(pixel.0) + 0.5, f64::from(pixel.1) + 0.5);
        let polygon = self.polygon(TriangleId(id));
        let (w, h) = (f64::from(self.film.width()), f64::from(self.film.height()));
        // Coordinates of up to w + margin in f32, rounded a few times on their way to 1/64.
        let vertex = 1.0 / 64.0 + 4.0 * (w.max(h) + MARGIN) * f64::from(f32::EPSILON);
        let first_row_and_slope = 1.0 / 64.0 + h / 65536.0;
        // Whether the centre is strictly to the left, and to the right, of some edge.
        let (mut left, mut right) = (polygon.len() < 3, polygon.len() < 3);
        for (&a, &b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
            let along = b - a;
            let length = along.length();
            if length == 0.0 {
                if (p - a).abs().max_element() <= vertex {
                    return Coverage::NearEdge;
                }
                continue;
            }
            let n = DVec2::new(-along.y, along.x) / length;
            let reach = (n.x.abs() + n.y.abs()) * vertex + n.x.abs() * first_row_and_slope;
            let (place, side) = ((p - a).dot(along) / length, (p - a).dot(n));
            if side.abs() <= reach && place >= -2.0 * vertex && place <= length + 2.0 * vertex {
                return Coverage::NearEdge;
            }
            left |= side > 0.0;
            right |= side < 0.0;
        }
        if left && right { Coverage::Outside } else { Coverage::Inside }
    }
}

/// Where the centre of a pixel lies with regard to a projected triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coverage {
    Inside,
    /// So near to an edge that tiny-skia may see it on the other side.
    NearEdge,
    Outside,
}

/// A triangle as it is seen at a pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub(crate) coverage: Coverage,
    /// t of its plane.
    pub(crate) depth: f64,
}

impl Sight {
    /// Whether two surfaces are as far away, as far as f32 can tell. Where there is none, nothing is.
    pub(crate) fn is_as_far_as(&self, other: &Self) -> bool {
        let (one, other) = (self.depth as f32, other.depth as f32);
        one.is_finite() && (one - other).abs() <= one.abs() * f32::EPSILON
    }
}

/// The part of a convex polygon where a linear function is not negative.
fn clip(polygon: &[DVec3], inside: impl Fn(&DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (at_a, at_b) = (inside(a), inside(b));
        if at_a >= 0.0 {
            kept.push(*a);
        }
        if (at_a < 0.0) != (at_b < 0.0) {
            kept.push(*a + (*b - *a) * (at_a / (at_a - at_b)));
        }
    }
    kept
}

/// Some rows of a film that are filled together.
struct Band<'a> {
    view: &'a View<'a>,
    width: u32,
    first: u32,
    rows: u32,
    mask: Mask,
}

impl<'a> Band<'a> {
    fn new(view: &'a View<'a>, width: u32, first: u32, rows: u32) -> Option<Self> {
        Some(Self { view, width, first, rows, mask: Mask::new(width, rows)? })
    }

    /// The nearest triangle at each pixel of the band.
    fn fill(mut self, polygons: &[(u32, Vec<DVec2>)]) -> Vec<u32> {
        let pixels = self.width as usize * self.rows as usize;
        let (mut ids, mut depths) = (vec![NO_TRIANGLE; pixels], vec![f64::INFINITY; pixels]);
        for (id, polygon) in polygons {
            let Some([x0, y0, x1, y1]) = self.bounds(polygon) else {
                continue;
            };
            let Some(path) = self.path(polygon) else {
                continue;
            };
            self.mask.fill_path(&path, FillRule::EvenOdd, false, Transform::identity());
            for y in y0..y1 {
                for x in x0..x1 {
                    let place = y as usize * self.width as usize + x as usize;
                    if std::mem::take(&mut self.mask.data_mut()[place]) == 0 {
                        continue;
                    }
                    let depth = self.view.depth(*id, (x, self.first + y));
                    if depth < depths[place] {
                        (depths[place], ids[place]) = (depth, *id);
                    }
                }
            }
        }
        ids
    }

    /// The pixels of the band that a polygon may cover: [x0, y0, x1, y1], half open.
    fn bounds(&self, polygon: &[DVec2]) -> Option<[u32; 4]> {
        let lo = polygon.iter().fold(DVec2::INFINITY, |lo, p| lo.min(*p));
        let hi = polygon.iter().fold(DVec2::NEG_INFINITY, |hi, p| hi.max(*p));
        let first = f64::from(self.first);
        // One pixel of slack; the casts saturate at zero.
        let column = |x: f64| (x as u32).min(self.width);
        let row = |y: f64| ((y - first) as u32).min(self.rows);
        let [x0, y0, x1, y1] = [column(lo.x - 1.0), row(lo.y - 1.0), column(hi.x + 2.0), row(hi.y + 2.0)];
        (x0 < x1 && y0 < y1).then_some([x0, y0, x1, y1])
    }

    /// The polygon as tiny-skia takes it, relative to the band.
    fn path(&self, polygon: &[DVec2]) -> Option<Path> {
        let mut builder = PathBuilder::with_capacity(polygon.len() + 1, polygon.len());
        for (index, p) in polygon.iter().enumerate() {
            let (x, y) = (p.x as f32, (p.y - f64::from(self.first)) as f32);
            if index == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
        }
        builder.close();
        builder.finish()
    }
}
