//! The corners of a polygon that are left, as a ring from which ears are clipped.
//!
//! A tip b with neighbours a and c is an *ear* when abc turns left and no edge of the remaining polygon passes through
//! the open triangle abc. Edges and corners may touch its border: that is what a hole bridged by two coincident edges
//! needs. Winding numbers are constant on the open triangle, so where they were 0 or 1 they stay so when it is clipped:
//! triangles of a polygon that does not cross itself never overlap. A corner that does not turn can always be clipped: its
//! triangle has no area. Spikes (ac back along ab) and repeated corners go first, since a triangle beside a spike may lie
//! outside; corners on a straight side go last.
//!
//! Cost: O(n²) predicates, nearly all of which a box test spares.
//!
//! Based on: Gary H. Meisters, "Polygons Have Ears", 1975; Martin Held, "FIST: Fast Industrial-Strength Triangulation of
//! Polygons", 2001 (fall-backs for polygons that are not simple).

use robust::{Coord, orient2d};

/// A point of the plane onto which the polygon is projected.
pub(crate) type Point = Coord<f64>;

/// How often all corners may be ranked anew. Clipping an ear can free a corner that is not its neighbour; this is rare,
/// and a bound keeps the cost quadratic for polygons that cross themselves everywhere.
const FULL_RANKINGS: u32 = 8;

/// What clipping a corner would do, worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// It turns right: the triangle lies outside.
    Reflex,
    /// An edge passes through the triangle.
    Blocked,
    /// It lies on a straight side: a triangle without area.
    Straight,
    /// An ear whose border touches another corner.
    Touching,
    /// An ear that touches no other corner.
    Clear,
    /// It repeats a neighbour or ends a spike: a triangle without area.
    Spike,
}

/// The corners that are left, as a linked ring.
pub(crate) struct Ring {
    points: Vec<Point>,
    previous: Vec<u32>,
    next: Vec<u32>,
    ranks: Vec<Rank>,
}

impl Ring {
    pub(crate) fn new(points: Vec<Point>, count: u32) -> Self {
        let previous = (0..count).map(|i| i.checked_sub(1).unwrap_or(count - 1)).collect();
        let next = (0..count).map(|i| (i + 1) % count).collect();
        let ranks = vec![Rank::Reflex; points.len()];
        let mut ring = Self { points, previous, next, ranks };
        ring.rank_all(0);
        ring
    }

    /// Clips corners, best first, until one triangle is left.
    pub(crate) fn clip(mut self) -> Vec<[u32; 3]> {
        let wanted = self.points.len() - 2;
        let mut triangles = Vec::with_capacity(wanted);
        let mut full_rankings = FULL_RANKINGS;
        let mut start = 0;
        while triangles.len() + 1 < wanted {
            let mut tip = self.best(start);
            if self.ranks[tip as usize] < Rank::Straight && full_rankings > 0 {
                full_rankings -= 1;
                self.rank_all(start);
                tip = self.best(start);
            }
            let [before, tip, after] = self.around(tip);
            triangles.push([before, tip, after]);
            self.next[before as usize] = after;
            self.previous[after as usize] = before;
            self.ranks[before as usize] = self.rank(before);
            self.ranks[after as usize] = self.rank(after);
            // Going on behind the new edge makes fewer slivers than a fan.
            start = self.next[after as usize];
        }
        triangles.push(self.around(start));
        triangles
    }

    /// A corner between its neighbours.
    fn around(&self, tip: u32) -> [u32; 3] {
        [self.previous[tip as usize], tip, self.next[tip as usize]]
    }

    fn point(&self, corner: u32) -> Point {
        self.points[corner as usize]
    }

    /// The first corner from `start` on whose rank no other exceeds.
    fn best(&self, start: u32) -> u32 {
        let (mut best, mut at) = (start, start);
        loop {
            if self.ranks[at as usize] > self.ranks[best as usize] {
                best = at;
            }
            at = self.next[at as usize];
            if at == start || self.ranks[best as usize] == Rank::Spike {
                return best;
            }
        }
    }

    fn rank_all(&mut self, start: u32) {
        let mut at = start;
        loop {
            self.ranks[at as usize] = self.rank(at);
            at = self.next[at as usize];
            if at == start {
                return;
            }
        }
    }

    /// Tests a corner against all others that are left.
    fn rank(&self, tip: u32) -> Rank {
        let [before, tip, after] = self.around(tip);
        let abc = [before, tip, after].map(|corner| self.point(corner));
        let turn = orient2d(abc[0], abc[1], abc[2]);
        if turn == 0.0 {
            // Both products have the sign of the sum, or are 0: it is exact.
            let [a, b, c] = abc;
            let back = (a.x - b.x) * (c.x - b.x) + (a.y - b.y) * (c.y - b.y) >= 0.0;
            return if back { Rank::Spike } else { Rank::Straight };
        }
        // NaN counts as the worst.
        let left = turn > 0.0;
        if !left {
            return Rank::Reflex;
        }
        let [x_min, y_min] = [abc[0].x.min(abc[1].x).min(abc[2].x), abc[0].y.min(abc[1].y).min(abc[2].y)];
        let [x_max, y_max] = [abc[0].x.max(abc[1].x).max(abc[2].x), abc[0].y.max(abc[1].y).max(abc[2].y)];
        let mut rank = Rank::Clear;
        let mut at = after;
        // The edges from `after` around to `before`: all but the two that meet in the tip.
        while at != before {
            let (u, v) = (self.point(at), self.point(self.next[at as usize]));
            let apart = u.x < x_min && v.x < x_min
                || u.x > x_max && v.x > x_max
                || u.y < y_min && v.y < y_min
                || u.y > y_max && v.y > y_max;
            if !apart {
                let sides = sides_of(abc, u);
                if passes_through(abc, u, v, sides) {
                    return Rank::Blocked;
                }
                if sides.iter().all(|&side| side >= 0.0) && !abc.contains(&u) {
                    rank = Rank::Touching;
                }
            }
            at = self.next[at as usize];
        }
        rank
    }
}

/// On which side of the three edges of abc a point lies; all positive inside.
fn sides_of([a, b, c]: [Point; 3], p: Point) -> [f64; 3] {
    [orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)]
}

/// Whether the segment uv meets the open triangle abc, with the sides of u given.
///
/// The two are apart iff a line along an edge of abc or along uv separates them (separating axes in the plane). A segment
/// of length 0 counts as apart: the edges beside it start at the same point.
fn passes_through(abc: [Point; 3], u: Point, v: Point, sides_of_u: [f64; 3]) -> bool {
    let outside = |(u_side, v_side): (f64, f64)| u_side <= 0.0 && v_side <= 0.0;
    if sides_of_u.into_iter().zip(sides_of(abc, v)).any(outside) {
        return false;
    }
    let turns = abc.map(|corner| orient2d(u, v, corner));
    turns.iter().any(|&turn| turn > 0.0) && turns.iter().any(|&turn| turn < 0.0)
}
