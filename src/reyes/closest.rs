//! Reyes: surfaces that exist only where rays are, driven by the recursion of the pencil path.
//!
//! ```text
//! halve(rays, objects):
//!     drop objects outside the frustum; open those that both halves would open, the largest first, until there are many
//!     more rays than a tile: both halves of the film in parallel, with what is left of the objects
//!     a tile: nearest first: drop what is hidden; open, or dice and sample what is ready
//! ```
//!
//! Opening expands a group or splits a patch, see [`crate::reyes::dice`]. So tiles share the work on objects that are
//! larger than they are, hidden objects are never opened but for those few, and nothing is kept: a list of objects per
//! film that is being halved, one grid per thread, and what the rays of a tile have hit.
//!
//! A list holds one object for [`PIXELS`] rays, and at most [`WIDE`]. Lists of 64 for every film took 2.2 times as long
//! for a displaced cage, whose patches each of many tiles had to open anew, and 1.1 times for terrain. Lists of 1024
//! for every film open what is hidden, too: 128 sheets behind each other took 2.5 times as long as the first, and take
//! 1.4 times so.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Alexander
//! Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure", 2011.

use std::mem::size_of;
use std::sync::{Mutex, PoisonError};

use fearless_simd::Level;

use crate::error::Error;
use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::rect::{TILE_SIDE, tile_stats};
use crate::intersect::pencil::screen_bounds::Pixels;
use crate::intersect::pencil::viewport::Viewport;
use crate::options::{Options, Path};
use crate::query::call::{check_call, in_pool};
use crate::rays::film::{Film, Sampling};
use crate::rays::frustum::Frustum;
use crate::rays::pencil::Pencil;
use crate::reyes::dice::density::Density;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::reference;
use crate::reyes::sample::grid_tile::{GridTile, START};
use crate::reyes::sample::hits::{SurfaceHits, SurfaceWindow};
use crate::reyes::tile::TileWork;
use crate::reyes::walk::{Item, Opener};
use crate::stats::Stats;

/// The most objects that a film hands its halves, but for the parts of one group.
const WIDE: usize = 1024;
/// Rays for each of them.
const PIXELS: usize = 64;

/// Finds the nearest surface along each ray, making surfaces where they are needed only.
///
/// Patches are diced into micropolygons as the density of the rays asks: see [`Dicing`]. What a ray sees is exact for
/// those micropolygons, and the same on every path, thread count and machine; so is what lies between two grids, as
/// they never leave a crack. Runs on the current rayon pool. Memory does not grow with the number of micropolygons: see
/// [`Stats::engine_bytes`]. [`crate::options::Accuracy`] changes nothing here. [`Path::General`] makes all triangles
/// first, see [`crate::reyes::reference::dice_all`].
///
/// # Errors
/// When a film is scattered, the shading rate is out of range, a surface gives points that are not finite, or the
/// thread flushes subnormal numbers to zero.
pub fn closest_hit_on_demand<S: OnDemand>(
    surfaces: &S,
    pencil: &Pencil,
    dicing: &Dicing,
    options: &Options,
) -> Result<(SurfaceHits, Stats), Error> {
    let mut hits = SurfaceHits::default();
    let stats = hits.find(surfaces, pencil, dicing, options)?;
    Ok((hits, stats))
}

impl SurfaceHits {
    /// Finds the nearest surface along each ray, as [`closest_hit_on_demand`] does, in the memory of these hits: for as
    /// many rays as before none is asked of the system, which takes longer than a frame of few micropolygons.
    ///
    /// # Errors
    /// As of [`closest_hit_on_demand`]; then these hits are those of no rays in particular.
    pub fn find<S: OnDemand>(
        &mut self,
        surfaces: &S,
        pencil: &Pencil,
        dicing: &Dicing,
        options: &Options,
    ) -> Result<Stats, Error> {
        let level = check_call(pencil.len(), options)?;
        dicing.check()?;
        let density = Density::new(pencil, level)?;
        self.make_room(pencil.len(), dicing.keep_corners);
        match options.path {
            Path::Pencil => in_pool(|| see(surfaces, pencil, (&density, dicing), level, self))?,
            Path::General => reference::see_all(surfaces, pencil, dicing, options, self),
        }
    }
}

/// What all rays of a film share.
struct SurfaceQuery<'q, 'a, S: OnDemand> {
    surfaces: &'a S,
    view: &'q Viewport,
    /// The number of the film.
    index: usize,
    level: Level,
    density: &'a Density,
    dicing: &'q Dicing,
    /// What no thread works with now.
    idle: &'q Mutex<Vec<Box<TileWork<'a, S>>>>,
}

