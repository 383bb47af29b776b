//! What every call does first: checks of what no ray decides, and the threads that work on it.

use std::sync::atomic::{AtomicBool, Ordering};

use fearless_simd::Level;

use crate::error::Error;
use crate::options::Options;

/// Checks what the rays do not depend on: their number, and the instruction set.
pub(crate) fn check_call(rays: usize, options: &Options) -> Result<Level, Error> {
    if u32::try_from(rays).is_err() {
        return Err(Error::TooManyRays { rays: rays as u64 });
    }
    options.isa.level()
}

/// Does all work on threads of the pool, so that its parallel parts need not wait for a thread outside, and has each
/// thread check meanwhile that subnormal numbers are what they are.
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
