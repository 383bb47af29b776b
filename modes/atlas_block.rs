//! Some rows of an atlas, texel by texel: which triangles touch each, and what they hold of it.
//!
//! A row is made like a sparse matrix: each triangle's span of columns adds one to the columns' counts, and from their sums
//! follow the places of the triangles at each column. Memory is that of one row.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (half planes); Fred Gustavson, "Two Fast
//! Algorithms for Sparse Matrices", 1978 (rows by counting).

use std::ops::Range;

use umbel_core::TriangleId;

use crate::atlas::Atlas;
use crate::footprint::{Footprint, Point};

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

/// Some rows of an atlas.
#[derive(Debug)]
pub(crate) struct Block<'a> {
    atlas: &'a Atlas<'a>,
    rows: Range<u32>,
    /// In ascending order.
    triangles: Vec<Listed>,
    /// For each column of the row at hand, where its triangles start in `touching`; then the end.
    starts: Vec<u32>,
    /// Indices into `triangles`, column by column.
    touching: Vec<u32>,
}

impl<'a> Block<'a> {
    /// A block of `rows`, none of which other triangles than those of `ids` touch.
    pub(crate) fn new(atlas: &'a Atlas<'a>, rows: Range<u32>, ids: &[u32]) -> Self {
        let listed = |&id: &u32| {
            let triangle = TriangleId(id);
            let footprint = atlas.footprint(triangle)?;
            let [columns, lines] = footprint.bounds(atlas.size());
            let share = Share { chart: atlas.chart(triangle)?, triangle, held: 0, footprint };
            Some(Listed { share, columns, lines })
        };
        let triangles = ids.iter().filter_map(listed).collect();
        Self { atlas, rows, triangles, starts: Vec::new(), touching: Vec::new() }
    }

    /// Calls a function with the place (column, row) of each texel that is touched and with the shares of the triangles that
    /// touch it, in the order of (chart, triangle).
    pub(crate) fn for_each_texel(&mut self, mut texel: impl FnMut((u32, u32), &[Share])) {
        let mut shares = Vec::new();
        for row in self.rows.clone() {
            let line = self.atlas.line(row);
            self.fill(line);
            for column in 0..self.atlas.size() {
                let [start, end] = [0, 1].map(|k| self.starts[column as usize + k] as usize);
                if start == end {
                    continue;
                }
                let share = |&index: &u32| {
                    let share = self.triangles[index as usize].share;
                    Share { held: self.held(&share.footprint, (column, line)), ..share }
                };
                shares.clear();
                shares.extend(self.touching[start..end].iter().map(share));
                shares.sort_unstable_by_key(|share| (share.chart, share.triangle));
                texel((column, row), &shares);
            }
        }
    }

    /// Finds the triangles that touch each texel of a line.
    fn fill(&mut self, line: u32) {
        let on_line = (0_u32..).zip(&self.triangles).filter(|(_, listed)| listed.lines.contains(&line));
        let spans: Vec<(u32, Range<u32>)> = on_line
            .map(|(index, listed)| (index, listed.share.footprint.span(line, listed.columns.clone())))
            .collect();
        // Counts, two places ahead of their columns: their sums are one place ahead, and placing moves them back.
        self.starts.clear();
        self.starts.resize(self.atlas.size() as usize + 2, 0);
        for column in spans.iter().flat_map(|(_, span)| span.clone()) {
            self.starts[column as usize + 2] += 1;
        }
        for column in 2..self.starts.len() {
            self.starts[column] += self.starts[column - 1];
        }
        self.touching.clear();
        self.touching.resize(self.starts.last().map_or(0, |&end| end as usize), 0);
        for (index, span) in spans {
            for column in span {
                let place = &mut self.starts[column as usize + 1];
                self.touching[*place as usize] = index;
                *place += 1;
            }
        }
    }

    /// The sub-positions of a texel, given as (column, line), that a triangle holds.
    fn held(&self, footprint: &Footprint, (column, line): (u32, u32)) -> u64 {
        let samples = self.atlas.sub_positions();
        if samples.len() > 1 && footprint.swallows(column, line) {
            return u64::MAX >> (u64::BITS as usize - samples.len());
        }
        let holds = |sample: &Point| {
            footprint.holds(Point { x: f64::from(column) + sample.x, y: f64::from(line) + sample.y })
        };
        let bits = (0..).zip(samples).filter(|&(_, sample)| holds(sample));
        bits.fold(0, |held, (k, _): (u32, _)| held | 1 << k)
    }
}