/// The recursion for every film.
fn see<S: OnDemand>(
    surfaces: &S,
    pencil: &Pencil,
    (density, dicing): (&Density, &Dicing),
    level: Level,
    hits: &mut SurfaceHits,
) -> Result<Stats, Error> {
    let grids = || {
        pencil.films().iter().filter_map(|film| match film {
            Film::Grid(film) => Some(film),
            Film::Scattered(_) => None,
        })
    };
    let windows = SurfaceWindow::over(hits.row(), grids().map(|film| [film.width(), film.height()]));
    let idle = Mutex::new(Vec::new());
    let mut stats = Stats::default();
    for (index, (film, mut window)) in grids().zip(windows).enumerate() {
        let Some(view) = &Viewport::new(pencil.origin(), *film, Sampling::Grid) else {
            window.miss();
            continue;
        };
        let query = SurfaceQuery { surfaces, view, index, level, density, dicing, idle: &idle };
        let detail = density.detail.of_micropolygons(dicing);
        let roots: Vec<Item<S::Object>> = Item::roots(surfaces, &detail).collect();
        stats = stats.then(query.halve(&roots, window)?);
    }
    let mut idle = idle.into_inner().unwrap_or_else(PoisonError::into_inner);
    let threads: usize = idle.iter().map(|work| work.bytes()).sum();
    stats.engine_bytes = stats.engine_bytes * rayon::current_num_threads() as u64 + threads as u64;
    stats.micropolygons_in_flight = idle.iter().map(|work| work.largest_grid).sum();
    hits.tiles = idle.iter_mut().flat_map(|work| work.tiles.drain(..)).collect();
    hits.tiles.sort_unstable_by_key(|tile| (tile.film, tile.rows, tile.columns));
    Ok(stats)
}

impl<'a, S: OnDemand> SurfaceQuery<'_, 'a, S> {
    /// Something to work with, and its return.
    fn with_work<R>(&self, work: impl FnOnce(&mut TileWork<'a, S>) -> R) -> R {
        let taken = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut taken = taken
            .unwrap_or_else(|| Box::new(TileWork::new(Dicer::new(self.surfaces, self.density, self.dicing))));
        let result = work(&mut taken);
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(taken);
        result
    }

    fn frustum(&self, rect: Rect) -> Frustum {
        self.view.frustum_over(rect, START)
    }

    /// One step of the recursion: the rays of a window and the objects that they may meet.
    fn halve(&self, objects: &[Item<S::Object>], mut window: SurfaceWindow<'_>) -> Result<Stats, Error> {
        let rect = window.rect;
        let frustum = self.frustum(rect);
        let mut stats = Stats { nodes: 1, ..Stats::default() };
        let mut met: Vec<Item<S::Object>> =
            objects.iter().filter_map(|item| item.enter(&frustum, &mut stats)).collect();
        if rect.width() <= TILE_SIDE && rect.height() <= TILE_SIDE {
            let tile = GridTile { view: self.view, rect, frustum, pixels: self.pixels([rect.x0, rect.y0]) };
            return self.with_work(|work| {
                work.see(self.level, &tile, met, &mut window, &mut stats)?;
                work.tiles.push(tile_stats(self.index)((rect, stats)));
                Ok(stats)
            });
        }
        let pixels = rect.width() as usize * rect.height() as usize;
        let [first, second] = window.halves(TILE_SIDE);
        let halves = [self.frustum(first.rect), self.frustum(second.rect)];
        self.with_work(|work| refine(&mut met, &halves, pixels, &mut work.walk.opener, &mut stats));
        let (first, second) = rayon::join(|| self.halve(&met, first), || self.halve(&met, second));
        let (first, second) = (first?, second?);
        // The greatest along one way down; each thread is on one.
        stats.engine_bytes = (met.capacity() * size_of::<Item<S::Object>>()) as u64;
        Ok(stats.plus(first.then(second)))
    }

    /// Columns and rows of the film counted from a ray.
    fn pixels(&self, first: [u32; 2]) -> Pixels {
        Pixels::counted_from(&self.view.projection, &self.view.film, first, Sampling::Grid)
    }
}

/// Opens objects that both halves would open, the largest first, until there are many. The size of the others becomes
/// 0. Each round opens those of at least half the greatest size.
fn refine<S: OnDemand>(
    objects: &mut Vec<Item<S::Object>>,
    halves: &[Frustum; 2],
    pixels: usize,
    opener: &mut Opener<'_, S>,
    stats: &mut Stats,
) {
    let wide = WIDE.min(pixels / PIXELS);
    *objects = objects.iter().filter_map(|item| enter_halves(item, halves, stats)).collect();
    loop {
        let greatest = objects.iter().fold(0.0, |most, item| if item.size > most { item.size } else { most });
        if greatest == 0.0 {
            return;
        }
        for place in (0..objects.len()).rev() {
            if objects.len() >= wide {
                return;
            }
            if objects[place].size < greatest * 0.5 {
                continue;
            }
            let item = objects.swap_remove(place);
            let ready =
                opener.open(&item, stats, |part, stats| objects.extend(enter_halves(&part, halves, stats)));
            objects.extend(ready.map(|piece| Item { piece, size: 0.0, ..item }));
        }
    }
}

/// The object, unless it lies outside both frusta. It has a size only if it lies in both, and is not ready.
fn enter_halves<O: Copy>(item: &Item<O>, halves: &[Frustum; 2], stats: &mut Stats) -> Option<Item<O>> {
    let [first, second] = halves.each_ref().map(|half| item.enter(half, stats));
    match (first, second) {
        (Some(item), Some(_)) if item.piece.ready().is_none() => Some(item),
        (first, second) => first.or(second).map(|item| Item { size: 0.0, ..item }),
    }
}
