//! The file of a scene: its bytes, as far as there may be so many, what format they are, and the name of the scene.
//!
//! `-` is the standard input. Bytes that are compressed by gzip or Zstandard are unpacked, whatever the file is called. The format is
//! that of the extension (that before `.gz` or `.zst`), or else what the content looks like.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::packed::{self, Packing};

/// What stands for the standard input.
const STDIN: &str = "-";

/// What is read at once where the length is not known.
const BLOCK: u64 = 1 << 20;

/// The bytes of a scene's file, unpacked, counted before they are read.
pub(crate) fn read_scene_file(path: &Path, budget: &Budget) -> Result<Vec<u8>, Problem> {
    let unreadable = |error: io::Error| Problem {
        line: None,
        what: format!("cannot be read: {error}"),
        remedy: "Give the path of a file that exists and that you may read.",
    };
    let what = "the bytes of the file";
    let bytes = if path == Path::new(STDIN) {
        let bytes =
            read_counted(io::stdin().lock(), budget, what).map_err(|trouble| trouble.or(unreadable))?;
        budget.take(bytes.len() as u64, what)?;
        bytes
    } else {
        // Of a pipe the system does not know the length.
        budget.take(fs::metadata(path).map_err(unreadable)?.len(), what)?;
        fs::read(path).map_err(unreadable)?
    };
    unpack(bytes, budget)
}

/// Bytes as they are, or what they become when they are unpacked.
pub(crate) fn unpack(bytes: Vec<u8>, budget: &Budget) -> Result<Vec<u8>, Problem> {
    let Some(packing) = Packing::of(&bytes) else {
        return Ok(bytes);
    };
    let what = "what the file is when it is unpacked";
    let unpacked = packed::reader(packing, &bytes)
        .map_err(Trouble::from)
        .and_then(|reader| read_counted(reader, budget, what));
    let unpacked = unpacked.map_err(|trouble| {
        trouble.or(|error| Problem {
            line: None,
            what: format!("cannot be unpacked as {}: {error}", packing.name()),
            remedy: "Check that the file is whole, for example by unpacking it yourself.",
        })
    })?;
    budget.take(unpacked.len() as u64, what)?;
    Ok(unpacked)
}

/// Why bytes could not be read.
enum Trouble {
    Failed(io::Error),
    TooLarge(Problem),
}

impl From<io::Error> for Trouble {
    fn from(error: io::Error) -> Self {
        Self::Failed(error)
    }
}

impl Trouble {
    fn or(self, problem: impl FnOnce(io::Error) -> Problem) -> Problem {
        match self {
            Self::Failed(error) => problem(error),
            Self::TooLarge(problem) => problem,
        }
    }
}

/// Reads to the end, a block at a time, each one as long as the budget has room for what there is then.
fn read_counted(mut source: impl Read, budget: &Budget, what: &str) -> Result<Vec<u8>, Trouble> {
    let mut bytes = Vec::new();
    loop {
        budget.check(bytes.len() as u64 + BLOCK, what).map_err(Trouble::TooLarge)?;
        if source.by_ref().take(BLOCK).read_to_end(&mut bytes)? == 0 {
            return Ok(bytes);
        }
    }
}

/// A format of scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Gltf,
    Obj,
    Ply,
    Stl,
    Off,
}

impl Format {
    /// The format that the name of a file tells.
    pub(crate) fn of_name(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "glb" | "gltf" => Some(Self::Gltf),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            "off" | "coff" | "noff" | "cnoff" | "stoff" => Some(Self::Off),
            _ => None,
        }
    }

    /// The format that bytes look like.
    pub(crate) fn of_content(bytes: &[u8]) -> Option<Self> {
        const OBJ_WORDS: [&str; 9] = ["v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"];
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut lines = text.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
        // The first word behind comments.
        let line = lines.find(|line| !line.is_empty() && !line.starts_with(b"#")).unwrap_or_default();
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        let is_off = word.strip_suffix(b"OFF").is_some_and(|kinds| kinds.len() < 6);
        if bytes.starts_with(b"glTF") || word.starts_with(b"{") {
            Some(Self::Gltf)
        } else if bytes.starts_with(b"ply") {
            Some(Self::Ply)
        } else if word.eq_ignore_ascii_case(b"solid") || is_binary_stl(bytes) {
            Some(Self::Stl)
        } else if is_off {
            Some(Self::Off)
        } else {
            OBJ_WORDS.iter().any(|known| known.as_bytes() == word).then_some(Self::Obj)
        }
    }
}

/// Whether bytes are a binary STL file: a header of 80 bytes, a count, and 50 bytes for each triangle.
pub(crate) fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(count))
}

/// The extension of a name in lower case, without that of what it is packed with.
pub(crate) fn extension(path: &Path) -> String {
    let unpacked = path.with_extension("");
    let last = lower_extension(path);
    if Packing::has_extension(&last) { lower_extension(&unpacked) } else { last }
}

fn lower_extension(path: &Path) -> String {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_ascii_lowercase()
}

/// The name of a scene: its file's, without the extensions.
pub(crate) fn stem(path: &Path) -> String {
    if path == Path::new(STDIN) {
        return "stdin".to_owned();
    }
    let stem = path.file_stem().unwrap_or_default();
    let stem = if Packing::has_extension(&lower_extension(path)) {
        Path::new(stem).file_stem().unwrap_or_default()
    } else {
        stem
    };
    stem.to_string_lossy().into_owned()
}
