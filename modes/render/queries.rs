//! The engine's work for a preview: one frame for the shadows of all passes, and the time that queries take.

use std::time::{Duration, Instant};

use umbel_core::Frame;

/// A frame that keeps its memory and the order of the triangles from pass to pass, and how long the engine has worked.
#[derive(Debug)]
pub(crate) struct Queries {
    /// For what lights see: the hits of the camera are in another one, which is read meanwhile.
    pub(crate) lit: Frame,
    /// The time of all queries.
    pub(crate) time: Duration,
}

impl Queries {
    /// Nothing asked yet.
    pub(crate) fn new() -> Self {
        Self { lit: Frame::keeping_order(), time: Duration::ZERO }
    }
}

/// Runs a query and adds its time.
pub(crate) fn timed<T>(time: &mut Duration, query: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let answer = query();
    *time += start.elapsed();
    answer
}
