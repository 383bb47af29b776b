//! What a caller may choose. Only [`Accuracy`] can change an output; everything else changes time alone.

use crate::intersect::general::partition::Partition;
use crate::simd::isa::Isa;

/// Which recursion answers the question. Both give the same answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// One bound stands for many rays: for a whole sub-pencil, or for a bundle of rays without a common origin. Segments
    /// ([`crate::query::blocked`]), and numbers too large or too small for bounds in f32, take the general path all the same.
    #[default]
    Pencil,
    /// Algorithm 1 of the paper: every ray is tested by itself. The reference for pencils and bundles.
    General,
}

/// What happens where f64 cannot decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accuracy {
    /// The decision is made in exact arithmetic: no cracks, no double hits.
    #[default]
    Exact,
    /// The pencil path keeps the rounded decision. Shared edges stay closed; a ray within rounding distance of a vertex
    /// may slip through.
    Fast,
}

/// Options of a query. `Options::default()` is exact, by pencils.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// Which recursion runs.
    pub path: Path,
    /// How [`Path::General`] divides the objects. Never changes an output.
    pub partition: Partition,
    /// What happens where f64 cannot decide.
    pub accuracy: Accuracy,
    /// Which instructions the kernels use. Never changes an output.
    pub isa: Isa,
}
