//! Where a grid of points comes from: which part of which patch, and how many segments it has.

use crate::reyes::dice::patch::SubPatch;

/// A grid, without its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GridOrigin {
    pub(crate) surface: u32,
    pub(crate) part: SubPatch,
    /// Segments along u and v as powers of two.
    pub(crate) bits: [u8; 2],
}

impl GridOrigin {
    /// The points of a triangle, counted through the grid, given the first corner of its quadrilateral and which of the
    /// two it is.
    pub(crate) fn corners(&self, (first, second): (usize, bool)) -> [usize; 3] {
        let above = first + (1 << self.bits[0]) + 1;
        if second { [first, above + 1, above] } else { [first, first + 1, above + 1] }
    }
}
