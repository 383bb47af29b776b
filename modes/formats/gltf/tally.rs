//! What a reader of glTF leaves out or mends, counted and said.

use crate::scene::Scene;

/// What is left out or mended, to be counted in warnings.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    /// Primitives that are points, lines or without positions.
    pub(crate) not_triangles: usize,
    /// Indices behind the last whole triangle.
    pub(crate) left_over: usize,
    /// Positions that are not finite, and triangles that have such.
    pub(crate) spoilt: usize,
    pub(crate) dropped: usize,
    /// Normals and texture coordinates that are not finite.
    pub(crate) normals: usize,
    pub(crate) uvs: usize,
    /// Primitives of skinned nodes that no joint moves.
    pub(crate) jointless: usize,
    /// Vertices without weights.
    pub(crate) unbound: usize,
    /// Nodes that have both a skin and instances.
    pub(crate) skinned_copies: usize,
    /// Primitives whose morph targets would move texture coordinates.
    pub(crate) moved_uvs: usize,
}

impl Tally {
    /// Notes everything in the scene's warnings.
    pub(crate) fn warn(&self, scene: &mut Scene) {
        let counts = [
            (self.not_triangles, "primitives that are points, lines or without positions are left out"),
            (self.left_over, "indices behind the last whole triangle are left out"),
            (self.normals, "normals that are not finite become 0"),
            (self.uvs, "texture coordinates that are not finite become 0"),
            (self.jointless, "primitives of skinned nodes without joints stand where their node does"),
            (self.unbound, "skinned vertices without weights follow their first joint"),
            (self.skinned_copies, "skinned nodes with instances stand once each"),
            (self.moved_uvs, "morph targets of texture coordinates are ignored, in primitives"),
        ];
        for (count, what) in counts.into_iter().filter(|&(count, _)| count > 0) {
            scene.warnings.push(format!("{what}: {count}"));
        }
        if self.spoilt > 0 {
            let Self { spoilt, dropped, .. } = self;
            scene.warnings.push(format!(
                "vertices that are not finite: {spoilt}; triangles left out with them: {dropped}"
            ));
        }
        if scene.triangles.is_empty() {
            let what = format!("the file has no triangles ({} vertices)", scene.positions.len());
            scene.warnings.push(what);
        }
    }
}
