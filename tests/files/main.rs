//! Files, read and written: OBJ, glTF, other meshes, images, arrays.

#[cfg(feature = "gltf")]
mod gltf;
mod image_files;
#[cfg(all(
    feature = "obj",
    feature = "gltf",
    feature = "ply",
    feature = "stl",
    feature = "off",
    feature = "gz",
    feature = "zst"
))]
mod meshes;
#[cfg(feature = "obj")]
mod obj;
mod output;
