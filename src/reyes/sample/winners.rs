//! The nearest micropolygons of a tile's rays, while it is worked on.
//!
//! Each ray keeps bounds of its depth key, see [`crate::intersect::grid::tile_keys`], and the triangle that it has hit:
//! its corners, and the place of its quadrilateral in a grid. Grids are forgotten when they have been sampled; what
//! remains of one that some ray has hit is which part of which patch it was. Those that are hidden by now are dropped
//! when there is no room for more, so that a tile takes as much memory as its rays, whatever the number of
//! micropolygons.
//!
//! Based on: Edwin Catmull, "A Subdivision Algorithm for Computer Display of Curved Surfaces", 1974 (the z-buffer).

use fearless_simd::prelude::*;

use crate::exact::distance::{Distance, compare};
use crate::exact::filter::Sign;
use crate::exact::predicates::covers;
use crate::geometry::aabb::Aabb;
use crate::geometry::ray::Ray;
use crate::intersect::grid::hierarchical_z::BLOCK_SIDE;
use crate::intersect::grid::tile_keys::{SIDE, TileKeys};
use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::setup::exact_side;
use crate::rays::origin::Origin;
use crate::reyes::dice::grid::GridOrigin;
use crate::reyes::sample::grid_tile::GridTile;
use crate::reyes::sample::hits::SurfaceRow;
use crate::reyes::sample::micropolygon::{Micropolygon, triangle_of};
use crate::reyes::sample::resolve::Seen;
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// Grids that are remembered: what a tile's rays may need, and some more, so that they are dropped rarely.
const GRIDS: usize = SIDE * SIDE + 512;
/// Rays that are tested one by one; of more, those are left out first that are not near a triangle.
const FEW_RAYS: u32 = 32;
/// Keys from distances: rounded twice to f32.
const KEY_ROUNDING: f32 = 1.0 / (1 << 22) as f32;
/// The greatest lower bound of a key.
const GREATEST_KEY: f32 = 1e37;

/// What a ray has hit.
#[derive(Debug, Clone, Copy)]
struct Winner {
    corners: [[f32; 3]; 3],
    /// The place of the grid.
    grid: u32,
    /// The first corner of the quadrilateral, counted through the grid.
    first: u16,
    /// Which triangle of the two.
    second: bool,
}

/// What the rays of a tile have hit so far.
#[derive(Debug)]
pub(crate) struct TileSamples {
    pub(crate) keys: TileKeys,
    winners: Box<[Winner]>,
    grids: Vec<GridOrigin>,
}

impl TileSamples {
    /// Room for the rays of a tile.
    pub(crate) fn new() -> Self {
        let none = Winner { corners: [[0.0; 3]; 3], grid: 0, first: 0, second: false };
        Self { keys: TileKeys::new(), winners: vec![none; SIDE * SIDE].into_boxed_slice(), grids: Vec::new() }
    }

    /// Bytes of the buffers.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.winners.len() * size_of::<Winner>()
            + self.grids.capacity() * size_of::<GridOrigin>()
    }

    /// Forgets all hits: see [`TileKeys::clear`].
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        self.keys.clear(width, height);
        self.keys.make_ready();
        self.grids.clear();
    }

    /// What a ray has hit, if it has.
    fn winner(&self, x: u32, y: u32) -> Option<&Winner> {
        let hit = self.keys.covered[y as usize % SIDE] >> x & 1 == 1;
        hit.then(|| &self.winners[y as usize * SIDE + x as usize])
    }

    /// The triangle of a winner.
    fn micropolygon(&self, winner: &Winner) -> Micropolygon {
        let place = (usize::from(winner.first), winner.second);
        Micropolygon::of(&self.grids[winner.grid as usize], place, winner.corners)
    }

    /// Writes what the rays of a row see.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &self,
        simd: S,
        tile: &GridTile<'_>,
        y: u32,
        row: &mut SurfaceRow<'_>,
        stats: &mut Stats,
    ) {
        let width = tile.rect.width();
        for x in (0..width).step_by(LANES) {
            let lanes = u64::MAX >> (u64::BITS - (width - x).min(BLOCK_SIDE));
            let hit = self.keys.covered[y as usize % SIDE] >> x & lanes;
            row.miss_some(x as usize, lanes & !hit);
            if hit != 0 {
                let (mut seen, mut ids) = (Seen::NOTHING, [0; LANES]);
                for lane in bits(hit) {
                    let winner = &self.winners[y as usize * SIDE + x as usize + lane];
                    let Micropolygon { surface, corners, parameters } = self.micropolygon(winner);
                    seen.set(lane, corners, parameters);
                    ids[lane] = surface;
                }
                // In range: fewer than eight columns.
                let ray = |lane: usize| tile.ray([x + lane as u32, y]);
                let resolved = seen.along(simd, tile.eight_rays(simd, [x, y]), hit, ray, stats);
                row.put(x as usize, hit, (&ids, &seen), &resolved);
            }
        }
    }

    /// Drops the grids that no ray has hit. O(rays).
    #[cold]
    fn drop_hidden(&mut self, rect: Rect) {
        let (mut places, mut kept) = (vec![u32::MAX; self.grids.len()], Vec::new());
        for y in 0..rect.height() {
            for x in 0..rect.width() {
                if self.winner(x, y).is_none() {
                    continue;
                }
                let grid = &mut self.winners[y as usize * SIDE + x as usize].grid;
                let place = &mut places[*grid as usize];
                if *place == u32::MAX {
                    // In range: at most GRIDS.
                    *place = kept.len() as u32;
                    kept.push(self.grids[*grid as usize]);
                }
                *grid = *place;
            }
        }
        self.grids.clear();
        self.grids.extend(kept);
    }
}

