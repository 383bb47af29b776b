//! Dividing objects by their centres at the middle of the longest side of their box; at the median where that is
//! lopsided.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (the middle of the longest side).

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::general::active::move_to_front;

/// A split with less than this part of the objects on one side is made at the median instead. The depth of the
/// recursion is at most log(n)/log(8/7), 166 steps for 2³² objects: any stack holds that.
const LOPSIDED: usize = 8;

/// Divides objects in place. Returns how many are on the left side, and the axis.
pub(crate) fn split(triangles: &Triangles<'_>, objects: &mut [u32], bounds: &Aabb) -> (usize, usize) {
    let axis = bounds.longest_axis();
    let centre = |id: u32| triangles.bounds(id).centre()[axis];
    let middle = bounds.centre()[axis];
    let mut left = move_to_front(objects, |&id| centre(id) < middle);
    if left.min(objects.len() - left) < objects.len() / LOPSIDED + 1 {
        // Triangles that share a vertex have boxes that all begin there: the middle would peel them off one by one.
        left = objects.len() / 2;
        objects.select_nth_unstable_by(left, |&one, &other| centre(one).total_cmp(&centre(other)));
    }
    (left, axis)
}
