//! A tile of rays as Reyes sees it: its film, its frustum, and its place on the film.

use fearless_simd::prelude::*;

use crate::geometry::ray::Ray;
use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::screen_bounds::Pixels;
use crate::intersect::pencil::viewport::Viewport;
use crate::rays::frustum::{Frustum, Interval};
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, Lanes, Points};

/// 0 to 7.
const COLUMNS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
/// Where rays start.
pub(crate) const START: Interval = Interval { lo: 0.0, hi: 0.0 };

/// What a tile is to its leaf.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GridTile<'a> {
    pub(crate) view: &'a Viewport,
    pub(crate) rect: Rect,
    pub(crate) frustum: Frustum,
    /// Columns and rows from the first ray of the tile.
    pub(crate) pixels: Pixels,
}

impl GridTile<'_> {
    /// The ray at a column and row of the tile.
    pub(crate) fn ray(&self, [x, y]: [u32; 2]) -> Ray {
        self.view.origin.ray(self.view.film.at(self.rect.x0 + x, self.rect.y0 + y))
    }

    /// Origins and directions of eight rays of a row: exact, as those of one.
    #[inline(always)]
    pub(crate) fn eight_rays<S: Simd>(&self, simd: S, [x, y]: [u32; 2]) -> [Points<S>; 2] {
        let [_, right, _] = self.view.film.span();
        let first = self.view.film.at(self.rect.x0 + x, self.rect.y0 + y);
        let steps = Lanes::load_array(simd, COLUMNS) * self.view.film.step();
        let along = Points {
            x: steps * right.x + first.x,
            y: steps * right.y + first.y,
            z: steps * right.z + first.z,
        };
        match self.view.origin {
            Origin::Point(eye) => [Points::splat(simd, eye), along],
            Origin::Infinity(direction) => [along, Points::splat(simd, direction)],
        }
    }

    /// The frustum over a rectangle of the tile's rays.
    pub(crate) fn frustum_over(&self, Rect { x0, y0, x1, y1 }: Rect) -> Frustum {
        let [left, top] = [self.rect.x0, self.rect.y0];
        let rect = Rect { x0: left + x0, y0: top + y0, x1: left + x1, y1: top + y1 };
        self.view.frustum_over(rect, START)
    }
}
