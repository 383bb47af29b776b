//! The corners of a polygon that are left, as a ring from which ears are clipped.
//!
//! A tip b with neighbours a and c is an *ear* when abc turns left and no edge of the remaining polygon passes through
//! the open triangle abc. Edges and corners may touch its border: that is what a hole bridged by two coincident edges
//! needs. Winding numbers are constant on the open triangle, so where they were 0 or 1 they stay so when it is clipped:
//! triangles of a polygon that does not cross itself never overlap. A corner that does not turn can always be clipped: its
//! triangle has no area. Spikes (ac back along ab) and repeated corners go first, since a triangle beside a spike may lie
//! outside; corners on a straight side go last.
//!
//! Cost: up to [`FEW`] corners O(n²) box tests. Beyond, corners are found by place ([`crate::formats::polygons::corner_tree`]) and
//! the best one by its rank: O(n log n) where few corners lie in a triangle whose tip turns left, as in polygons that people
//! have. Only edges with an end in the closed triangle are then looked at. In a polygon that does not cross itself there are
//! no others to find: an edge from outside to outside that passes through the triangle would have to cross ab or bc, which
//! are edges themselves. Polygons that do cross themselves have no right answer, and many of their corners may lie in each
//! triangle: one of 90,000 corners that goes around three points took 324 s. So the corners that are looked at are counted,
//! and when they are more than [`LOOKS`] says, corners that turn left are clipped as they come.
//!
//! Based on: Gary H. Meisters, "Polygons Have Ears", 1975; Martin Held, "FIST: Fast Industrial-Strength Triangulation of
//! Polygons", 2001 (fall-backs for polygons that are not simple).

use robust::orient2d;

use crate::formats::polygons::corner_tree::{CornerTree, Point, Seen};

/// How often all corners may be ranked anew. Clipping an ear can free a corner that is not its neighbour; this is rare,
/// and a bound keeps the cost quadratic for polygons that cross themselves everywhere.
const FULL_RANKINGS: u32 = 8;

/// Up to so many corners, looking at all of them is faster than looking for some.
const FEW: usize = 64;

/// How many corners may be looked at for each of a polygon's, and in any polygon: all for all of 4,096. A polygon that does not cross
/// itself looks at a handful.
const LOOKS: [u64; 2] = [512, 1 << 24];

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
    index: Option<Index>,
}

/// What finds corners among many.
struct Index {
    tree: CornerTree,
    /// The corners of each rank, a bit for each corner.
    by_rank: [Bits; 6],
    /// How many corners may still be looked at.
    looks: u64,
}

/// A set of corners.
struct Bits {
    words: Vec<u64>,
    count: usize,
}

impl Bits {
    fn set(&mut self, corner: u32, is_in: bool) {
        let (word, bit) = (&mut self.words[corner as usize / 64], 1 << (corner % 64));
        let was_in = *word & bit != 0;
        if is_in != was_in {
            *word ^= bit;
            self.count = if is_in { self.count + 1 } else { self.count - 1 };
        }
    }

    /// The first corner from `start` on, and behind the last one from 0 on.
    fn first_from(&self, start: u32) -> Option<u32> {
        if self.count == 0 {
            return None;
        }
        let (word, bit) = (start as usize / 64, start % 64);
        let here = self.words[word];
        let (before, behind) = (here & !(u64::MAX << bit), here & (u64::MAX << bit));
        let others = self.words[word + 1..].iter().copied().zip(word + 1..);
        let wrapped = self.words[..word].iter().copied().zip(0..);
        let mut all = [(behind, word)].into_iter().chain(others).chain(wrapped).chain([(before, word)]);
        let (bits, word) = all.find(|&(bits, _)| bits != 0)?;
        // In range: corners are 32 bits wide.
        Some(word as u32 * 64 + bits.trailing_zeros())
    }
}

