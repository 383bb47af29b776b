//! From a name on the command line to a scene: a file by its extension, or `builtin:NAME`.

use std::ffi::OsStr;
use std::path::Path;

use crate::builtin;
use crate::error::Error;
use crate::scene::Scene;

/// How to read a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Leave out triangles with a NaN or infinite position, with a warning, instead of refusing the file.
    pub drop_non_finite: bool,
    /// Open what the file names in other folders than its own, too: buffers and material libraries.
    pub allow_outside: bool,
    /// The most bytes that reading may take; without it half of what [`available_memory`](crate::files::available_memory) tells.
    pub max_memory: Option<u64>,
}

/// Reads a file, or makes the built-in scene `builtin:NAME`. Names of files need not be UTF-8.
///
/// # Errors
/// When there is no such file or scene, its format is not read, or its content cannot be taken.
#[cfg_attr(
    not(any(feature = "gltf", feature = "obj")),
    expect(unused_variables, reason = "only readers of files take options")
)]
pub fn load(name: impl AsRef<OsStr>, options: LoadOptions) -> Result<Scene, Error> {
    if let Some(rule) = builtin_name(name.as_ref()) {
        return builtin(rule);
    }
    let path = Path::new(name.as_ref());
    let extension =
        path.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_ascii_lowercase();
    match extension.as_str() {
        #[cfg(feature = "gltf")]
        "glb" | "gltf" => {
            let LoadOptions { drop_non_finite, allow_outside, max_memory } = options;
            let options = crate::formats::gltf::options::GltfOptions {
                drop_non_finite,
                uv_set: 0,
                allow_outside,
                max_memory,
            };
            crate::formats::gltf::read_gltf(path, &options)
        }
        #[cfg(feature = "obj")]
        "obj" => {
            let LoadOptions { drop_non_finite, allow_outside, max_memory } = options;
            let options = crate::formats::obj::ObjOptions { drop_non_finite, allow_outside, max_memory };
            crate::formats::obj::read_obj(path, &options)
        }
        _ => Err(unknown_format(path, &extension)),
    }
}

/// What follows `builtin:` in a name; `None` for that of a file.
pub(crate) fn builtin_name(name: &OsStr) -> Option<&str> {
    name.to_str()?.strip_prefix("builtin:")
}

/// The error for a format that is not read.
fn unknown_format(path: &Path, extension: &str) -> Error {
    let formats = [(cfg!(feature = "obj"), "OBJ (.obj)"), (cfg!(feature = "gltf"), "glTF 2.0 (.gltf, .glb)")];
    let built: Vec<&str> =
        formats.into_iter().filter(|&(is_built, _)| is_built).map(|(_, name)| name).collect();
    let read = if built.is_empty() { "no file format in this build".to_owned() } else { built.join(", ") };
    let problem = match extension {
        "" => "the name has no extension, so the format is not known".to_owned(),
        other => format!(".{other} files are not read"),
    };
    Error::Input {
        path: path.to_owned(),
        line: None,
        problem,
        remedy: format!("umbel reads {read} and builtin:umbel, builtin:cornell"),
    }
}
