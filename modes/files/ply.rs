//! Meshes with a value at each vertex, as PLY files.
//!
//! The vertices with `float x y z`, the value under its name, and as `uchar red green blue` for viewers; the
//! faces as `list uchar uint vertex_indices`; binary, little-endian. Gray is linear, 255 times the value; a vertex without a value
//! has NaN, and is white.
//!
//! Based on: Greg Turk, "The PLY Polygon File Format", 1994.

use std::path::Path;

use crate::error::Error;
use crate::files::output::{refused, write_atomically};
use crate::files::png::gray8;

/// Writes triangles, as indices of positions, with a value for each position. `name` is that of the property.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written, or if there are more or fewer values than vertices.
pub fn write_ply_mesh(
    path: &Path,
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    name: &str,
    values: &[f32],
) -> Result<(), Error> {
    let (vertices, faces) = (positions.len(), triangles.len());
    if values.len() != vertices {
        return Err(refused(path, format!("{} values for {vertices} vertices", values.len())));
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nproperty float {name}\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    );
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        for (&[x, y, z], &value) in positions.iter().zip(values) {
            out.write_all([x, y, z, value].map(f32::to_le_bytes).as_flattened())?;
            out.write_all(&[gray8(value); 3])?;
        }
        triangles.iter().try_for_each(|corners| {
            out.write_all(&[3])?;
            out.write_all(corners.map(u32::to_le_bytes).as_flattened())
        })
    })
}
