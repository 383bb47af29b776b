//! Which path answers: the one place where a kind of rays meets the path of the options.
//!
//! | rays | [`Path::Pencil`] | [`Path::General`] |
//! |---|---|---|
//! | a pencil | grid films by tiles, scattered films in bundles | ray by ray |
//! | arbitrary rays, segments | bundles | ray by ray |
//! | receivers of one light | the light's pencil, on films around the receivers | ray by ray |
//! | open rays of many receivers, shared samples | by direction or by origin | ray by ray |
//! | open rays of few receivers, or of samples of their own | bundles | ray by ray |
//!
//! Numbers too large or too small for the bounds of a path are answered ray by ray as well.

use fearless_simd::Level;

use crate::error::{Error, first_wrong};
use crate::geometry::triangles::Triangles;
use crate::intersect::beam::Beams;
use crate::intersect::bundle::stream;
use crate::intersect::bundle::stream::Objects;
use crate::intersect::context::Context;
use crate::intersect::general;
use crate::intersect::irregular::shadow;
use crate::intersect::ray_set::{Question, RaySet};
use crate::objects::runs::{Order, Runs};
use crate::options::{Options, Path};
use crate::query::call::{check_call, in_pool};
use crate::query::{occlusion, pencil};
use crate::rays::film::Film;
use crate::rays::hemisphere::{Grouping, Occlusion, OpenRays, RaySample, RaySamples};
use crate::rays::hits::{Hits, NO_TRIANGLE};
use crate::rays::origin::Origin;
use crate::rays::pencil::{Pencil, Rays};
use crate::rays::receiver;
use crate::rays::receiver::Receiver;
use crate::rays::segment::Segment;
use crate::stats::{Stats, TileStats};

/// Triangles per receiver from which on bundles are faster everywhere, and up to which beams are.
const FEW: f64 = 6.0;
const MANY: f64 = 0.8;
/// Fitted to koala, sponza and chess with 20 thousand to a million receivers: nanoseconds on one core of Zen 5 for a
/// ray, a node, a triangle that is set up and sixteen rays that are tested, in beams.
const BEAM_COSTS: [f64; 4] = [5.0, 28.0, 3.0, 7.6];
/// The same for a ray, and for a triangle, in bundles.
const BUNDLE_COSTS: [f64; 2] = [130.0, 500.0];

/// What is kept from query to query, and the answer of the last one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    pub(crate) hits: Hits,
    pub(crate) order: Option<Order>,
    pub(crate) tiles: Vec<TileStats>,
    /// Pairs of each ray, where they are counted.
    pub(crate) pairs: Vec<u32>,
    pub(crate) counts_pairs: bool,
}

/// Finds the nearest, or any, hit of each ray, and leaves the answer with what was kept.
pub(crate) fn hits(
    triangles: &Triangles<'_>,
    rays: Rays<'_>,
    options: &Options,
    any: bool,
    kept: &mut Kept,
) -> Result<Stats, Error> {
    let level = check_call(rays.len(), options)?;
    if let Rays::General(rays) = rays
        && let Some(ray) = first_wrong(rays, |ray| ray.check().is_err())
    {
        rays[ray].check()?;
    }
    let in_tiles = |pencil: &Pencil| pencil.films().iter().all(|film| matches!(film, Film::Grid(_)));
    let counts = match (rays, options.path) {
        (Rays::Pencil(pencil), Path::Pencil) => kept.counts_pairs && !in_tiles(pencil),
        _ => kept.counts_pairs,
    };
    kept.pairs.clear();
    kept.pairs.resize(if counts { rays.len() } else { 0 }, 0);
    in_pool(|| match (rays, options.path) {
        (Rays::Pencil(pencil), Path::Pencil) => {
            kept.hits.make_room(rays.len());
            let runs = Runs::new(triangles, level, kept.order.take());
            let context = Context { triangles, accuracy: options.accuracy, level };
            let answer = (&mut kept.hits, &mut kept.pairs[..]);
            let stats;
            (stats, kept.tiles) = pencil::intersect(context, pencil, any, &runs, answer);
            kept.order = Some(runs.into_order());
            stats
        }
        (_, path) => {
            (kept.hits, kept.tiles) = (Hits::missed(rays.len()), Vec::new());
            let question = Question { triangles, set: RaySet::Rays(rays), any };
            let answer = (&mut kept.hits, &mut kept.pairs[..]);
            match path {
                Path::Pencil => stream::intersect(question, level, (answer.0.as_row(), answer.1)),
                Path::General => general::intersect_by(options.partition, question, answer),
            }
        }
    })
}

