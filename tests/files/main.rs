//! Files, read and written: OBJ, glTF, images, arrays.

#[cfg(feature = "gltf")]
mod gltf;
mod image_files;
#[cfg(feature = "obj")]
mod obj;
mod output;
