//! Patterns: rays from one place along directions that a file lists, as a LiDAR's own table does.
//!
//! The file is an NPY array of shape (..., 3): one direction (x, y, z) in world axes for each element of the leading
//! extents, of any length, taken as it is. The rays of a pattern are one scattered film.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005 (scattered films).

use std::path::Path;

use glam::DVec3;
use umbel_core::{Film, Origin, Pencil};

use crate::error::Error;
use crate::files::npy::read::read_npy;
use crate::scene::camera::{Shot, on_origin_grid};

/// How a file of directions is made.
const REMEDY: &str = "each row is a direction x, y, z: numpy.save(FILE, directions.reshape(-1, 3))";

/// Rays along listed directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// The rays, in the order of the list.
    pub shot: Shot,
    /// The extents of the list, the slowest first: (N) for directions of shape (N, 3).
    pub shape: Vec<u32>,
}

/// Reads directions, and sends a ray from `center` along each.
///
/// # Errors
/// [`Error::Input`] when the file is no such array, with the row of the first direction that is zero, not finite or out of
/// range; [`Error::Engine`] when `center` is out of range.
pub fn read_pattern(path: &Path, center: DVec3) -> Result<Pattern, Error> {
    let refused = |problem: String, remedy: &str| Error::Input {
        path: path.to_owned(),
        line: None,
        problem,
        remedy: remedy.to_owned(),
    };
    let (extents, numbers) = read_npy(path)?;
    let shape = match extents.as_slice() {
        [leading @ .., 3] if !leading.is_empty() => leading,
        _ => return Err(refused(format!("an array of shape {extents:?} is no list of directions"), REMEDY)),
    };
    let shape: Option<Vec<u32>> = shape.iter().map(|&extent| u32::try_from(extent).ok()).collect();
    let shape = shape.ok_or_else(|| refused(format!("shape {extents:?} has too many rays"), REMEDY))?;

    let directions = numbers.as_chunks().0.iter().copied().map(DVec3::from_array).collect();
    let pencil = Pencil::new(Origin::Point(on_origin_grid(center)), vec![Film::Scattered(directions)]);
    let pencil = pencil.map_err(|error| match error {
        umbel_core::Error::Direction { direction } => {
            let same = |row: &[f64; 3]| row.map(f64::to_bits) == direction.map(f64::to_bits);
            let row = numbers.as_chunks().0.iter().position(same).unwrap_or_default();
            refused(format!("row {row}, counted from 0: {error}"), "leave it out, or mend it")
        }
        other => other.into(),
    })?;
    Ok(Pattern { shot: Shot { pencil, pixels: None }, shape })
}
