//! Meshes with a value at each vertex, as PLY files.
//!
//! The vertices with `float x y z`, the value under its name, and as `uchar red green blue` for viewers; the
//! faces as `list uchar uint vertex_indices`; binary, little-endian. Gray is linear, 255 times the value; a vertex without a value
//! has NaN, and is white. A mesh that was moved by an offset while it was read is written where its file has it, with
//! `double x y z`.
//!
//! Based on: Greg Turk, "The PLY Polygon File Format", 1994.

use std::path::Path;

use umbel_core::glam::DVec3;

use crate::error::Error;
use crate::files::output::{refused, write_atomically};
use crate::files::png::gray8;

/// Writes a mesh with a value for each position: positions, triangles as indices of these, and the offset that was taken
/// from the positions when they were read, else 0. `name` is that of the property.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or if there are more or fewer values than vertices.
pub fn write_ply_mesh(
    path: &Path,
    (positions, triangles, offset): (&[[f32; 3]], &[[u32; 3]], DVec3),
    name: &str,
    values: &[f32],
) -> Result<(), Error> {
    let (vertices, faces) = (positions.len(), triangles.len());
    if values.len() != vertices {
        return Err(refused(path, format!("{} values for {vertices} vertices", values.len())));
    }
    let is_moved = offset != DVec3::ZERO;
    let number = if is_moved { "double" } else { "float" };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty {number} x\nproperty {number} y\n\
         property {number} z\nproperty float {name}\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        for (&[x, y, z], &value) in positions.iter().zip(values) {
            if is_moved {
                let place = DVec3::new(x.into(), y.into(), z.into()) + offset;
                out.write_all(place.to_array().map(f64::to_le_bytes).as_flattened())?;
                out.write_all(&value.to_le_bytes())?;
            } else {
                out.write_all([x, y, z, value].map(f32::to_le_bytes).as_flattened())?;
            }
            out.write_all(&[gray8(value); 3])?;
        }
        triangles.iter().try_for_each(|corners| {
            out.write_all(&[3])?;
            out.write_all(corners.map(u32::to_le_bytes).as_flattened())
        })
    })
}
