//! Tiles of receivers: points that a light sees next to each other, on a film of their own around them.
//!
//! The points are ordered along a curve, see [`crate::intersect::irregular::order`], and seen from the light on the
//! faces of a cube around it, or along its rays on the plane of two coordinates, see [`Plane`]. Those of a tile that
//! share a face get a film of 64x64 columns and rows that just holds them, and the light's pencil over that film goes
//! through the same recursion as a tile of pixels. Nothing is kept per point but its answer.
//!
//! A film is at least 2⁻²⁰ of the coordinates wide, so that a column errs by less than 2⁻²⁴. A point's own column is
//! rounded to f32: another 2⁻¹⁹. See [`crate::intersect::pencil::setup`] for what pays for that.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Chris Wyman, Rama Hoetzlein, Aaron Lefohn,
//! "Frustum-Traced Raster Shadows", 2015.

use std::mem::size_of;
use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::dispatch;
use glam::DVec3;
use rayon::prelude::*;

use crate::intersect::context::Context;
use crate::intersect::general;
use crate::intersect::irregular::face_points::{FacePoints, TILE_POINTS, ToTile};
use crate::intersect::irregular::order::LightGrid;
use crate::intersect::irregular::packets::Packets;
use crate::intersect::pencil::intersect_objects;
use crate::intersect::pencil::leaf::{FilmQuery, Tile, Workspace};
use crate::intersect::pencil::rect::{Rect, TILE_SIDE};
use crate::intersect::pencil::viewport::Viewport;
use crate::intersect::ray_set::{Question, RaySet};
use crate::objects::morton::{along_curve, bytes_for};
use crate::objects::runs::Runs;
use crate::rays::film::{GridFilm, Sampling};
use crate::rays::frustum::Interval;
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
pub(crate) const KEPT: usize = 1;

/// What all tiles share.
#[derive(Debug, Clone, Copy)]
struct ShadowQuery<'a> {
    context: Context<'a>,
    light: Origin,
    receivers: &'a [Receiver],
    runs: &'a Runs,
}

/// What a thread keeps from tile to tile.
struct Scratch<'a> {
    work: Box<Workspace<Packets<'a>>>,
    seen: Box<FacePoints>,
}

impl Scratch<'_> {
    /// Bytes of it.
    const BYTES: usize = Workspace::<Packets<'_>>::bytes(KEPT) + size_of::<FacePoints>() + size_of::<Self>();

    fn new() -> Self {
        Self { work: Workspace::new(Packets::new(), KEPT), seen: Box::new(FacePoints::new()) }
    }
}

/// Finds which receivers a light does not see.
pub(crate) fn shadowed<'a>(
    context: Context<'a>,
    light: Origin,
    receivers: &'a [Receiver],
    runs: &'a Runs,
) -> (Vec<bool>, Stats) {
    let query = ShadowQuery { context, light, receivers, runs };
    let order = along_curve(&LightGrid::new(light, receivers), receivers.len(), context.level);
    let shadowed: Vec<AtomicBool> = (0..receivers.len()).map(|_| AtomicBool::new(false)).collect();
    let of_tile = |scratch: &mut Scratch<'a>, ids: &[u32]| query.tile(scratch, ids, &shadowed);
    let mut stats =
        order.par_chunks(TILE_POINTS).map_init(Scratch::new, of_tile).reduce(Stats::default, Stats::plus);
    let threads = rayon::current_num_threads() * Scratch::BYTES;
    let bytes = runs.bytes() + threads + order.capacity() * size_of::<u32>() + stats.engine_bytes as usize;
    stats.engine_bytes =
        bytes.max(runs.ordering_bytes()).max(runs.bytes() + bytes_for(receivers.len())) as u64;
    (shadowed.into_iter().map(AtomicBool::into_inner).collect(), stats)
}

impl<'a> ShadowQuery<'a> {
    /// Finds which receivers of a tile are in shadow. Each has its own place among the answers.
    fn tile(self, scratch: &mut Scratch<'a>, ids: &[u32], shadowed: &[AtomicBool]) -> Stats {
        let Self { light, receivers, context: Context { level, .. }, .. } = self;
        let seen = &mut scratch.seen;
        let [first, last] = dispatch!(level, simd => seen.see(simd, light, (receivers, ids), None));
        if first == last {
            return self.face(scratch, first, ids, shadowed);
        }
        let mut stats = Stats::default();
        for face in first..=last {
            let seen = &mut scratch.seen;
            dispatch!(level, simd => seen.see(simd, light, (receivers, ids), Some(face)));
            if seen.count > 0 {
                stats = stats.plus(self.face(scratch, face, ids, shadowed));
            }
        }
        stats
    }

