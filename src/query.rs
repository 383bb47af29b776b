//! The two verbs of the engine: closest hit and any hit.

use crate::{Error, Hits, Options, Path, Rays, Stats, Triangles, general, recursion};

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
    run(triangles, rays.into(), options, false)
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
    let (hits, stats) = run(triangles, rays.into(), options, true)?;
    Ok((
        (0..hits.len()).map(|ray| hits.get(ray).is_some()).collect(),
        stats,
    ))
}

/// Checks the rays and takes the path of the options.
fn run(
    triangles: &Triangles<'_>,
    rays: Rays<'_>,
    options: &Options,
    any: bool,
) -> Result<(Hits, Stats), Error> {
    if flushes_to_zero() {
        return Err(Error::FlushToZero);
    }
    if let Rays::General(rays) = rays {
        if u32::try_from(rays.len()).is_err() {
            return Err(Error::TooManyRays {
                rays: rays.len() as u64,
            });
        }
        rays.iter().try_for_each(crate::Ray::check)?;
    }
    let level = options.isa.level()?;
    let mut hits = Hits::missed(rays.len());
    let stats = match (rays, options.path) {
        (Rays::Pencil(pencil), Path::Pencil) => {
            recursion::intersect(triangles, pencil, options.accuracy, level, any, &mut hits)
        }
        _ => general::intersect(triangles, rays, any, &mut hits),
    };
    Ok((hits, stats))
}

/// Whether this thread or the pool's threads were told to treat subnormal numbers as zero.
fn flushes_to_zero() -> bool {
    let flushes = || std::hint::black_box(f64::MIN_POSITIVE) * std::hint::black_box(0.5) == 0.0;
    flushes()
        || rayon::broadcast(|_| flushes())
            .into_iter()
            .any(|flushes| flushes)
}
