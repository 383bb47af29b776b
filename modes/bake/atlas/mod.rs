//! A texture atlas as a set of receivers: which points of the surface stand for which texels of a baked image.
//!
//! *Coverage* is conservative: a texel is covered iff its closed square touches the footprint of a triangle in the texture,
//! decided exactly (`texel_coverage.rs`). Filtered look-ups anywhere on the surface therefore read baked texels, up to the
//! half texel by which bilinear filters look beyond a chart: that is the margin's ([`crate::bake::atlas::image::TexelImage::extend`]).
//!
//! *Samples.* A texel has S sub-positions, a Hammersley set; one alone is the centre. Each triangle of the texel's chart that
//! holds one of them gives a receiver there, and the texel's value is the mean of its receivers: every receiver stands for
//! 1/S of the texel's area, so that the mean is weighted by coverage. A texel whose chart holds none of them has one receiver:
//! the chart's point nearest to its centre in the texture.
//!
//! *Ownership.* Charts (`charts.rs`) are never mixed. Where several touch a texel, the one that holds most sub-positions
//! owns it, then the smaller chart id. Where none holds any, the one nearest to the centre does, and charts without area in
//! the texture come last: a triangle shrunk to a point or a segment is looked up there, so its texels are covered, but it
//! never takes a texel from a surface with area.
//!
//! A chart that fills a texel owns it whatever follows, so later charts are not looked at there: scenes whose textures repeat
//! have thousands. (One of 88,000 triangles took more than six minutes of CPU time without that, for 1024² texels of 4
//! samples; 0.7 s with it.)
//!
//! *Not baked* are triangles without texture coordinates; triangles without area in space, which have no sides; and what lies
//! outside of \[0, 1\]², without wrapping: mirrored or repeated halves are moved out by a whole unit on purpose, so that they
//! are not baked twice. What only touches the border of \[0, 1\]² from outside counts as outside.
//!
//! Based on: Jon Hasselgren, Tomas Akenine-Möller and Lennart Ohlsson, "Conservative Rasterization", GPU Gems 2, 2005;
//! ands, "lightmapper", 2015 (receivers clamped into their triangles).

pub(crate) mod block;
pub(crate) mod charts;
pub mod image;
pub mod layout;
pub(crate) mod texel_coverage;
pub mod uv_check;

use std::ops::Range;
use std::path::PathBuf;

use rayon::prelude::*;
use umbel_core::{TriangleId, Triangles};

use crate::bake::atlas::block::{Block, Share};
use crate::bake::atlas::layout::{AtlasOptions, Layout};
use crate::bake::atlas::texel_coverage::{Footprint, Point};
use crate::error::Error;
use crate::scene::Scene;

/// Rows of texels that are made together.
const BLOCK_ROWS: u32 = 16;

/// A point of the surface that stands for a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexelReceiver {
    /// The texel: row · size + column, row 0 on top of the image.
    pub texel: u32,
    /// The triangle that it lies on: one with area.
    pub triangle: TriangleId,
    /// The barycentric weights of the corners b and c.
    weights: [f32; 2],
}

impl TexelReceiver {
    /// Rounds the weights of b and c down, so that they are never more than 1 together.
    fn new(texel: u32, triangle: TriangleId, [_, b, c]: [f64; 3]) -> Self {
        let down = |weight: f64| {
            let rounded = weight as f32;
            if f64::from(rounded) > weight { rounded.next_down() } else { rounded }
        };
        Self { texel, triangle, weights: [down(b), down(c)] }
    }

    /// The barycentric weights of a, b and c: not negative, their sum 1. [`Triangles::leave`] takes them.
    #[must_use]
    pub fn barycentrics(&self) -> [f64; 3] {
        let [b, c] = self.weights.map(f64::from);
        [(1.0 - (b + c)).max(0.0), b, c]
    }
}

/// The receivers of a baked image, made band by band: an atlas holds triangles, not texels.
#[derive(Debug)]
pub struct Atlas<'a> {
    pub(crate) layout: Layout<'a>,
    /// For each block of rows, where its triangles start in `listed`; then the end.
    starts: Vec<usize>,
    /// The triangles that are baked and whose bounds touch a block, in ascending order; block by block.
    listed: Vec<u32>,
}

