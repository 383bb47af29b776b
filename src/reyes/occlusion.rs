//! Ambient occlusion by surfaces on demand: diced as finely as receivers are apart, tested exactly, and forgotten.
//!
//! Rays leave all over the box of the receivers to all sides, so no pencil tells how finely a surface is to be diced:
//! it is as fine as they are apart at their start, and coarser the farther away, see [`Around`]. A round of
//! micropolygons goes, with the triangles that receivers lie on, through the query for triangles; a ray is open iff it
//! is in every round.
//!
//! Memory: [`ROUND`] triangles and what the query takes for them, about 150 bytes each; nothing grows with the number
//! of micropolygons.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987; Per
//! Christensen, "Point-Based Approximate Color Bleeding", 2008 (coarser with the distance).

use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::widen;
use crate::geometry::triangles::Triangles;
use crate::options::Options;
use crate::query::call::{check_call, in_pool};
use crate::query::frame::Frame;
use crate::rays::hemisphere::{Occlusion, OpenRays, RaySamples};
use crate::reyes::dice::density::Density;
use crate::reyes::dice::detail::Around;
use crate::reyes::dice::detail::gap;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::grid_triangles::GridTriangles;
use crate::reyes::walk::{Item, Ready, Search, Walk};
use crate::stats::Stats;

/// Triangles of a round, about.
const ROUND: usize = 1 << 19;
/// Heaps of pieces that are diced side by side.
const HEAPS: usize = 8;
/// Pieces to begin with, if there are as many.
const PIECES: usize = 256;
/// Rounding of distances.
const SLACK: f64 = 1.0 + 1e-9;

/// Finds which rays of receivers neither triangles nor surfaces on demand occlude: see [`crate::query::open_rays`].
///
/// Surfaces are diced for rays from all over the box of `around`, which should hold all receivers: so the answer for a
/// receiver does not depend on which others are asked for. Exact for the micropolygons that come out.
///
/// # Errors
/// As [`crate::query::open_rays`], and when `around` has no size, the shading rate is out of range, or a surface gives
/// points that are not finite.
pub fn open_rays_on_demand<S: OnDemand>(
    surfaces: &S,
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    (around, dicing): (&Around, &Dicing),
    options: &Options,
) -> Result<(OpenRays, Stats), Error> {
    let level = check_call(occlusion.hemispheres.len(), options)?;
    around.check()?;
    dicing.check()?;
    let (mut open, mut stats) = Frame::new().open_rays(triangles, occlusion, options)?;
    let (density, reach) = (Density::around(around, level), Reach::of(occlusion));
    let mut rounds = Rounds::new(surfaces, &density, dicing, &reach, &mut stats);
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    loop {
        in_pool(|| rounds.dice())??;
        positions.clear();
        indices.clear();
        triangles.append_to(&mut positions, &mut indices);
        if rounds.take(&mut positions, &mut indices) == 0 {
            break;
        }
        let all = Triangles::new(&positions, &indices)?;
        let (more, of_round) = Frame::new().open_rays(&all, occlusion, options)?;
        open.retain(&more);
        let bytes = rounds.bytes()
            + positions.capacity() * size_of::<[f32; 3]>()
            + indices.capacity() * size_of::<[u32; 3]>();
        stats = stats.then(Stats { engine_bytes: of_round.engine_bytes + bytes as u64, ..of_round });
    }
    Ok((open, stats.then(rounds.stats())))
}

/// How far from the receivers something matters.
struct Reach {
    receivers: Aabb,
    distance: f64,
}

impl Reach {
    fn of(occlusion: &Occlusion<'_>) -> Self {
        let points = occlusion.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point);
        let distance = match occlusion.samples {
            RaySamples::Shared(samples) => samples.iter().fold(0.0, |most: f64, sample| {
                most.max(sample.direction.length() * f64::from(sample.t_max) * SLACK)
            }),
            RaySamples::Own { .. } => f64::INFINITY,
        };
        Self { receivers: Aabb::of_points(points), distance }
    }

    /// Whether some ray may get as far as a box.
    fn holds(&self, bounds: &Aabb) -> bool {
        if self.receivers.is_empty() {
            return false;
        }
        let ends = |bounds: &Aabb| [widen(bounds.lo), widen(bounds.hi)];
        // A box without end, whose distance is no number, is kept.
        let gap = gap(ends(bounds), ends(&self.receivers));
        gap <= self.distance || gap.is_nan()
    }
}

