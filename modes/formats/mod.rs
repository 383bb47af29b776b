//! Readers of scenes: OBJ, glTF, Bezier patches and patterns of rays.

pub mod bpt;
#[cfg(feature = "gltf")]
pub mod gltf;
pub mod load;
pub mod load_surfaces;
#[cfg(any(feature = "gltf", feature = "obj"))]
pub mod neighbours;
#[cfg(feature = "obj")]
pub mod obj;
#[cfg(any(feature = "gltf", feature = "obj"))]
pub(crate) mod offset;
pub mod pattern;
#[cfg(any(feature = "gltf", feature = "obj"))]
pub(crate) mod scene_file;

pub use bpt::read_bpt;
#[cfg(feature = "gltf")]
pub use gltf::options::{GltfOptions, GltfOrigin};
#[cfg(feature = "gltf")]
pub use gltf::write::vertex::VertexTarget;
#[cfg(feature = "gltf")]
pub use gltf::{GltfFile, read_gltf};
pub use load::{LoadOptions, load};
pub use load_surfaces::{SurfaceOptions, SurfaceScene, load_surfaces, names_surfaces, surface_view};
#[cfg(any(feature = "gltf", feature = "obj"))]
pub use neighbours::Resolver;
#[cfg(feature = "obj")]
pub use obj::{ObjOptions, read_obj, read_obj_bytes};
pub use pattern::{Pattern, read_pattern};
