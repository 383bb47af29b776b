//! Points of a file as receivers: positions and normals, and on request the triangles that they lie on.
//!
//! The file is an NPY array (N, 6) of x, y, z, nx, ny, nz, rounded to f32. A normal is of any length; rays leave into the
//! half space that it points into. A point is taken as it is. Where it comes from somewhere else and may lie a little
//! beneath the surface, a bias moves it along its unit normal: p + b·n.
//!
//! A second file names the triangle of each point, which never occludes it: an array (N) of integers, −1 or 4294967295 for none.
//!
//! Based on: the conventions of `ambient_occlusion(V, F, P, N)` in libigl, Alec Jacobson, Daniele Panozzo et al.

use std::path::Path;

use glam::DVec3;
use umbel_core::{Above, Hemisphere, NO_TRIANGLE, Receiver, TriangleId, Triangles};

use crate::bake::receivers::BakeReceivers;
use crate::bake::receivers::angles::unit;
use crate::error::Error;
use crate::files::npy::read::{read_npy, read_npy_ids};

/// How a file of points is made.
const POINTS: &str = "each row is x, y, z, nx, ny, nz: numpy.save(FILE, numpy.hstack([positions, normals]))";
/// How a file of ids is made.
const IDS: &str = "one triangle for each point, or -1: numpy.save(FILE, ids.astype(\"<u4\"))";

/// Reads points, and the triangles of `triangles` that they lie on. Their numbers are those of the rows. The points are in
/// the frame of the scene's file; `offset` is what was taken from that, [`Scene::offset`](crate::Scene::offset).
///
/// # Errors
/// [`Error::Input`] when a file is no such array, with the first row whose position is not finite, whose normal is zero or
/// not finite, or whose triangle does not exist.
pub fn read_points(
    path: &Path,
    ids: Option<&Path>,
    triangles: &Triangles<'_>,
    (bias, offset): (f64, DVec3),
) -> Result<BakeReceivers, Error> {
    let (shape, numbers) = read_npy(path)?;
    let rows: &[[f64; 6]] = match shape.as_slice() {
        [_, 6] => numbers.as_chunks().0,
        _ => return Err(refused(path, format!("an array of shape {shape:?} is no list of points"), POINTS)),
    };
    if u32::try_from(rows.len()).is_err() {
        return Err(refused(path, format!("{} points are too many", rows.len()), "split the file"));
    }
    let ids = ids.map(|path| read_ids(path, rows.len(), triangles)).transpose()?;
    let mut receivers = BakeReceivers::default();
    for (index, row) in (0_u32..).zip(rows) {
        let triangle = TriangleId(ids.as_ref().map_or(NO_TRIANGLE, |ids| ids[index as usize]));
        let (hemisphere, normal) = receiver(*row, triangle, (bias, offset)).map_err(|problem| {
            refused(path, format!("row {index}, counted from 0: {problem}"), "leave it out, or mend it")
        })?;
        receivers.push(hemisphere, normal, index);
    }
    Ok(receivers)
}

/// The receiver of a row, and its unit normal; or what is wrong with it.
fn receiver(
    row: [f64; 6],
    triangle: TriangleId,
    (bias, offset): (f64, DVec3),
) -> Result<(Hemisphere, [f32; 3]), String> {
    let [x, y, z, nx, ny, nz] = row;
    let (position, normal) = (DVec3::new(x, y, z) - offset, DVec3::new(nx, ny, nz));
    let unit =
        unit(normal).ok_or_else(|| format!("the normal {nx}, {ny}, {nz} must be finite and not zero"))?;
    let to_f32 = |v: DVec3| v.to_array().map(|x| x as f32);
    let point = to_f32(if bias == 0.0 { position } else { position + unit * bias });
    if !point.iter().all(|x| x.is_finite()) {
        return Err(format!("the position {x}, {y}, {z} must be finite, in the range of f32"));
    }
    // A length that f32 does not hold is no matter: only the direction counts.
    let given = to_f32(normal);
    let is_normal = given.iter().all(|x| x.is_finite()) && given.iter().any(|x| x.is_normal());
    let above = Above::Normal(if is_normal { given } else { to_f32(unit) });
    Ok((Hemisphere { receiver: Receiver { point, triangle }, above }, to_f32(unit)))
}

/// Reads the triangle of each point.
fn read_ids(path: &Path, points: usize, triangles: &Triangles<'_>) -> Result<Vec<u32>, Error> {
    let (shape, numbers) = read_npy_ids(path)?;
    if shape != [points] {
        return Err(refused(path, format!("an array of shape {shape:?} for {points} points"), IDS));
    }
    let id = |(row, &number): (usize, &i64)| match u32::try_from(number) {
        Ok(id) if id == NO_TRIANGLE || (id as usize) < triangles.len() => Ok(id),
        Err(_) if number == -1 => Ok(NO_TRIANGLE),
        _ => {
            let problem = format!(
                "row {row}, counted from 0: triangle {number} does not exist, the scene has {}",
                triangles.len()
            );
            Err(refused(path, problem, "ids count the triangles in file order, from 0"))
        }
    };
    numbers.iter().enumerate().map(id).collect()
}

/// The error of a file.
fn refused(path: &Path, problem: String, remedy: &str) -> Error {
    Error::Input { path: path.to_owned(), line: None, problem, remedy: remedy.into() }
}
