//! Pixels of a grid film, taken in tiles and blocks.

pub(crate) mod compare;
pub(crate) mod depth;
pub(crate) mod hierarchical_z;
pub(crate) mod relations;
pub(crate) mod resolve;
pub(crate) mod rows;
pub(crate) mod tile_keys;
pub(crate) mod tiles;

use std::mem::size_of;

use rayon::prelude::*;

use crate::intersect::grid::depth::TileDepth;
use crate::intersect::pencil::intersect_objects;
use crate::intersect::pencil::leaf::{FilmQuery, Tile, Workspace};
use crate::intersect::pencil::rect::{Rect, TILE_SIDE};
use crate::intersect::pencil::screen_bounds::KEPT;
use crate::intersect::pencil::window::Window;
use crate::objects::runs::Runs;
use crate::rays::frustum::Interval;
use crate::rays::hits::Row;
use crate::stats::Stats;

/// Bytes that a thread needs for its tile.
pub(crate) const THREAD_BYTES: usize =
    size_of::<Tile<'_, TileDepth>>() + Workspace::<TileDepth>::bytes(KEPT) + TileDepth::RECORD_BYTES;

/// Finds the hits of the rays of a film: splits it down to tiles, and works on them in parallel.
pub(crate) fn intersect(query: FilmQuery<'_>, runs: &Runs, window: Window<Row<'_>>) -> Vec<(Rect, Stats)> {
    let in_tile = |work: &mut Box<Workspace<TileDepth>>, mut window: Window<Row<'_>>| {
        work.depth.clear(window.rect.width(), window.rect.height());
        let mut tile = Tile::new(query, window.rect, Interval { lo: 0.0, hi: 0.0 }, work);
        let mut stats = intersect_objects(&mut tile, runs);
        tile.write(&mut window, &mut stats);
        (window.rect, stats)
    };
    window
        .tiles(TILE_SIDE)
        .into_par_iter()
        .map_init(|| Workspace::new(TileDepth::new(), KEPT), in_tile)
        .collect()
}
