//! The files of a rendered picture: AOVs and the preview, as arrays, channels or something to look at.

use std::path::Path;

use umbel::{
    Aov, AovData, Array, Camera, Channel, Error, Lens, Samples, Scene, VisibilityBuffer, srgb_encode,
    write_exr, write_npy, write_png_rgb8,
};

use crate::cli::RenderArgs;

/// A rendered picture, from which files are made.
pub(crate) struct Picture<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) camera: &'a Camera,
    pub(crate) buffer: &'a VisibilityBuffer,
}

impl Picture<'_> {
    /// Writes AOVs, then the preview, and hashes what was written.
    pub(crate) fn write(
        &self,
        args: &RenderArgs,
        output: Option<&Path>,
        linear: Option<Vec<f32>>,
        hash: &mut blake3::Hasher,
    ) -> Result<(), Error> {
        let mut channels = Vec::new();
        for (aov, file) in &args.aovs {
            let data = self.buffer.derive(*aov, self.scene)?;
            hash_data(hash, &data);
            match file {
                Some(file) => write_npy(file, &self.shape(&data), array(&data))?,
                None => channels.extend(exr_channels(*aov, data)),
            }
        }
        let (Some(output), Some(linear)) = (output, linear) else {
            return Ok(());
        };
        let (width, rows) = (self.camera.width, self.camera.rows());
        match extension(output).as_str() {
            "npy" => {
                let data = AovData::F32(3, linear);
                hash_data(hash, &data);
                write_npy(output, &self.shape(&data), array(&data))
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

    /// The shape of an NPY file: (H, W), with 6 in front for a cube and the numbers per pixel behind.
    fn shape(&self, data: &AovData) -> Vec<usize> {
        let (width, rows) = (self.camera.width as usize, self.camera.rows() as usize);
        let mut shape =
            if self.camera.lens == Lens::Cube { vec![6, width, width] } else { vec![rows, width] };
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

/// Hashes the numbers, little-endian.
fn hash_data(hash: &mut blake3::Hasher, data: &AovData) {
    let bytes: Vec<u8> = match data {
        AovData::U32(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
        AovData::F32(_, values) => values.iter().flat_map(|x| x.to_le_bytes()).collect(),
    };
    hash.update(&bytes);
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
        Aov::Bary => &["bary.u", "bary.v"],
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

/// The extension in lower case.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or("").to_ascii_lowercase()
}
