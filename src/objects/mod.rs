//! Triangles in an order: gathering, boxes of runs, the order along a curve, and points on and above their surfaces.

pub(crate) mod barycentric;
pub(crate) mod boxes;
pub(crate) mod closed;
pub(crate) mod gather;
pub(crate) mod morton;
pub(crate) mod offset;
pub(crate) mod runs;
pub(crate) mod split;
