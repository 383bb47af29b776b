//! From a name on the command line to a scene: a file by its extension, or `builtin:NAME`.

use std::ffi::OsStr;
use std::path::Path;

use crate::builtin;
use crate::error::{Error, Problem};
use crate::files::budget::Budget;
use crate::formats::neighbours::{Neighbours, Resolver};
use crate::formats::scene_file::{Format, extension, read_scene_file, stem, unpack};
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

/// Reads a file, or makes the built-in scene `builtin:NAME`. Names of files need not be UTF-8; `-` is the standard input.
///
/// The extension tells the format, and the content where that tells none. Files may be compressed by gzip or Zstandard.
///
/// # Errors
/// When there is no such file or scene, its format is not read, or its content cannot be taken.
pub fn load(name: impl AsRef<OsStr>, options: LoadOptions) -> Result<Scene, Error> {
    if let Some(rule) = builtin_name(name.as_ref()) {
        return builtin(rule);
    }
    let path = Path::new(name.as_ref());
    let budget = Budget::new(options.max_memory);
    let named = Format::of_name(path);
    if named.is_none() && !extension(path).is_empty() {
        return Err(unknown_format(path));
    }
    let mut neighbours = Neighbours::of(path, options.allow_outside, &budget);
    let bytes = read_scene_file(path, &budget).map_err(|problem| budget.error(problem, path))?;
    read((path, named), &bytes, options, &mut neighbours, &budget)
}

/// Reads the bytes of a file in memory. `name` stands for its path in messages, gives the scene its name, and tells the format where
/// it has an extension; else the content does. `resolver` gives the bytes of the files that it names.
///
/// # Errors
/// As [`load`].
pub fn load_bytes(
    name: &str,
    bytes: Vec<u8>,
    options: LoadOptions,
    resolver: &mut Resolver<'_>,
) -> Result<Scene, Error> {
    let path = Path::new(name);
    let budget = Budget::new(options.max_memory);
    let mut neighbours = Neighbours::given(resolver, &budget);
    let bytes = unpack(bytes, &budget).map_err(|problem| budget.error(problem, path))?;
    read((path, Format::of_name(path)), &bytes, options, &mut neighbours, &budget)
}

/// Has the reader of the format read bytes.
fn read(
    (path, named): (&Path, Option<Format>),
    bytes: &[u8],
    options: LoadOptions,
    neighbours: &mut Neighbours<'_>,
    budget: &Budget,
) -> Result<Scene, Error> {
    let format = named.or_else(|| Format::of_content(bytes));
    match format.and_then(|format| read_format((format, path, bytes), options, neighbours, budget)) {
        Some(scene) => scene
            .map(|scene| Scene { name: stem(path), ..scene })
            .map_err(|problem| budget.error(problem, path)),
        None => Err(unknown_format(path)),
    }
}

/// The same for a format that is known; `None` where this build does not read it.
#[cfg_attr(
    not(all(feature = "gltf", feature = "obj", any(feature = "ply", feature = "stl", feature = "off"))),
    allow(unused_variables, reason = "not all readers take all options")
)]
fn read_format(
    (format, path, bytes): (Format, &Path, &[u8]),
    options: LoadOptions,
    neighbours: &mut Neighbours<'_>,
    budget: &Budget,
) -> Option<Result<Scene, Problem>> {
    let LoadOptions { drop_non_finite, allow_outside, max_memory } = options;
    match format {
        #[cfg(feature = "gltf")]
        Format::Gltf => {
            use crate::formats::gltf::GltfFile;
            use crate::formats::gltf::options::GltfOptions;
            let options = GltfOptions { drop_non_finite, uv_set: 0, allow_outside, max_memory };
            let read = GltfFile::try_read((path, bytes), &options, neighbours, budget);
            Some(read.map(|(_, scene)| scene))
        }
        #[cfg(feature = "obj")]
        Format::Obj => {
            let options = crate::formats::obj::ObjOptions { drop_non_finite, allow_outside, max_memory };
            Some(crate::formats::obj::read(bytes, &options, neighbours, budget))
        }
        #[cfg(feature = "ply")]
        Format::Ply => Some(crate::formats::ply::read_ply(bytes, drop_non_finite, budget)),
        #[cfg(feature = "stl")]
        Format::Stl => Some(crate::formats::stl::read_stl(bytes, drop_non_finite, budget)),
        #[cfg(feature = "off")]
        Format::Off => Some(crate::formats::off::read_off(bytes, drop_non_finite, budget)),
        #[allow(unreachable_patterns, reason = "where all readers are built there is no other")]
        _ => None,
    }
}

/// What follows `builtin:` in a name; `None` for that of a file.
pub(crate) fn builtin_name(name: &OsStr) -> Option<&str> {
    name.to_str()?.strip_prefix("builtin:")
}

/// The error for a format that is not read.
fn unknown_format(path: &Path) -> Error {
    let formats = [
        (cfg!(feature = "obj"), "OBJ (.obj)"),
        (cfg!(feature = "gltf"), "glTF 2.0 (.gltf, .glb)"),
        (cfg!(feature = "ply"), "PLY (.ply)"),
        (cfg!(feature = "stl"), "STL (.stl)"),
        (cfg!(feature = "off"), "OFF (.off)"),
    ];
    let built: Vec<&str> =
        formats.into_iter().filter(|&(is_built, _)| is_built).map(|(_, name)| name).collect();
    let read = if built.is_empty() { "no file format in this build".to_owned() } else { built.join(", ") };
    let problem = match extension(path).as_str() {
        "" => "neither the name nor the content tells a format that is read".to_owned(),
        other => format!(".{other} files are not read"),
    };
    Error::Input {
        path: path.to_owned(),
        line: None,
        problem,
        remedy: format!("umbel reads {read} and builtin:umbel, builtin:cornell"),
    }
}
