//! The files of a rendered picture: AOVs and the preview, as arrays, channels or something to look at.

use std::path::{Path, PathBuf};

use umbel::files::{Array, Channel, Samples, srgb_encode, write_exr, write_npy, write_png_rgb8};
use umbel::render::{Look, SeenPoint, SurfaceBuffer, write_ply};
use umbel::scene::Shot;
use umbel::{Aov, AovData, Camera, Error, Lens, Scene, VisibilityBuffer};

use crate::options::parse::extension;
use crate::options::picture::PictureArgs;

/// Numbers that are hashed together.
const HASHED: usize = 1 << 16;

/// Rays to follow, and the array of pixels that they make up.
pub(crate) struct Sight {
    pub(crate) shot: Shot,
    /// The extents of the pixels, the slowest first: (H, W), or (6, N, N) for a cube.
    pub(crate) shape: Vec<u32>,
    /// `None` where the rays are no camera's: then there is no preview.
    pub(crate) camera: Option<Camera>,
}

impl Sight {
    /// How many pixels there are.
    pub(crate) fn pixels(&self) -> usize {
        self.shape.iter().map(|&extent| extent as usize).product()
    }

    /// What a camera sees through its pixel centres.
    pub(crate) fn of_camera(camera: &Camera) -> Result<Self, Error> {
        let (width, height) = (camera.width, camera.height);
        let shape = if camera.lens == Lens::Cube { vec![6, width, width] } else { vec![height, width] };
        Ok(Self { shot: camera.shot()?, shape, camera: Some(*camera) })
    }
}

/// The files to write.
pub(crate) struct Files<'a> {
    pub(crate) args: &'a PictureArgs,
    /// The file of the preview or of the points, checked.
    pub(crate) output: Option<PathBuf>,
    /// How the preview is lit, and what is followed.
    pub(crate) look: Look,
    /// The bytes of the process that were foreseen.
    pub(crate) forecast: u64,
}

/// A rendered picture, from which files are made.
pub(crate) struct Picture<'a> {
    /// The extents of the pixels, the slowest first.
    pub(crate) shape: Vec<u32>,
    pub(crate) seen: &'a dyn Seen,
}

/// What rays have hit, from which quantities are derived.
pub(crate) trait Seen {
    fn derive(&self, aov: Aov) -> Result<AovData, Error>;

    fn points(&self) -> Result<Vec<SeenPoint>, Error>;
}

impl Seen for (&VisibilityBuffer, &Scene) {
    fn derive(&self, aov: Aov) -> Result<AovData, Error> {
        self.0.derive(aov, self.1)
    }

    fn points(&self) -> Result<Vec<SeenPoint>, Error> {
        self.0.points(self.1)
    }
}

impl Seen for SurfaceBuffer {
    fn derive(&self, aov: Aov) -> Result<AovData, Error> {
        self.derive(aov)
    }

    fn points(&self) -> Result<Vec<SeenPoint>, Error> {
        self.points()
    }
}

impl Picture<'_> {
    /// Writes AOVs, then the preview or else the points, and hashes what was written.
    pub(crate) fn write(
        &self,
        files: &Files<'_>,
        linear: Option<Vec<f32>>,
        hash: &mut blake3::Hasher,
    ) -> Result<(), Error> {
        let mut channels = Vec::new();
        for (aov, file) in &files.args.aovs {
            let data = self.seen.derive(*aov)?;
            hash_data(hash, &data);
            match file {
                Some(file) => write_npy(file, &self.shape_of(&data), array(&data))?,
                None => channels.extend(exr_channels(*aov, data)),
            }
        }
        let Some(output) = files.output.as_deref() else {
            return Ok(());
        };
        match linear {
            Some(linear) => self.write_preview(output, linear, channels, hash),
            None => {
                let points = self.seen.points()?;
                points.iter().for_each(|point| _ = hash.update(&point.to_le_bytes()));
                write_ply(output, &points)
            }
        }
    }

    /// Writes the preview; an EXR has other channels as well.
    fn write_preview(
        &self,
        output: &Path,
        linear: Vec<f32>,
        mut channels: Vec<Channel>,
        hash: &mut blake3::Hasher,
    ) -> Result<(), Error> {
        let (width, rows) = self.extents();
        match extension(output).as_str() {
            "npy" => {
                let data = AovData::F32(3, linear);
                hash_data(hash, &data);
                write_npy(output, &self.shape_of(&data), array(&data))
            }
            "exr" => {
                let data = AovData::F32(3, linear);
                hash_data(hash, &data);
                channels.extend(split(&["R", "G", "B"], data));
                write_exr(output, width as usize, rows as usize, channels)
            }
            _ => {
                let bytes: Vec<u8> = linear.into_iter().map(srgb_encode).collect();
                hash.update(&bytes);
                write_png_rgb8(output, width, rows, &bytes)
            }
        }
    }

    /// Pixels per row, and rows one below the other.
    fn extents(&self) -> (u32, u32) {
        match self.shape.split_last() {
            Some((&width, slower)) => (width, slower.iter().product()),
            None => (0, 0),
        }
    }

    /// The shape of an NPY file: that of the pixels, with the numbers per pixel behind.
    fn shape_of(&self, data: &AovData) -> Vec<usize> {
        let mut shape: Vec<usize> = self.shape.iter().map(|&extent| extent as usize).collect();
        if let AovData::F32(numbers @ 2.., _) = data {
            shape.push(*numbers);
        }
        shape
    }
}

/// The numbers as an NPY array.
fn array(data: &AovData) -> Array<'_> {
    match data {
        AovData::U32(values) => Array::U32(values),
        AovData::F32(_, values) => Array::F32(values),
    }
}

/// Hashes the numbers, little-endian, in parts: they are not copied as a whole.
fn hash_data(hash: &mut blake3::Hasher, data: &AovData) {
    fn add<T: Copy>(hash: &mut blake3::Hasher, values: &[T], bytes_of: fn(T) -> [u8; 4]) {
        let mut bytes = Vec::with_capacity(4 * values.len().min(HASHED));
        for part in values.chunks(HASHED) {
            bytes.clear();
            bytes.extend(part.iter().flat_map(|&value| bytes_of(value)));
            hash.update(&bytes);
        }
    }
    match data {
        AovData::U32(values) => add(hash, values, u32::to_le_bytes),
        AovData::F32(_, values) => add(hash, values, f32::to_le_bytes),
    }
}

/// An AOV as EXR channels, under the names of the field.
fn exr_channels(aov: Aov, data: AovData) -> Vec<Channel> {
    let names: &[&str] = match aov {
        Aov::Id => &["id"],
        Aov::Object => &["object"],
        Aov::Depth => &["Z"],
        Aov::Distance => &["distance"],
        Aov::Normal => &["N.X", "N.Y", "N.Z"],
        Aov::Position => &["P.X", "P.Y", "P.Z"],
        Aov::Work => &["work"],
        Aov::Doubts => &["doubts"],
        Aov::Bary => &["bary.u", "bary.v"],
        Aov::Uv => &["uv.u", "uv.v"],
    };
    split(names, data)
}

/// Interleaved numbers as one channel each.
fn split(names: &[&str], data: AovData) -> Vec<Channel> {
    let channel = |name: &str, samples| Channel { name: name.to_owned(), samples };
    match data {
        AovData::U32(values) => vec![channel(names[0], Samples::U32(values))],
        AovData::F32(numbers, values) => {
            let of = |k: usize| values.iter().skip(k).step_by(numbers).copied().collect();
            names.iter().enumerate().map(|(k, name)| channel(name, Samples::F32(of(k)))).collect()
        }
    }
}
