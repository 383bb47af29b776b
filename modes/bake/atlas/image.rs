//! Images of texels: values where something was baked, and their extension beyond the borders of charts.
//!
//! A texel is *covered* where it has receivers, which a mask of its own says: neither black nor NaN do. Its value is the mean of
//! its receivers' values.
//!
//! *Extension* gives each uncovered texel within a margin the value of the nearest covered one, so that filters and smaller
//! levels of the texture find no background beside a chart. Let g(q) be the distance along column q from a row to the nearest
//! covered texel. For column x of that row the nearest one minimises (x − q)² + g(q)² over q: the lower envelope of parabolas,
//! found in integers and in linear time. Values are copied, never mixed.
//!
//! Based on: Arnold Meijster, Jos Roerdink and Wim Hesselink, "A General Algorithm for Computing Distance Transforms in Linear
//! Time", 2000.

use std::ops::Range;

use rayon::prelude::*;

use crate::bake::atlas::TexelReceiver;

/// Rows that one task extends at least.
const BAND_ROWS: u32 = 64;

/// The row of a column without a covered texel in reach.
const NONE: u32 = u32::MAX;

/// An image of size x size texels with C channels.
#[derive(Debug, Clone, PartialEq)]
pub struct TexelImage<const C: usize> {
    size: u32,
    values: Vec<[f32; C]>,
    covered: Vec<bool>,
}

impl<const C: usize> TexelImage<C> {
    /// An image in which nothing is covered: all values are NaN. `size` is that of an [`crate::bake::atlas::Atlas`].
    #[must_use]
    pub fn new(size: u32) -> Self {
        let texels = size as usize * size as usize;
        Self { size, values: vec![[f32::NAN; C]; texels], covered: vec![false; texels] }
    }

    /// Texels along each side.
    #[must_use]
    pub fn size(&self) -> u32 {
        self.size
    }

    /// The values, row by row, row 0 on top; NaN where nothing was baked or extended.
    #[must_use]
    pub fn values(&self) -> &[[f32; C]] {
        &self.values
    }

    /// Which texels have receivers. Extension changes none.
    #[must_use]
    pub fn covered(&self) -> &[bool] {
        &self.covered
    }

    /// Covers the texels of some receivers, as a band has them: each becomes the mean of its receivers' values. Sums are made
    /// in f64 and in the order of the receivers.
    ///
    /// # Panics
    /// When there are not as many values as receivers, or a texel lies outside.
    pub fn cover(&mut self, receivers: &[TexelReceiver], values: &[[f32; C]]) {
        assert_eq!(receivers.len(), values.len(), "one value for each receiver");
        let mut values = values.iter();
        for of_texel in receivers.chunk_by(|one, other| one.texel == other.texel) {
            let mut sum = [0.0; C];
            for value in values.by_ref().take(of_texel.len()) {
                sum.iter_mut().zip(value).for_each(|(sum, &value)| *sum += f64::from(value));
            }
            let texel = of_texel[0].texel as usize;
            // Exact: there are fewer than 2⁵³ of them.
            self.values[texel] = sum.map(|sum| (sum / of_texel.len() as f64) as f32);
            self.covered[texel] = true;
        }
    }

    /// Extends the covered texels: each uncovered one whose centre lies within `margin` texels of that of a covered one takes
    /// the value of the nearest. Of equals it is the one farthest to the left, then the upper one.
    ///
    /// Covered texels keep their values. O(texels) time for any margin, in parallel; 8 bytes per texel of a few hundred rows.
    pub fn extend(&mut self, margin: u32) {
        // A diagonal is shorter.
        let margin = margin.min(2 * self.size);
        let rows = BAND_ROWS.max(margin.saturating_mul(2));
        let bands: Vec<u32> = (0..self.size).step_by(rows as usize).collect();
        // A few bands at a time bound the memory. Sources are covered and targets are not, so that no band sees another's.
        for bands in bands.chunks(rayon::current_num_threads()) {
            let of_band = |&first: &u32| self.sources(first..(first + rows).min(self.size), margin);
            let copies: Vec<Vec<[u32; 2]>> = bands.par_iter().map(of_band).collect();
            for [target, source] in copies.into_iter().flatten() {
                self.values[target as usize] = self.values[source as usize];
            }
        }
    }

