//! Some rows of an atlas, texel by texel: which triangles touch each, and what they hold of it.
//!
//! A row takes its triangles in the order of (chart, triangle) and sorts what they touch by columns, by counting. A column that
//! charts have *filled*, with a triangle that holds its whole texel, as often as the caller cares for is closed: triangles of
//! other charts no longer enter it, and those whose columns are all closed cost nothing. So textures that repeat, where
//! thousands of triangles lie on top of each other, are no worse than others. Closed columns are skipped by a union-find
//! over the row.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (half planes); Harold Gabow and Robert
//! Tarjan, "A Linear-Time Algorithm for a Special Case of Disjoint Set Union", 1985 (intervals).

use std::ops::Range;

use umbel_core::TriangleId;

use crate::bake::atlas::layout::Layout;
use crate::bake::atlas::texel_coverage::{Footprint, Point};

/// What a triangle that touches a texel holds of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    pub(crate) chart: u32,
    pub(crate) triangle: TriangleId,
    /// One bit for each sub-position that the triangle holds.
    pub(crate) held: u64,
    pub(crate) footprint: Footprint,
}

/// A triangle of a block.
#[derive(Debug)]
struct Listed {
    share: Share,
    columns: Range<u32>,
    lines: Range<u32>,
}

/// A triangle that touches a texel of the row at hand.
#[derive(Debug, Clone, Copy, Default)]
struct Touch {
    column: u32,
    /// Into the triangles of the block.
    index: u32,
    /// Whether the whole texel lies in its interior.
    fills: bool,
}

/// Some rows of an layout.
#[derive(Debug)]
pub(crate) struct Block<'a> {
    layout: &'a Layout<'a>,
    rows: Range<u32>,
    /// In the order of (chart, triangle).
    triangles: Vec<Listed>,
}

impl<'a> Block<'a> {
    /// A block of `rows`, none of which other triangles than those of `ids` touch.
    pub(crate) fn new(layout: &'a Layout<'a>, rows: Range<u32>, ids: &[u32]) -> Self {
        let listed = |&id: &u32| {
            let triangle = TriangleId(id);
            let footprint = layout.footprint(triangle)?;
            let [columns, lines] = footprint.bounds(layout.size());
            let share = Share { chart: layout.chart(triangle)?, triangle, held: 0, footprint };
            Some(Listed { share, columns, lines })
        };
        let mut triangles: Vec<Listed> = ids.iter().filter_map(listed).collect();
        triangles.sort_unstable_by_key(|listed| (listed.share.chart, listed.share.triangle));
        Self { layout, rows, triangles }
    }

    /// Calls a function with the place (column, row) of each texel that is touched and with the shares of the triangles that
    /// touch it, in the order of (chart, triangle). Once triangles have filled a texel `most_fills` times, later charts are
    /// left out there.
    pub(crate) fn for_each_texel(&mut self, most_fills: u32, mut texel: impl FnMut((u32, u32), &[Share])) {
        let mut shares = Vec::new();
        for row in self.rows.clone() {
            let line = self.layout.line(row);
            let touches = by_column(&self.touches(line, most_fills), self.layout.size());
            for of_texel in touches.chunk_by(|one, other| one.column == other.column) {
                let column = of_texel[0].column;
                let share = |touch: &Touch| {
                    let share = self.triangles[touch.index as usize].share;
                    Share { held: self.held(&share.footprint, touch, line), ..share }
                };
                shares.clear();
                shares.extend(of_texel.iter().map(share));
                texel((column, row), &shares);
            }
        }
    }

    /// The triangles that touch the texels of a line, in the order of (chart, triangle), without what is closed to them.
    fn touches(&self, line: u32, most_fills: u32) -> Vec<Touch> {
        let mut touches: Vec<Touch> = Vec::new();
        let mut open = OpenColumns::new(self.layout.size(), most_fills);
        let (mut chart, mut first_of_chart) = (0, 0);
        for (index, listed) in (0_u32..).zip(&self.triangles) {
            if listed.share.chart != chart {
                // Columns close between charts, so that the triangles of one stay together.
                let filled = touches[first_of_chart..].iter().filter(|touch| touch.fills);
                filled.for_each(|touch| open.fill(touch.column));
                (chart, first_of_chart) = (listed.share.chart, touches.len());
            }
            let is_off = !listed.lines.contains(&line);
            if is_off || open.next(listed.columns.start) >= listed.columns.end {
                continue;
            }
            let footprint = &listed.share.footprint;
            let span = footprint.span(line, listed.columns.clone());
            let interior = footprint.interior(line, span.clone());
            let mut column = open.next(span.start);
            while column < span.end {
                touches.push(Touch { column, index, fills: interior.contains(&column) });
                column = open.next(column + 1);
            }
        }
        touches
    }

    /// The sub-positions of its texel that a triangle holds.
    fn held(&self, footprint: &Footprint, touch: &Touch, line: u32) -> u64 {
        let samples = self.layout.samples();
        if touch.fills {
            return u64::MAX >> (u64::BITS as usize - samples.len());
        }
        let holds = |sample: &Point| {
            footprint.holds(Point { x: f64::from(touch.column) + sample.x, y: f64::from(line) + sample.y })
        };
        let bits = (0..).zip(samples).filter(|&(_, sample)| holds(sample));
        bits.fold(0, |held, (k, _): (u32, _)| held | 1 << k)
    }
}

/// Sorts touches by column, those of a column in the order given. O(touches + size).
fn by_column(touches: &[Touch], size: u32) -> Vec<Touch> {
    let mut places = vec![0_usize; size as usize + 1];
    touches.iter().for_each(|touch| places[touch.column as usize + 1] += 1);
    for column in 1..places.len() {
        places[column] += places[column - 1];
    }
    let mut sorted = vec![Touch::default(); touches.len()];
    for touch in touches {
        let place = &mut places[touch.column as usize];
        sorted[*place] = *touch;
        *place += 1;
    }
    sorted
}

/// The columns of a row that are not filled often enough.
struct OpenColumns {
    /// For each column and the end: itself where it is open, else one farther on, toward the next open one.
    ahead: Vec<u32>,
    /// How many times each column is yet to be filled.
    left: Vec<u32>,
}

impl OpenColumns {
    fn new(size: u32, most_fills: u32) -> Self {
        Self { ahead: (0..=size).collect(), left: vec![most_fills; size as usize] }
    }

    /// The first open column from one on, or the end. Halves the path to it.
    fn next(&mut self, column: u32) -> u32 {
        let mut at = (column as usize).min(self.left.len());
        while self.ahead[at] as usize != at {
            self.ahead[at] = self.ahead[self.ahead[at] as usize];
            at = self.ahead[at] as usize;
        }
        // In range: it is an entry of `ahead`.
        at as u32
    }

    /// Fills a column once more.
    fn fill(&mut self, column: u32) {
        let left = &mut self.left[column as usize];
        *left = left.saturating_sub(1);
        if *left == 0 {
            self.ahead[column as usize] = column + 1;
        }
    }
}
