//! Pictures of where a setting differs from the reference: pixel by pixel, texel by texel, or on the surface of the scene.
//!
//! A picture is reduced to a small one. Each block of pixels shows the one of them that differs most, so that a single wrong
//! pixel does not vanish.

use umbel::builtin::builtin_view;
use umbel::files::encode_png_rgb8;
use umbel::glam::DVec3;
use umbel::{Camera, Error, Lens, Options, Scene, Triangles, visibility};

use crate::bake::source::Source;

/// The most pixels along a side of a picture.
const SIDE: usize = 360;
/// Where there is nothing to compare.
const NOTHING: [u8; 3] = [52, 55, 62];
/// The error that is drawn brightest.
pub(crate) const BRIGHTEST: f64 = 0.25;
/// Colours from no error to the brightest, evenly spaced in the root of the error: dark to light, also in gray.
const RAMP: [[f64; 3]; 5] =
    [[0.0, 0.0, 4.0], [81.0, 18.0, 124.0], [183.0, 55.0, 121.0], [252.0, 137.0, 97.0], [252.0, 253.0, 191.0]];
/// The light reaches it, and the setting says it does not.
pub(crate) const TOO_DARK: [u8; 3] = [230, 120, 0];
/// It is in shadow, and the setting says that it is lit.
pub(crate) const TOO_LIGHT: [u8; 3] = [40, 140, 255];

/// What items are drawn on.
pub(crate) enum Canvas {
    /// They are the pixels of a picture; a mask shows on which side it errs.
    Pixels { width: usize, rows: usize, is_mask: bool },
    /// They are vertices: for each pixel those of the triangle that it sees, and their weights.
    Surface { width: usize, rows: usize, seen: Vec<Option<[(u32, f64); 3]>> },
    /// They lie anywhere.
    Nothing,
}

impl Canvas {
    /// The picture of a camera.
    pub(crate) fn of_camera(camera: &Camera, is_mask: bool) -> Self {
        Self::Pixels { width: camera.width as usize, rows: camera.rows() as usize, is_mask }
    }

    /// The picture of what is baked.
    pub(crate) fn of_source(source: &Source<'_>, scene: &Scene) -> Result<Self, Error> {
        match source {
            Source::Texels(atlas, _) => {
                let side = atlas.size() as usize;
                Ok(Self::Pixels { width: side, rows: side, is_mask: false })
            }
            Source::Vertices(..) => Self::of_surface(scene),
            Source::Points(_) => Ok(Self::Nothing),
        }
    }

    /// The scene as a camera sees it that frames it.
    fn of_surface(scene: &Scene) -> Result<Self, Error> {
        let (width, rows) = (SIDE as u32, SIDE as u32 * 2 / 3);
        let lens = Lens::Pinhole { fov: 45.0 };
        let mut camera = Camera::framing(&scene.bounds(), DVec3::new(1.0, 0.7, 1.0), lens, width, rows);
        if let Some(view) = scene.name.strip_prefix("builtin:").and_then(builtin_view) {
            let [eye, target, up] = [view.eye, view.target, view.up].map(DVec3::from_array);
            camera = Camera { eye, target, up, lens: Lens::Pinhole { fov: view.fov_degrees }, ..camera };
        }
        let triangles = scene.geometry()?;
        let (buffer, _) = visibility(scene, &camera, &Options::default())?;
        let pencil = camera.shot()?.pencil;
        let of_ray = |k: usize| {
            let hit = buffer.hits.get(k)?;
            let weights = Triangles::barycentrics(&triangles, hit.id, &pencil.ray(k));
            let corners = scene.triangles[hit.id.0 as usize];
            Some([0, 1, 2].map(|corner| (corners[corner], weights[corner])))
        };
        let seen = (0..pencil.len()).map(of_ray).collect();
        Ok(Self::Surface { width: width as usize, rows: rows as usize, seen })
    }

    /// A picture, as a PNG file, of where an answer differs from the reference.
    pub(crate) fn difference(&self, found: &[f32], reference: &[f32], channels: usize) -> Option<Vec<u8>> {
        let (width, rows) = match *self {
            Self::Pixels { width, rows, .. } | Self::Surface { width, rows, .. } => (width, rows),
            Self::Nothing => return None,
        };
        let pixel = |k: usize| match self {
            Self::Pixels { is_mask: true, .. } => mask_colour(found[k], reference[k]),
            Self::Pixels { .. } => {
                let of = |values: &[f32], channel: usize| f64::from(values[k * channels + channel]);
                let errors = (0..channels).map(|c| (of(found, c) - of(reference, c)).abs());
                colour(errors.fold(f64::NAN, f64::max))
            }
            Self::Surface { seen, .. } => seen[k].map_or((0.0, NOTHING), |corners| {
                let error =
                    |vertex: u32| f64::from((found[vertex as usize] - reference[vertex as usize]).abs());
                colour(corners.iter().map(|&(vertex, weight)| error(vertex) * weight).sum())
            }),
            Self::Nothing => (0.0, NOTHING),
        };
        let block = width.max(rows).div_ceil(SIDE);
        let (small_width, small_rows) = (width.div_ceil(block), rows.div_ceil(block));
        let reduced = |k: usize| {
            let (column, row) = (k % small_width * block, k / small_width * block);
            let pixels = (row..rows.min(row + block))
                .flat_map(|y| (column..width.min(column + block)).map(move |x| y * width + x));
            let worst = pixels.map(pixel).max_by(|a, b| a.0.total_cmp(&b.0));
            worst.map_or(NOTHING, |(_, colour)| colour)
        };
        let bytes: Vec<u8> = (0..small_width * small_rows).flat_map(reduced).collect();
        // In range: neither side is more than SIDE.
        encode_png_rgb8(small_width as u32, small_rows as u32, &bytes).ok()
    }
}

/// How much an error shows, and its colour.
fn colour(error: f64) -> (f64, [u8; 3]) {
    if error.is_nan() {
        return (0.0, NOTHING);
    }
    let at = (error / BRIGHTEST).sqrt().min(1.0) * (RAMP.len() - 1) as f64;
    let k = (at as usize).min(RAMP.len() - 2);
    let part = at - k as f64;
    (
        error + f64::MIN_POSITIVE,
        [0, 1, 2].map(|c| (RAMP[k][c] * (1.0 - part) + RAMP[k + 1][c] * part).round() as u8),
    )
}

/// The same for a mask: where it is right, a dark picture of the reference.
fn mask_colour(found: f32, reference: f32) -> (f64, [u8; 3]) {
    let error = f64::from((found - reference).abs());
    if reference.is_nan() || found.is_nan() {
        (0.0, NOTHING)
    } else if error > 0.0 {
        (error, if found < reference { TOO_DARK } else { TOO_LIGHT })
    } else {
        (f64::MIN_POSITIVE, [(reference * 150.0) as u8; 3])
    }
}
