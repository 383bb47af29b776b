//! How many bytes things take, and the limit that a run may not pass.

use umbel::files::available_memory;
use umbel::{Error, Scene};

use crate::common::Common;

/// Bytes of a pixel: hits 8, and either points 28 with their positions and normals 24, or else a preview 12 and its sum 12,
/// bytes of the picture 3 and the widest derived image 12.
pub(crate) const PIXEL_BYTES: u64 = 60;

/// More bytes of a scattered ray: its direction and its pixel.
pub(crate) const SCATTERED_BYTES: u64 = 32;

/// More bytes of a pixel for each light: the receiver 20, at most half of that again while receivers are joined, the answer 1.
pub(crate) const SHADOW_BYTES: u64 = 31;

/// More bytes of a pixel than a triangle's hit has: (u, v) and the normal of the micropolygon.
pub(crate) const SURFACE_PIXEL_BYTES: u64 = 20;

/// Bytes of a pixel for shadows: the corners of its micropolygon, and their indices.
pub(crate) const CORNERS_BYTES: u64 = 48;

/// Bytes per texel of a map: the hit 8, the distance 4, a picture 12.
pub(crate) const MAP_TEXEL_BYTES: u64 = 24;

/// Bytes per pixel of a mask beside those of the query: the hit 8, the mask 4, bytes of the file 4.
pub(crate) const MASK_PIXEL_BYTES: u64 = 16;

/// Bytes that surfaces on demand take: those of a round of micropolygons.
pub(crate) const ROUND_BYTES: u64 = 100 << 20;

/// Stops when so many bytes, with the engine's own for the triangles, are more than there may be.
pub(crate) fn limit_memory(bytes: u64, scene: &Scene, remedy: &str, common: &Common) -> Result<(), Error> {
    let forecast = bytes + scene.triangles.len() as u64 * 6;
    let (limit, name) = match common.max_memory {
        Some(limit) => (limit, "--max-memory"),
        None => (available_memory().unwrap_or(u64::MAX), "the memory that is left,"),
    };
    if forecast > limit {
        return Err(Error::Limit(format!(
            "about {forecast} bytes are needed, more than {name} {limit}; use a smaller {remedy}"
        )));
    }
    Ok(())
}
