//! A rectangle of a film, and the tile: the rectangle that is worked on at once.

use crate::stats::{Stats, TileStats};

/// Rays along one side of a tile: its buffer, 12 bytes per ray, stays in the second-level cache.
pub(crate) const TILE_SIDE: u32 = 64;

/// Columns `columns` and rows `rows` of a film, half open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rect {
    pub(crate) x0: u32,
    pub(crate) y0: u32,
    pub(crate) x1: u32,
    pub(crate) y1: u32,
}

impl Rect {
    /// Columns.
    pub(crate) fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub(crate) fn height(&self) -> u32 {
        self.y1 - self.y0
    }
}

/// The counters of a rectangle of a film.
pub(crate) fn tile_stats(film: usize) -> impl Fn((Rect, Stats)) -> TileStats {
    move |(Rect { x0, y0, x1, y1 }, stats)| TileStats { film, columns: [x0, x1], rows: [y0, y1], stats }
}
