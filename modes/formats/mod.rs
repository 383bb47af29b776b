//! Readers of scenes: OBJ, glTF, PLY, STL, OFF, Bezier patches and patterns of rays.

pub mod bpt;
#[cfg(feature = "gltf")]
pub mod gltf;
pub mod load;
pub mod load_surfaces;
#[cfg_attr(
    not(any(feature = "gltf", feature = "obj")),
    allow(dead_code, reason = "only these formats name other files")
)]
pub mod neighbours;
#[cfg(feature = "obj")]
pub mod obj;
#[cfg(feature = "off")]
pub(crate) mod off;
#[cfg(any(feature = "gltf", feature = "obj", feature = "off", feature = "ply", feature = "stl"))]
pub(crate) mod offset;
pub(crate) mod packed;
pub mod pattern;
#[cfg(feature = "ply")]
pub(crate) mod ply;
#[cfg(any(feature = "obj", feature = "off", feature = "ply", feature = "stl"))]
pub(crate) mod polygons;
pub(crate) mod scene_file;
#[cfg(feature = "stl")]
pub(crate) mod stl;

pub use bpt::read_bpt;
#[cfg(feature = "gltf")]
pub use gltf::options::{GltfOptions, GltfOrigin};
#[cfg(feature = "gltf")]
pub use gltf::write::vertex::VertexTarget;
#[cfg(feature = "gltf")]
pub use gltf::{GltfFile, read_gltf};
pub use load::{LoadOptions, load, load_bytes};
pub use load_surfaces::{SurfaceOptions, SurfaceScene, load_surfaces, names_surfaces, surface_view};
pub use neighbours::Resolver;
#[cfg(feature = "obj")]
pub use obj::{ObjOptions, read_obj, read_obj_bytes};
pub use pattern::{Pattern, read_pattern};
