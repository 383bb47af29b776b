//! Checks on the user's own scene: pencils against the general path, and both against tiny-skia.
//!
//! Pencil and general path must agree in every id and every t. tiny-skia must agree in every id, with two exceptions: where the
//! nearer of the two triangles has an edge so near to the pixel that fixed-point coordinates may fall on its other side, and
//! where both cover the pixel at the same depth.

use rayon::prelude::*;
use umbel_core::{Film, Options, Path, closest_hit};

use crate::error::Error;
use crate::render::raster::{Coverage, View};
use crate::render::{VisibilityBuffer, visibility};
use crate::scene::Scene;
use crate::scene::camera::Camera;

/// What a check found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Verification {
    /// Rays compared between the paths.
    pub rays: usize,
    /// Rays that hit something.
    pub hits: usize,
    /// Rays for which id or t differ between pencil and general path: must be 0.
    pub path_differences: usize,
    /// Pixels compared with tiny-skia; 0 for lenses that bend straight lines.
    pub pixels: usize,
    /// Pixels that differ from tiny-skia near a projected edge.
    pub near_edges: usize,
    /// Pixels that differ from tiny-skia where two surfaces have the same depth.
    pub same_depth: usize,
    /// Pixels that differ from tiny-skia without an excuse: must be 0.
    pub raster_differences: usize,
    /// One byte per pixel of the film rows, top down: see [`Mark`].
    pub marks: Vec<Mark>,
}

/// What a check found at a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mark {
    /// No hit, no difference.
    #[default]
    Miss,
    /// A hit, no difference.
    Hit,
    /// A difference within the tolerance.
    Tolerated,
    /// A real difference.
    Difference,
}

impl Verification {
    /// Whether there is no real difference.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.path_differences == 0 && self.raster_differences == 0
    }
}

/// Renders by pencil, by general path and by tiny-skia, and compares.
///
/// # Errors
/// When the camera or the scene is refused.
pub fn verify(scene: &Scene, camera: &Camera, options: &Options) -> Result<Verification, Error> {
    let (buffer, _) = visibility(scene, camera, &Options { path: Path::Pencil, ..*options })?;
    verify_buffer(scene, &buffer, options)
}

/// Compares a visibility buffer with the general path and with tiny-skia.
///
/// # Errors
/// When the scene is refused.
pub fn verify_buffer(
    scene: &Scene,
    buffer: &VisibilityBuffer,
    options: &Options,
) -> Result<Verification, Error> {
    let triangles = scene.geometry()?;
    let (shot, pencil) = (&buffer.shot, &buffer.hits);
    let (general, _) = closest_hit(&triangles, &shot.pencil, &Options { path: Path::General, ..*options })?;

    let mut found = Verification { rays: pencil.len(), ..Verification::default() };
    found.marks = (0..pencil.len())
        .map(|ray| match (pencil.get(ray) == general.get(ray), pencil.get(ray)) {
            (false, _) => Mark::Difference,
            (true, Some(_)) => Mark::Hit,
            (true, None) => Mark::Miss,
        })
        .collect();
    found.hits = pencil.ids().iter().filter(|&&id| id != umbel_core::NO_TRIANGLE).count();
    found.path_differences = found.marks.iter().filter(|&&mark| mark == Mark::Difference).count();

    let mut first = 0;
    for film in shot.pencil.films() {
        let Film::Grid(film) = film else { continue };
        let view = View::new(&triangles, shot.pencil.origin(), film);
        let raster = view.rasterize();
        let ids = &pencil.ids()[first..first + raster.ids.len()];
        let excuses: Vec<Option<Excuse>> = (0..ids.len())
            .into_par_iter()
            .map(|place| {
                // In range: a film has fewer than 2³² pixels.
                let pixel = (place as u32 % film.width(), place as u32 / film.width());
                excuse(&view, ids[place], raster.ids[place], pixel)
            })
            .collect();
        for (place, excuse) in excuses.into_iter().enumerate() {
            let Some(excuse) = excuse else { continue };
            let (counter, mark) = match excuse {
                Excuse::NearEdge => (&mut found.near_edges, Mark::Tolerated),
                Excuse::SameDepth => (&mut found.same_depth, Mark::Tolerated),
                Excuse::None => (&mut found.raster_differences, Mark::Difference),
            };
            *counter += 1;
            // What tiny-skia excuses does not excuse a difference between the paths.
            if found.marks[first + place] != Mark::Difference {
                found.marks[first + place] = mark;
            }
        }
        found.pixels += raster.ids.len();
        first += raster.ids.len();
    }
    Ok(found)
}

/// Why two rasterizers may differ at a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Excuse {
    NearEdge,
    SameDepth,
    None,
}

/// `None` where both see the same.
///
/// An excuse holds only where both answers could be right if tiny-skia were displaced by its own rounding: each of the two
/// triangles covers the pixel or nearly does, and the nearer one, which one of the two has not seen, only nearly does.
fn excuse(view: &View<'_>, ours: u32, theirs: u32, pixel: (u32, u32)) -> Option<Excuse> {
    if ours == theirs {
        return None;
    }
    let (ours, theirs) = (view.sight(ours, pixel), view.sight(theirs, pixel));
    if ours.coverage == Coverage::Outside || theirs.coverage == Coverage::Outside {
        return Some(Excuse::None);
    }
    let nearer = if ours.depth < theirs.depth { ours } else { theirs };
    Some(if nearer.coverage == Coverage::NearEdge {
        Excuse::NearEdge
    } else if ours.is_as_far_as(&theirs) {
        Excuse::SameDepth
    } else {
        Excuse::None
    })
}
