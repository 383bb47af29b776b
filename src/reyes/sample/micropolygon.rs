//! One of the two triangles of a micropolygon, and its order among others.
//!
//! Triangles at the same distance come in the order of their surfaces' ids, then of their corners and parameters. So
//! the order is one of values alone, and it does not matter who found them, when, or how often.

use std::cmp::Ordering;

use crate::geometry::aabb::widen;
use crate::geometry::triangles::Triangle;
use crate::reyes::dice::grid::GridOrigin;

/// A triangle of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Micropolygon {
    pub(crate) surface: u32,
    pub(crate) corners: [[f32; 3]; 3],
    /// (u, v) of the corners.
    pub(crate) parameters: [[f64; 2]; 3],
}

/// The corners in f64.
pub(crate) fn triangle_of(corners: &[[f32; 3]; 3]) -> Triangle {
    let [a, b, c] = corners.map(widen);
    Triangle { a, b, c }
}

impl Micropolygon {
    /// A triangle of a grid, given the first corner of its quadrilateral and which of the two it is.
    pub(crate) fn of(grid: &GridOrigin, triangle: (usize, bool), corners: [[f32; 3]; 3]) -> Self {
        let width = (1 << grid.bits[0]) + 1;
        let parameters = grid.corners(triangle).map(|corner| {
            // In range: grids are small.
            grid.part.parameters(grid.bits, [corner % width, corner / width].map(|place| place as u32))
        });
        Self { surface: grid.surface, corners, parameters }
    }

    /// The order of triangles at the same distance.
    pub(crate) fn order(&self, other: &Self) -> Ordering {
        let corners = [self, other].map(|triangle| triangle.corners.as_flattened());
        let parameters = [self, other].map(|triangle| triangle.parameters.as_flattened());
        self.surface
            .cmp(&other.surface)
            .then_with(|| lexicographic(corners, f32::total_cmp))
            .then_with(|| lexicographic(parameters, f64::total_cmp))
    }
}

/// The order of the first difference.
fn lexicographic<T>([one, other]: [&[T]; 2], order: fn(&T, &T) -> Ordering) -> Ordering {
    let pairs = one.iter().zip(other);
    pairs.map(|(x, y)| order(x, y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
