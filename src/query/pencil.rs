//! Pencils: which leaf the rays of each film take, and the memory of all of them.

use crate::intersect::context::Context;
use crate::intersect::grid::tiles::Window;
use crate::intersect::pencil::leaf::FilmQuery;
use crate::intersect::pencil::rect::{TILE_SIDE, tile_stats};
use crate::intersect::pencil::viewport::Viewport;
use crate::intersect::scattered::ScatteredQuery;
use crate::intersect::{grid, scattered};
use crate::objects::runs::Runs;
use crate::rays::film::{Film, Sampling};
use crate::rays::hits::{Hits, Row};
use crate::rays::pencil::Pencil;
use crate::stats::{Stats, TileStats};

/// Finds the nearest, or any, hit of each ray of a pencil, and counts the pairs of scattered rays unless there is no
/// room for that. Returns what each tile has cost as well.
pub(crate) fn intersect(
    context: Context<'_>,
    pencil: &Pencil,
    any: bool,
    runs: &Runs,
    (hits, mut pairs): (&mut Hits, &mut [u32]),
) -> (Stats, Vec<TileStats>) {
    let mut tiles = Vec::new();
    // In range: a pencil has fewer than 2³² rays.
    let sizes = pencil.films().iter().map(|film| match film {
        Film::Grid(grid) => (grid.width(), grid.height()),
        Film::Scattered(samples) => (samples.len() as u32, 1),
    });
    let origin = pencil.origin();
    let bounds = runs.bounds();
    for (index, (film, mut window)) in pencil.films().iter().zip(Window::over(hits, sizes)).enumerate() {
        let of_film;
        (of_film, pairs) = pairs.split_at_mut((film.len() as usize).min(pairs.len()));
        match film {
            Film::Grid(film) => {
                let Some(view) = &Viewport::new(origin, *film, Sampling::Grid) else {
                    window.miss();
                    continue;
                };
                let query = FilmQuery { context, view, bounds, any };
                tiles.extend(grid::intersect(query, runs, window).into_iter().map(tile_stats(index)));
            }
            Film::Scattered(samples) => {
                let Some(row) = window.rows.first_mut() else { continue };
                let counts = !of_film.is_empty();
                let query = ScatteredQuery { context, origin, samples, any, bounds, counts };
                let stats = scattered::intersect(query, runs, (row, of_film));
                tiles.push(tile_stats(index)((window.rect, stats)));
            }
        }
    }
    let mut stats = tiles.iter().fold(Stats::default(), |sum, tile: &TileStats| sum.plus(tile.stats));
    // Each thread works on one tile; each tile has its rows of the hits. All that comes after the order was found.
    let threads = rayon::current_num_threads() * grid::THREAD_BYTES;
    let rows =
        pencil.len() / TILE_SIDE as usize * size_of::<Row<'_>>() + tiles.len() * size_of::<TileStats>();
    let bytes = runs.bytes() + threads + rows + stats.engine_bytes as usize;
    stats.engine_bytes = bytes.max(runs.ordering_bytes()) as u64;
    (stats, tiles)
}