impl Ring {
    pub(crate) fn new(points: Vec<Point>, count: u32) -> Self {
        let previous = (0..count).map(|i| i.checked_sub(1).unwrap_or(count - 1)).collect();
        let next = (0..count).map(|i| (i + 1) % count).collect();
        let ranks = vec![Rank::Reflex; points.len()];
        let index = (points.len() > FEW).then(|| {
            let empty = || Bits { words: vec![0; points.len().div_ceil(64)], count: 0 };
            let looks = LOOKS[1].max(points.len() as u64 * LOOKS[0]);
            Index { tree: CornerTree::new(&points), by_rank: std::array::from_fn(|_| empty()), looks }
        });
        let mut ring = Self { points, previous, next, ranks, index };
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
            self.take_out([before, tip, after]);
            self.rank_anew(before);
            self.rank_anew(after);
            // Going on behind the new edge makes fewer slivers than a fan.
            start = self.next[after as usize];
        }
        triangles.push(self.around(start));
        triangles
    }

    /// Takes a corner out of the ring.
    fn take_out(&mut self, [before, tip, after]: [u32; 3]) {
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
        if let Some(index) = &mut self.index {
            index.tree.take_out(tip);
            index.by_rank[self.ranks[tip as usize] as usize].set(tip, false);
        }
    }

    /// Ranks a corner of the ring anew.
    fn rank_anew(&mut self, corner: u32) {
        let rank = self.rank(corner);
        if let Some(index) = &mut self.index {
            index.by_rank[self.ranks[corner as usize] as usize].set(corner, false);
            index.by_rank[rank as usize].set(corner, true);
        }
        self.ranks[corner as usize] = rank;
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
        if let Some(index) = &self.index {
            // The ring's order is that of the file, so the next one in it has the next number.
            return index.by_rank.iter().rev().find_map(|bits| bits.first_from(start)).unwrap_or(start);
        }
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
            self.rank_anew(at);
            at = self.next[at as usize];
            if at == start {
                return;
            }
        }
    }

    /// Tests a corner against all others that are left.
    fn rank(&mut self, tip: u32) -> Rank {
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
        let mut rank = Rank::Clear;
        if let Some(mut index) = self.index.take() {
            let mut looks = index.looks;
            if looks > 0 {
                index.tree.near(abc, |corner| {
                    looks -= 1;
                    // The edges that meet in it, but for the two that meet in the tip.
                    for at in [self.previous[corner as usize], corner] {
                        if at != before && at != tip {
                            rank = rank.min(self.rank_beside(abc, at));
                        }
                    }
                    match rank {
                        _ if looks == 0 => Seen::Enough,
                        Rank::Blocked => Seen::Enough,
                        Rank::Touching => Seen::Touched,
                        _ => Seen::Nothing,
                    }
                });
            }
            index.looks = looks;
            self.index = Some(index);
            return rank;
        }
        let [x_min, y_min] = [abc[0].x.min(abc[1].x).min(abc[2].x), abc[0].y.min(abc[1].y).min(abc[2].y)];
        let [x_max, y_max] = [abc[0].x.max(abc[1].x).max(abc[2].x), abc[0].y.max(abc[1].y).max(abc[2].y)];
        let mut at = after;
        // The edges from `after` around to `before`: all but the two that meet in the tip.
        while at != before && rank != Rank::Blocked {
            let (u, v) = (self.point(at), self.point(self.next[at as usize]));
            let apart = u.x < x_min && v.x < x_min
                || u.x > x_max && v.x > x_max
                || u.y < y_min && v.y < y_min
                || u.y > y_max && v.y > y_max;
            if !apart {
                rank = rank.min(self.rank_beside(abc, at));
            }
            at = self.next[at as usize];
        }
        rank
    }

    /// What the edge that begins at a corner leaves of a triangle's rank.
    fn rank_beside(&self, abc: [Point; 3], at: u32) -> Rank {
        let (u, v) = (self.point(at), self.point(self.next[at as usize]));
        let sides = sides_of(abc, u);
        if passes_through(abc, u, v, sides) {
            Rank::Blocked
        } else if sides.iter().all(|&side| side >= 0.0) && !abc.contains(&u) {
            Rank::Touching
        } else {
            Rank::Clear
        }
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