impl<'a> Atlas<'a> {
    /// Finds the charts of a scene and sorts its triangles by rows. O(n log n) time; about 8 bytes per triangle, and 80 more on
    /// the way.
    ///
    /// # Errors
    /// [`Error::Usage`] for options out of range. [`Error::Input`] where nothing can be baked: no triangles, none with texture
    /// coordinates, all of them outside of \[0, 1\]², or all without area. [`Error::Engine`] as [`Scene::geometry`].
    pub fn new(scene: &'a Scene, options: &AtlasOptions) -> Result<Self, Error> {
        let layout = Layout::new(scene, options)?;
        let geometry = scene.geometry()?;
        let mut atlas = Self { layout, starts: Vec::new(), listed: Vec::new() };
        atlas.list(&geometry);
        if atlas.listed.is_empty() {
            return Err(nothing_to_bake(&atlas.layout));
        }
        Ok(atlas)
    }

    /// Texels along each side.
    #[must_use]
    pub fn size(&self) -> u32 {
        self.layout.size()
    }

    /// Sub-positions per texel.
    #[must_use]
    pub fn samples(&self) -> u32 {
        self.layout.samples().len() as u32
    }

    /// The number of charts, those outside of the image included.
    #[must_use]
    pub fn charts(&self) -> u32 {
        // In range: each has a triangle.
        self.layout.charts.turns.len() as u32
    }

    /// The area of all charts in the texture, wherever they lie and however often they lie on each other: 1 is that of the
    /// image. O(triangles) time.
    #[must_use]
    pub fn charts_area(&self) -> f64 {
        let ids = (0_u32..).zip(&self.layout.scene.triangles).map(|(id, _)| TriangleId(id));
        // One after the other: a sum in parts would depend on the number of threads.
        ids.filter_map(|id| self.layout.scene.uv_corners(id)).map(area).fold(0.0, |sum, area| sum + area)
    }

