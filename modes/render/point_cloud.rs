//! Point clouds: the points that rays see, and their PLY file.
//!
//! One vertex for each ray that hits, in the order of the pixels: `float x y z`, the unit normal `float nx ny nz` and the
//! triangle `uint id`; binary, little-endian.
//!
//! Based on: Greg Turk, "The PLY Polygon File Format", 1994.

use std::path::Path;

use umbel_core::NO_TRIANGLE;

use crate::error::Error;
use crate::files::output::write_atomically;
use crate::render::{Aov, AovData, VisibilityBuffer};
use crate::scene::Scene;

/// A point that a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPoint {
    /// Where it is, in world space.
    pub position: [f32; 3],
    /// The unit normal (b − a)×(c − a) of its triangle, not flipped toward the eye.
    pub normal: [f32; 3],
    /// Its triangle.
    pub id: u32,
}

impl SeenPoint {
    /// The point as a vertex of the file, and as it is hashed.
    #[must_use]
    pub fn to_le_bytes(self) -> [u8; 28] {
        let [x, y, z] = self.position.map(f32::to_bits);
        let [nx, ny, nz] = self.normal.map(f32::to_bits);
        let words = [x, y, z, nx, ny, nz, self.id].map(u32::to_le_bytes);
        let mut bytes = [0; 28];
        bytes.copy_from_slice(words.as_flattened());
        bytes
    }
}

impl VisibilityBuffer {
    /// The points that are seen: one for each pixel with a hit, in the order of the pixels.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn points(&self, scene: &Scene) -> Result<Vec<SeenPoint>, Error> {
        let (positions, normals) = (self.derive(Aov::Position, scene)?, self.derive(Aov::Normal, scene)?);
        Ok(seen_points(self.ids(), &positions, &normals))
    }
}

/// The points of pixels with a hit.
pub(crate) fn seen_points(ids: Vec<u32>, positions: &AovData, normals: &AovData) -> Vec<SeenPoint> {
    let (AovData::F32(_, positions), AovData::F32(_, normals)) = (positions, normals) else {
        return Vec::new();
    };
    let places = positions.as_chunks().0.iter().zip(normals.as_chunks().0);
    // A list that grows would be copied.
    let mut points = Vec::with_capacity(ids.iter().filter(|&&id| id != NO_TRIANGLE).count());
    let hits = ids.into_iter().zip(places).filter(|(id, _)| *id != NO_TRIANGLE);
    points.extend(hits.map(|(id, (&position, &normal))| SeenPoint { position, normal, id }));
    points
}

/// Writes points as a PLY file.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written.
pub fn write_ply(path: &Path, points: &[SeenPoint]) -> Result<(), Error> {
    let fields = ["x", "y", "z", "nx", "ny", "nz"].map(|name| format!("property float {name}\n")).concat();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{fields}property uint id\nend_header\n",
        points.len()
    );
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        points.iter().try_for_each(|point| out.write_all(&point.to_le_bytes()))
    })
}
