//! The files of `umbel bake`: values as arrays, meshes and images; bent normals; rays.
//!
//! Arrays have NaN where nothing was baked. Images are for use and for looking at: they are extended by the margin, and white beyond it.

use std::path::Path;

use glam::DVec3;
use umbel::{
    Array, Channel, Error, GrayBits, Polarity, Samples, Scene, TexelImage, write_exr, write_npy,
    write_ply_mesh, write_png_gray,
};

use crate::bake_args::BakeArgs;
use crate::bake_source::{Results, Source, Values};
use crate::picture::extension;

/// Writes the files that were asked for, and hashes their numbers.
pub(crate) fn write(
    args: &BakeArgs,
    (scene, source): (&Scene, &Source<'_>),
    found: Results,
    polarity: Polarity,
    hash: &mut blake3::Hasher,
) -> Result<(), Error> {
    let name = if polarity == Polarity::Openness { "openness" } else { "occlusion" };
    let mut hashed = |values: &[f32]| {
        values.iter().for_each(|value| _ = hash.update(&value.to_le_bytes()));
    };
    let (shape, bent) = match found.values {
        Values::List(values, bent) => {
            if let Some(path) = &args.output {
                hashed(&values);
                write_list(path, (scene, source), name, &values)?;
            }
            (vec![values.len()], bent)
        }
        Values::Image(mut image, bent) => {
            let side = image.size() as usize;
            if let Some(path) = &args.coverage {
                let covered: Vec<f32> = image.covered().iter().map(|&covered| f32::from(covered)).collect();
                hashed(&covered);
                write_plane(path, side, "coverage", &covered, GrayBits::Eight)?;
            }
            if let Some(path) = &args.output {
                if extension(path) != "npy" {
                    image.extend(args.receivers.margin.unwrap_or(crate::bake_args::MARGIN));
                }
                hashed(image.values().as_flattened());
                write_plane(path, side, name, image.values().as_flattened(), args.bits())?;
            }
            (vec![side, side], bent.map_or(Vec::new(), |bent| unit_vectors(&bent)))
        }
    };
    if let Some(path) = &args.bent {
        hashed(bent.as_flattened());
        write_npy(path, &[shape, vec![3]].concat(), Array::F32(bent.as_flattened()))?;
    }
    if let Some(path) = &args.dump_rays {
        hashed(found.traced.as_flattened());
        write_npy(path, &[found.traced.len(), 8], Array::F32(found.traced.as_flattened()))?;
    }
    Ok(())
}

/// Writes values one after the other: on the scene itself, or on points without faces.
fn write_list(
    path: &Path,
    (scene, source): (&Scene, &Source<'_>),
    name: &str,
    values: &[f32],
) -> Result<(), Error> {
    if extension(path) == "npy" {
        return write_npy(path, &[values.len()], Array::F32(values));
    }
    match source {
        Source::Points(points) => {
            let positions = points.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point).collect();
            write_ply_mesh(path, &Scene { positions, ..Scene::default() }, name, values)
        }
        _ => write_ply_mesh(path, scene, name, values),
    }
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
