//! What is in a scene: counts, bounds, and what a user should know before rendering it.

use std::collections::HashSet;

use crate::scene::Scene;
use umbel_core::{Aabb, TriangleId};

/// Counts and bounds of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Info {
    /// Triangles, degenerate ones included.
    pub triangles: usize,
    /// Vertex positions.
    pub vertices: usize,
    /// Vertices that no triangle uses.
    pub unused_vertices: usize,
    /// Objects and groups.
    pub objects: usize,
    /// Materials.
    pub materials: usize,
    /// Triangles whose corners all have normals of the file.
    pub with_normals: usize,
    /// Triangles whose corners all have texture coordinates.
    pub with_uvs: usize,
    /// Triangles without area: exactly collinear or repeated corners. No ray hits them.
    pub degenerate: usize,
    /// Triangles whose three positions another triangle before them has as well, in any order.
    pub duplicates: usize,
    /// Vertices with a NaN or infinite coordinate.
    pub non_finite: usize,
    /// The box of all vertices that triangles use.
    pub bounds: Aabb,
}

/// Looks through a scene. O(n) time and memory.
#[must_use]
pub fn info(scene: &Scene) -> Info {
    let mut used = vec![false; scene.positions.len()];
    scene.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let complete = |indices: &[[u32; 3]]| {
        indices.iter().filter(|corners| !corners.contains(&crate::scene::NO_INDEX)).count()
    };
    let is_finite = |p: &&[f32; 3]| p.iter().all(|x| x.is_finite());
    let mut seen = HashSet::with_capacity(scene.triangles.len());
    let duplicates =
        scene.triangles.iter().filter(|corners| !seen.insert(position_key(scene, corners))).count();
    Info {
        triangles: scene.triangles.len(),
        vertices: scene.positions.len(),
        unused_vertices: used.iter().filter(|&&used| !used).count(),
        objects: scene.objects.len(),
        materials: scene.materials.len(),
        with_normals: complete(&scene.normal_indices),
        with_uvs: complete(&scene.uv_indices),
        degenerate: degenerate(scene),
        duplicates,
        non_finite: scene.positions.len() - scene.positions.iter().filter(is_finite).count(),
        bounds: scene.bounds(),
    }
}

/// Triangles without area, decided exactly; 0 when the scene cannot be checked because positions are not finite.
fn degenerate(scene: &Scene) -> usize {
    let Ok(triangles) = scene.geometry() else {
        return 0;
    };
    (0_u32..).zip(&scene.triangles).filter(|&(id, _)| triangles.is_degenerate(TriangleId(id))).count()
}

/// The bits of the three positions in ascending order; −0 counts as 0.
fn position_key(scene: &Scene, corners: &[u32; 3]) -> [[u32; 3]; 3] {
    let mut key = corners.map(|v| scene.positions[v as usize].map(|x| (x + 0.0).to_bits()));
    key.sort_unstable();
    key
}
