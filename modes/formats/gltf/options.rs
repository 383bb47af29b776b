//! How a glTF file is read, and where the parts of its scene come from.

use std::ops::Range;

/// How to read a glTF file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GltfOptions {
    /// Leave out triangles with a NaN or infinite position and warn, instead of refusing the file. The position itself
    /// becomes the origin, so that vertices stay those of the file.
    pub drop_non_finite: bool,
    /// The set of texture coordinates: n of `TEXCOORD_n`. An occlusion texture will name it, too.
    pub uv_set: u32,
    /// Open the buffers that the file names in other folders, too. Without this a name that leads out of the file's folder
    /// is refused: a file of unknown origin could copy what it names into an output.
    pub allow_outside: bool,
    /// The most bytes that reading may take; without it half of what
    /// [`available_memory`](crate::files::available_memory) tells.
    pub max_memory: Option<u64>,
}

/// Where a part of a scene comes from: one primitive of a mesh at one node.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct GltfOrigin {
    /// Index into the file's `nodes`.
    pub node: usize,
    /// Which of the places that `EXT_mesh_gpu_instancing` gives the node's mesh; 0 without it.
    pub instance: u32,
    /// Index into the file's `meshes`.
    pub mesh: usize,
    /// Index into the mesh's `primitives`.
    pub primitive: usize,
    /// Its triangles in the scene. Empty where all were dropped.
    pub triangles: Range<u32>,
    /// Its vertices: indices into [`crate::scene::Scene::positions`], in the order of the primitive's accessors. Primitives of one node
    /// that share their accessors share this range.
    pub vertices: Range<u32>,
    /// Whether it has the set of texture coordinates that was asked for.
    pub has_uvs: bool,
}
