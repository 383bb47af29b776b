//! Surfaces that exist only as a rule: bounds, parts, and points where they are asked for.
//!
//! A rule speaks of *objects*. An object is a group of others (a mesh, a cell of a field) or a *patch*: a map from the
//! unit square (u, v) to points. Whoever drives the rule bounds an object, drops it, expands it, or takes points of it;
//! what was expanded is forgotten after use.
//!
//! Patches that meet along a border u = 0, u = 1, v = 0 or v = 1 must give bit-equal points there, for parameters s
//! and, where they run against each other, 1 − s (parameters are dyadic, so 1 − s is exact). The sure way: let one of
//! the patches own the border, and have the others ask it. Inside a patch nothing of the kind is needed.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987 (bound,
//! split, dice); Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (objects of known extent, generated on demand).

use crate::geometry::aabb::Aabb;
use crate::reyes::dice::detail::Detail;

/// A rectangle of parameters within the unit square. Its ends are dyadic: whole multiples of a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// From and to, u₀ < u₁.
    pub u: [f64; 2],
    /// From and to, v₀ < v₁.
    pub v: [f64; 2],
}

impl Domain {
    /// All of a patch.
    pub const UNIT: Self = Self { u: [0.0, 1.0], v: [0.0, 1.0] };
}

/// Surfaces that are made where rays are, and forgotten.
pub trait OnDemand: Sync {
    /// What the rule speaks of: a group or a patch. A recipe of a few words, not geometry.
    type Object: Copy + Send + Sync;

    /// The objects with which everything begins: few of them, groups if there are many patches.
    fn roots(&self) -> Vec<Self::Object>;

    /// A box around every point that a group can show, or that a patch has over `domain`, displacement included, for
    /// rays that see so much detail. For a group the domain is [`Domain::UNIT`].
    fn bounds(&self, object: &Self::Object, domain: Domain, detail: &Detail) -> Aabb;

    /// Appends the parts of a group; `false`, and nothing appended, for a patch. Every call gives the same parts for
    /// the same `spacing`: that of `detail` for the group's box, the least distance between neighbouring rays there, in
    /// world units. Parts that are smaller than that may be replaced by a coarser level of detail.
    fn expand(
        &self,
        object: &Self::Object,
        spacing: f64,
        detail: &Detail,
        parts: &mut Vec<Self::Object>,
    ) -> bool;

    /// Appends the points of a patch at parameters (u, v) in the unit square: finite, within the bounds of any domain
    /// that holds the parameters, and the same bits in every call with the same `detail`. What is smaller than rays can
    /// tell apart at a place may be left out there: as long as it is the place that decides, and not the part, nothing
    /// tears.
    fn evaluate(
        &self,
        patch: &Self::Object,
        parameters: &[[f64; 2]],
        detail: &Detail,
        points: &mut Vec<[f32; 3]>,
    );

    /// The id that hits of a patch report: below `0xFFFF_FFFF`. Patches may share one.
    fn id(&self, patch: &Self::Object) -> u32;
}