/// A grid that is being sampled.
#[derive(Debug)]
pub(crate) struct GridSamples<'a> {
    pub(crate) tile: &'a mut TileSamples,
    pub(crate) points: &'a [[f32; 3]],
    pub(crate) grid: GridOrigin,
    /// Its place, once some ray has hit it.
    pub(crate) place: Option<u32>,
    pub(crate) stats: &'a mut Stats,
}

impl GridSamples<'_> {
    /// The corners of a triangle.
    #[inline(always)]
    fn corners(&self, triangle: (usize, bool)) -> [[f32; 3]; 3] {
        self.grid.corners(triangle).map(|corner| self.points[corner])
    }

    /// Keeps a triangle for a ray that hits it, for certain or perhaps, if it is the nearest. Its key lies in [lo, hi].
    #[inline(always)]
    pub(crate) fn offer(
        &mut self,
        tile: &GridTile<'_>,
        triangle: (usize, bool),
        [x, y]: [u32; 2],
        [lo, hi]: [f32; 2],
        certain: bool,
    ) {
        self.stats.samples_tested += 1;
        let [near_lo, near_hi] = self.tile.keys.at(x, y);
        if hi < near_lo {
            return;
        }
        // Parallel rays start somewhere, and may start behind.
        let certain = certain && (hi < 0.0 || matches!(tile.view.origin, Origin::Point(_)));
        if certain && lo > near_hi {
            self.keep(tile.rect, triangle, [x, y], [lo, hi]);
        } else {
            self.decide(tile, triangle, ([x, y], [lo, hi]), certain);
        }
    }

    /// Decides exactly: coverage, then the order.
    #[inline(never)]
    fn decide(
        &mut self,
        tile: &GridTile<'_>,
        triangle: (usize, bool),
        ([x, y], [lo, hi]): ([u32; 2], [f32; 2]),
        certain: bool,
    ) {
        self.stats.doubtful_samples += 1;
        let corners = self.corners(triangle);
        let ray = tile.ray([x, y]);
        if !certain && !covers(&ray, &triangle_of(&corners), tile.view.origin.ties(), self.stats) {
            return;
        }
        let nearer = match self.tile.winner(x, y) {
            Some(&winner) if lo <= self.tile.keys.at(x, y)[1] => {
                self.precedes((triangle, corners), &winner, &ray)
            }
            _ => true,
        };
        if nearer {
            self.keep(tile.rect, triangle, [x, y], [lo, hi]);
        }
    }

    /// Whether a triangle comes before a winner along a ray that hits both. Where surfaces coincide, their ids mostly tell: the rest of
    /// the order is not made before it is needed.
    fn precedes(
        &mut self,
        (triangle, corners): ((usize, bool), [[f32; 3]; 3]),
        winner: &Winner,
        ray: &Ray,
    ) -> bool {
        let (one, other) = (triangle_of(&corners), triangle_of(&winner.corners));
        let surfaces = self.grid.surface.cmp(&self.tile.grids[winner.grid as usize].surface);
        match compare(ray, &one, &other, self.stats) {
            Sign::Negative => true,
            Sign::Positive => false,
            Sign::Zero if surfaces.is_ne() => surfaces.is_lt(),
            Sign::Zero => {
                let candidate = Micropolygon::of(&self.grid, triangle, corners);
                candidate.order(&self.tile.micropolygon(winner)).is_lt()
            }
        }
    }

    /// Keeps a triangle.
    #[inline(always)]
    fn keep(&mut self, rect: Rect, triangle: (usize, bool), [x, y]: [u32; 2], keys: [f32; 2]) {
        let grid = match self.place {
            Some(place) => place,
            None => self.enter(rect),
        };
        let corners = self.corners(triangle);
        let (first, second) = (triangle.0 as u16, triangle.1);
        self.tile.winners[y as usize * SIDE + x as usize] = Winner { corners, grid, first, second };
        self.tile.keys.put(x, y, keys);
        self.tile.keys.blocks.mark_stale(y..y + 1);
    }

    /// Remembers the grid.
    #[inline(never)]
    fn enter(&mut self, rect: Rect) -> u32 {
        if self.tile.grids.len() >= GRIDS {
            self.tile.drop_hidden(rect);
        }
        // In range: at most GRIDS.
        let place = self.tile.grids.len() as u32;
        self.tile.grids.push(self.grid);
        self.place = Some(place);
        place
    }

    /// Tests both triangles of a quadrilateral against the rays of a rectangle.
    #[inline(never)]
    pub(crate) fn test_all(&mut self, tile: &GridTile<'_>, first: usize, rect: Rect) {
        for second in [false, true] {
            let corners = self.corners((first, second));
            let bounds = Aabb::of_points(corners);
            if tile.frustum.enter(&bounds).is_none() {
                continue;
            }
            if exact_side(tile.view.origin, &triangle_of(&corners)) == Sign::Zero {
                // Seen edge-on, or without area.
                continue;
            }
            // Halves of halves, so that there are at most as many as halvings.
            let mut rects = vec![rect];
            while let Some(rect) = rects.pop() {
                if rect.width() * rect.height() <= FEW_RAYS {
                    self.test_some(tile, (first, second), rect);
                } else if tile.frustum_over(rect).enter(&bounds).is_some() {
                    rects.extend(halves(rect));
                }
            }
        }
    }

    /// Tests a triangle against the rays of a rectangle, one by one.
    fn test_some(&mut self, tile: &GridTile<'_>, triangle: (usize, bool), rect: Rect) {
        let corners = triangle_of(&self.corners(triangle));
        for y in rect.y0..rect.y1 {
            for x in rect.x0..rect.x1 {
                let ray = tile.ray([x, y]);
                if covers(&ray, &corners, tile.view.origin.ties(), self.stats) {
                    let keys = keys_of(tile.view.origin, Distance::new(&ray, &corners).bounds());
                    self.offer(tile, triangle, [x, y], keys, true);
                }
            }
        }
    }
}

