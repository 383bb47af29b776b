//! The files of shadows: maps of distances and masks, one per light or all in one array.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap_lex::OsStrExt as _;
use umbel::Error;
use umbel::files::{
    Array, Channel, Samples, write_exr, write_ktx2_cube, write_npy, write_png_rgb8, write_png_rgba8,
};

use crate::options::parse::extension;

/// What stands for the number of the light in a name.
const LIGHT: &str = "{light}";

/// Numbers that are hashed together: a map is not copied as a whole.
const HASHED: usize = 1 << 16;

/// The cells of a cube's cross, 4 wide and 3 high: each face stands beside those that it shares an edge with.
///
/// ```text
///       +Y
///   −X  +Z  +X  −Z
///       −Y
/// ```
const CROSS: [(u32, u32); 6] = [(2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1)];

/// What the numbers are, and how many of them there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    /// Distances on six faces of this many texels a side.
    Cube(u32),
    /// Distances on one square of this many texels a side.
    Square(u32),
    /// A mask of columns and rows.
    Mask(u32, u32),
    /// A mask of six faces of this many pixels a side.
    CubeMask(u32),
}

impl Content {
    /// The extents of an array, the slowest first.
    fn shape(self) -> Vec<usize> {
        let shape = match self {
            Self::Cube(size) | Self::CubeMask(size) => vec![6, size, size],
            Self::Square(size) => vec![size, size],
            Self::Mask(width, rows) => vec![rows, width],
        };
        shape.into_iter().map(|extent| extent as usize).collect()
    }

    /// Columns and rows of a picture in which faces stand below each other.
    fn strip(self) -> (u32, u32) {
        match self {
            Self::Cube(size) | Self::CubeMask(size) => (size, 6 * size),
            Self::Square(size) => (size, size),
            Self::Mask(width, rows) => (width, rows),
        }
    }
}

/// Where the numbers of each light go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Names {
    /// A file for each light.
    Each(Vec<PathBuf>),
    /// One array for all lights, which has them as its first index.
    Together(PathBuf),
}

impl Names {
    /// The names for some lights that a path with or without `{light}` stands for, if its format is one of `formats`.
    pub(crate) fn new(option: &str, path: &Path, lights: usize, formats: &[&str]) -> Result<Self, Error> {
        let (format, shown) = (extension(path), path.display());
        if !formats.contains(&format.as_str()) {
            let list = formats.iter().map(|format| format!(".{format}")).collect::<Vec<_>>().join(", ");
            return Err(Error::Usage(format!("{shown}: {option} takes one of {list} here")));
        }
        let parts: Vec<&OsStr> = path.as_os_str().split(LIGHT).collect();
        if parts.len() > 1 {
            let name = |light: usize| -> PathBuf {
                let light = OsString::from(light.to_string());
                parts.join(light.as_os_str()).into()
            };
            return Ok(Self::Each((0..lights).map(name).collect()));
        }
        match (lights, format.as_str()) {
            (1, _) => Ok(Self::Each(vec![path.to_owned()])),
            (_, "npy") => Ok(Self::Together(path.to_owned())),
            _ => Err(Error::Usage(format!(
                "{shown}: {lights} lights need {LIGHT} in the name, such as {LIGHT}.{format}, or one .npy for all"
            ))),
        }
    }

    /// All names.
    pub(crate) fn paths(&self) -> &[PathBuf] {
        match self {
            Self::Each(paths) => paths,
            Self::Together(path) => std::slice::from_ref(path),
        }
    }
}

/// Takes the numbers of one light after the other, part by part, and writes them.
pub(crate) struct Writer<'a> {
    names: &'a Names,
    content: Content,
    hash: &'a mut blake3::Hasher,
    /// Numbers that wait for the rest of their light, or for the other lights.
    gathered: Vec<f32>,
    lights: usize,
    /// Numbers that a file has.
    room: usize,
}

