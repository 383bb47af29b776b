//! A grid film of a pencil, and where points are seen on it.

use crate::intersect::pencil::screen_bounds::Pixels;
use crate::rays::film::{GridFilm, Sampling};
use crate::rays::frustum::Projection;
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
}
