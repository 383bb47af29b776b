//! What a caller may choose. Only [`Accuracy`] can change an output; everything else changes time alone.

use crate::simd::isa::Isa;

/// Which recursion answers the question. Both give the same answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// One bound stands for many rays: for a whole sub-pencil, or for a bundle of rays without a common origin.
    /// Segments ([`crate::query::blocked`]), and numbers too large or too small for bounds in f32, take the general
    /// path all the same.
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

/// How [`Path::General`] divides the objects. Changes time and memory only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Partition {
    /// At the middle of the longest side of their box, by their centres; at the median where that is lopsided.
    #[default]
    Middle,
    /// As they are given: halves of whole groups
    /// ([`Triangles::with_groups`](crate::geometry::triangles::Triangles::with_groups)), then halves of a group's
    /// order, whole runs of 64. Good where neighbours in the file are neighbours in space, as the objects of a scene
    /// graph are; where boxes overlap too much, as [`Partition::Middle`] from there on.
    Given,
    /// By space: the halves of a voxel, each with the triangles that reach into it. A triangle may be in both. Where
    /// that does not reduce the work, as [`Partition::Middle`].
    Spatial,
    /// By cost: of a few planes per axis the one with the least number of pairs, as a sample of the rays meets its
    /// sides. Where there are few rays, as [`Partition::Middle`].
    Sampled,
}

impl Partition {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Middle, Self::Given, Self::Spatial, Self::Sampled];
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
