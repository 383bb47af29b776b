//! The footprint of a triangle in a texture: which texels it touches, which points it holds, and its nearest point.
//!
//! Units are texels of an N x N texture: x = N·u and y = N·v. Both are exact in f64, 24 bits times 16. Texel (i, j) is the closed
//! square \[i, i+1\] x \[j, j+1\]; j counts lines, which rise with v. Nothing is flipped here: N − N·v would be rounded.
//!
//! *Touching.* A convex set and a square are apart iff a line along a side of one of them separates them. For the sides of
//! the square that is a comparison of bounds. For a side ab of the triangle, with the inside on its left, it is the sign of
//! orient2d(a, b, p) at the corner p of the square that lies farthest to the left. Along a line of texels that sign changes
//! once, so a binary search finds where: a line costs O(log width). A triangle without area is a segment or a point: its
//! sides count in both directions.
//!
//! *Holding.* A point on a side belongs to the triangle that holds p + (ε, ε²). So triangles that share sides hold a point
//! once, and where two hold a point their interiors overlap. A triangle without area holds none.
//!
//! Based on: Stefan Gottschalk, Ming Lin and Dinesh Manocha, "OBBTree: A Hierarchical Structure for Rapid Interference
//! Detection", 1996 (separating axes); Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990; Jonathan
//! Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997.

use std::ops::Range;

use robust::{Coord, orient2d};

/// A point in units of texels.
pub(crate) type Point = Coord<f64>;

/// A triangle in the plane of a texture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Footprint {
    /// The corners a, b, c, in units of texels.
    corners: [Point; 3],
    /// Whether a, b, c turn left: the sign of the area; 0 without area.
    pub(crate) turn: i8,
}

impl Footprint {
    /// The footprint of texture coordinates (u, v), which are finite, in a texture of `size` x `size` texels.
    pub(crate) fn new(uv: [[f32; 2]; 3], size: u32) -> Self {
        let scale = f64::from(size);
        let corners = uv.map(|[u, v]| Point { x: f64::from(u) * scale, y: f64::from(v) * scale });
        let area = orient2d(corners[0], corners[1], corners[2]);
        Self { corners, turn: i8::from(area > 0.0) - i8::from(area < 0.0) }
    }

    /// The columns and lines whose texels the bounds touch, within a texture of `size` x `size` texels.
    ///
    /// What only touches the border of the texture from outside is not of it: none.
    pub(crate) fn bounds(&self, size: u32) -> [Range<u32>; 2] {
        let [a, b, c] = self.corners;
        let range = |[a, b, c]: [f64; 3]| touched(a.min(b).min(c), a.max(b).max(c), size);
        [range([a.x, b.x, c.x]), range([a.y, b.y, c.y])]
    }

    /// The columns within `columns` whose texels of a line the triangle touches. `columns` and `line` are within the bounds.
    pub(crate) fn span(&self, line: u32, columns: Range<u32>) -> Range<u32> {
        let touching = cut(&self.sides(self.turn), line, columns, Reach::Touches);
        if self.turn == 0 { cut(&self.sides(-1), line, touching, Reach::Touches) } else { touching }
    }

    /// The columns within a span whose closed texels lie in the triangle's interior.
    pub(crate) fn interior(&self, line: u32, span: Range<u32>) -> Range<u32> {
        if self.turn == 0 {
            span.start..span.start
        } else {
            cut(&self.sides(self.turn), line, span, Reach::Fills)
        }
    }

    /// Whether the triangle holds a point: each point of a mesh without folds is held once.
    pub(crate) fn holds(&self, point: Point) -> bool {
        self.turn != 0 && self.sides(self.turn).into_iter().all(|side| is_left(side, point))
    }

