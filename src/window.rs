//! A rectangle of the hits of a film, split into disjoint halves: parallel writing without locks.

use crate::Hits;

/// Columns `columns` and rows `rows` of a film, half open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rect {
    pub(crate) x0: u32,
    pub(crate) y0: u32,
    pub(crate) x1: u32,
    pub(crate) y1: u32,
}

impl Rect {
    /// Columns.
    pub(crate) fn width(&self) -> u32 {
        self.x1 - self.x0
    }

    /// Rows.
    pub(crate) fn height(&self) -> u32 {
        self.y1 - self.y0
    }
}

/// The hits of one row of a window: ids and distances.
pub(crate) type Row<'a> = (&'a mut [u32], &'a mut [f32]);

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

    /// The tiles of at most `side` columns and rows, near each other in the order of the list: halves of halves.
    pub(crate) fn split(self, side: u32, tiles: &mut Vec<Self>) {
        if self.rect.width() <= side && self.rect.height() <= side {
            tiles.push(self);
        } else {
            let (one, other) = self.halves(side);
            one.split(side, tiles);
            other.split(side, tiles);
        }
    }

    /// The halves left and right of a column, or above and below a row, whichever side is longer, cut at a multiple of
    /// `align` where there is one.
    fn halves(self, align: u32) -> (Self, Self) {
        let Rect { x0, y0, x1, y1 } = self.rect;
        let middle = |lo: u32, hi: u32| lo + ((hi - lo) / 2).div_ceil(align) * align;
        if self.rect.width() >= self.rect.height() {
            let x = middle(x0, x1);
            let at = (x - x0) as usize;
            let halves = self.rows.into_iter().map(|(ids, ts)| {
                let ((left_ids, right_ids), (left_ts, right_ts)) =
                    (ids.split_at_mut(at), ts.split_at_mut(at));
                ((left_ids, left_ts), (right_ids, right_ts))
            });
            let (left, right) = halves.unzip();
            let (left_rect, right_rect) = (Rect { x0, y0, x1: x, y1 }, Rect { x0: x, y0, x1, y1 });
            (Self { rect: left_rect, rows: left }, Self { rect: right_rect, rows: right })
        } else {
            let y = middle(y0, y1);
            let mut above = self.rows;
            let below = above.split_off((y - y0) as usize);
            let (above_rect, below_rect) = (Rect { x0, y0, x1, y1: y }, Rect { x0, y0: y, x1, y1 });
            (Self { rect: above_rect, rows: above }, Self { rect: below_rect, rows: below })
        }
    }
}