/// The halves of the longer side of a rectangle.
fn halves(rect: Rect) -> [Rect; 2] {
    if rect.width() < rect.height() {
        let y = rect.y0 + rect.height() / 2;
        [Rect { y1: y, ..rect }, Rect { y0: y, ..rect }]
    } else {
        let x = rect.x0 + rect.width() / 2;
        [Rect { x1: x, ..rect }, Rect { x0: x, ..rect }]
    }
}

/// Bounds of the key of a distance within bounds.
fn keys_of(origin: Origin, (least, greatest): (f64, f64)) -> [f32; 2] {
    let [lo, hi] = match origin {
        Origin::Point(_) => [1.0 / greatest, 1.0 / least],
        Origin::Infinity(_) => [-greatest, -least],
    };
    let (lo, hi) = (lo as f32, hi as f32);
    let lo = lo - (lo.abs() * KEY_ROUNDING + f32::MIN_POSITIVE);
    let hi = hi + (hi.abs() * KEY_ROUNDING + f32::MIN_POSITIVE);
    // No lower bound is infinite: nothing would ever be nearer, or the ray would seem to have hit nothing.
    [
        if lo > GREATEST_KEY {
            GREATEST_KEY
        } else if lo >= -f32::MAX {
            lo
        } else {
            -f32::MAX
        },
        hi,
    ]
}
