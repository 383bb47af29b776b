//! What is wrong with the texture coordinates of a scene, as far as baking is concerned.
//!
//! *Overlap* is found at the sub-positions of the texels: one that two triangles hold lies in the interior of both
//! (`texel_coverage.rs`), so nothing is reported that does not overlap; what overlaps between sub-positions only is not seen.
//! *Mirrored* is a triangle whose corners turn right in the texture: −u against u. Alone that is harmless.
//!
//! A chart lies in another *tile* if all of it lies in one unit square other than \[0, 1\]²: tiles (UDIM), or halves moved out on
//! purpose.

use std::collections::BTreeMap;

use rayon::prelude::*;
use umbel_core::TriangleId;

use crate::bake::atlas::Atlas;
use crate::bake::atlas::block::{Block, Share};

/// Surfaces that fill a texel after which no others are looked for: scenes whose textures repeat have thousands.
const FILLS: u32 = 4;

/// Tiles that a warning lists by name.
const LISTED_TILES: usize = 4;

/// Counts of what an atlas covers and of what is odd in it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UvCheck {
    /// Texels of the image.
    pub texels: u64,
    /// Texels with a receiver.
    pub covered: u64,
    /// The area of all charts in the texture, wherever they lie, in images: [`Atlas::charts_area`].
    pub charts_area: f64,
    /// Texels in which several triangles hold one sub-position.
    pub overlapping: u64,
    /// Those in which one of these triangles is mirrored and another is not. Where more than four fill the texel, it is found
    /// among the charts with the smallest ids.
    pub mirrored_overlap: u64,
    /// Triangles in all.
    pub triangles: usize,
    /// Triangles with a corner that has no texture coordinate, or none that is finite.
    pub without_uvs: usize,
    /// Triangles with texture coordinates that have no area in the texture.
    pub flat: usize,
    /// Triangles with texture coordinates that have no area in space: never baked.
    pub without_area: usize,
    /// Triangles with a corner outside of \[0, 1\]².
    pub outside: usize,
    /// Charts.
    pub charts: u32,
    /// Charts without area in the texture.
    pub flat_charts: u32,
    /// Mirrored charts.
    pub mirrored_charts: u32,
    /// Charts that lie wholly in another tile than (0, 0), by tile (column, row), in the order of rows.
    pub other_tiles: Vec<([i64; 2], u32)>,
}

/// Looks through an atlas. O(texels · samples + triangles) time, in parallel.
#[must_use]
pub fn check_uvs(atlas: &Atlas<'_>) -> UvCheck {
    let scene = atlas.layout.scene;
    let [covered, overlapping, mirrored_overlap] = atlas
        .blocks(0..atlas.size())
        .map(texel_counts)
        .reduce(|| [0; 3], |one, other| [0, 1, 2].map(|k| one[k] + other[k]));
    let turns = &atlas.layout.charts.turns;
    let charts_that_turn = |turn: i8| turns.iter().filter(|&&of_chart| of_chart == turn).count() as u32;
    let mut check = UvCheck {
        texels: u64::from(atlas.size()) * u64::from(atlas.size()),
        covered,
        charts_area: atlas.charts_area(),
        overlapping,
        mirrored_overlap,
        triangles: scene.triangles.len(),
        charts: atlas.charts(),
        flat_charts: charts_that_turn(0),
        mirrored_charts: charts_that_turn(-1),
        other_tiles: other_tiles(atlas),
        ..UvCheck::default()
    };
    let geometry = scene.geometry().ok();
    for id in (0_u32..).zip(&scene.triangles).map(|(id, _)| TriangleId(id)) {
        let (Some(corners), Some(chart)) = (scene.uv_corners(id), atlas.chart(id)) else {
            check.without_uvs += 1;
            continue;
        };
        check.flat += usize::from(turns[chart as usize] == 0);
        check.without_area +=
            usize::from(geometry.as_ref().is_some_and(|geometry| geometry.is_degenerate(id)));
        check.outside += usize::from(corners.as_flattened().iter().any(|x| !(0.0..=1.0).contains(x)));
    }
    check
}

