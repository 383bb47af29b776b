//! The verbs of the engine: closest hit and any hit of rays, blocked segments, shadowed receivers, open rays.

pub(crate) mod call;
pub(crate) mod frame;
pub(crate) mod occlusion;
pub(crate) mod path;
pub(crate) mod pencil;

use crate::error::Error;
use crate::geometry::triangles::Triangles;
use crate::options::Options;
use crate::query::frame::Frame;
use crate::query::path::Kept;
use crate::rays::hemisphere::{Occlusion, OpenRays};
use crate::rays::hits::Hits;
use crate::rays::origin::Origin;
use crate::rays::pencil::Rays;
use crate::rays::receiver::Receiver;
use crate::rays::segment::Segment;
use crate::stats::Stats;

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
    let mut kept = Kept::default();
    let stats = path::hits(triangles, rays.into(), options, true, &mut kept)?;
    let hits = kept.hits;
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
    path::blocked(triangles, segments, options)
}

/// Finds which receivers a light does not see: for exact shadows, with no resolution and no bias. See [`Receiver`].
///
/// The light is a point, or the direction that its rays travel in. Receivers may come in any order. Time about
/// O(n + p log n) for n triangles and p receivers; memory O(n + p), see [`Stats::engine_bytes`].
///
/// # Errors
/// When the light is out of range, a receiver is not finite, there are too many, or the thread flushes subnormal
/// numbers to zero.
pub fn shadowed(
    triangles: &Triangles<'_>,
    light: Origin,
    receivers: &[Receiver],
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    Frame::new().shadowed(triangles, light, receivers, options)
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
