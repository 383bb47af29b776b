//! The recursion of the pencil path.
//!
//! ```text
//! intersect(rays, objects):
//!     while the rays are more than a tile: split the film, both halves in parallel
//!     drop objects outside the frustum or behind all that the rays have hit
//!     a run of triangles: leaf.   more objects: split, recurse, near ones first
//! ```
//!
//! Rays are split first: a tile's depth buffer then fits a cache, and halves share nothing, so no lock is needed. A common
//! origin gives a true order from front to back; with the farthest hit of the tile it drops what is hidden.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1.

pub(crate) mod leaf;
pub(crate) mod screen_bounds;
pub(crate) mod setup;

use std::mem::size_of;

use fearless_simd::Level;
use rayon::prelude::*;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::grid::depth::TileDepth;
use crate::intersect::grid::hierarchical_z::TILE_SIDE;
use crate::intersect::grid::tiles::{Rect, Row, Window};
use crate::intersect::pencil::leaf::{FilmQuery, LeafDepth, Tile, Workspace, greatest_key};
use crate::intersect::pencil::screen_bounds::{KEPT, Pixels};
use crate::intersect::scattered;
use crate::intersect::scattered::{Cluster, ScatteredQuery};
use crate::objects::runs::{Node, Runs};
use crate::options::Accuracy;
use crate::rays::film::Film;
use crate::rays::film::Sampling;
use crate::rays::frustum::{Interval, Projection};
use crate::rays::hits::Hits;
use crate::rays::pencil::Pencil;
use crate::simd::lanes::{Boxes, LANES, bits};
use crate::stats::{Stats, TileStats};

/// Finds the nearest, or any, hit of each ray of a pencil, and counts the pairs of scattered rays unless there is no room for that.
/// Returns what each tile has cost as well.
pub(crate) fn intersect(
    triangles: &Triangles<'_>,
    pencil: &Pencil,
    runs: &Runs,
    (accuracy, level, any): (Accuracy, Level, bool),
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
                let Some(projection) = &Projection::new(origin, film.span()) else {
                    window.miss();
                    continue;
                };
                let sampling = Sampling::Grid;
                let pixels = &Pixels::new(projection, film, sampling);
                let query = FilmQuery {
                    triangles,
                    origin,
                    film,
                    projection,
                    pixels,
                    bounds,
                    accuracy,
                    level,
                    sampling,
                    any,
                };
                tiles.extend(split_film(query, runs, window).into_iter().map(tile_stats(index)));
            }
            Film::Scattered(samples) => {
                let (rect, counts) = (window.rect, !of_film.is_empty());
                let query =
                    ScatteredQuery { triangles, origin, samples, accuracy, level, any, bounds, counts };
                let stats = scattered::intersect(query, runs, (window, of_film));
                tiles.push(tile_stats(index)((rect, stats)));
            }
        }
    }
    let mut stats = tiles.iter().fold(Stats::default(), |sum, tile: &TileStats| sum.plus(tile.stats));
    // Each thread works on one tile; each tile has its rows of the hits. All that comes after the order was found.
    let threads = rayon::current_num_threads()
        * (size_of::<Tile<'_, TileDepth>>() + Workspace::<TileDepth>::bytes(KEPT) + TileDepth::RECORD_BYTES);
    let rows =
        pencil.len() / TILE_SIDE as usize * size_of::<Row<'_>>() + tiles.len() * size_of::<TileStats>();
    let bytes = runs.bytes() + threads + rows + stats.engine_bytes as usize;
    stats.engine_bytes = bytes.max(runs.ordering_bytes()) as u64;
    (stats, tiles)
}

/// The counters of a rectangle of a film.
pub(crate) fn tile_stats(film: usize) -> impl Fn((Rect, Stats)) -> TileStats {
    move |(Rect { x0, y0, x1, y1 }, stats)| TileStats { film, columns: [x0, x1], rows: [y0, y1], stats }
}

/// Splits the rays of a film down to tiles, and works on them in parallel.
fn split_film(query: FilmQuery<'_>, runs: &Runs, window: Window<'_>) -> Vec<(Rect, Stats)> {
    let in_tile = |work: &mut Box<Workspace<TileDepth>>, mut window: Window<'_>| {
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

/// A set of rays that one bound stands for.
pub(crate) trait SubPencil {
    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each. Counts the tests.
    fn enter(&mut self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]);
    /// Whether what lies no nearer than t is hidden from all rays.
    fn hides(&self, t: f64) -> bool;
    /// Tests a run of triangles within a box against all rays, now or later.
    fn intersect(&mut self, runs: &Runs, run: usize, bounds: &Aabb, stats: &mut Stats);
    /// Finishes what was put off.
    fn finish(&mut self, stats: &mut Stats);
}

/// Finds the hits of a sub-pencil with all objects.
pub(crate) fn intersect_objects(rays: &mut impl SubPencil, runs: &Runs) -> Stats {
    let mut stats = Stats::default();
    descend(rays, runs, runs.root(), &mut stats);
    rays.finish(&mut stats);
    stats
}

/// One step of the recursion: a node that the rays may meet.
fn descend(rays: &mut impl SubPencil, runs: &Runs, node: Node, stats: &mut Stats) {
    let Some(boxes) = runs.boxes(node) else { return };
    stats.nodes += 1;
    // Keep what the rays may meet, and take the near ones first.
    let (met, ts) = rays.enter(boxes, stats);
    let (mut near_first, mut kept) = ([0; LANES], 0);
    for lane in bits(met) {
        near_first[kept] = lane;
        kept += 1;
    }
    let near_first = &mut near_first[..kept];
    // Of equal ones the first: copies of a mesh come one after the other.
    near_first.sort_unstable_by(|&one, &other| ts[one].total_cmp(&ts[other]).then(one.cmp(&other)));
    for &mut lane in near_first {
        if rays.hides(ts[lane]) {
            stats.culled_by_depth += 1;
            continue;
        }
        let child = node.child(lane);
        match child.leaf() {
            Some(run) => rays.intersect(runs, run, &boxes.get(lane), stats),
            None => descend(rays, runs, child, stats),
        }
    }
}

impl<D: LeafDepth> SubPencil for Tile<'_, D> {
    fn enter(&mut self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]) {
        let (met, ts) = self.enter(boxes);
        stats.frustum_tests += LANES as u64;
        stats.culled_by_bound += LANES as u64 - u64::from(met.count_ones());
        (met, ts)
    }

    fn hides(&self, t: f64) -> bool {
        self.hides(t)
    }

    fn intersect(&mut self, runs: &Runs, run: usize, bounds: &Aabb, stats: &mut Stats) {
        self.intersect(runs, run, bounds, stats);
    }

    fn finish(&mut self, stats: &mut Stats) {
        self.finish(stats);
    }
}

impl SubPencil for Cluster<'_> {
    fn enter(&mut self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]) {
        self.depth.refresh();
        self.entered(boxes, stats)
    }

    fn hides(&self, t: f64) -> bool {
        self.depth.hides(greatest_key(self.origin(), t))
    }

    fn intersect(&mut self, runs: &Runs, run: usize, _: &Aabb, stats: &mut Stats) {
        let (ids, count) = runs.ids(run);
        ids[..count].iter().for_each(|&id| self.intersect(id, stats));
    }

    fn finish(&mut self, _: &mut Stats) {}
}
