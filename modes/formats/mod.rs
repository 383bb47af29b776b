//! Readers of scenes: OBJ, glTF, Bezier patches and patterns of rays.

pub(crate) mod bpt;
#[cfg(feature = "gltf")]
pub(crate) mod gltf;
pub(crate) mod load;
pub(crate) mod load_surfaces;
#[cfg(any(feature = "gltf", feature = "obj"))]
pub(crate) mod neighbours;
#[cfg(feature = "obj")]
pub(crate) mod obj;
#[cfg(any(feature = "gltf", feature = "obj"))]
pub(crate) mod offset;
pub(crate) mod pattern;
