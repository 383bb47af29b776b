//! The leaf of surfaces on demand: micropolygons against the points of a film.

pub(crate) mod grid_tile;
pub(crate) mod hits;
pub(crate) mod kernel;
pub(crate) mod micropolygon;
pub(crate) mod projected;
pub(crate) mod resolve;
pub(crate) mod winners;