    /// For the uncovered texels of some rows that have a covered one within the margin: which, and the nearest of those.
    fn sources(&self, rows: Range<u32>, margin: u32) -> Vec<[u32; 2]> {
        let nearest_rows = self.nearest_rows(rows.clone(), margin);
        let mut sources = Vec::new();
        let mut envelope = Envelope::default();
        for (row, nearest_rows) in rows.zip(nearest_rows.chunks_exact(self.size as usize)) {
            envelope.build(row, nearest_rows, self.size);
            let mut parabolas = envelope.0.iter().peekable();
            let mut at = None;
            for column in 0..self.size {
                while let Some(next) = parabolas.next_if(|next| next.from <= column) {
                    at = Some(*next);
                }
                let Some(nearest) = at else { break };
                let texel = row * self.size + column;
                if !self.covered[texel as usize]
                    && nearest.at(column) <= i64::from(margin) * i64::from(margin)
                {
                    sources.push([texel, nearest_rows[nearest.column as usize] * self.size + nearest.column]);
                }
            }
        }
        sources
    }

    /// For each texel of some rows, the row of the nearest covered texel in its column within the margin, or [`NONE`]. Of
    /// equals it is the upper one.
    fn nearest_rows(&self, rows: Range<u32>, margin: u32) -> Vec<u32> {
        let size = self.size as usize;
        let mut nearest = vec![NONE; rows.len() * size];
        let mut last = vec![NONE; size];
        let mut visit = |row: u32, is_closer: fn(u32, u32) -> bool| {
            for column in 0..size {
                if self.covered[row as usize * size + column] {
                    last[column] = row;
                }
                let within = last[column] != NONE && last[column].abs_diff(row) <= margin;
                if within && rows.contains(&row) {
                    let found = &mut nearest[(row - rows.start) as usize * size + column];
                    let distance = last[column].abs_diff(row);
                    if *found == NONE || is_closer(distance, found.abs_diff(row)) {
                        *found = last[column];
                    }
                }
            }
        };
        let reach = rows.start.saturating_sub(margin)..rows.end.saturating_add(margin).min(self.size);
        reach.clone().for_each(|row| visit(row, |_, _| true));
        // Below the lowest covered texel of a column `last` still holds it: what was found from above.
        reach.rev().for_each(|row| visit(row, |below, above| below < above));
        nearest
    }
}

/// The squared distance of a column from a covered texel: a parabola.
#[derive(Debug, Clone, Copy)]
struct Parabola {
    /// The first column at which it is the least.
    from: u32,
    /// Its column.
    column: u32,
    /// Its least value.
    squared: i64,
}

impl Parabola {
    /// Its value at a column.
    fn at(&self, column: u32) -> i64 {
        let apart = i64::from(column) - i64::from(self.column);
        apart * apart + self.squared
    }

    /// The last column at which it is not more than one farther to the right; may lie outside of the image.
    fn last_before(&self, other: &Self) -> i64 {
        let (i, u) = (i64::from(self.column), i64::from(other.column));
        (u * u - i * i + other.squared - self.squared).div_euclid(2 * (u - i))
    }
}

/// The lower envelope of the parabolas of a row, from left to right.
#[derive(Debug, Default)]
struct Envelope(Vec<Parabola>);

impl Envelope {
    /// Builds it for a row, from the rows of the nearest covered texels.
    fn build(&mut self, row: u32, nearest_rows: &[u32], size: u32) {
        self.0.clear();
        for (column, &nearest) in (0..size).zip(nearest_rows) {
            if nearest == NONE {
                continue;
            }
            let apart = i64::from(nearest.abs_diff(row));
            let mut parabola = Parabola { from: 0, column, squared: apart * apart };
            let is_hidden = |last: &mut Parabola| last.at(last.from) > parabola.at(last.from);
            while self.0.pop_if(is_hidden).is_some() {}
            if let Some(last) = self.0.last() {
                let from = last.last_before(&parabola) + 1;
                // It is nowhere the least within the image.
                if from >= i64::from(size) {
                    continue;
                }
                // In range: it is not the least at `last.from`, which is before.
                parabola.from = from as u32;
            }
            self.0.push(parabola);
        }
    }
}
