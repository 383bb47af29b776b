//! A tile of Reyes: objects from near to far, until they are diced or hidden.

use fearless_simd::dispatch;

use crate::error::Error;
use crate::intersect::pencil::leaf::greatest_key;
use crate::reyes::closest::{FilmQuery, Item, Workspace, enter};
use crate::reyes::dice::patch::SubPatch;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::sample::hits::SurfaceWindow;
use crate::reyes::sample::kernel::GridTile;
use crate::reyes::sample::winners::{GridOrigin, GridSamples};
use crate::stats::Stats;

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
        let ready = item.piece.ready().or_else(|| open(query, tile, work, &item, &mut stats));
        if let Some(part) = ready {
            dice(query, tile, work, (&item, part), &mut stats)?;
        }
    }
    dispatch!(query.level, simd => {
        for (y, row) in (0..).zip(&mut window.rows) {
            work.samples.write(simd, tile, y, row, &mut stats);
        }
    });
    Ok(stats)
}

/// Opens an object: its parts come next. A patch that is ready as it is has none: it is returned.
fn open<S: OnDemand>(
    query: &FilmQuery<'_, '_, S>,
    tile: &GridTile<'_>,
    work: &mut Workspace<'_, S>,
    item: &Item<S::Object>,
    stats: &mut Stats,
) -> Option<SubPatch> {
    let Workspace { dicer, opened, stack, .. } = work;
    opened.clear();
    if let Some(piece) = dicer.open(&item.piece, &item.bounds, opened, stats) {
        return piece.ready();
    }
    let first = stack.len();
    let parts = opened.iter().map(|piece| Item::new(*piece, query.surfaces, &dicer.detail));
    stack.extend(parts.filter_map(|part| enter(&part, &tile.frustum, stats)));
    sort_far_first(&mut stack[first..]);
    None
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
