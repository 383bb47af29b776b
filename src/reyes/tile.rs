//! A tile of Reyes: objects from near to far, until they are diced or hidden.

use std::mem::size_of;

use fearless_simd::{Level, dispatch};

use crate::error::Error;
use crate::intersect::pencil::leaf::greatest_key;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::sample::grid_tile::GridTile;
use crate::reyes::sample::hits::SurfaceWindow;
use crate::reyes::sample::projected::PlacedGrid;
use crate::reyes::sample::winners::{GridSamples, TileSamples};
use crate::reyes::walk::{Item, Ready, Search, Walk};
use crate::stats::{Stats, TileStats};

/// What a thread works with.
pub(crate) struct TileWork<'a, S: OnDemand> {
    pub(crate) walk: Walk<'a, S>,
    samples: TileSamples,
    grid: PlacedGrid,
    /// The most micropolygons of a grid.
    pub(crate) largest_grid: u64,
    /// What the tiles have cost that were worked on here.
    pub(crate) tiles: Vec<TileStats>,
}

impl<'a, S: OnDemand> TileWork<'a, S> {
    pub(crate) fn new(dicer: Dicer<'a, S>) -> Self {
        let (samples, grid) = (TileSamples::new(), PlacedGrid::default());
        Self { walk: Walk::new(dicer), samples, grid, largest_grid: 0, tiles: Vec::new() }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.walk.bytes()
            + self.samples.bytes()
            + self.grid.bytes()
            + self.tiles.capacity() * size_of::<TileStats>()
    }

    /// Finds what the rays of a tile see of some objects, which have entered its frustum, and writes it.
    pub(crate) fn see(
        &mut self,
        level: Level,
        tile: &GridTile<'_>,
        objects: Vec<Item<S::Object>>,
        window: &mut SurfaceWindow<'_>,
        stats: &mut Stats,
    ) -> Result<(), Error> {
        let Self { walk, samples, grid, largest_grid, .. } = self;
        samples.clear(tile.rect.width(), tile.rect.height());
        let mut search = TileSearch { level, tile, samples, grid, largest_grid };
        walk.begin_with(objects);
        walk.go(&mut search, stats)?;
        dispatch!(level, simd => {
            for (y, row) in (0..).zip(&mut window.rows) {
                samples.write(simd, tile, y, row, stats);
            }
        });
        Ok(())
    }
}

/// Looks for what the rays of a tile see.
struct TileSearch<'t> {
    level: Level,
    tile: &'t GridTile<'t>,
    samples: &'t mut TileSamples,
    grid: &'t mut PlacedGrid,
    largest_grid: &'t mut u64,
}

impl<S: OnDemand> Search<S> for TileSearch<'_> {
    #[inline(always)]
    fn enter(&mut self, item: Item<S::Object>, stats: &mut Stats) -> Option<Item<S::Object>> {
        item.enter(&self.tile.frustum, stats)
    }

    fn hides(&mut self, item: &Item<S::Object>) -> bool {
        let bounds = (item.bounds, greatest_key(self.tile.view.origin, item.t));
        let keys = &mut self.samples.keys;
        dispatch!(self.level, simd => {
            keys.refresh_blocks(simd);
            self.tile.hides(simd, &keys.blocks, bounds)
        })
    }

    /// Dices a part of a patch, and tests the micropolygons.
    fn take(&mut self, mut ready: Ready<'_, '_, S>, stats: &mut Stats) -> Result<(), Error> {
        let tile = self.tile;
        let grid = ready.dice(stats)?;
        let size = grid.bits.map(|bits| 1_usize << bits);
        *self.largest_grid = ((size[0] * size[1]) as u64).max(*self.largest_grid);
        let points = &ready.dicer.points[..];
        let placed = &mut *self.grid;
        let mut samples = GridSamples { tile: &mut *self.samples, points, grid, place: None, stats };
        let irregular = dispatch!(self.level, simd => {
            let irregular = placed.place(simd, (points, size), &tile.pixels, &ready.item.bounds);
            if !irregular {
                tile.sample(simd, placed, &mut samples);
            }
            irregular
        });
        if irregular {
            // Points that are not finite have no place either.
            ready.check_points()?;
            dispatch!(self.level, simd => tile.sample(simd, placed, &mut samples));
        }
        Ok(())
    }
}
