//! What rays see of surfaces on demand: ids, distances, parameters and normals, and rectangles of them to be written.

use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::window::{HitRow, Window};
use crate::rays::hits::{Hits, NO_TRIANGLE};
use crate::reyes::sample::resolve::{Resolved, Seen};
use crate::simd::lanes::{LANES, bits};
use crate::stats::TileStats;

/// The nearest surfaces of a set of rays, in the order of the rays.
#[derive(Debug, Clone, Default)]
pub struct SurfaceHits {
    hits: Hits,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) corners: Vec<[[f32; 3]; 3]>,
    pub(crate) tiles: Vec<TileStats>,
    pub(crate) pairs: Vec<u32>,
}

impl PartialEq for SurfaceHits {
    /// The same hits, whatever they have cost.
    fn eq(&self, other: &Self) -> bool {
        (&self.hits, &self.uvs, &self.normals, &self.corners)
            == (&other.hits, &other.uvs, &other.normals, &other.corners)
    }
}

impl SurfaceHits {
    /// Makes room for some rays that are all going to be written. New memory is made of zeros that nobody has touched
    /// yet.
    pub(crate) fn make_room(&mut self, rays: usize, corners: bool) {
        let kept = if corners { rays } else { 0 };
        self.hits.make_room(rays);
        if (self.uvs.len(), self.corners.len()) != (rays, kept) {
            *self = Self {
                hits: std::mem::take(&mut self.hits),
                uvs: vec![[0.0; 2]; rays],
                normals: vec![[0.0; 3]; rays],
                corners: vec![[[0.0; 3]; 3]; kept],
                ..Self::default()
            };
        }
        self.tiles.clear();
        self.pairs.clear();
    }

    /// The number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.hits.len()
    }

    /// Whether there was no ray.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.hits.is_empty()
    }

    /// The ids of the surfaces: `0xFFFF_FFFF` is a miss.
    #[must_use]
    pub fn ids(&self) -> &[u32] {
        self.hits.ids()
    }

    /// Distances in units of the ray's direction, rounded to the nearest f32: +∞ is a miss.
    #[must_use]
    pub fn ts(&self) -> &[f32] {
        self.hits.ts()
    }

    /// (u, v) of the patch, each within \[0, 1\]: NaN is a miss.
    #[must_use]
    pub fn uvs(&self) -> &[[f32; 2]] {
        &self.uvs
    }

    /// Normals of the micropolygons, of unit length, on the side of ∂P/∂u × ∂P/∂v: NaN is a miss.
    #[must_use]
    pub fn normals(&self) -> &[[f32; 3]] {
        &self.normals
    }

    /// The corners of the micropolygons that are seen, as
    /// [`Triangles::leave`](crate::geometry::triangles::Triangles::leave) needs them: zeros where there is a miss.
    /// Empty unless [`Dicing::keep_corners`](crate::reyes::dice::dicing::Dicing::keep_corners) was asked for.
    #[must_use]
    pub fn corners(&self) -> &[[[f32; 3]; 3]] {
        &self.corners
    }

    /// What each tile of the films has cost, those that share objects aside; empty on the general path.
    #[must_use]
    pub fn tiles(&self) -> &[TileStats] {
        &self.tiles
    }

    /// What each ray has cost on the general path, as [`Frame::pairs`](crate::query::frame::Frame::pairs) tells it;
    /// else empty.
    #[must_use]
    pub fn pairs(&self) -> &[u32] {
        &self.pairs
    }

    /// All hits as one row.
    pub(crate) fn row(&mut self) -> SurfaceRow<'_> {
        let Self { hits, uvs, normals, corners, .. } = self;
        let (ids, ts) = hits.as_row();
        SurfaceRow { ids, ts, uvs, normals, corners }
    }
}

