//! Readers of scenes: OBJ, glTF, Bezier patches and patterns of rays.

pub(crate) mod bpt;
#[cfg(feature = "gltf")]
pub(crate) mod gltf;
pub(crate) mod load;
pub(crate) mod load_surfaces;
#[cfg(feature = "obj")]
pub(crate) mod obj;
pub(crate) mod pattern;
