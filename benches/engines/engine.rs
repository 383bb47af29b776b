//! What every engine offers: one run over a subject, timed.

use std::time::Instant;

use crate::Result;
use crate::subjects::Subject;

/// What one run took, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Times {
    /// From positions and indices to a structure that rays can be traced with. 0 for umbel, which builds none, and where
    /// the structure was there already.
    pub(crate) build: f64,
    /// From there to the answer in memory.
    pub(crate) trace: f64,
}

impl Times {
    /// Both.
    pub(crate) fn total(&self) -> f64 {
        self.build + self.trace
    }
}

/// One engine with its settings.
pub(crate) trait Variant {
    /// The name in tables, such as `embree-medium-16`.
    fn name(&self) -> &str;

    /// Whether the structure is built once, outside the times.
    fn prebuilt(&self) -> bool {
        false
    }
}

/// An engine that is ready to run on one subject.
pub(crate) trait Engine<S: Subject>: Variant {
    /// Runs once and fills an answer that has room for all rays.
    fn run(&mut self, subject: &S, answer: &mut S::Answer) -> Result<Times>;
}

/// Runs something and measures it in milliseconds.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let value = work();
    (start.elapsed().as_secs_f64() * 1e3, value)
}

/// Million rays per second, of a number of rays that took some milliseconds.
pub(crate) fn million_per_second(rays: usize, ms: f64) -> f64 {
    rays as f64 / ms / 1e3
}
