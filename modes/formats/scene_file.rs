//! The file of a scene: its bytes, as far as there may be so many, and the name that it gives the scene.

use std::fs;
use std::path::Path;

use crate::error::Problem;
use crate::files::budget::Budget;

/// The bytes of a scene's file, counted before they are read; `format` is what it should be.
pub(crate) fn read_scene_file(path: &Path, budget: &Budget, format: SceneFormat) -> Result<Vec<u8>, Problem> {
    let unreadable = |error: std::io::Error| Problem {
        line: None,
        what: format!("cannot be read: {error}"),
        remedy: match format {
            SceneFormat::Gltf => "Give the path of a glTF file that exists and that you may read.",
            SceneFormat::Obj => "Give the path of an OBJ file that exists and that you may read.",
        },
    };
    // Of a pipe the system does not know the length.
    budget.take(fs::metadata(path).map_err(unreadable)?.len(), "the bytes of the file")?;
    fs::read(path).map_err(unreadable)
}

/// What a file of a scene should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SceneFormat {
    #[cfg_attr(not(feature = "gltf"), expect(dead_code, reason = "glTF is not read"))]
    Gltf,
    #[cfg_attr(not(feature = "obj"), expect(dead_code, reason = "OBJ is not read"))]
    Obj,
}

/// The name of a scene: its file's, without the extension.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
