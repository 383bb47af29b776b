//! Shadows of surfaces on demand: diced as the eye sees them, tested exactly, and forgotten.
//!
//! What casts a shadow is the surface that is seen: micropolygons are those of the *view*, wherever the light is. So a
//! surface that is both seen and in the way casts the shadow of the very triangles that are seen, and has no acne: a
//! receiver lies in its own triangle's plane or on the light's side of it, see [`crate::rays::receiver`], and its
//! neighbours are decided exactly.
//!
//! ```text
//! for each tile of receivers that the light sees side by side, on a film around them:
//!     nearest the roots first: drop objects outside the frustum of the film, and behind all receivers that are left
//!     open what is left, or dice it; test the micropolygons, some thousands at a time
//! ```
//!
//! A tile of receivers is that of [`crate::intersect::irregular::shadow`], and micropolygons are tested as triangles
//! are there. Memory: those that wait and a tile for each thread, and the way to them; nothing grows with the number of
//! micropolygons.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Gregory
//! Johnson et al., "The Irregular Z-Buffer", 2005.

use std::mem::size_of;
use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::intersect::context::Context;
use crate::intersect::general;
use crate::intersect::irregular::face_points::FacePoints;
use crate::intersect::irregular::face_points::TILE_POINTS;
use crate::intersect::irregular::order::LightGrid;
use crate::intersect::irregular::packets::Packets;
use crate::intersect::irregular::shadow::{FaceFilm, KEPT, block, start};
use crate::intersect::pencil::leaf::{LeafDepth, Workspace, greatest_key};
use crate::intersect::ray_set::{Question, RaySet};
use crate::objects::morton::{along_curve, bytes_for};
use crate::objects::runs::{Order, Runs};
use crate::options::{Options, Path};
use crate::query::call::{check_call, in_pool};
use crate::query::frame::Frame;
use crate::rays::frustum::{Frustum, Interval};
use crate::rays::hits::Hits;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::origin::Origin;
use crate::rays::pencil::Pencil;
use crate::rays::projection::Plane;
use crate::rays::receiver;
use crate::rays::receiver::Receiver;
use crate::reyes::dice::density::Density;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::grid_triangles::GridTriangles;
use crate::reyes::dice::patch::{GRID_BITS, SubPatch};
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::reference::dice_all;
use crate::reyes::walk::{Item, Search, Walk};
use crate::stats::Stats;

/// Micropolygons that are tested together, at least: their runs are made by one thread.
const TOGETHER: usize = 1 << 11;

/// Finds which receivers a light does not see because of surfaces on demand, diced as the rays of `view` ask.
///
/// Exact for those micropolygons; as [`crate::query::shadowed`] in all else. The triangles of receivers are not asked
/// for: on a micropolygon, a receiver is what [`Triangles::leave`] makes of
/// [`crate::reyes::sample::hits::SurfaceHits::corners`].
///
/// # Errors
/// As [`crate::query::shadowed`] and [`crate::reyes::closest::closest_hit_on_demand`].
pub fn shadowed_on_demand<S: OnDemand>(
    surfaces: &S,
    (view, dicing): (&Pencil, &Dicing),
    light: Origin,
    receivers: &[Receiver],
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    let level = check_call(receivers.len(), options)?;
    receiver::check(light, receivers)?;
    dicing.check()?;
    let density = Density::new(view, level)?;
    let nowhere = |receiver: &Receiver| Receiver { triangle: TriangleId(NO_TRIANGLE), ..*receiver };
    let receivers: Vec<Receiver> = receivers.iter().map(nowhere).collect();
    if receivers.is_empty() {
        return Ok((Vec::new(), Stats::default()));
    }
    if options.path == Path::General {
        let diced = dice_all(surfaces, view, dicing)?;
        let triangles = Triangles::new(diced.positions(), diced.indices())?;
        return Frame::new().shadowed(&triangles, light, &receivers, options);
    }
    let query = Query { surfaces, density: &density, dicing, light, receivers: &receivers, options, level };
    in_pool(|| query.run())?
}

/// What all tiles share.
struct Query<'a, S: OnDemand> {
    surfaces: &'a S,
    density: &'a Density,
    dicing: &'a Dicing,
    light: Origin,
    receivers: &'a [Receiver],
    options: &'a Options,
    level: Level,
}

