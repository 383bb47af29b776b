//! A rectangle of the hits of a film, split into disjoint tiles: parallel writing without locks.

use rayon::prelude::*;

use crate::intersect::pencil::rect::Rect;
use crate::rays::hits::{Hits, NO_TRIANGLE, Row};

/// A rectangle of hits that can be written.
#[derive(Debug)]
pub(crate) struct Window<'a> {
    pub(crate) rect: Rect,
    pub(crate) rows: Vec<Row<'a>>,
}

impl<'a> Window<'a> {
    /// Windows over consecutive films of the given widths and heights; a scattered film counts as one row.
    pub(crate) fn over(hits: &'a mut Hits, sizes: impl Iterator<Item = (u32, u32)>) -> Vec<Self> {
        let (mut ids, mut ts) = (&mut hits.ids[..], &mut hits.ts[..]);
        let mut windows = Vec::new();
        for (width, height) in sizes {
            let mut rows = Vec::with_capacity(height as usize);
            for _ in 0..height {
                let (id_row, more_ids) = ids.split_at_mut(width as usize);
                let (t_row, more_ts) = ts.split_at_mut(width as usize);
                rows.push((id_row, t_row));
                (ids, ts) = (more_ids, more_ts);
            }
            windows.push(Self { rect: Rect { x0: 0, y0: 0, x1: width, y1: height }, rows });
        }
        windows
    }

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

    /// Notes that no ray has hit anything.
    pub(crate) fn miss(&mut self) {
        for (ids, ts) in &mut self.rows {
            ids.fill(NO_TRIANGLE);
            ts.fill(f32::INFINITY);
        }
    }
}