/// Finds which segments are blocked.
pub(crate) fn blocked(
    triangles: &Triangles<'_>,
    segments: &[Segment],
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    let level = check_call(segments.len(), options)?;
    segments.iter().try_for_each(Segment::check)?;
    let mut hits = Hits::missed(segments.len());
    let question = Question { triangles, set: RaySet::Segments(segments), any: true };
    let stats = in_pool(|| match options.path {
        Path::Pencil => stream::intersect(question, level, (hits.as_row(), &mut [])),
        Path::General => general::intersect_by(options.partition, question, (&mut hits, &mut [])),
    })?;
    Ok((hits.ids.iter().map(|&id| id != NO_TRIANGLE).collect(), stats))
}

/// Finds which receivers a light does not see.
pub(crate) fn shadowed(
    triangles: &Triangles<'_>,
    (light, receivers): (Origin, &[Receiver]),
    options: &Options,
    kept: &mut Kept,
) -> Result<(Vec<bool>, Stats), Error> {
    let level = check_call(receivers.len(), options)?;
    receiver::check(light, receivers)?;
    in_pool(|| match options.path {
        Path::Pencil => {
            let runs = Runs::new(triangles, level, kept.order.take());
            let context = Context { triangles, accuracy: options.accuracy, level };
            let found = shadow::shadowed(context, light, receivers, &runs);
            kept.order = Some(runs.into_order());
            found
        }
        Path::General => {
            let mut hits = Hits::missed(receivers.len());
            let question = Question { triangles, set: RaySet::Shadows(light, receivers), any: true };
            let stats = general::intersect_by(options.partition, question, (&mut hits, &mut []));
            (hits.ids.iter().map(|&id| id != NO_TRIANGLE).collect(), stats)
        }
    })
}

/// Finds which rays of receivers are open.
pub(crate) fn open_rays(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    options: &Options,
) -> Result<(OpenRays, Stats), Error> {
    let level = check_call(occlusion.hemispheres.len(), options)?;
    occlusion.check(triangles)?;
    let in_bundles = || {
        let objects = Objects::new(triangles, level);
        occlusion::by_ray(triangles, occlusion, objects.as_ref(), level)
    };
    let (words, stats) = in_pool(|| match options.path {
        Path::Pencil => in_beams(triangles, occlusion, level).map_or_else(in_bundles, Ok),
        Path::General => occlusion::by_ray(triangles, occlusion, None, level),
    })??;
    Ok((OpenRays::new(occlusion.samples.count(), words), stats))
}

/// Finds the open rays in beams, [`crate::intersect::beam`], where all receivers share their samples and that is
/// estimated to take less time than bundles, or is asked for.
fn in_beams(triangles: &Triangles<'_>, occlusion: &Occlusion<'_>, level: Level) -> Option<(Vec<u32>, Stats)> {
    let RaySamples::Shared(samples) = occlusion.samples else { return None };
    // What beams decide for all receivers at once they decide from t = 0 on.
    if samples.iter().any(|sample| sample.t_min > 0.0) {
        return None;
    }
    let per_receiver = triangles.len() as f64 / occlusion.hemispheres.len().max(1) as f64;
    let is_few = match occlusion.grouping {
        Grouping::Auto => per_receiver > FEW,
        Grouping::Direction => false,
        Grouping::Origin => true,
    };
    if is_few {
        return None;
    }
    let beams = Beams::new(triangles, occlusion, level)?;
    let is_sure = occlusion.grouping == Grouping::Direction || per_receiver < MANY;
    (is_sure || are_faster(&beams, triangles, occlusion, samples)).then(|| beams.open_rays(samples))
}

/// Whether beams take less time than bundles, by what some of them cost.
fn are_faster(
    beams: &Beams<'_>,
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    samples: &[RaySample],
) -> bool {
    let (stats, rays) = beams.sampled(samples);
    let [ray, node, triangle, test] = BEAM_COSTS;
    let tests = stats.samples_tested as f64 / 16.0;
    let cost = node * stats.nodes as f64 + triangle * stats.triangles_set_up as f64 + test * tests;
    let in_beams = ray + cost / rays.max(1) as f64;
    // About half of the samples are above the horizon.
    let total = (occlusion.hemispheres.len() * samples.len()) as f64 * 0.5;
    let [ray, triangle] = BUNDLE_COSTS;
    in_beams < ray + triangle * triangles.len() as f64 / total
}