impl<'a> Writer<'a> {
    /// For the numbers of so many lights.
    pub(crate) fn new(
        names: &'a Names,
        content: Content,
        lights: usize,
        hash: &'a mut blake3::Hasher,
    ) -> Self {
        let numbers: usize = content.shape().iter().product();
        let room = if matches!(names, Names::Together(_)) { lights * numbers } else { numbers };
        Self { names, content, hash, gathered: Vec::new(), lights: 0, room }
    }

    /// Takes the next numbers.
    pub(crate) fn put(&mut self, values: &[f32]) {
        for part in values.chunks(HASHED) {
            let bytes: Vec<u8> = part.iter().flat_map(|value| value.to_le_bytes()).collect();
            self.hash.update(&bytes);
        }
        // A list that grows would be copied.
        self.gathered.reserve_exact(self.room - self.gathered.len());
        self.gathered.extend_from_slice(values);
    }

    /// Ends a light.
    pub(crate) fn end(&mut self) -> Result<(), Error> {
        let light = self.lights;
        self.lights += 1;
        match self.names {
            Names::Each(paths) => write(&paths[light], self.content, std::mem::take(&mut self.gathered)),
            Names::Together(_) => Ok(()),
        }
    }

    /// Writes what has been gathered.
    pub(crate) fn finish(self) -> Result<(), Error> {
        let Names::Together(path) = self.names else {
            return Ok(());
        };
        let shape = [vec![self.lights], self.content.shape()].concat();
        write_npy(path, &shape, Array::F32(&self.gathered))
    }
}

/// Writes the numbers of one light.
fn write(path: &Path, content: Content, values: Vec<f32>) -> Result<(), Error> {
    let (width, rows) = content.strip();
    match (extension(path).as_str(), content) {
        ("npy", _) => write_npy(path, &content.shape(), Array::F32(&values)),
        ("ktx2", Content::Cube(size)) => write_ktx2_cube(path, size, &values),
        ("exr", _) => {
            let channel = Channel { name: "distance".into(), samples: Samples::F32(values) };
            write_exr(path, width as usize, rows as usize, vec![channel])
        }
        (_, Content::Cube(size)) => write_cross(path, size, &codes(&values, greatest_finite(&values))),
        (_, Content::Square(_)) => write_gray(path, (width, rows), &codes(&values, greatest_finite(&values))),
        (_, Content::Mask(..) | Content::CubeMask(_)) => {
            write_gray(path, (width, rows), &codes(&values, 1.0))
        }
    }
}

/// The greatest number that is finite; 1 where none is.
fn greatest_finite(values: &[f32]) -> f32 {
    let greatest = values.iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
    if greatest > 0.0 { greatest } else { 1.0 }
}

/// Numbers from 0 to `white` as bytes from 0 to 255, linear. What is greater, infinite or NaN is white.
fn codes(values: &[f32], white: f32) -> Vec<u8> {
    let code = |&value: &f32| {
        if value <= white { (value / white * 255.0).round() as u8 } else { u8::MAX }
    };
    values.iter().map(code).collect()
}

/// Writes a gray picture.
fn write_gray(path: &Path, (width, rows): (u32, u32), codes: &[u8]) -> Result<(), Error> {
    let pixels: Vec<u8> = codes.iter().flat_map(|&code| [code; 3]).collect();
    write_png_rgb8(path, width, rows, &pixels)
}

/// Writes six gray faces as a cross, transparent where no face is.
fn write_cross(path: &Path, size: u32, codes: &[u8]) -> Result<(), Error> {
    let n = size as usize;
    let (width, rows) = (4 * n, 3 * n);
    let mut pixels = vec![0; 4 * width * rows];
    for (k, row) in codes.chunks(n).enumerate() {
        let (column, line) = CROSS[k / n];
        let first = (line as usize * n + k % n) * width + column as usize * n;
        for (pixel, &code) in pixels[4 * first..].chunks_mut(4).zip(row) {
            pixel.copy_from_slice(&[code, code, code, u8::MAX]);
        }
    }
    write_png_rgba8(path, 4 * size, 3 * size, &pixels)
}
