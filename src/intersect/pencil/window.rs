//! A rectangle of the hits of a film, as rows that can be written: split into disjoint parts, these are written in
//! parallel without locks.

use crate::intersect::pencil::rect::Rect;
use crate::rays::hits::{NO_TRIANGLE, Row};

/// The hits of consecutive rays, to be written.
pub(crate) trait HitRow: Sized {
    /// The first rays, and the rest.
    fn split(self, rays: usize) -> [Self; 2];

    /// Notes that no ray has hit anything.
    fn miss(&mut self);
}

/// A rectangle of hits that can be written.
#[derive(Debug)]
pub(crate) struct Window<R> {
    pub(crate) rect: Rect,
    pub(crate) rows: Vec<R>,
}

impl<R: HitRow> Window<R> {
    /// Windows over consecutive films of the given widths and heights, out of all hits.
    pub(crate) fn over(hits: R, sizes: impl Iterator<Item = [u32; 2]>) -> Vec<Self> {
        let mut rest = hits;
        let mut windows = Vec::new();
        for [width, height] in sizes {
            let mut rows = Vec::with_capacity(height as usize);
            for _ in 0..height {
                let [row, more] = rest.split(width as usize);
                rest = more;
                rows.push(row);
            }
            windows.push(Self { rect: Rect { x0: 0, y0: 0, x1: width, y1: height }, rows });
        }
        windows
    }

    /// Notes that no ray has hit anything.
    pub(crate) fn miss(&mut self) {
        self.rows.iter_mut().for_each(HitRow::miss);
    }
}

impl HitRow for Row<'_> {
    fn split(self, rays: usize) -> [Self; 2] {
        let (ids, more_ids) = self.0.split_at_mut(rays);
        let (ts, more_ts) = self.1.split_at_mut(rays);
        [(ids, ts), (more_ids, more_ts)]
    }

    fn miss(&mut self) {
        self.0.fill(NO_TRIANGLE);
        self.1.fill(f32::INFINITY);
    }
}