/// Pieces that wait, and what they are diced into.
struct Heap<'a, S: OnDemand> {
    walk: Walk<'a, S>,
    triangles: GridTriangles,
    stats: Stats,
}

/// Dices everything that matters, a round at a time.
struct Rounds<'a, S: OnDemand> {
    heaps: Vec<Heap<'a, S>>,
    reach: &'a Reach,
}

impl<'a, S: OnDemand> Rounds<'a, S> {
    fn new(
        surfaces: &'a S,
        density: &'a Density,
        dicing: &Dicing,
        reach: &'a Reach,
        stats: &mut Stats,
    ) -> Self {
        let heap = || Heap {
            walk: Walk::new(Dicer::new(surfaces, density, dicing)),
            triangles: GridTriangles::default(),
            stats: Stats::default(),
        };
        let mut heaps: Vec<Heap<'a, S>> = (0..HEAPS).map(|_| heap()).collect();
        let Heap { walk, triangles, .. } = &mut heaps[0];
        let (mut search, mut of_first) = (ReachSearch { reach, triangles }, Stats::default());
        walk.begin(&mut search, &mut of_first);
        walk.spread(PIECES, &mut search, &mut of_first);
        *stats = stats.then(of_first);
        Self { heaps, reach }
    }

    /// Dices until there are as many micropolygons as a round has, or none are left.
    fn dice(&mut self) -> Result<(), Error> {
        let items: Vec<Item<S::Object>> =
            self.heaps.iter_mut().flat_map(|heap| heap.walk.items.drain(..)).collect();
        for (place, item) in items.into_iter().enumerate() {
            self.heaps[place % HEAPS].walk.items.push(item);
        }
        let reach = self.reach;
        self.heaps.par_iter_mut().try_for_each(|heap| heap.dice(reach))
    }

    /// Takes the triangles of the round: how many there are.
    fn take(&mut self, positions: &mut Vec<[f32; 3]>, indices: &mut Vec<[u32; 3]>) -> usize {
        let before = indices.len();
        for heap in &mut self.heaps {
            // In range: a round is small beside 2³² less the triangles that there are; else `Triangles::new` refuses.
            let base = positions.len() as u32;
            positions.extend_from_slice(&heap.triangles.positions);
            indices
                .extend(heap.triangles.indices.iter().map(|corners| corners.map(|v| base.wrapping_add(v))));
            heap.triangles.clear();
        }
        indices.len() - before
    }

    fn bytes(&self) -> usize {
        let of_heap = |heap: &Heap<'a, S>| heap.walk.bytes() + heap.triangles.bytes();
        self.heaps.iter().map(of_heap).sum()
    }

    /// What was done.
    fn stats(&self) -> Stats {
        self.heaps.iter().fold(Stats::default(), |sum, heap| sum.then(heap.stats))
    }
}

impl<S: OnDemand> Heap<'_, S> {
    /// Dices until there are enough micropolygons.
    fn dice(&mut self, reach: &Reach) -> Result<(), Error> {
        let Self { walk, triangles, stats } = self;
        walk.go(&mut ReachSearch { reach, triangles }, stats)
    }
}

/// Looks for all that rays of the receivers may reach.
struct ReachSearch<'t> {
    reach: &'t Reach,
    triangles: &'t mut GridTriangles,
}

impl<S: OnDemand> Search<S> for ReachSearch<'_> {
    fn enter(&mut self, item: Item<S::Object>, stats: &mut Stats) -> Option<Item<S::Object>> {
        let entered = self.reach.holds(&item.bounds).then_some(item);
        stats.surfaces_culled_by_frustum += u64::from(entered.is_none());
        entered
    }

    fn take(&mut self, ready: Ready<'_, '_, S>, stats: &mut Stats) -> Result<(), Error> {
        self.triangles.dice(ready, stats)
    }

    fn is_full(&self) -> bool {
        self.triangles.indices.len() >= ROUND / HEAPS
    }
}
