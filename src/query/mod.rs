//! The verbs of the engine: closest hit and any hit of rays, and any hit of segments.

pub(crate) mod frame;
pub(crate) mod occlusion;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Error;
use crate::error::first_wrong;
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::Objects;
use crate::intersect::general;
use crate::intersect::general::partition::Partition;
use crate::intersect::irregular::shadow;
use crate::intersect::pencil;
use crate::intersect::ray_set::Probes;
use crate::objects::runs::Runs;
use crate::options::{Options, Path};
use crate::query::frame::Frame;
use crate::rays::film::Film;
use crate::rays::hemisphere::{Occlusion, OpenRays};
use crate::rays::hits::Hits;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::pencil::{Origin, Pencil, Rays};
use crate::rays::receiver;
use crate::rays::receiver::Receiver;
use crate::rays::segment::Segment;
use crate::stats::Stats;
use fearless_simd::Level;

/// Finds the nearest triangle along each ray: by exact t, then by the smaller id.
///
/// Runs on the current rayon pool. The result depends on neither the pool, nor the path, nor the machine. Time about
/// O(n + r log n) for n triangles and r coherent rays; memory O(n + r), see [`Stats::engine_bytes`].
///
/// # Errors
/// When a general ray is out of range, there are too many rays, or the thread flushes subnormal numbers to zero.
pub fn closest_hit<'a>(
    triangles: &Triangles<'_>,
    rays: impl Into<Rays<'a>>,
    options: &Options,
) -> Result<(Hits, Stats), Error> {
    let mut frame = Frame::new();
    let stats = frame.closest_hit(triangles, rays, options)?;
    Ok((frame.into_hits(), stats))
}

/// Finds whether each ray meets any triangle. Costs less than [`closest_hit`]; which triangle it was is not told.
///
/// # Errors
/// As [`closest_hit`].
pub fn any_hit<'a>(
    triangles: &Triangles<'_>,
    rays: impl Into<Rays<'a>>,
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    let mut frame = Frame::new();
    let stats = run(triangles, rays.into(), options, true, &mut frame)?;
    let hits = frame.into_hits();
    Ok(((0..hits.len()).map(|ray| hits.get(ray).is_some()).collect(), stats))
}

/// Finds whether each segment is blocked: for shadows. Exact, with no distance and no bias; see [`Segment`].
///
/// # Errors
/// When an end point is out of range, there are too many segments, or the thread flushes subnormal numbers to zero.
pub fn blocked(
    triangles: &Triangles<'_>,
    segments: &[Segment],
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    let level = check_call(segments.len(), options)?;
    segments.iter().try_for_each(Segment::check)?;
    let mut hits = Hits::missed(segments.len());
    let probes = Probes::Segments(segments);
    let stats = in_pool(|| match options.path {
        Path::Pencil => in_bundles((triangles, probes, true), level, (&mut hits, &mut [])),
        Path::General => {
            general::intersect_by(options.partition, (triangles, probes, true), (&mut hits, &mut []))
        }
    })?;
    Ok((hits.ids.iter().map(|&id| id != NO_TRIANGLE).collect(), stats))
}

/// Finds which receivers a light does not see: for exact shadows, with no resolution and no bias. See [`Receiver`].
///
/// The light is a point, or the direction that its rays travel in. Receivers may come in any order. Time about
/// O(n + p log n) for n triangles and p receivers; memory O(n + p), see [`Stats::engine_bytes`].
///
/// # Errors
/// When the light is out of range, a receiver is not finite, there are too many, or the thread flushes subnormal numbers to
/// zero.
pub fn shadowed(
    triangles: &Triangles<'_>,
    light: Origin,
    receivers: &[Receiver],
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    Frame::new().shadowed(triangles, light, receivers, options)
}

/// The same with what the frame has.
pub(crate) fn run_shadowed(
    triangles: &Triangles<'_>,
    (light, receivers): (Origin, &[Receiver]),
    options: &Options,
    frame: &mut Frame,
) -> Result<(Vec<bool>, Stats), Error> {
    let level = check_call(receivers.len(), options)?;
    receiver::check(light, receivers)?;
    in_pool(|| match options.path {
        Path::Pencil => {
            let runs = Runs::new(triangles, level, frame.order.take());
            let found = shadow::shadowed(triangles, (light, receivers), &runs, (options.accuracy, level));
            frame.order = Some(runs.into_order());
            found
        }
        Path::General => {
            let mut hits = Hits::missed(receivers.len());
            let query = (triangles, Probes::Shadows(light, receivers), true);
            let stats = general::intersect_by(options.partition, query, (&mut hits, &mut []));
            (hits.ids.iter().map(|&id| id != NO_TRIANGLE).collect(), stats)
        }
    })
}

