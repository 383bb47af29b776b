//! Height maps: images whose brightness is a height, and the range of heights over a rectangle of texture coordinates.
//!
//! Texel (i, j) has its centre at ((i + ½)/W, (j + ½)/H), row 0 on top. Heights between centres are bilinear, and the image
//! repeats. Such a height lies between the least and the greatest of its four texels, so over a rectangle it lies between those of
//! all texels around it. They are read from a pyramid: cell (x, y) of level l keeps the least and the greatest of the texels
//! 2ˡx .. 2ˡ(x + 1), 2ˡy .. 2ˡ(y + 1). At the level where a span of texels meets at most two cells, four cells answer.
//!
//! Based on: Lance Williams, "Pyramidal Parametrics", 1983; Art Tevs, Ivo Ihrke and Hans-Peter Seidel, "Maximum Mipmaps for Fast,
//! Accurate, and Scalable Dynamic Height Field Rendering", 2008.

use std::path::Path;

use crate::error::Error;
use crate::files::budget::Budget;
use crate::files::exr::{Samples, announced, read_exr};
use crate::files::png::read_png_gray16;

/// Bytes of a texel while a map is made: its height, its range, and its share of the coarser levels, whose sum is a third.
const TEXEL_BYTES: u64 = 4 + 8 + 4;

/// Heights, of a PNG from 0 (black) to 1 (white), linear in the numbers of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The levels of the pyramid; the least and the greatest are equal on level 0.
    levels: Vec<Level>,
}

/// A level of the pyramid, row by row.
#[derive(Debug, Clone, PartialEq)]
struct Level {
    width: usize,
    height: usize,
    ranges: Vec<[f32; 2]>,
}

impl HeightMap {
    /// A map of `width` columns; heights row by row, row 0 on top, finite.
    ///
    /// # Panics
    /// When there is no texel, or the last row is not whole.
    #[must_use]
    pub fn new(width: usize, heights: &[f32]) -> Self {
        assert!(
            width > 0 && !heights.is_empty() && heights.len().is_multiple_of(width),
            "whole rows of texels"
        );
        let ranges = heights.iter().map(|&height| [height; 2]).collect();
        let mut levels = vec![Level { width, height: heights.len() / width, ranges }];
        while let Some(last) = levels.last()
            && last.ranges.len() > 1
        {
            let next = last.coarser();
            levels.push(next);
        }
        Self { levels }
    }