    /// Finds which of the receivers that were seen on a face are in shadow.
    fn face(self, scratch: &mut Scratch<'a>, face: usize, ids: &[u32], shadowed: &[AtomicBool]) -> Stats {
        let Scratch { work, seen } = scratch;
        let receivers = self.receivers;
        let (extent, depth) = dispatch!(self.context.level, simd => seen.extent(simd));
        let plane = Plane::numbered(self.light, face);
        let Some(film) = FaceFilm::around(self.light, plane, extent, (seen.depth[0], depth)) else {
            let mut stats = Stats::default();
            for &place in &seen.places[..seen.count] {
                let id = ids[usize::from(place)] as usize;
                let answer = self.alone(&receivers[id], &mut stats);
                shadowed[id].store(answer, Ordering::Relaxed);
            }
            return stats;
        };
        dispatch!(self.context.level, simd => work.depth.fill(simd, (receivers, ids), seen, &film.to_tile));
        let stats = block(self.context, self.runs, &film.view, work);
        for id in work.depth.shadowed() {
            shadowed[id as usize].store(true, Ordering::Relaxed);
        }
        stats
    }

    /// Decides one receiver by the general path: where rounding leaves no film.
    #[cold]
    fn alone(self, receiver: &Receiver, stats: &mut Stats) -> bool {
        let mut hits = Hits::missed(1);
        let set = RaySet::Shadows(self.light, std::slice::from_ref(receiver));
        *stats = stats.plus(general::intersect(
            Question { triangles: self.context.triangles, set, any: true },
            &mut hits,
        ));
        hits.ids[0] != NO_TRIANGLE
    }
}

/// Tests all triangles with the receivers of a film.
pub(crate) fn block(
    context: Context<'_>,
    runs: &Runs,
    view: &Viewport,
    work: &mut Workspace<Packets<'_>>,
) -> Stats {
    let query = FilmQuery { context, view, bounds: runs.bounds(), any: true };
    work.forget_footprints();
    let rect = Rect { x0: 0, y0: 0, x1: view.film.width(), y1: view.film.height() };
    intersect_objects(&mut Tile::new(query, rect, start(view.origin), work), runs)
}

/// The t-coordinates at which what may block receivers begins.
pub(crate) fn start(light: Origin) -> Interval {
    match light {
        Origin::Point(_) => Interval { lo: 0.0, hi: 0.0 },
        // What lies on the way to a receiver has no least t.
        Origin::Infinity(_) => Interval { lo: f64::NEG_INFINITY, hi: 0.0 },
    }
}

/// A film around some receivers.
#[derive(Debug)]
pub(crate) struct FaceFilm {
    pub(crate) view: Viewport,
    pub(crate) to_tile: ToTile,
}

impl FaceFilm {
    /// The film around what is seen on a plane, given the depth of a point and the greatest. `None` where rounding
    /// leaves none.
    pub(crate) fn around(
        light: Origin,
        plane: Plane,
        extent: [[f64; 2]; 2],
        (height, greatest): (f64, f64),
    ) -> Option<Self> {
        let [ahead, right, up] = plane.axes();
        let (size, forward) = match light {
            // Coordinates on the face of a cube are at most 1.
            Origin::Point(_) => (1.0, ahead),
            Origin::Infinity(d) => {
                // Parallel rays start at a point's height, back along D from where they pierce the plane through zero.
                let aside = right * d.dot(right) + up * d.dot(up);
                let size = extent.as_flattened().iter().fold(greatest, |size, x| size.max(x.abs()));
                (size, ahead * height + aside * (height / d.dot(ahead)))
            }
        };
        let half = |[lo, hi]: [f64; 2]| ((hi - lo) * 0.5).max(size * LEAST_WIDTH) / FILM_REACH;
        let [x, y] = extent.map(|[lo, hi]| lo * 0.5 + hi * 0.5);
        let forward = forward + right * x + up * y;
        let spans = [right * half(extent[0]), up * half(extent[1])];
        let film = GridFilm::new(TILE_SIDE, TILE_SIDE, forward, spans[0], spans[1]).ok()?;
        let view = Viewport::new(light, film, Sampling::Scattered)?;
        // As the film has them: X = 2·column − 63, Y = 63 − 2·row.
        let [forward, r, u] = view.film.span();
        let (r, u, last) = (r.dot(right), u.dot(up), f64::from(TILE_SIDE - 1));
        let (middle, depth) = match light {
            Origin::Point(_) => ([right, up].map(|axis| forward.dot(axis)), [0.0, 1.0]),
            Origin::Infinity(d) => {
                let (height, along) = (forward.dot(ahead), d.dot(ahead));
                let place = |axis: DVec3| forward.dot(axis) - height * (d.dot(axis) / along);
                ([right, up].map(place), [height, -1.0 / along])
            }
        };
        let at = [[middle[0] - last * r, 0.5 / r], [middle[1] + last * u, -0.5 / u]];
        Some(Self { view, to_tile: ToTile { at, depth } })
    }
}
