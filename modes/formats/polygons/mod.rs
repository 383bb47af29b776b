//! Polygons of a file and how they become the triangles of a scene: what readers of OBJ, PLY and OFF share.

pub(crate) mod clip_ring;
pub(crate) mod corner_tree;
pub(crate) mod cut;
pub(crate) mod ear_clip;
pub(crate) mod faces;

use umbel_core::glam::DVec3;

use crate::error::Problem;
use crate::formats::offset;
use crate::formats::polygons::cut::{Cut, take_faces};
use crate::formats::polygons::faces::Faces;
use crate::scene::{NO_INDEX, Scene};

/// The polygons of a file, for a scene that has their positions, normals and texture coordinates already.
pub(crate) struct PolygonSource<'a> {
    /// All faces, in the order of the file.
    pub(crate) faces: &'a [Faces],
    /// The positions of the file in f64; NaN where one is no number. Only scenes far from the origin ask for them.
    pub(crate) wide: &'a dyn Fn() -> Vec<DVec3>,
    /// The line in which a position stands, counted from 1, where that is known.
    pub(crate) line_of: &'a dyn Fn(usize) -> Option<u64>,
}

impl PolygonSource<'_> {
    /// Cuts the faces into triangles of the scene, and moves a scene that is far away. `starts` are the faces before each part
    /// of the file, ascending. Returns the first triangle of each part, and behind them the number of triangles.
    ///
    /// Positions that are not finite are refused, or left out with their faces; texture coordinates and normals that are not finite
    /// become 0.
    pub(crate) fn cut_into(
        &self,
        scene: &mut Scene,
        starts: &[usize],
        drop_non_finite: bool,
    ) -> Result<Vec<u32>, Problem> {
        let mended = [(mend(&mut scene.uvs), "texture coordinate"), (mend(&mut scene.normals), "normal")];
        for (count, what) in mended.into_iter().filter(|&(count, _)| count > 0) {
            scene.warnings.push(format!("{what}s that are not finite become 0: {count}"));
        }
        let spoilt = self.find_non_finite(scene, drop_non_finite)?;
        let mut cut = take_faces(scene, self.faces, starts, &spoilt)?;
        if offset::is_in_doubt(scene) {
            offset::settle(scene, &(self.wide)());
            // How polygons are cut depends on their shape, which is seen only now.
            if scene.offset != DVec3::ZERO {
                cut = take_faces(scene, self.faces, starts, &spoilt)?;
            }
        }
        let Cut { firsts, dropped, dropped_vertices } = cut;
        if dropped_vertices > 0 {
            scene.warnings.push(format!(
                "vertices that are not finite: {dropped_vertices}; triangles left out with them: {dropped}"
            ));
        }
        for indices in [&mut scene.uv_indices, &mut scene.normal_indices] {
            if indices.iter().flatten().all(|&index| index == NO_INDEX) {
                indices.clear();
            }
        }
        Ok(firsts)
    }

    /// The positions that are not finite, one flag each, once they are replaced; empty where all are finite.
    fn find_non_finite(&self, scene: &mut Scene, drop_non_finite: bool) -> Result<Vec<bool>, Problem> {
        let is_spoilt = |position: &[f32; 3]| !position.iter().all(|x| x.is_finite());
        let Some(first) = scene.positions.iter().position(is_spoilt) else {
            return Ok(Vec::new());
        };
        if !drop_non_finite {
            return Err(Problem {
                line: (self.line_of)(first),
                what: format!("vertex {} has a coordinate that is NaN or infinite", first + 1),
                remedy: "Correct it, or leave out such faces: LoadOptions::drop_non_finite.",
            });
        }
        let spoilt = scene.positions.iter().map(is_spoilt).collect();
        mend(&mut scene.positions);
        Ok(spoilt)
    }
}

/// Sets vectors with a NaN or infinite component to 0 and counts them.
fn mend<const N: usize>(vectors: &mut [[f32; N]]) -> usize {
    let spoilt = vectors.iter_mut().filter(|vector| !vector.iter().all(|x| x.is_finite()));
    spoilt.map(|vector| *vector = [0.0; N]).count()
}