    /// Reads a PNG of any depth, whose colours become their luminance, or the heights of an EXR as they are: its channel Y, else
    /// R, else the only one.
    ///
    /// # Errors
    /// [`Error::Input`] when there is no such file, it is cut off or neither of both, or an EXR has no such channel or a height
    /// that is not finite.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_within(path, None)
    }

    /// The same in so many bytes, or in half of what [`available_memory`](crate::files::available_memory) tells. A few bytes of a
    /// file can stand for an image of gigabytes.
    ///
    /// # Errors
    /// As [`read`](Self::read); [`Error::Limit`] when it would take more, with what would be needed.
    pub fn read_within(path: &Path, max_memory: Option<u64>) -> Result<Self, Error> {
        let budget = Budget::new(max_memory);
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
            // Samples as they are decoded, as they are kept, and at worst a height for every two bytes.
            let bytes = announced(path).saturating_mul(3 + TEXEL_BYTES / 2);
            budget.check(bytes, "the image").map_err(|problem| budget.error(problem, path))?;
            return Self::read_exr(path);
        }
        let (width, _, levels) = read_png_gray16(path, TEXEL_BYTES, &budget)?;
        let heights: Vec<f32> =
            levels.into_iter().map(|level| f32::from(level) / f32::from(u16::MAX)).collect();
        Ok(Self::new(width as usize, &heights))
    }

    fn read_exr(path: &Path) -> Result<Self, Error> {
        let refused = |problem: String, remedy: &str| Error::Input {
            path: path.to_owned(),
            line: None,
            problem,
            remedy: remedy.into(),
        };
        let (width, _, mut channels) = read_exr(path)?;
        let named = |name: &str| channels.iter().position(|channel| channel.name == name);
        let place = named("Y").or_else(|| named("R")).or((channels.len() == 1).then_some(0));
        let Some(place) = place else {
            let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
            let problem = format!("no channel Y or R is among {}", names.join(", "));
            return Err(refused(problem, "name the channel of heights Y, or write it alone"));
        };
        let heights = match channels.swap_remove(place).samples {
            Samples::F32(heights) => heights,
            Samples::U32(heights) => heights.into_iter().map(|height| height as f32).collect(),
        };
        if let Some(texel) = heights.iter().position(|height| !height.is_finite()) {
            let (x, y) = (texel % width, texel / width);
            let problem = format!("the height at column {x} of row {y} is {}", heights[texel]);
            return Err(refused(problem, "write finite heights"));
        }
        Ok(Self::new(width, &heights))
    }

    /// The height at (u, v), v running down from row 0.
    #[must_use]
    pub fn at(&self, uv: [f64; 2]) -> f64 {
        let base = &self.levels[0];
        let [(x, s), (y, t)] = [(uv[0], base.width), (uv[1], base.height)].map(|(place, count)| {
            let place = in_texels(place, count);
            (place.floor(), place - place.floor())
        });
        let texel = |i: f64, j: f64| {
            f64::from(base.ranges[base.place(wrap(x + i, base.width), wrap(y + j, base.height))][0])
        };
        let row = |j: f64| texel(0.0, j) * (1.0 - s) + texel(1.0, j) * s;
        row(0.0) * (1.0 - t) + row(1.0) * t
    }

    /// The least and the greatest height over u from `lo[0]` to `hi[0]` and v from `lo[1]` to `hi[1]`, or a little more.
    pub(crate) fn range(&self, lo: [f64; 2], hi: [f64; 2]) -> [f64; 2] {
        let base = &self.levels[0];
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for columns in spans(lo[0], hi[0], base.width) {
            for rows in spans(lo[1], hi[1], base.height) {
                let found = self.of_texels(columns, rows);
                range = [range[0].min(found[0]), range[1].max(found[1])];
            }
        }
        // Four products and their sums err by less than this part of the greatest.
        let slack = 1e-14 * f64::from(range[0].abs().max(range[1].abs()));
        [f64::from(range[0]) - slack, f64::from(range[1]) + slack]
    }

    /// The range of the texels from the first to the last of each, both included.
    fn of_texels(&self, columns: [usize; 2], rows: [usize; 2]) -> [f32; 2] {
        let fits = |level: usize, [first, last]: [usize; 2]| (last >> level) - (first >> level) <= 1;
        let level = (0..self.levels.len()).find(|&l| fits(l, columns) && fits(l, rows));
        let level = level.unwrap_or(self.levels.len() - 1);
        let cells = &self.levels[level];
        let mut range = [f32::INFINITY, f32::NEG_INFINITY];
        for y in rows[0] >> level..=rows[1] >> level {
            for x in columns[0] >> level..=columns[1] >> level {
                let [least, greatest] = cells.ranges[cells.place(x, y)];
                range = [range[0].min(least), range[1].max(greatest)];
            }
        }
        range
    }
}

impl Level {
    fn place(&self, x: usize, y: usize) -> usize {
        y * self.width + x
    }

    /// The next level: half as many cells per side, rounded up.
    fn coarser(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; width * height];
        for y in 0..self.height {
            for x in 0..self.width {
                let (cell, [least, greatest]) =
                    (&mut ranges[y / 2 * width + x / 2], self.ranges[self.place(x, y)]);
                *cell = [cell[0].min(least), cell[1].max(greatest)];
            }
        }
        Self { width, height, ranges }
    }
}

/// A texture coordinate in texels, so that centres are whole numbers. Monotone.
fn in_texels(place: f64, count: usize) -> f64 {
    place * count as f64 - 0.5
}

/// A whole number as the index of a texel of an axis that repeats.
fn wrap(index: f64, count: usize) -> usize {
    // In range after the remainder; the cast of NaN is 0.
    (index.rem_euclid(count as f64) as usize).min(count - 1)
}

/// The texels around an interval of a texture coordinate: one span, or two where the image begins again.
fn spans(lo: f64, hi: f64, count: usize) -> impl Iterator<Item = [usize; 2]> {
    let (first, last) = (in_texels(lo, count).floor(), in_texels(hi, count).floor() + 1.0);
    let some = last - first < (count - 1) as f64;
    let (start, end) = (wrap(first, count), wrap(last, count));
    let spans = match (some, start <= end) {
        (false, _) => [Some([0, count - 1]), None],
        (true, true) => [Some([start, end]), None],
        (true, false) => [Some([start, count - 1]), Some([0, end])],
    };
    spans.into_iter().flatten()
}