    /// The chart of a triangle; `None` for one without texture coordinates. Ids rise with the first triangles of the charts.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn chart(&self, triangle: TriangleId) -> Option<u32> {
        self.layout.chart(triangle)
    }

    /// The receivers of some rows of the image: by texel, then by triangle, then by sub-position. Rows beyond the last are none.
    ///
    /// The receivers of all rows are those of any bands joined. 16 bytes each, at most `samples` per texel where charts do not
    /// overlap; O(texels · samples + rows · triangles in them) time, in parallel.
    #[must_use]
    pub fn band(&self, rows: Range<u32>) -> Vec<TexelReceiver> {
        let of_block = |mut block: Block<'_>| {
            let mut receivers = Vec::new();
            // A chart that fills a texel owns it, whatever follows.
            block.for_each_texel(1, |place, shares| self.receive(place, shares, &mut receivers));
            receivers
        };
        let parts: Vec<Vec<TexelReceiver>> = self.blocks(rows).map(of_block).collect();
        let mut all = Vec::with_capacity(parts.iter().map(Vec::len).sum());
        parts.into_iter().for_each(|mut part| all.append(&mut part));
        all
    }

    /// The blocks of some rows, cut to them.
    pub(crate) fn blocks(&self, rows: Range<u32>) -> impl IndexedParallelIterator<Item = Block<'_>> {
        let rows = rows.start..rows.end.min(self.layout.size()).max(rows.start);
        let blocks = rows.start / BLOCK_ROWS..rows.end.div_ceil(BLOCK_ROWS);
        let blocks = if rows.is_empty() { 0..0 } else { blocks };
        blocks.into_par_iter().map(move |block| {
            let first = block * BLOCK_ROWS;
            let within = rows.start.max(first)..rows.end.min(first + BLOCK_ROWS);
            let listed = self.starts[block as usize]..self.starts[block as usize + 1];
            Block::new(&self.layout, within, &self.listed[listed])
        })
    }

    /// Lists the triangles of each block: a counting sort.
    fn list(&mut self, geometry: &Triangles<'_>) {
        // In range: there are fewer than 2³² triangles.
        let ids = 0..geometry.len() as u32;
        let of_triangle = |id: u32| self.triangle_blocks(geometry, TriangleId(id));
        let blocks: Vec<Range<u32>> = ids.into_par_iter().map(of_triangle).collect();
        let mut starts = vec![0_usize; self.layout.size().div_ceil(BLOCK_ROWS) as usize + 1];
        blocks.iter().flat_map(Clone::clone).for_each(|block| starts[block as usize + 1] += 1);
        for block in 1..starts.len() {
            starts[block] += starts[block - 1];
        }
        let mut listed = vec![0; starts.last().copied().unwrap_or(0)];
        let mut next = starts.clone();
        for (triangle, blocks) in (0_u32..).zip(blocks) {
            for block in blocks {
                listed[next[block as usize]] = triangle;
                next[block as usize] += 1;
            }
        }
        (self.starts, self.listed) = (starts, listed);
    }

    /// The blocks whose rows a triangle's bounds touch; none for what is not baked.
    fn triangle_blocks(&self, geometry: &Triangles<'_>, triangle: TriangleId) -> Range<u32> {
        let Some(footprint) = self.layout.footprint(triangle) else { return 0..0 };
        let [columns, lines] = footprint.bounds(self.layout.size());
        if columns.is_empty() || lines.is_empty() || geometry.is_degenerate(triangle) {
            return 0..0;
        }
        let (one, other) = (self.layout.line(lines.start), self.layout.line(lines.end - 1));
        one.min(other) / BLOCK_ROWS..one.max(other) / BLOCK_ROWS + 1
    }

    /// Adds the receivers of a texel, given as (column, row), that `shares` touch.
    fn receive(&self, (column, row): (u32, u32), shares: &[Share], receivers: &mut Vec<TexelReceiver>) {
        let texel = row * self.layout.size() + column;
        let corner = Point { x: f64::from(column), y: f64::from(self.layout.line(row)) };
        let owners = most_covering(shares);
        if owners.is_empty() {
            let centre = Point { x: corner.x + 0.5, y: corner.y + 0.5 };
            let nearest = shares.iter().map(|share| (share, share.footprint.nearest(centre)));
            // Areas first, then distances; `shares` are in the order of charts and triangles, and the first of equals is taken.
            let is_flat = |share: &Share| share.footprint.turn == 0;
            let nearest = nearest.min_by(|(one, (_, near)), (other, (_, far))| {
                is_flat(one).cmp(&is_flat(other)).then(near.total_cmp(far))
            });
            receivers.extend(
                nearest.map(|(share, (weights, _))| TexelReceiver::new(texel, share.triangle, weights)),
            );
        }
        for share in owners {
            let held = (0_u32..).zip(self.layout.samples()).filter(|&(k, _)| share.held >> k & 1 == 1);
            receivers.extend(held.map(|(_, sample)| {
                let point = Point { x: corner.x + sample.x, y: corner.y + sample.y };
                TexelReceiver::new(texel, share.triangle, share.footprint.weights(point))
            }));
        }
    }
}

/// The area of a triangle of texture coordinates.
fn area(corners: [[f32; 2]; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
}

/// The shares of the chart that holds most sub-positions, the first of equals; none where none holds any.
fn most_covering(shares: &[Share]) -> &[Share] {
    let (mut most, mut owners) = (0, &shares[..0]);
    for of_chart in shares.chunk_by(|one, other| one.chart == other.chart) {
        let held = of_chart.iter().fold(0, |held, share| held | share.held).count_ones();
        if held > most {
            (most, owners) = (held, of_chart);
        }
    }
    owners
}

/// Why an atlas is empty, and what to do about it.
fn nothing_to_bake(layout: &Layout<'_>) -> Error {
    let footprints =
        || (0..layout.scene.triangles.len()).filter_map(|id| layout.footprint(TriangleId(id as u32)));
    let is_inside =
        |footprint: Footprint| footprint.bounds(layout.size()).iter().all(|range| !range.is_empty());
    let (problem, remedy) = if layout.scene.triangles.is_empty() {
        ("there are no triangles", "Give a scene that has some.")
    } else if footprints().next().is_none() {
        ("no triangle has texture coordinates", "Unwrap the mesh first, or bake per vertex.")
    } else if footprints().any(is_inside) {
        ("all triangles with texture coordinates have no area", "Check the positions of the mesh.")
    } else {
        ("all texture coordinates lie outside of 0 to 1", "Move the charts into the unit square.")
    };
    let path = PathBuf::from(&layout.scene.name);
    Error::Input { path, line: None, problem: problem.to_owned(), remedy: remedy.to_owned() }
}
