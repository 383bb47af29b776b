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
//! A tile of receivers is that of [`crate::intersect::irregular::tile`], and micropolygons are tested as triangles
//! are there. Memory: those that wait and a tile for each thread, and the way to them; nothing grows with the number of
//! micropolygons.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Gregory
//! Johnson et al., "The Irregular Z-Buffer", 2005.

use std::mem::size_of;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::intersect::context::Context;
use crate::intersect::irregular::face_points::TILE_POINTS;
use crate::intersect::irregular::order::LightGrid;
use crate::intersect::irregular::packets::Packets;
use crate::intersect::irregular::tile::{FaceFilm, Lit, LitTile, block, note};
use crate::intersect::pencil::leaf::{LeafDepth, Workspace, greatest_key};
use crate::objects::morton::{along_curve, bytes_for};
use crate::objects::runs::{Order, Runs};
use crate::options::{Accuracy, Options, Path};
use crate::query::call::{check_call, in_pool};
use crate::query::frame::Frame;
use crate::rays::frustum::Frustum;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::origin::Origin;
use crate::rays::pencil::Pencil;
use crate::rays::receiver;
use crate::rays::receiver::Receiver;
use crate::reyes::dice::density::Density;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::patch::GRID_BITS;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::grid_triangles::GridTriangles;
use crate::reyes::reference::dice_all;
use crate::reyes::walk::{Item, Ready, Search, Walk};
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
    let lit = Lit { light, receivers: &receivers, level };
    let query = Query { surfaces, density: &density, dicing, lit, accuracy: options.accuracy };
    in_pool(|| query.run())?
}

/// What all tiles share.
struct Query<'a, S: OnDemand> {
    surfaces: &'a S,
    density: &'a Density,
    dicing: &'a Dicing,
    lit: Lit<'a>,
    accuracy: Accuracy,
}

/// What a thread keeps from tile to tile.
struct Scratch<'a, S: OnDemand> {
    tile: LitTile<'a>,
    walk: Walk<'a, S>,
    waiting: GridTriangles,
}

/// The receivers of a tile on one face.
#[expect(clippy::large_enum_variant, reason = "a thread has one at a time")]
enum Face {
    /// On the film around them, with the frustum over it.
    Film(Frustum, FaceFilm),
    /// Where rounding leaves no film: which they are.
    Alone(Vec<u32>),
}

impl<'a, S: OnDemand> Query<'a, S> {
    /// Goes through all tiles.
    fn run(&self) -> Result<(Vec<bool>, Stats), Error> {
        let Lit { light, receivers, level } = self.lit;
        let count = receivers.len();
        let order = along_curve(&LightGrid::new(light, receivers), count, level);
        let shadowed: Vec<AtomicBool> = (0..count).map(|_| AtomicBool::new(false)).collect();
        let of_tile = |scratch: &mut Scratch<'a, S>, ids: &[u32]| self.tile(scratch, ids, &shadowed);
        // Of bytes the larger remain: those of a thread.
        let tiles = order.par_chunks(TILE_POINTS).map_init(|| self.scratch(), of_tile);
        let mut stats = tiles.try_reduce(Stats::default, |one, other| Ok(one.then(other)))?;
        let threads = stats.engine_bytes as usize * rayon::current_num_threads();
        let waiting = (TOGETHER as u64 + (1 << (2 * GRID_BITS))) * rayon::current_num_threads() as u64;
        stats.micropolygons_in_flight = stats.micropolygons.min(waiting);
        let of_receivers = size_of_val(receivers) + order.capacity() * size_of::<u32>();
        stats.engine_bytes = (threads + of_receivers).max(bytes_for(count)) as u64;
        Ok((shadowed.into_iter().map(AtomicBool::into_inner).collect(), stats))
    }

    fn scratch(&self) -> Scratch<'a, S> {
        Scratch {
            tile: LitTile::new(),
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
        let mut stats = Stats::default();
        for face in scratch.tile.see(self.lit, ids) {
            let face = match scratch.tile.turn_to(self.lit, ids, face) {
                Some(film) => Face::Film(film.frustum(), film),
                None => Face::Alone(scratch.tile.here(ids)),
            };
            if !matches!(&face, Face::Alone(ids) if ids.is_empty()) {
                stats = stats.then(self.face(scratch, &face, shadowed)?);
            }
        }
        stats.engine_bytes = scratch.bytes() as u64;
        Ok(stats)
    }

    /// Goes through the objects that may keep light from the receivers of a face.
    fn face(
        &self,
        scratch: &mut Scratch<'a, S>,
        face: &Face,
        shadowed: &[AtomicBool],
    ) -> Result<Stats, Error> {
        let Scratch { tile, walk, waiting } = scratch;
        let work = &mut *tile.work;
        let mut stats = Stats::default();
        let mut search = FaceSearch { query: self, face, work, waiting, shadowed };
        walk.begin(&mut search, &mut stats);
        walk.go(&mut search, &mut stats)?;
        search.test(&mut stats)?;
        if let Face::Film(..) = face {
            note(&tile.work, shadowed);
        }
        Ok(stats)
    }
}

/// Looks for what keeps light from the receivers of a face.
struct FaceSearch<'t, 'q, 'a, S: OnDemand> {
    query: &'t Query<'q, S>,
    face: &'t Face,
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
        let Query { accuracy, lit, .. } = **query;
        match face {
            Face::Film(_, film) => {
                let runs = Runs::new(&triangles, lit.level, Some(Order::as_given(triangles.len())));
                let context = Context { triangles: &triangles, accuracy, level: lit.level };
                work.forget_triangles();
                *stats = stats.plus(block(context, &runs, film, work));
            }
            Face::Alone(ids) => *stats = stats.plus(lit.one_by_one(&triangles, ids, shadowed)),
        }
        waiting.clear();
        Ok(())
    }
}

impl<S: OnDemand> Search<S> for FaceSearch<'_, '_, '_, S> {
    fn enter(&mut self, item: Item<S::Object>, stats: &mut Stats) -> Option<Item<S::Object>> {
        match self.face {
            Face::Film(frustum, _) => item.enter(frustum, stats),
            Face::Alone(_) => Some(item),
        }
    }

    fn hides(&mut self, item: &Item<S::Object>) -> bool {
        matches!(self.face, Face::Film(..))
            && self.work.depth.hides(greatest_key(self.query.lit.light, item.t))
    }

    fn take(&mut self, ready: Ready<'_, '_, S>, stats: &mut Stats) -> Result<(), Error> {
        self.waiting.dice(ready, stats)?;
        if self.waiting.indices.len() >= 2 * TOGETHER { self.test(stats) } else { Ok(()) }
    }
}

impl<S: OnDemand> Scratch<'_, S> {
    fn bytes(&self) -> usize {
        LitTile::BYTES + self.walk.bytes() + self.waiting.bytes()
    }
}
