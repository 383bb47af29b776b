//! A grid film of a pencil, and where points are seen on it.

use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::screen_bounds::Pixels;
use crate::rays::film::{GridFilm, Sampling};
use crate::rays::frustum::{Frustum, Interval, Projection};
use crate::rays::origin::Origin;

/// The rays of a pencil over one grid film.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewport {
    pub(crate) origin: Origin,
    pub(crate) film: GridFilm,
    pub(crate) projection: Projection,
    pub(crate) pixels: Pixels,
    /// Where on the film the rays lie.
    pub(crate) sampling: Sampling,
}

impl Viewport {
    /// `None` where the film spans no volume for certain.
    pub(crate) fn new(origin: Origin, film: GridFilm, sampling: Sampling) -> Option<Self> {
        let projection = Projection::new(origin, film.span())?;
        let pixels = Pixels::new(&projection, &film, sampling);
        Some(Self { origin, film, projection, pixels, sampling })
    }

    /// All of the film.
    pub(crate) fn rect(&self) -> Rect {
        Rect { x0: 0, y0: 0, x1: self.film.width(), y1: self.film.height() }
    }

    /// The frustum over a rectangle of the rays, which start at t-coordinates `start`.
    pub(crate) fn frustum_over(&self, rect: Rect, start: Interval) -> Frustum {
        let x = Interval { lo: self.film.x(rect.x0), hi: self.film.x(rect.x1 - 1) };
        let y = Interval { lo: self.film.y(rect.y1 - 1), hi: self.film.y(rect.y0) };
        Frustum::new(&self.projection, x, y, start)
    }
}