    /// The barycentric weights of a point that the triangle holds: not negative, their sum within 2 ulp of 1.
    pub(crate) fn weights(&self, point: Point) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let areas = [orient2d(b, c, point), orient2d(c, a, point), orient2d(a, b, point)].map(f64::abs);
        let sum = areas[0] + areas[1] + areas[2];
        areas.map(|area| area / sum)
    }

    /// The point of the closed triangle nearest to a point: its barycentric weights and the square of its distance.
    pub(crate) fn nearest(&self, point: Point) -> ([f64; 3], f64) {
        if self.holds(point) {
            return (self.weights(point), 0.0);
        }
        let mut nearest = ([1.0, 0.0, 0.0], f64::INFINITY);
        for k in 0..3 {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % 3]);
            let (along, to) = ([b.x - a.x, b.y - a.y], [point.x - a.x, point.y - a.y]);
            let squared = along[0] * along[0] + along[1] * along[1];
            let place = to[0] * along[0] + to[1] * along[1];
            let place = if squared > 0.0 { (place / squared).clamp(0.0, 1.0) } else { 0.0 };
            let apart = [to[0] - place * along[0], to[1] - place * along[1]];
            let distance = apart[0] * apart[0] + apart[1] * apart[1];
            if distance < nearest.1 {
                let mut weights = [0.0; 3];
                (weights[k], weights[(k + 1) % 3]) = (1.0 - place, place);
                nearest = (weights, distance);
            }
        }
        nearest
    }

    /// The sides in the order of the corners, or against it for a negative turn.
    fn sides(&self, turn: i8) -> [[Point; 2]; 3] {
        let [a, b, c] = self.corners;
        if turn < 0 { [[b, a], [c, b], [a, c]] } else { [[a, b], [b, c], [c, a]] }
    }
}

/// What a texel has to do with the left of a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// A corner lies on the left or on the side.
    Touches,
    /// All corners lie on the left.
    Fills,
}

/// The columns whose texels of a line reach the left of all sides.
fn cut(sides: &[[Point; 2]; 3], line: u32, mut columns: Range<u32>, reach: Reach) -> Range<u32> {
    let fills = reach == Reach::Fills;
    for &[a, b] in sides {
        // The left is (a.y − b.y, b.x − a.x). The corner that lies farthest there touches; the opposite one decides on filling.
        let y = f64::from(line + u32::from((b.x > a.x) != fills));
        let reaches = |x: u32| {
            let side = orient2d(a, b, Point { x: f64::from(x), y });
            if fills { side > 0.0 } else { side >= 0.0 }
        };
        // About where the side crosses; the exact search starts there.
        let near = a.x + (y - a.y) * ((b.x - a.x) / (b.y - a.y));
        if b.y < a.y {
            columns.start = first_near(&columns, near, |column| reaches(column + u32::from(!fills)));
        } else if b.y > a.y {
            columns.end = first_near(&columns, near, |column| !reaches(column + u32::from(fills)));
        } else if !reaches(columns.start) {
            columns.end = columns.start;
        }
    }
    columns
}

/// The cells \[k, k+1\] of \[0, size\] that the closed interval \[lo, hi\] touches, if it meets the open one or is a point.
fn touched(lo: f64, hi: f64, size: u32) -> Range<u32> {
    let end = f64::from(size);
    let is_point_within = lo == hi && lo >= 0.0 && hi <= end;
    if !(lo < end && hi > 0.0 || is_point_within) {
        return 0..0;
    }
    // In range after the clamps.
    (lo.ceil() - 1.0).max(0.0) as u32..(hi.floor() + 1.0).min(end) as u32
}

/// The first number of a range that holds, if none before it and all behind it do; else its end. O(log n).
fn first(range: Range<u32>, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut from, mut to) = (range.start, range.end);
    while from < to {
        let middle = from + (to - from) / 2;
        if holds(middle) { to = middle } else { from = middle + 1 }
    }
    from
}

/// The same, sought outward from a guess in steps that double: O(log distance) from it.
///
/// Based on: Jon Bentley and Andrew Yao, "An Almost Optimal Algorithm for Unbounded Searching", 1976.
fn first_near(range: &Range<u32>, guess: f64, holds: impl Fn(u32) -> bool) -> u32 {
    // In range after the clamp; what is no number becomes 0.
    let guess = (guess.clamp(f64::from(range.start), f64::from(range.end)) as u32).max(range.start);
    let (mut from, mut to, mut step) = (range.start, range.end, 1_u32);
    if guess == range.end || holds(guess) {
        to = guess;
        while to > from {
            let lower = to.saturating_sub(step).max(from);
            if !holds(lower) {
                from = lower + 1;
                break;
            }
            (to, step) = (lower, step.saturating_mul(2));
        }
    } else {
        from = guess + 1;
        while from < to {
            let upper = from.saturating_add(step - 1).min(to - 1);
            if holds(upper) {
                to = upper;
                break;
            }
            (from, step) = (upper + 1, step.saturating_mul(2));
        }
    }
    first(from..to, holds)
}

/// Whether p + (ε, ε²) lies strictly on the left of ab.
fn is_left([a, b]: [Point; 2], point: Point) -> bool {
    let side = orient2d(a, b, point);
    if side != 0.0 {
        side > 0.0
    } else if a.y != b.y {
        b.y < a.y
    } else {
        b.x > a.x
    }
}
