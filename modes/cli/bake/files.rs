//! The files of `umbel bake`: values as arrays, meshes and images; bent normals; rays.
//!
//! Arrays have NaN where nothing was baked. Images are for use and for looking at: they are extended by the margin, and white beyond it.

use std::path::Path;

use glam::DVec3;
use umbel::bake::{Polarity, TexelImage, TracedRay};
use umbel::files::{
    Array, Channel, GrayBits, Samples, encode_png_gray, write_exr, write_npy, write_ply_mesh, write_png_gray,
};
use umbel::{Error, Scene};

use crate::bake::args::{BakeArgs, MARGIN};
use crate::bake::gltf::Patched;
use crate::bake::source::{Results, Source, Values};
use crate::common::Common;
use crate::options::parse::extension;

/// What is written, and what from.
pub(crate) struct Files<'a> {
    pub(crate) args: &'a BakeArgs,
    pub(crate) common: &'a Common,
    pub(crate) scene: &'a Scene,
    pub(crate) source: &'a Source<'a>,
    /// The file of the scene, where the output is one like it.
    pub(crate) patched: Option<Patched>,
}

impl Files<'_> {
    /// Writes the files that were asked for, and hashes their numbers.
    pub(crate) fn write(
        mut self,
        found: Results,
        polarity: Polarity,
        hash: &mut blake3::Hasher,
    ) -> Result<(), Error> {
        let name = if polarity == Polarity::Openness { "openness" } else { "occlusion" };
        let (shape, bent) = match found.values {
            Values::List(values, bent) => {
                self.write_list(name, &values, hash)?;
                (vec![values.len()], bent)
            }
            Values::Image(image, bent) => {
                let side = image.size() as usize;
                self.write_image(name, image, hash)?;
                (vec![side, side], bent.map_or(Vec::new(), |bent| unit_vectors(&bent)))
            }
        };
        if let Some(path) = &self.args.bent {
            hash_numbers(hash, bent.as_flattened());
            write_npy(path, &[shape, vec![3]].concat(), Array::F32(bent.as_flattened()))?;
        }
        if let Some(path) = &self.args.dump_rays {
            let traced = in_frame_of_file(found.traced, self.scene.offset);
            hash_numbers(hash, traced.as_flattened());
            write_npy(path, &[traced.len(), 8], Array::F32(traced.as_flattened()))?;
        }
        Ok(())
    }

    /// Writes values one after the other: as an array, on the scene itself, or on points without faces.
    fn write_list(&mut self, name: &str, values: &[f32], hash: &mut blake3::Hasher) -> Result<(), Error> {
        let Some(path) = &self.args.output else { return Ok(()) };
        hash_numbers(hash, values);
        match (self.patched.take(), self.source) {
            (Some(file), _) => file.write_vertices(path, values, (self.args.into, self.common)),
            _ if extension(path) == "npy" => write_npy(path, &[values.len()], Array::F32(values)),
            (None, Source::Points(points)) => {
                let positions: Vec<[f32; 3]> =
                    points.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point).collect();
                write_ply_mesh(path, (&positions, &[], self.scene.offset), name, values)
            }
            _ => write_ply_mesh(
                path,
                (&self.scene.positions, &self.scene.triangles, self.scene.offset),
                name,
                values,
            ),
        }
    }

    /// Writes which texels were baked, and their values.
    fn write_image(
        &mut self,
        name: &str,
        mut image: TexelImage<1>,
        hash: &mut blake3::Hasher,
    ) -> Result<(), Error> {
        let (args, side) = (self.args, image.size() as usize);
        if let Some(path) = &args.coverage {
            let covered: Vec<f32> = image.covered().iter().map(|&covered| f32::from(covered)).collect();
            hash_numbers(hash, &covered);
            write_plane(path, side, "coverage", &covered, GrayBits::Eight)?;
        }
        let Some(path) = &args.output else { return Ok(()) };
        if extension(path) != "npy" {
            image.extend(args.receivers.margin.unwrap_or(MARGIN));
        }
        let values = image.values().as_flattened();
        hash_numbers(hash, values);
        match self.patched.take() {
            Some(file) => file.write_texture(path, &png(path, side, values, args)?, self.common),
            None => write_plane(path, side, name, values, args.bits()),
        }
    }
}

/// Rays whose origins are where the scene's file has them.
fn in_frame_of_file(mut rays: Vec<TracedRay>, offset: DVec3) -> Vec<TracedRay> {
    if offset != DVec3::ZERO {
        for ray in &mut rays {
            for (origin, moved) in ray.iter_mut().zip(offset.to_array()) {
                *origin = (f64::from(*origin) + moved) as f32;
            }
        }
    }
    rays
}

/// Hashes numbers, little-endian.
fn hash_numbers(hash: &mut blake3::Hasher, values: &[f32]) {
    values.iter().for_each(|value| _ = hash.update(&value.to_le_bytes()));
}

/// The bytes of a square texture, for a file that holds it.
fn png(path: &Path, side: usize, values: &[f32], args: &BakeArgs) -> Result<Vec<u8>, Error> {
    // In range: the sides of an atlas are.
    let encoded = encode_png_gray(side as u32, side as u32, values, args.bits());
    encoded.map_err(|problem| Error::Write { path: path.to_owned(), problem })
}

/// Writes a square of values.
fn write_plane(path: &Path, side: usize, name: &str, values: &[f32], bits: GrayBits) -> Result<(), Error> {
    match extension(path).as_str() {
        "npy" => write_npy(path, &[side, side], Array::F32(values)),
        "exr" => {
            let channel = Channel { name: name.into(), samples: Samples::F32(values.to_vec()) };
            write_exr(path, side, side, vec![channel])
        }
        // In range: the sides of an atlas are.
        _ => write_png_gray(path, side as u32, side as u32, values, bits),
    }
}

/// The mean vectors of texels, of unit length again; NaN where there are none.
fn unit_vectors(image: &TexelImage<3>) -> Vec<[f32; 3]> {
    let unit = |v: &[f32; 3]| {
        let sum = DVec3::from_array(v.map(f64::from));
        let length = (sum.x * sum.x + sum.y * sum.y + sum.z * sum.z).sqrt();
        if length > 0.0 { (sum / length).to_array().map(|x| x as f32) } else { *v }
    };
    image.values().iter().map(unit).collect()
}
