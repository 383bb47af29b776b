//! The corners of a polygon that are left, by place: which of them lie in a triangle.
//!
//! The corners stand in Morton order, and a binary tree over that order keeps boxes, which shrink as corners are clipped. A
//! box is passed over only where it lies beside the triangle, decided exactly.
//!
//! Cost: O(n log n) to make, O(log n) to take a corner out; asking costs what lies in the triangle and near its border.
//!
//! Based on: Guy Macdonald Morton, "A Computer Oriented Geodetic Data Base", 1966; Stefan Gottschalk, Ming Lin and Dinesh
//! Manocha, "OBBTree", 1996 (separating axes).

use robust::{Coord, orient2d};

/// A point of the plane onto which the polygon is projected.
pub(crate) type Point = Coord<f64>;

/// The box that holds nothing: x from, x to, y from, y to.
const EMPTY: [f64; 4] = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];

/// What has been found of a triangle so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seen {
    /// Nothing that matters.
    Nothing,
    /// A corner touches it: further ones on its last side would say no more.
    Touched,
    /// All there is to know.
    Enough,
}

/// A tree of boxes over corners.
pub(crate) struct CornerTree {
    /// Node 1 is the root, the children of k are 2k and 2k + 1; the last half are the corners, in `order`.
    boxes: Vec<[f64; 4]>,
    order: Vec<u32>,
    /// Where a corner stands in the order.
    places: Vec<u32>,
    waiting: Vec<usize>,
}

impl CornerTree {
    /// The tree of corners, whose number is 32 bits wide.
    pub(crate) fn new(points: &[Point]) -> Self {
        let around = |p: &Point| [p.x, p.x, p.y, p.y];
        let frame = points.iter().fold(EMPTY, |frame, p| union(frame, around(p)));
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.sort_by_cached_key(|&corner| (morton(points[corner as usize], &frame), corner));
        let leaves = points.len().next_power_of_two();
        let mut boxes = vec![EMPTY; 2 * leaves];
        let mut places = vec![0; points.len()];
        for (place, &corner) in (0_u32..).zip(&order) {
            boxes[leaves + place as usize] = around(&points[corner as usize]);
            places[corner as usize] = place;
        }
        for node in (1..leaves).rev() {
            boxes[node] = union(boxes[2 * node], boxes[2 * node + 1]);
        }
        Self { boxes, order, places, waiting: Vec::new() }
    }

    /// Takes a corner out.
    pub(crate) fn take_out(&mut self, corner: u32) {
        let mut node = self.boxes.len() / 2 + self.places[corner as usize] as usize;
        self.boxes[node] = EMPTY;
        while node > 1 {
            node /= 2;
            let both = union(self.boxes[2 * node], self.boxes[2 * node + 1]);
            if both == self.boxes[node] {
                return;
            }
            self.boxes[node] = both;
        }
    }

    /// Calls `visit` with each corner that may lie in the closed triangle abc, which turns left, until that has seen enough.
    /// Once something touches it, corners on the line of ca may be left out.
    pub(crate) fn near(&mut self, abc: [Point; 3], mut visit: impl FnMut(u32) -> Seen) {
        let bounds = abc.iter().fold(EMPTY, |bounds, p| union(bounds, [p.x, p.x, p.y, p.y]));
        let leaves = self.boxes.len() / 2;
        let mut seen = Seen::Nothing;
        self.waiting.clear();
        self.waiting.push(1);
        while let Some(node) = self.waiting.pop() {
            let here = &self.boxes[node];
            if is_apart(&bounds, here) || is_beside(&abc, here, seen == Seen::Touched) {
                continue;
            }
            if node < leaves {
                self.waiting.extend([2 * node, 2 * node + 1]);
                continue;
            }
            match visit(self.order[node - leaves]) {
                Seen::Enough => return,
                Seen::Touched => seen = Seen::Touched,
                Seen::Nothing => {}
            }
        }
    }
}

fn union(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

/// Whether two boxes lie strictly beside each other, or the second is empty.
fn is_apart(a: &[f64; 4], b: &[f64; 4]) -> bool {
    b[1] < a[0] || b[0] > a[1] || b[3] < a[2] || b[2] > a[3]
}

/// Whether a box lies strictly on the right of a side of a triangle that turns left, or on that of its last side, if the line
/// of that counts as beside.
fn is_beside(abc: &[Point; 3], &[x0, x1, y0, y1]: &[f64; 4], is_line_beside: bool) -> bool {
    (0..3).any(|k| {
        let (p, q) = (abc[k], abc[(k + 1) % 3]);
        // The corner of the box that lies farthest to the left.
        let farthest = Point { x: if q.y > p.y { x0 } else { x1 }, y: if q.x > p.x { y1 } else { y0 } };
        let side = orient2d(p, q, farthest);
        side < 0.0 || (is_line_beside && k == 2 && side == 0.0)
    })
}

/// The place of a point along the Morton curve of a frame: the bits of its coordinates, interleaved.
fn morton(p: Point, frame: &[f64; 4]) -> u64 {
    // Not a number casts to 0.
    let cell = |x: f64, from: f64, to: f64| ((x - from) / (to - from) * 65535.0) as u16;
    let spread = |cell: u16| (0..16).fold(0, |bits, k| bits | (u64::from(cell) >> k & 1) << (2 * k));
    spread(cell(p.x, frame[0], frame[1])) | spread(cell(p.y, frame[2], frame[3])) << 1
}