/// What a thread keeps from tile to tile.
struct Scratch<'a, S: OnDemand> {
    work: Box<Workspace<Packets<'a>>>,
    seen: Box<FacePoints>,
    walk: Walk<'a, S>,
    waiting: GridTriangles,
}

/// The receivers of a tile on one face.
struct Face<'f> {
    /// Their indices.
    ids: &'f [u32],
    /// The film around them, and the frustum over it; none where rounding leaves none.
    film: Option<(FaceFilm, Frustum)>,
}

impl<'a, S: OnDemand> Query<'a, S> {
    /// Goes through all tiles.
    fn run(&self) -> Result<(Vec<bool>, Stats), Error> {
        let (count, light) = (self.receivers.len(), self.light);
        let order = along_curve(&LightGrid::new(light, self.receivers), count, self.level);
        let shadowed: Vec<AtomicBool> = (0..count).map(|_| AtomicBool::new(false)).collect();
        let of_tile = |scratch: &mut Scratch<'a, S>, ids: &[u32]| self.tile(scratch, ids, &shadowed);
        // Of bytes the larger remain: those of a thread.
        let tiles = order.par_chunks(TILE_POINTS).map_init(|| self.scratch(), of_tile);
        let mut stats = tiles.try_reduce(Stats::default, |one, other| Ok(one.then(other)))?;
        let threads = stats.engine_bytes as usize * rayon::current_num_threads();
        let waiting = (TOGETHER as u64 + (1 << (2 * GRID_BITS))) * rayon::current_num_threads() as u64;
        stats.micropolygons_in_flight = stats.micropolygons.min(waiting);
        let receivers = size_of_val(self.receivers) + order.capacity() * size_of::<u32>();
        stats.engine_bytes = (threads + receivers).max(bytes_for(count)) as u64;
        Ok((shadowed.into_iter().map(AtomicBool::into_inner).collect(), stats))
    }

    fn scratch(&self) -> Scratch<'a, S> {
        Scratch {
            work: Workspace::new(Packets::new(), KEPT),
            seen: Box::new(FacePoints::new()),
            walk: Walk::new(Dicer::new(self.surfaces, self.density, self.dicing)),
            waiting: GridTriangles::default(),
        }
    }

    /// Finds which receivers of a tile are in shadow. Each has its own place among the answers.
    fn tile(
        &self,
        scratch: &mut Scratch<'a, S>,
        ids: &[u32],
        shadowed: &[AtomicBool],
    ) -> Result<Stats, Error> {
        let (light, receivers) = (self.light, self.receivers);
        let see = |seen: &mut FacePoints, face| dispatch!(self.level, simd => seen.see(simd, light, (receivers, ids), face));
        let [first, last] = see(&mut scratch.seen, None);
        let mut stats = Stats::default();
        for face in first..=last {
            see(&mut scratch.seen, Some(face));
            let seen = &scratch.seen;
            let here: Vec<u32> =
                seen.places[..seen.count].iter().map(|&place| ids[usize::from(place)]).collect();
            if !here.is_empty() {
                let film = self.film(scratch, face, ids);
                stats = stats.then(self.face(scratch, &Face { ids: &here, film }, shadowed)?);
            }
        }
        stats.engine_bytes = scratch.bytes() as u64;
        Ok(stats)
    }

    /// The film around the receivers that were seen on a face; they are put there.
    fn film(&self, scratch: &mut Scratch<'a, S>, face: usize, ids: &[u32]) -> Option<(FaceFilm, Frustum)> {
        let Scratch { work, seen, .. } = scratch;
        let plane = Plane::numbered(self.light, face);
        let (extent, depth) = dispatch!(self.level, simd => seen.extent(simd));
        let film = FaceFilm::around(self.light, plane, extent, (seen.depth[0], depth))?;
        let receivers = self.receivers;
        dispatch!(self.level, simd => work.depth.fill(simd, (receivers, ids), seen, &film.to_tile));
        let ends = |first: f64, last: f64| Interval { lo: first.min(last), hi: first.max(last) };
        let (width, height) = (film.view.film.width() - 1, film.view.film.height() - 1);
        let (x, y) = (
            ends(film.view.film.x(0), film.view.film.x(width)),
            ends(film.view.film.y(0), film.view.film.y(height)),
        );
        let frustum = Frustum::new(&film.view.projection, x, y, start(self.light));
        Some((film, frustum))
    }

    /// Goes through the objects that may keep light from the receivers of a face.
    fn face(
        &self,
        scratch: &mut Scratch<'a, S>,
        face: &Face<'_>,
        shadowed: &[AtomicBool],
    ) -> Result<Stats, Error> {
        let Scratch { work, walk, waiting, .. } = scratch;
        let mut stats = Stats::default();
        let mut search = FaceSearch { query: self, face, work, waiting, shadowed };
        walk.begin(&mut search, &mut stats);
        walk.go(&mut search, &mut stats)?;
        search.test(&mut stats)?;
        if face.film.is_some() {
            scratch.work.depth.shadowed().for_each(|id| shadowed[id as usize].store(true, Ordering::Relaxed));
        }
        Ok(stats)
    }

    /// Decides receivers by the general path: where rounding leaves no film.
    #[cold]
    fn one_by_one(&self, triangles: &Triangles<'_>, ids: &[u32], shadowed: &[AtomicBool]) -> Stats {
        let receivers: Vec<Receiver> = ids.iter().map(|&id| self.receivers[id as usize]).collect();
        let mut hits = Hits::missed(ids.len());
        let set = RaySet::Shadows(self.light, &receivers);
        let stats = general::intersect(Question { triangles, set, any: true }, &mut hits);
        for (&id, _) in ids.iter().zip(&hits.ids).filter(|(_, hit)| **hit != NO_TRIANGLE) {
            shadowed[id as usize].store(true, Ordering::Relaxed);
        }
        stats
    }
}

