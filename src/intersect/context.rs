//! What every path is given with its rays.

use fearless_simd::Level;

use crate::geometry::triangles::Triangles;
use crate::options::Accuracy;

/// The triangles, and how they are tested.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) accuracy: Accuracy,
    pub(crate) level: Level,
}

impl Context<'_> {
    /// Whether the exact stage decides what rounding leaves in doubt.
    #[inline(always)]
    pub(crate) fn is_exact(&self) -> bool {
        self.accuracy == Accuracy::Exact
    }

    /// Scaled edge functions within ± this are in doubt.
    #[inline(always)]
    pub(crate) fn doubt(&self) -> f32 {
        if self.is_exact() { 1.0 } else { 0.0 }
    }
}
