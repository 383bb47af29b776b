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

use crate::error::{Error, first_wrong};
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::stream;
use crate::intersect::bundle::stream::Objects;
use crate::intersect::context::Context;
use crate::intersect::irregular::shadow;
use crate::intersect::ray_set::{Question, RaySet};
use crate::intersect::{directions, general};
use crate::objects::runs::{Order, Runs};
use crate::options::{Options, Path};
use crate::query::call::{check_call, in_pool};
use crate::query::{occlusion, pencil};
use crate::rays::film::Film;
use crate::rays::hemisphere::{Occlusion, OpenRays, RaySamples};
use crate::rays::hits::{Hits, NO_TRIANGLE};
use crate::rays::origin::Origin;
use crate::rays::pencil::{Pencil, Rays};
use crate::rays::receiver;
use crate::rays::receiver::Receiver;
use crate::rays::segment::Segment;
use crate::stats::{Stats, TileStats};

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
    kept: &mut Kept,
) -> Result<(OpenRays, Stats), Error> {
    let level = check_call(occlusion.hemispheres.len(), options)?;
    occlusion.check(triangles)?;
    let (words, stats) = in_pool(|| match (options.path, occlusion.samples) {
        (Path::Pencil, RaySamples::Shared(samples)) if !directions::are_few(triangles, occlusion) => {
            let runs = Runs::new(triangles, level, kept.order.take());
            let how = (options.accuracy, level);
            let found = if directions::are_in_range(&runs, occlusion) {
                Ok(directions::open_rays(triangles, occlusion, samples, &runs, how))
            } else {
                occlusion::by_ray(triangles, occlusion, None, level)
            };
            kept.order = Some(runs.into_order());
            found
        }
        (Path::Pencil, _) => {
            let objects = Objects::new(triangles, level);
            occlusion::by_ray(triangles, occlusion, objects.as_ref(), level)
        }
        (Path::General, _) => occlusion::by_ray(triangles, occlusion, None, level),
    })??;
    Ok((OpenRays::new(occlusion.samples.count(), words), stats))
}
