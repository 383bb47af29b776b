//! A tile of Reyes: objects from near to far, until they are diced or hidden.

use fearless_simd::dispatch;

use crate::dicer::Piece;
use crate::grid_samples::{GridOrigin, GridSamples};
use crate::grid_tile::GridTile;
use crate::hits::NO_TRIANGLE;
use crate::leaf::greatest_key;
use crate::micropolygon::Sight;
use crate::reyes::{FilmQuery, Item, Workspace, enter};
use crate::sub_patch::SubPatch;
use crate::surface_hits::{SurfaceRow, SurfaceWindow};
use crate::{Error, OnDemand, Stats};

/// Finds what the rays of a tile see of some objects, and writes it.
pub(crate) fn see<S: OnDemand>(
    query: &FilmQuery<'_, '_, S>,
    tile: &GridTile<'_>,
    work: &mut Workspace<'_, S>,
    (objects, mut window): (Vec<Item<S::Object>>, SurfaceWindow<'_>),
    mut stats: Stats,
) -> Result<Stats, Error> {
    let rect = tile.rect;
    work.samples.clear(rect.width(), rect.height());
    work.stack.clear();
    work.stack.extend(objects);
    sort_far_first(&mut work.stack);
    while let Some(item) = work.stack.pop() {
        let bounds = (item.bounds, greatest_key(tile.origin, item.t));
        let samples = &mut work.samples;
        let hidden = dispatch!(query.level, simd => {
            samples.keys.refresh_blocks(simd);
            tile.hides(simd, &samples.keys.blocks, bounds)
        });
        if hidden {
            stats.surfaces_culled_by_depth += 1;
            continue;
        }
        match item.piece.ready() {
            Some(part) => dice(query, tile, work, (&item, part), &mut stats)?,
            None => open(query, tile, work, &item, &mut stats),
        }
    }
    let seen = |place: [u32; 2]| {
        let ray = || tile.origin.ray(tile.film.at(rect.x0 + place[0], rect.y0 + place[1]));
        work.samples.seen(place, ray)
    };
    for (y, row) in (0..).zip(&mut window.rows) {
        (0..rect.width()).for_each(|x| row.put(x as usize, seen([x, y])));
    }
    Ok(stats)
}

/// Opens an object: its parts come next.
fn open<S: OnDemand>(
    query: &FilmQuery<'_, '_, S>,
    tile: &GridTile<'_>,
    work: &mut Workspace<'_, S>,
    item: &Item<S::Object>,
    stats: &mut Stats,
) {
    let Workspace { dicer, opened, stack, .. } = work;
    opened.clear();
    dicer.open(&item.piece, &item.bounds, opened, stats);
    let first = stack.len();
    stack.extend(opened.iter().filter_map(|piece: &Piece<S::Object>| {
        let bounds = piece.bounds(query.surfaces);
        enter(&Item { piece: *piece, bounds, t: 0.0 }, &tile.frustum, stats)
    }));
    sort_far_first(&mut stack[first..]);
}

/// Dices a part of a patch, and tests the micropolygons.
fn dice<S: OnDemand>(
    query: &FilmQuery<'_, '_, S>,
    tile: &GridTile<'_>,
    work: &mut Workspace<'_, S>,
    (item, part): (&Item<S::Object>, SubPatch),
    stats: &mut Stats,
) -> Result<(), Error> {
    let object = &item.piece.object;
    let bits = work.dicer.dice(object, &part)?;
    let size = bits.map(|bits| 1_usize << bits);
    let count = (size[0] * size[1]) as u64;
    stats.surfaces_diced += 1;
    stats.micropolygons += count;
    work.largest_grid = work.largest_grid.max(count);
    let grid = GridOrigin { surface: query.surfaces.id(object), part, bits };
    let Workspace { dicer, samples, grid: placed, .. } = work;
    let points = &dicer.points[..];
    let mut samples = GridSamples { tile: samples, points, grid, place: None, stats };
    let irregular = dispatch!(query.level, simd => {
        let irregular = placed.place(simd, (points, size), &tile.pixels, &item.bounds);
        if !irregular {
            tile.sample(simd, placed, &mut samples);
        }
        irregular
    });
    if irregular {
        // Points that are not finite have no place either.
        dicer.check_points(object)?;
        dispatch!(query.level, simd => tile.sample(simd, placed, &mut samples));
    }
    Ok(())
}

/// Sorts so that the nearest is the last.
fn sort_far_first<O>(items: &mut [Item<O>]) {
    items.sort_unstable_by(|one, other| other.t.total_cmp(&one.t));
}

impl SurfaceRow<'_> {
    /// Writes what a ray sees.
    pub(crate) fn put(&mut self, ray: usize, seen: Option<(u32, Sight)>) {
        let miss = Sight { t: f32::INFINITY, uv: [f32::NAN; 2], normal: [f32::NAN; 3] };
        let (id, Sight { t, uv, normal }) = seen.unwrap_or((NO_TRIANGLE, miss));
        (self.ids[ray], self.ts[ray], self.uvs[ray], self.normals[ray]) = (id, t, uv, normal);
    }
}
