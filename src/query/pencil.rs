//! Pencils: which path the rays of each film take, and the memory of all of them.
//!
//! Scattered films go in bundles, though their rays share an origin. Clusters of 256 directions under a frustum, tested
//! ray by ray in f64, took 2.6 (koala) to 3.1 (sponza from inside) times as long as bundles on panoramas of 2048x1024.
//! Tiles of 4096 directions on films of their own, as shadows have them, with a hierarchical z and packets of eight
//! took 0.53 (mines), 0.55 (chess) and 0.65 to 0.7 (sponza) of the time of bundles, but 1.3 to 1.4 times as long on
//! koala: not kept. A triangle was compared with 40 (koala) to 50 (sponza) packets there.

use crate::intersect::bundle::stream;
use crate::intersect::context::Context;
use crate::intersect::grid;
use crate::intersect::pencil::leaf::FilmQuery;
use crate::intersect::pencil::rect::{TILE_SIDE, tile_stats};
use crate::intersect::pencil::viewport::Viewport;
use crate::intersect::pencil::window::Window;
use crate::intersect::ray_set::{Question, RaySet};
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
        Film::Grid(grid) => [grid.width(), grid.height()],
        // A scattered film counts as one row.
        Film::Scattered(samples) => [samples.len() as u32, 1],
    });
    let origin = pencil.origin();
    let bounds = runs.bounds();
    for (index, (film, mut window)) in
        pencil.films().iter().zip(Window::over(hits.as_row(), sizes)).enumerate()
    {
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
                window.miss();
                let Some((ids, ts)) = window.rows.first_mut() else { continue };
                let set = RaySet::Samples(origin, samples);
                let question = Question { triangles: context.triangles, set, any };
                let stats = stream::intersect(question, context.level, ((ids, ts), of_film));
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::geometry::triangles::Triangles;
    use crate::options::{Options, Path};
    use crate::query::closest_hit;
    use crate::rays::film::{Film, GridFilm};
    use crate::rays::origin::Origin;
    use crate::rays::pencil::Pencil;
    use crate::simd::isa::Isa;

    /// A tent and a floor, small enough for an interpreter of the compiler's own code.
    #[test]
    fn films_agree_with_single_rays() {
        let positions = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0]];
        let indices = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 2]];
        let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
        let grid = GridFilm::new(3, 3, DVec3::Z, DVec3::X * 0.25, DVec3::Y * 0.25).expect("a valid film");
        let samples = positions.map(|p| DVec3::from_array(p.map(f64::from)));
        for origin in [Origin::Point(DVec3::ZERO), Origin::Infinity(DVec3::Z)] {
            let films = vec![Film::Grid(grid), Film::Scattered(samples.to_vec())];
            let pencil = Pencil::new(origin, films).expect("rays in range");
            for isa in [Isa::Auto, Isa::Sse2, Isa::Sse42, Isa::Avx2] {
                let ask =
                    |path| closest_hit(&triangles, &pencil, &Options { path, isa, ..Options::default() });
                if isa.level().is_ok() {
                    let [(films, _), (single, _)] =
                        [Path::Pencil, Path::General].map(|p| ask(p).expect("in range"));
                    assert_eq!((films.ids(), films.ts()), (single.ids(), single.ts()));
                    assert!((0..films.len()).any(|ray| films.get(ray).is_some()));
                }
            }
        }
    }
}