/// The hits of consecutive rays, to be written.
#[derive(Debug, Default)]
pub(crate) struct SurfaceRow<'a> {
    pub(crate) ids: &'a mut [u32],
    pub(crate) ts: &'a mut [f32],
    pub(crate) uvs: &'a mut [[f32; 2]],
    pub(crate) normals: &'a mut [[f32; 3]],
    /// Empty where nobody wants them.
    pub(crate) corners: &'a mut [[[f32; 3]; 3]],
}

impl SurfaceRow<'_> {
    /// Writes what some of eight rays from one on see.
    #[inline(always)]
    pub(crate) fn put(
        &mut self,
        first: usize,
        lanes: u64,
        (ids, seen): (&[u32; LANES], &Seen),
        resolved: &Resolved,
    ) {
        let Resolved { ts, uvs, normals } = resolved;
        for lane in bits(lanes) {
            let ray = first + lane;
            (self.ids[ray], self.ts[ray]) = (ids[lane], ts[lane]);
            self.uvs[ray] = uvs.each_ref().map(|part| part[lane]);
            self.normals[ray] = normals.each_ref().map(|part| part[lane]);
            if let Some(corners) = self.corners.get_mut(ray) {
                *corners = seen.corners.map(|corner| corner[lane]);
            }
        }
    }

    /// Notes that some of eight rays from one on have hit nothing.
    #[inline(always)]
    pub(crate) fn miss_some(&mut self, first: usize, lanes: u64) {
        for lane in bits(lanes) {
            let ray = first + lane;
            (self.ids[ray], self.ts[ray]) = (NO_TRIANGLE, f32::INFINITY);
            (self.uvs[ray], self.normals[ray]) = ([f32::NAN; 2], [f32::NAN; 3]);
            if let Some(corners) = self.corners.get_mut(ray) {
                *corners = [[0.0; 3]; 3];
            }
        }
    }
}

impl HitRow for SurfaceRow<'_> {
    fn split(self, rays: usize) -> [Self; 2] {
        let (ids, more_ids) = self.ids.split_at_mut(rays);
        let (ts, more_ts) = self.ts.split_at_mut(rays);
        let (uvs, more_uvs) = self.uvs.split_at_mut(rays);
        let (normals, more_normals) = self.normals.split_at_mut(rays);
        let kept = rays.min(self.corners.len());
        let (corners, more_corners) = self.corners.split_at_mut(kept);
        [
            Self { ids, ts, uvs, normals, corners },
            Self { ids: more_ids, ts: more_ts, uvs: more_uvs, normals: more_normals, corners: more_corners },
        ]
    }

    fn miss(&mut self) {
        self.ids.fill(NO_TRIANGLE);
        self.ts.fill(f32::INFINITY);
        self.uvs.fill([f32::NAN; 2]);
        self.normals.fill([f32::NAN; 3]);
        self.corners.fill([[0.0; 3]; 3]);
    }
}

/// A rectangle of the hits of a film.
pub(crate) type SurfaceWindow<'a> = Window<SurfaceRow<'a>>;

impl SurfaceWindow<'_> {
    /// The halves of the longer side, cut between tiles.
    pub(crate) fn halves(self, tile: u32) -> [Self; 2] {
        let Rect { x0, y0, x1, y1 } = self.rect;
        let middle = |size: u32| size.div_ceil(tile).div_ceil(2) * tile;
        if x1 - x0 < y1 - y0 {
            let rows_above = middle(y1 - y0);
            let mut above = self.rows;
            let below = above.split_off(rows_above as usize);
            let y = y0 + rows_above;
            return [
                Self { rect: Rect { y1: y, ..self.rect }, rows: above },
                Self { rect: Rect { y0: y, ..self.rect }, rows: below },
            ];
        }
        let columns = middle(x1 - x0);
        let (left, right) = self.rows.into_iter().map(|row| row.split(columns as usize).into()).unzip();
        let x = x0 + columns;
        [
            Self { rect: Rect { x1: x, ..self.rect }, rows: left },
            Self { rect: Rect { x0: x, ..self.rect }, rows: right },
        ]
    }
}