/// Finds which rays of receivers are open: for ambient occlusion, with no bias. See [`Occlusion`].
///
/// Receivers may come in any order. Samples that many receivers share go in beams: time about O(n log n + p log p + k·p)
/// for n triangles, p receivers and k samples; memory beside the answer at most 64 bytes per triangle, 4 per receiver and
/// 256 KiB per thread, see [`Stats::engine_bytes`]. Rays that receivers do not share, and those of few receivers, go in
/// bundles as arbitrary rays do: time about O(n log n + k·p log n).
///
/// # Errors
/// When a receiver or a sample is out of range, there are too many receivers, directions are not common as the grouping
/// asks, or the thread flushes subnormal numbers to zero.
pub fn open_rays(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    options: &Options,
) -> Result<(OpenRays, Stats), Error> {
    Frame::new().open_rays(triangles, occlusion, options)
}

/// The same for a frame, which has nothing that would help.
pub(crate) fn run_open_rays(
    triangles: &Triangles<'_>,
    occlusion: &Occlusion<'_>,
    options: &Options,
) -> Result<(OpenRays, Stats), Error> {
    let level = check_call(occlusion.hemispheres.len(), options)?;
    occlusion.check(triangles)?;
    let (words, stats) = in_pool(|| match options.path {
        Path::Pencil => occlusion::in_beams(triangles, occlusion, level).map_or_else(
            || {
                let objects = Objects::new(triangles, level);
                occlusion::by_ray(triangles, occlusion, objects.as_ref(), level)
            },
            Ok,
        ),
        Path::General => occlusion::by_ray(triangles, occlusion, None, level),
    })??;
    Ok((OpenRays::new(occlusion.samples.count(), words), stats))
}

/// Checks the rays and takes the path of the options. Uses what the frame has, and leaves the answer there.
pub(crate) fn run(
    triangles: &Triangles<'_>,
    rays: Rays<'_>,
    options: &Options,
    any: bool,
    frame: &mut Frame,
) -> Result<Stats, Error> {
    let level = check_call(rays.len(), options)?;
    if let Rays::General(rays) = rays
        && let Some(ray) = first_wrong(rays, |ray| ray.check().is_err())
    {
        rays[ray].check()?;
    }
    let in_tiles = |pencil: &Pencil| pencil.films().iter().all(|film| matches!(film, Film::Grid(_)));
    let counts = match (rays, options.path) {
        (Rays::Pencil(pencil), Path::Pencil) => frame.counts_pairs && !in_tiles(pencil),
        _ => frame.counts_pairs,
    };
    frame.pairs.clear();
    frame.pairs.resize(if counts { rays.len() } else { 0 }, 0);
    in_pool(|| match (rays, options.path) {
        (Rays::Pencil(pencil), Path::Pencil) => {
            frame.hits.make_room(rays.len());
            let runs = Runs::new(triangles, level, frame.order.take());
            let how = (options.accuracy, level, any);
            let answer = (&mut frame.hits, &mut frame.pairs[..]);
            let stats;
            (stats, frame.tiles) = pencil::intersect(triangles, pencil, &runs, how, answer);
            frame.order = Some(runs.into_order());
            stats
        }
        (_, path) => {
            (frame.hits, frame.tiles) = (Hits::missed(rays.len()), Vec::new());
            let query = (triangles, Probes::Rays(rays), any);
            let answer = (&mut frame.hits, &mut frame.pairs[..]);
            match path {
                Path::Pencil => in_bundles(query, level, answer),
                Path::General => general::intersect_by(options.partition, query, answer),
            }
        }
    })
}

/// Finds hits in bundles; ray by ray where numbers are too large or too small for bundles.
fn in_bundles(
    (triangles, probes, any): (&Triangles<'_>, Probes<'_>, bool),
    level: Level,
    (hits, pairs): (&mut Hits, &mut [u32]),
) -> Stats {
    let objects = Objects::new(triangles, level);
    let found = objects.and_then(|objects| objects.intersect(probes, any, (hits, pairs)));
    found.unwrap_or_else(|| {
        *hits = Hits::missed(probes.len());
        general::intersect_by(Partition::default(), (triangles, probes, any), (hits, pairs))
    })
}

/// Checks what the rays do not depend on: their number, and the instruction set.
pub(crate) fn check_call(rays: usize, options: &Options) -> Result<Level, Error> {
    if u32::try_from(rays).is_err() {
        return Err(Error::TooManyRays { rays: rays as u64 });
    }
    options.isa.level()
}

/// Does all work on threads of the pool, so that its parallel parts need not wait for a thread outside, and has each thread
/// check meanwhile that subnormal numbers are what they are.
pub(crate) fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let flushed = AtomicBool::new(flushes_to_zero());
    let result = rayon::scope(|scope| {
        scope.spawn_broadcast(|_, _| {
            flushed.fetch_or(flushes_to_zero(), Ordering::Relaxed);
        });
        work()
    });
    if flushed.into_inner() { Err(Error::FlushToZero) } else { Ok(result) }
}

/// Whether this thread was told to treat subnormal numbers as zero.
fn flushes_to_zero() -> bool {
    std::hint::black_box(f64::MIN_POSITIVE) * std::hint::black_box(0.5) == 0.0
}