/// The texels of a block that are covered, overlapping, and overlapping with a mirrored triangle.
fn texel_counts(mut block: Block<'_>) -> [u64; 3] {
    let mut counts = [0; 3];
    block.for_each_texel(FILLS, |_, shares| {
        let held = |turn: i8| {
            let of_turn = shares.iter().filter(move |share| share.footprint.turn == turn);
            of_turn.fold([0_u64; 2], |[once, twice], &Share { held, .. }| [once | held, twice | once & held])
        };
        let (plain, mirrored) = (held(1), held(-1));
        let both = plain[0] & mirrored[0];
        counts[0] += 1;
        counts[1] += u64::from(plain[1] | mirrored[1] | both != 0);
        counts[2] += u64::from(both != 0);
    });
    counts
}

/// How many charts lie wholly in each tile other than (0, 0).
fn other_tiles(atlas: &Atlas<'_>) -> Vec<([i64; 2], u32)> {
    let mut bounds = vec![[[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]; atlas.charts() as usize];
    for (id, _) in (0_u32..).zip(&atlas.layout.scene.triangles) {
        let id = TriangleId(id);
        if let (Some(corners), Some(chart)) = (atlas.layout.scene.uv_corners(id), atlas.chart(id)) {
            let [lo, hi] = &mut bounds[chart as usize];
            for (corner, k) in corners.iter().flat_map(|corner| [(corner, 0), (corner, 1)]) {
                (lo[k], hi[k]) = (lo[k].min(corner[k]), hi[k].max(corner[k]));
            }
        }
    }
    let mut tiles = BTreeMap::new();
    for [lo, hi] in bounds {
        let tile = lo.map(f32::floor);
        let is_whole = [0, 1].iter().all(|&k| hi[k] <= tile[k] + 1.0);
        // What touches the unit square from a point on its border is of that square.
        let is_unit = [0, 1].iter().all(|&k| lo[k] >= 0.0 && hi[k] <= 1.0);
        if is_whole && !is_unit {
            // Saturates: so far away it is no tile that anyone looks for.
            let [column, row] = tile.map(|x| x as i64);
            *tiles.entry((row, column)).or_insert(0) += 1;
        }
    }
    tiles.into_iter().map(|((row, column), charts)| ([column, row], charts)).collect()
}

impl UvCheck {
    /// The part of the charts' area that has texels of its own, at most 1: what repeats, overlaps, or lies outside of the
    /// image has none. 1/2 where every chart lies on its mirrored other half.
    #[must_use]
    pub fn own_part(&self) -> f64 {
        let covered = self.covered as f64 / self.texels as f64;
        if self.charts_area > covered { covered / self.charts_area } else { 1.0 }
    }

    /// What a user should know before baking, one sentence each, with what to do about it.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let (covered, triangles) = (self.covered, self.triangles);
        let alike = self.overlapping - self.mirrored_overlap;
        let found = [
            (alike > 0).then(|| {
                format!(
                    "surfaces share texels, which show one of them only: {alike} of {covered} covered texels; unwrap \
                     without overlap, or bake per vertex"
                )
            }),
            (self.mirrored_overlap > 0).then(|| {
                format!(
                    "mirrored surfaces share texels, which show one side only: {} of {covered} covered texels; give \
                     each side texels of its own, or move one side out by a whole unit where both look alike",
                    self.mirrored_overlap
                )
            }),
            (self.without_uvs > 0).then(|| {
                format!(
                    "triangles without texture coordinates are not baked: {} of {triangles}; unwrap them, or bake per \
                     vertex",
                    self.without_uvs
                )
            }),
            (self.flat > 0).then(|| {
                format!(
                    "triangles without area in the texture have no texels of their own: {} of {triangles}; unwrap them",
                    self.flat
                )
            }),
            (self.outside > 0).then(|| {
                format!(
                    "texture coordinates outside of 0 to 1 are not baked there: {} of {triangles} triangles{}",
                    self.outside,
                    self.tiles()
                )
            }),
        ];
        found.into_iter().flatten().collect()
    }

    /// Which other tiles hold whole charts, and what to do with what lies outside.
    fn tiles(&self) -> String {
        let names = self.other_tiles.iter().take(LISTED_TILES);
        let names: Vec<String> = names.map(|([u, v], charts)| format!("({u}, {v}): {charts}")).collect();
        let more = if self.other_tiles.len() > LISTED_TILES { ", ..." } else { "" };
        if names.is_empty() {
            return "; move the charts into the unit square".to_owned();
        }
        let names = names.join(", ");
        format!("; charts in other tiles: {names}{more}; move a tile to (0, 0) to bake it")
    }
}
