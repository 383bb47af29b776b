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
/// thread check meanwhile that its arithmetic is that of IEEE 754: subnormal numbers are what they are, and results are
/// rounded to nearest. Hosts can change either for a thread, and threads inherit it.
pub(crate) fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let (flushed, rounded) = (AtomicBool::new(flushes_to_zero()), AtomicBool::new(!rounds_to_nearest()));
    let result = rayon::scope(|scope| {
        scope.spawn_broadcast(|_, _| {
            flushed.fetch_or(flushes_to_zero(), Ordering::Relaxed);
            rounded.fetch_or(!rounds_to_nearest(), Ordering::Relaxed);
        });
        work()
    });
    if flushed.into_inner() {
        Err(Error::FlushToZero)
    } else if rounded.into_inner() {
        Err(Error::RoundingMode)
    } else {
        Ok(result)
    }
}

/// Whether this thread was told to treat subnormal numbers as zero.
fn flushes_to_zero() -> bool {
    std::hint::black_box(f64::MIN_POSITIVE) * std::hint::black_box(0.5) == 0.0
}

/// Whether this thread rounds to nearest, ties to even. Halves of a last place tell: upward 1 + ε/2 grows, downward
/// −1 − ε/2 does, and toward zero 1 + ε + ε/2 stays at 1 + ε instead of going to the even 1 + 2ε, ε = 2⁻⁵².
fn rounds_to_nearest() -> bool {
    let sum = |a: f64, b: f64| std::hint::black_box(a) + std::hint::black_box(b);
    let (half, next) = (f64::EPSILON / 2.0, 1.0 + f64::EPSILON);
    sum(1.0, half) == 1.0 && sum(-1.0, -half) == -1.0 && sum(next, half) == 1.0 + 2.0 * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::{flushes_to_zero, rounds_to_nearest};

    #[test]
    fn tests_run_in_the_usual_arithmetic() {
        assert!(rounds_to_nearest() && !flushes_to_zero());
    }
}
