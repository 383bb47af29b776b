//! Rays on their way down, and the move in place that divides rays and objects alike.

use crate::intersect::general::slab::Slabs;
use crate::intersect::ray_set::Nearest;

/// A ray on its way down, with the nearest hit so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Active {
    pub(crate) slabs: Slabs,
    pub(crate) nearest: Nearest,
    pub(crate) ray: u32,
    /// Pairs that were evaluated for it: what the others leave of 88 bytes.
    pub(crate) tested: u32,
}

/// Moves what satisfies the predicate to the front and returns how many those are. O(n), in place.
pub(crate) fn move_to_front<T>(items: &mut [T], predicate: impl Fn(&T) -> bool) -> usize {
    let mut kept = 0;
    for index in 0..items.len() {
        if predicate(&items[index]) {
            items.swap(kept, index);
            kept += 1;
        }
    }
    kept
}
