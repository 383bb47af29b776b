//! Some rows of an atlas, texel by texel: which triangles touch each, and what they hold of it.
//!
//! A row takes its triangles in the order of (chart, triangle) and sorts what they touch by columns, by counting. A column that
//! charts have *filled*, so that their triangles together hold all of its sub-positions, as often as the caller cares for is
//! closed: triangles of other charts no longer enter it, and those whose columns are all closed cost nothing. So textures that repeat, where
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
    /// One bit for each sub-position of the texel that it holds.
    held: u64,
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
    /// touch it, in the order of (chart, triangle). Once charts have filled a texel `most_fills` times, later charts are
    /// left out there.
    pub(crate) fn for_each_texel(&mut self, most_fills: u32, mut texel: impl FnMut((u32, u32), &[Share])) {
        let mut shares = Vec::new();
        for row in self.rows.clone() {
            let line = self.layout.line(row);
            let touches = by_column(&self.touches(line, most_fills), self.layout.size());
            for of_texel in touches.chunk_by(|one, other| one.column == other.column) {
                let column = of_texel[0].column;
                let share =
                    |touch: &Touch| Share { held: touch.held, ..self.triangles[touch.index as usize].share };
                shares.clear();
                shares.extend(of_texel.iter().map(share));
                texel((column, row), &shares);
            }
        }
    }

    /// The triangles that touch the texels of a line, in the order of (chart, triangle), without what is closed to them.
    fn touches(&self, line: u32, most_fills: u32) -> Vec<Touch> {
        let mut touches: Vec<Touch> = Vec::new();
        let mut open = OpenColumns::new(self.layout.size(), most_fills, self.all_samples());
        let (mut chart, mut first_of_chart) = (0, 0);
        for (index, listed) in (0_u32..).zip(&self.triangles) {
            if listed.share.chart != chart {
                // Columns close between charts, so that the triangles of one stay together.
                open.close(&touches[first_of_chart..]);
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
                let is_whole = interior.contains(&column);
                let held = if is_whole { self.all_samples() } else { self.held(footprint, column, line) };
                touches.push(Touch { column, index, held });
                column = open.next(column + 1);
            }
        }
        touches
    }

    /// A bit for each sub-position.
    fn all_samples(&self) -> u64 {
        u64::MAX >> (u64::BITS as usize - self.layout.samples().len())
    }

    /// The sub-positions of a texel that a triangle holds.
    fn held(&self, footprint: &Footprint, column: u32, line: u32) -> u64 {
        let holds = |sample: &Point| {
            footprint.holds(Point { x: f64::from(column) + sample.x, y: f64::from(line) + sample.y })
        };
        let bits = (0..).zip(self.layout.samples()).filter(|&(_, sample)| holds(sample));
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
    /// What the chart at hand holds of each column; 0 between charts.
    held: Vec<u64>,
    /// A bit for each sub-position.
    all: u64,
}

impl OpenColumns {
    fn new(size: u32, most_fills: u32, all: u64) -> Self {
        let held = vec![0; size as usize];
        Self { ahead: (0..=size).collect(), left: vec![most_fills; size as usize], held, all }
    }

    /// Fills the columns of which a chart, given by all of its touches, holds everything.
    fn close(&mut self, touches: &[Touch]) {
        for &Touch { column, held, .. } in touches {
            let before = self.held[column as usize];
            self.held[column as usize] |= held;
            if before != self.all && before | held == self.all {
                self.fill(column);
            }
        }
        touches.iter().for_each(|touch| self.held[touch.column as usize] = 0);
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
