//! Splits a window of hits into tiles.

use rayon::prelude::*;

use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::window::Window;
use crate::rays::hits::Row;

impl Window<Row<'_>> {
    /// The tiles of at most `side` columns and rows, row by row of tiles.
    pub(crate) fn tiles(mut self, side: u32) -> Vec<Self> {
        let Rect { x0, y0, x1, y1 } = self.rect;
        let bands: Vec<Vec<Self>> = self
            .rows
            .par_chunks_mut(side as usize)
            .zip((y0..y1).into_par_iter().step_by(side as usize))
            .map(|(band, y)| {
                let mut tiles: Vec<Self> = (x0..x1)
                    .step_by(side as usize)
                    .map(|x| Rect { x0: x, y0: y, x1: (x + side).min(x1), y1: (y + side).min(y1) })
                    .map(|rect| Self { rect, rows: Vec::with_capacity(band.len()) })
                    .collect();
                for row in band {
                    let (ids, ts) = std::mem::take(row);
                    let parts = ids.chunks_mut(side as usize).zip(ts.chunks_mut(side as usize));
                    tiles.iter_mut().zip(parts).for_each(|(tile, row)| tile.rows.push(row));
                }
                tiles
            })
            .collect();
        bands.into_iter().flatten().collect()
    }
}
