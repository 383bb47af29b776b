//! A tile of receivers: points that a light sees next to each other, on films of their own around them.
//!
//! The points are seen from the light on the faces of a cube around it, or along its rays on the plane of two
//! coordinates, see [`Plane`]. Those of a tile that share a face get a film of 64x64 columns and rows that just holds
//! them; the light's pencil over that film goes through the same recursion as a tile of pixels. Nothing is kept per
//! point but its answer.
//!
//! A film is at least 2⁻²⁰ of the coordinates wide, so that a column errs by less than 2⁻²⁴. A point's own column is
//! rounded to f32: another 2⁻¹⁹. See [`crate::intersect::pencil::setup`] for what pays for that.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Chris Wyman, Rama Hoetzlein, Aaron Lefohn,
//! "Frustum-Traced Raster Shadows", 2015.

use std::mem::size_of;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::{Level, dispatch};

use crate::geometry::triangles::Triangles;
use crate::intersect::context::Context;
use crate::intersect::general;
use crate::intersect::irregular::face_points::{Extent, FacePoints, ToTile};
use crate::intersect::irregular::packets::Packets;
use crate::intersect::pencil::intersect_objects;
use crate::intersect::pencil::leaf::{FilmQuery, Tile, Workspace};
use crate::intersect::pencil::rect::TILE_SIDE;
use crate::intersect::pencil::viewport::Viewport;
use crate::intersect::ray_set::{Question, RaySet};
use crate::objects::runs::Runs;
use crate::rays::film::{GridFilm, Sampling};
use crate::rays::frustum::{Frustum, Interval};
use crate::rays::hits::{Hits, NO_TRIANGLE};
use crate::rays::origin::Origin;
use crate::rays::projection::Plane;
use crate::rays::receiver::Receiver;
use crate::stats::Stats;

/// The least half width of a film, as a part of the coordinates.
const LEAST_WIDTH: f64 = 1.0 / (1 << 20) as f64;
/// X and Y of points on their film lie within ±62, those of its columns and rows within ±63.
const FILM_REACH: f64 = (TILE_SIDE - 2) as f64;
/// Runs whose footprints are kept: each is met once by a film.
const KEPT: usize = 1;

/// Receivers, and the light that they are asked about.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lit<'a> {
    pub(crate) light: Origin,
    pub(crate) receivers: &'a [Receiver],
    pub(crate) level: Level,
}

impl Lit<'_> {
    /// Decides receivers by the general path: where rounding leaves no film.
    #[cold]
    pub(crate) fn one_by_one(self, triangles: &Triangles<'_>, ids: &[u32], shadowed: &[AtomicBool]) -> Stats {
        let receivers: Vec<Receiver> = ids.iter().map(|&id| self.receivers[id as usize]).collect();
        let mut hits = Hits::missed(ids.len());
        let set = RaySet::Shadows(self.light, &receivers);
        let stats = general::intersect(Question { triangles, set, any: true }, &mut hits);
        for (&id, _) in ids.iter().zip(hits.ids()).filter(|(_, hit)| **hit != NO_TRIANGLE) {
            shadowed[id as usize].store(true, Ordering::Relaxed);
        }
        stats
    }
}

/// What a thread keeps from tile to tile.
pub(crate) struct LitTile<'a> {
    pub(crate) work: Box<Workspace<Packets<'a>>>,
    seen: Box<FacePoints>,
    /// The faces that the tile is seen on.
    faces: RangeInclusive<usize>,
}

impl<'a> LitTile<'a> {
    /// Bytes of it.
    pub(crate) const BYTES: usize =
        Workspace::<Packets<'_>>::bytes(KEPT) + size_of::<FacePoints>() + size_of::<Self>();

    pub(crate) fn new() -> Self {
        let work = Workspace::new(Packets::new(), KEPT);
        Self { work, seen: Box::new(FacePoints::new()), faces: 0..=0 }
    }

    /// Sees the receivers of a tile, and tells which faces they may be on.
    pub(crate) fn see(&mut self, lit: Lit<'a>, ids: &[u32]) -> RangeInclusive<usize> {
        let Lit { light, receivers, level } = lit;
        let [first, last] = dispatch!(level, simd => self.seen.see(simd, light, (receivers, ids), None));
        self.faces = first..=last;
        self.faces.clone()
    }