/// Looks for what keeps light from the receivers of a face.
struct FaceSearch<'t, 'q, 'a, S: OnDemand> {
    query: &'t Query<'q, S>,
    face: &'t Face<'t>,
    work: &'t mut Workspace<Packets<'a>>,
    waiting: &'t mut GridTriangles,
    shadowed: &'t [AtomicBool],
}

impl<S: OnDemand> FaceSearch<'_, '_, '_, S> {
    /// Tests the triangles that wait with the receivers of the face, and forgets them.
    fn test(&mut self, stats: &mut Stats) -> Result<(), Error> {
        let Self { query, face, work, waiting, shadowed } = self;
        if waiting.indices.is_empty() {
            return Ok(());
        }
        let triangles = Triangles::new(&waiting.positions, &waiting.indices)?;
        match &face.film {
            Some((film, _)) => {
                let runs = Runs::new(&triangles, query.level, Some(Order::as_given(triangles.len())));
                let accuracy = query.options.accuracy;
                let context = Context { triangles: &triangles, accuracy, level: query.level };
                work.forget_triangles();
                *stats = stats.plus(block(context, &runs, &film.view, work));
            }
            None => *stats = stats.plus(query.one_by_one(&triangles, face.ids, shadowed)),
        }
        waiting.clear();
        Ok(())
    }
}

impl<S: OnDemand> Search<S> for FaceSearch<'_, '_, '_, S> {
    fn enter(&mut self, item: Item<S::Object>, stats: &mut Stats) -> Option<Item<S::Object>> {
        match &self.face.film {
            Some((_, frustum)) => item.enter(frustum, stats),
            None => Some(item),
        }
    }

    fn hides(&mut self, item: &Item<S::Object>) -> bool {
        self.face.film.is_some() && self.work.depth.hides(greatest_key(self.query.light, item.t))
    }

    fn take(
        &mut self,
        dicer: &mut Dicer<'_, S>,
        item: &Item<S::Object>,
        part: SubPatch,
        stats: &mut Stats,
    ) -> Result<(), Error> {
        self.waiting.dice(dicer, (&item.piece.object, part), stats)?;
        if self.waiting.indices.len() >= 2 * TOGETHER { self.test(stats) } else { Ok(()) }
    }
}

impl<S: OnDemand> Scratch<'_, S> {
    fn bytes(&self) -> usize {
        Workspace::<Packets<'_>>::bytes(KEPT)
            + size_of::<FacePoints>()
            + self.walk.bytes()
            + self.waiting.bytes()
    }
}
