//! Which extensions a file may require and still be read: those that leave its triangles as the core describes them.
//!
//! A required extension that is not known could mean anything, so it is refused by name. One that is only *used* has a
//! fallback in the core, which is read.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.12 "Specifying Extensions".

use serde_json::Value;

use crate::error::Problem;

/// Required, and without effect on triangles, or understood.
const HARMLESS: [&str; 11] = [
    // Understood by the nodes.
    "EXT_mesh_gpu_instancing",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    // Understood by the accessors.
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];
/// Families of them.
const HARMLESS_PREFIX: &str = "KHR_materials_";

/// Extensions that replace the data of meshes by compressed data.
pub(crate) const DRACO: &str = "KHR_draco_mesh_compression";
const COMPRESSIONS: [&str; 3] = [DRACO, "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What to do about them. Tried with glTF-Transform 4.5: every one of its commands writes the file decompressed.
const DECOMPRESS: &str =
    "Decompress the file first, for example with `npx @gltf-transform/cli copy in.glb out.glb`.";

/// Says that data are compressed.
pub(crate) fn compressed(place: &str, extension: &str) -> Problem {
    Problem {
        line: None,
        what: format!("{place} compressed with {extension}, which is not read"),
        remedy: DECOMPRESS,
    }
}

/// Refuses a file that requires what is not understood.
pub(crate) fn check_required(json: &Value) -> Result<(), Problem> {
    let required = json.get("extensionsRequired").and_then(Value::as_array);
    let names = || required.into_iter().flatten().filter_map(Value::as_str);
    // Of several, the one with the most useful remedy.
    if let Some(name) = names().find(|name| COMPRESSIONS.contains(name)) {
        return Err(compressed("the meshes of the file are", name));
    }
    let is_unknown = |name: &&str| !HARMLESS.contains(name) && !name.starts_with(HARMLESS_PREFIX);
    match names().find(is_unknown) {
        None => Ok(()),
        Some(name) => Err(Problem {
            line: None,
            what: format!("the file requires the extension {name}, which is not read"),
            remedy: "Export the scene without this extension.",
        }),
    }
}
