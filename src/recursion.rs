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

use crate::depth::DepthBuffer;
use crate::frustum::Projection;
use crate::leaf::{FilmQuery, TILE_SIDE, Tile, greatest_key};
use crate::pencil::Pencil;
use crate::runs::{Node, Runs};
use crate::scattered::{self, Cluster};
use crate::window::Window;
use crate::{Aabb, Film, Hits, Options, Stats, Triangles};

/// Finds the nearest, or any, hit of each ray of a pencil.
pub(crate) fn intersect(
    triangles: &Triangles<'_>,
    pencil: &Pencil,
    options: &Options,
    any: bool,
    hits: &mut Hits,
) -> Stats {
    let runs = Runs::new(triangles);
    let mut stats = Stats {
        engine_bytes: runs.bytes() as u64,
        ..Stats::default()
    };
    // In range: a pencil has fewer than 2³² rays.
    let sizes = pencil.films().iter().map(|film| match film {
        Film::Grid(grid) => (grid.width(), grid.height()),
        Film::Scattered(samples) => (samples.len() as u32, 1),
    });
    for (film, window) in pencil.films().iter().zip(Window::over(hits, sizes)) {
        let accuracy = options.accuracy;
        stats = stats.add(match film {
            Film::Grid(film) => {
                let Some(projection) = Projection::new(pencil.origin(), film.span()) else {
                    continue;
                };
                let origin = pencil.origin();
                let query = FilmQuery {
                    triangles,
                    origin,
                    film,
                    projection: &projection,
                    accuracy,
                    any,
                };
                split_film(query, &runs, window)
            }
            Film::Scattered(samples) => scattered::intersect(
                triangles,
                &runs,
                pencil.origin(),
                samples,
                accuracy,
                any,
                window,
            ),
        });
    }
    stats
}

/// Splits the rays of a film down to tiles, halves in parallel.
fn split_film(query: FilmQuery<'_>, runs: &Runs, mut window: Window<'_>) -> Stats {
    if window.rect.width() > TILE_SIDE || window.rect.height() > TILE_SIDE {
        let (one, other) = window.halves(TILE_SIDE);
        let (one, other) = rayon::join(
            || split_film(query, runs, one),
            || split_film(query, runs, other),
        );
        return one.add(other);
    }
    let mut tile = Tile::new(query, window.rect);
    let stats = intersect_objects(&mut tile, runs);
    tile.write(&mut window);
    stats
}

/// A set of rays that one bound stands for.
pub(crate) trait SubPencil {
    /// A lower bound of t within a box, or `None` when no ray meets it. Counts the test.
    fn enter(&self, bounds: &Aabb, stats: &mut Stats) -> Option<f64>;
    /// The greatest depth key of what lies no nearer than t.
    fn greatest_key(&self, t: f64) -> f64;
    /// The hits so far.
    fn depth(&mut self) -> &mut DepthBuffer;
    /// Tests one triangle against all rays.
    fn intersect(&mut self, id: u32, stats: &mut Stats);
}

/// Finds the hits of a sub-pencil with all objects.
pub(crate) fn intersect_objects(rays: &mut impl SubPencil, runs: &Runs) -> Stats {
    let mut stats = Stats::default();
    rays.depth().refresh();
    if let Some(root) = runs.root() {
        match rays.enter(runs.bounds(root), &mut stats) {
            Some(t) => descend(rays, runs, root, t, &mut stats),
            None => stats.culled_by_bound += 1,
        }
    }
    stats
}

/// One step of the recursion: a node whose box the rays may meet, no nearer than t.
fn descend(rays: &mut impl SubPencil, runs: &Runs, node: Node, t: f64, stats: &mut Stats) {
    let key = rays.greatest_key(t);
    if rays.depth().hides(key) {
        stats.culled_by_depth += 1;
        return;
    }
    stats.nodes += 1;
    let Some(children) = runs.children(node) else {
        for id in runs.triangles(node) {
            rays.intersect(id, stats);
        }
        rays.depth().refresh();
        return;
    };
    // Keep what the rays may meet, and take the near ones first.
    let mut near_first = [(0.0, node); 16];
    let mut kept = 0;
    for child in children {
        match rays.enter(runs.bounds(child), stats) {
            Some(t) => {
                near_first[kept] = (t, child);
                kept += 1;
            }
            None => stats.culled_by_bound += 1,
        }
    }
    let near_first = &mut near_first[..kept];
    near_first.sort_unstable_by(|(one, _), (other, _)| one.total_cmp(other));
    for &mut (t, child) in near_first {
        descend(rays, runs, child, t, stats);
    }
}

impl SubPencil for Tile<'_> {
    fn enter(&self, bounds: &Aabb, stats: &mut Stats) -> Option<f64> {
        stats.frustum_tests += 1;
        self.frustum.enter(bounds)
    }

    fn greatest_key(&self, t: f64) -> f64 {
        self.greatest_key(t)
    }

    fn depth(&mut self) -> &mut DepthBuffer {
        &mut self.depth
    }

    fn intersect(&mut self, id: u32, stats: &mut Stats) {
        self.intersect(id, stats);
    }
}

impl SubPencil for Cluster<'_> {
    fn enter(&self, bounds: &Aabb, stats: &mut Stats) -> Option<f64> {
        self.enter(bounds, stats)
    }

    fn greatest_key(&self, t: f64) -> f64 {
        greatest_key(self.origin(), t)
    }

    fn depth(&mut self) -> &mut DepthBuffer {
        &mut self.depth
    }

    fn intersect(&mut self, id: u32, stats: &mut Stats) {
        self.intersect(id, stats);
    }
}