    /// Turns to those on one of these faces: the film around them, on which they are put. `None` where rounding leaves
    /// no film, or nothing is there.
    pub(crate) fn turn_to(&mut self, lit: Lit<'a>, ids: &[u32], face: usize) -> Option<FaceFilm> {
        let Self { work, seen, faces } = self;
        let Lit { light, receivers, level } = lit;
        if *faces != (face..=face) {
            dispatch!(level, simd => seen.see(simd, light, (receivers, ids), Some(face)));
        }
        if seen.count == 0 {
            return None;
        }
        let extent = dispatch!(level, simd => seen.extent(simd));
        let film = FaceFilm::around(Plane::numbered(light, face), &extent)?;
        dispatch!(level, simd => work.depth.fill(simd, (receivers, ids), seen, &film.to_tile));
        Some(film)
    }

    /// The receivers, out of those of the tile, on the face at hand.
    pub(crate) fn here(&self, ids: &[u32]) -> Vec<u32> {
        self.seen.places[..self.seen.count].iter().map(|&place| ids[usize::from(place)]).collect()
    }
}

/// Tests all triangles with the receivers of a film.
pub(crate) fn block(
    context: Context<'_>,
    runs: &Runs,
    film: &FaceFilm,
    work: &mut Workspace<Packets<'_>>,
) -> Stats {
    let query = FilmQuery { context, view: &film.view, bounds: runs.bounds(), any: true };
    work.forget_footprints();
    intersect_objects(&mut Tile::new(query, film.view.rect(), film.start(), work), runs)
}

/// Notes which receivers of a film were found in shadow. Each has its own place among the answers.
pub(crate) fn note(work: &Workspace<Packets<'_>>, shadowed: &[AtomicBool]) {
    work.depth.shadowed().for_each(|id| shadowed[id as usize].store(true, Ordering::Relaxed));
}

/// A film around some receivers.
#[derive(Debug)]
pub(crate) struct FaceFilm {
    view: Viewport,
    to_tile: ToTile,
}

impl FaceFilm {
    /// The film around what is seen on a plane. `None` where rounding leaves none.
    fn around(plane: Plane, extent: &Extent) -> Option<Self> {
        let Extent { at, depth, greatest_depth } = extent;
        let [_, right, up] = plane.axes();
        let size = match plane.origin {
            // Coordinates on the face of a cube are at most 1.
            Origin::Point(_) => 1.0,
            Origin::Infinity(_) => {
                at.as_flattened().iter().fold(*greatest_depth, |size, x| size.max(x.abs()))
            }
        };
        let half = |[lo, hi]: [f64; 2]| ((hi - lo) * 0.5).max(size * LEAST_WIDTH) / FILM_REACH;
        let forward = plane.seen_at(at.map(|[lo, hi]| lo * 0.5 + hi * 0.5), *depth);
        let spans = [right * half(at[0]), up * half(at[1])];
        let film = GridFilm::new(TILE_SIDE, TILE_SIDE, forward, spans[0], spans[1]).ok()?;
        let view = Viewport::new(plane.origin, film, Sampling::Scattered)?;
        // As the film has them, rounded: X = 2·column − 63, Y = 63 − 2·row.
        let [forward, r, u] = view.film.span();
        let (r, u, last) = (r.dot(right), u.dot(up), f64::from(TILE_SIDE - 1));
        let [x, y] = plane.place(forward).map(|place| place.value);
        let depth = match plane.origin {
            Origin::Point(_) => [0.0, 1.0],
            Origin::Infinity(direction) => [plane.ahead(forward), -1.0 / plane.ahead(direction)],
        };
        let at = [[x - last * r, 0.5 / r], [y + last * u, -0.5 / u]];
        Some(Self { view, to_tile: ToTile { at, depth } })
    }

    /// The t-coordinates at which what may block receivers begins.
    fn start(&self) -> Interval {
        match self.view.origin {
            Origin::Point(_) => Interval { lo: 0.0, hi: 0.0 },
            // What lies on the way to a receiver has no least t.
            Origin::Infinity(_) => Interval { lo: f64::NEG_INFINITY, hi: 0.0 },
        }
    }

    /// The frustum over it.
    pub(crate) fn frustum(&self) -> Frustum {
        self.view.frustum_over(self.view.rect(), self.start())
    }
}
