//! glTF 2.0 and GLB files: read as a scene, kept whole, and written back with ambient occlusion.
//!
//! ```no_run
//! use std::path::Path;
//! use umbel::formats::{GltfFile, GltfOptions, VertexTarget};
//!
//! let (mut file, scene) = GltfFile::read(Path::new("in.glb"), &GltfOptions::default())?;
//! let openness = vec![1.0; scene.positions.len()]; // one number a vertex, 1 = open
//! file.add_vertex_occlusion(&openness, VertexTarget::Ao)?;
//! file.write(Path::new("out.glb"))?;
//! # Ok::<(), umbel::Error>(())
//! ```
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021.

pub(crate) mod accessor;
pub(crate) mod buffers;
pub(crate) mod container;
pub(crate) mod document;
pub(crate) mod extensions;
pub(crate) mod instancing;
pub(crate) mod nodes;
pub(crate) mod optics;
pub mod options;
pub(crate) mod plan;
pub(crate) mod pose;
pub(crate) mod scene;
pub(crate) mod tally;
pub mod write;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use crate::error::{Error, Problem};
use crate::files::budget::Budget;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::container::{Container, open};
use crate::formats::gltf::document::Document;
use crate::formats::gltf::options::{GltfOptions, GltfOrigin};
use crate::formats::neighbours::{Neighbours, Resolver};
use crate::formats::offset;
use crate::formats::scene_file::{read_scene_file, stem};
use crate::scene::Scene;

/// A glTF or GLB file in memory, with all that it holds.
///
/// What is not understood (extensions, `extras`, animations) is written back as it was read, in its order; bytes of
/// buffers stay where they are, new ones are appended.
#[derive(Debug)]
pub struct GltfFile {
    pub(crate) path: PathBuf,
    pub(crate) is_glb: bool,
    pub(crate) json: Value,
    /// The bytes of the buffers, as far as the file or its neighbours have them.
    pub(crate) buffers: Vec<Option<Arc<Vec<u8>>>>,
    /// Whether the first of them is the BIN chunk.
    pub(crate) bin_is_first: bool,
    /// A BIN chunk that no buffer names.
    pub(crate) spare_bin: Option<Vec<u8>>,
    pub(crate) tail: Vec<u8>,
    /// The buffer that was added because there is no BIN chunk to append to.
    pub(crate) own_buffer: Option<usize>,
    pub(crate) origins: Vec<GltfOrigin>,
    pub(crate) uv_set: u32,
}

impl GltfFile {
    /// Reads a file and the buffers that it names, and makes a scene of its default scene.
    ///
    /// The scene has one position for each vertex of each instance of a mesh, in the world; one object for each primitive
    /// of each instance, named like its node or else its mesh; and all materials of the file, in its order. Triangles, strips
    /// and fans are read, with or without indices, also sparse and quantized (`KHR_mesh_quantization`). Skinned meshes stand
    /// where their joints stand in the file, morph targets at their default weights, and meshes of nodes with
    /// `EXT_mesh_gpu_instancing` at each of their places; animations are not played. What is left out is noted in
    /// [`Scene::warnings`].
    ///
    /// # Errors
    /// [`Error::Input`], with the place in the file, for what is not glTF 2.0, is cut off or contradicts itself, names files
    /// that cannot be read or lie outside of its folder ([`GltfOptions::allow_outside`]), requires an extension that is not
    /// known (compressed meshes are refused by name), and for positions that are not finite unless
    /// [`GltfOptions::drop_non_finite`] is set. [`Error::Limit`] when it would take more than [`GltfOptions::max_memory`].
    pub fn read(path: &Path, options: &GltfOptions) -> Result<(Self, Scene), Error> {
        let budget = Budget::new(options.max_memory);
        let mut neighbours = Neighbours::of(path, options.allow_outside, &budget);
        let bytes = read_scene_file(path, &budget);
        bytes
            .and_then(|bytes| Self::try_read((path, &bytes), options, &mut neighbours, &budget))
            .map_err(|problem| budget.error(problem, path))
    }

    /// The same for a file in memory: the bytes of a .gltf or a .glb. `name` stands for its path in messages and gives the
    /// scene its name; `resolver` gives the bytes of the buffers that it names.
    ///
    /// # Errors
    /// As [`read`](Self::read); what the resolver does not give is refused as a file that cannot be read.
    pub fn from_bytes(
        name: &str,
        bytes: &[u8],
        options: &GltfOptions,
        resolver: &mut Resolver<'_>,
    ) -> Result<(Self, Scene), Error> {
        let budget = Budget::new(options.max_memory);
        let mut neighbours = Neighbours::given(resolver, &budget);
        Self::try_read((Path::new(name), bytes), options, &mut neighbours, &budget)
            .map_err(|problem| budget.error(problem, Path::new(name)))
    }

    /// The file and the scene of its bytes.
    pub(crate) fn try_read(
        (path, bytes): (&Path, &[u8]),
        options: &GltfOptions,
        neighbours: &mut Neighbours<'_>,
        budget: &Budget,
    ) -> Result<(Self, Scene), Problem> {
        budget.take(container::forecast(bytes), "its JSON")?;
        let Container { is_glb, json, mut bin, tail } = open(bytes)?;
        extensions::check_required(&json)?;
        let document = Document::of(&json)?;
        let bin_is_first = bin.is_some() && document.buffers.first().is_some_and(|first| first.uri.is_none());
        let spare_bin = if bin_is_first { None } else { bin.take() };
        let buffers = buffers::load(&document.buffers, neighbours, bin, budget)?;
        let data = (Data::new(&document, &buffers), options);
        let mut built = scene::build(data, budget, false)?;
        if offset::is_in_doubt(&built.scene) {
            drop(built);
            built = scene::build(data, budget, true)?;
            offset::settle(&mut built.scene, &built.wide);
        }
        let scene::Built { mut scene, origins, .. } = built;
        scene.name = stem(path);
        let file = Self {
            path: path.to_owned(),
            is_glb,
            json,
            buffers,
            bin_is_first,
            spare_bin,
            tail,
            own_buffer: None,
            origins,
            uv_set: options.uv_set,
        };
        Ok((file, scene))
    }

    /// Where the parts of the scene come from, in its order. Ranges of triangles are disjoint and ascending, and cover all.
    #[must_use]
    pub fn origins(&self) -> &[GltfOrigin] {
        &self.origins
    }
}

/// Reads a glTF or GLB file as a scene. [`GltfFile::read`] tells more, and its errors.
///
/// # Errors
/// As [`GltfFile::read`].
pub fn read_gltf(path: &Path, options: &GltfOptions) -> Result<Scene, Error> {
    GltfFile::read(path, options).map(|(_, scene)| scene)
}
