//! What a camera sees of surfaces on demand: ids, distances and all that follows from them, and the shaded preview.
//!
//! A hit is that of a micropolygon: its normal is flat, and so small that a pixel sees about one or a few of them.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987.

use rayon::prelude::*;
use umbel_core::{Dicing, NO_TRIANGLE, Options, Stats, SurfaceHits, closest_hit_on_demand};

use crate::camera::{Camera, Shot};
use crate::extent::{rounded, widened};
use crate::point_cloud::{SeenPoint, seen_points};
use crate::primary::{Aov, AovData, spread};
use crate::scene::CLAY;
use crate::shade::{Appearance, background_of};
use crate::{Error, SurfaceScene};

/// What each ray of a camera hits of surfaces on demand, with the rays.
#[derive(Debug)]
pub struct SurfaceBuffer {
    /// The rays and the pixel of each.
    pub shot: Shot,
    /// What each ray hits.
    pub hits: SurfaceHits,
    /// Pixels of the picture.
    pub pixels: usize,
}

/// Finds what a camera sees of surfaces through its pixel centres.
///
/// # Errors
/// When the camera or the shading rate is refused, or the lens bends straight lines.
pub fn surface_visibility(
    scene: &SurfaceScene,
    shot: Shot,
    pixels: usize,
    dicing: &Dicing,
    options: &Options,
) -> Result<(SurfaceBuffer, Stats), Error> {
    let (hits, stats) = closest_hit_on_demand(&scene.surfaces, &shot.pencil, dicing, options)?;
    Ok((SurfaceBuffer { shot, hits, pixels }, stats))
}

/// The linear preview, (r, g, b) per pixel: the mean of `samples` passes over sub-pixel positions.
///
/// # Errors
/// As [`surface_visibility`].
pub fn surface_preview(
    scene: &SurfaceScene,
    camera: &Camera,
    buffer: &SurfaceBuffer,
    samples: u32,
    (dicing, options): (&Dicing, &Options),
    mut progress: impl FnMut(u32),
) -> Result<Vec<f32>, Error> {
    if samples <= 1 {
        return Ok(buffer.shade(scene, camera));
    }
    let mut sum = vec![0.0; buffer.pixels * 3];
    for pass in 0..samples {
        let shot = camera.subpixel_shot(pass, samples)?;
        let (seen, _) = surface_visibility(scene, shot, buffer.pixels, dicing, options)?;
        let pixels = seen.shade(scene, camera);
        sum.par_iter_mut().zip(pixels).for_each(|(sum, value)| *sum += value);
        progress(pass + 1);
    }
    let count = samples as f32;
    sum.par_iter_mut().for_each(|value| *value /= count);
    Ok(sum)
}

impl SurfaceBuffer {
    /// Derives one quantity: id (of the surface), depth, distance, normal (of the micropolygon), position, or uv (of the patch).
    /// O(pixels).
    ///
    /// # Errors
    /// [`Error::Usage`] for what only triangles have.
    pub fn derive(&self, aov: Aov) -> Result<AovData, Error> {
        Ok(match aov {
            Aov::Id => AovData::U32(spread(&self.shot, self.pixels, self.hits.ids(), &[NO_TRIANGLE])),
            Aov::Depth => AovData::F32(1, spread(&self.shot, self.pixels, self.hits.ts(), &[f32::INFINITY])),
            Aov::Distance => self.derived([f32::INFINITY], |k| {
                let length = self.shot.pencil.ray(k).direction.length() * f64::from(self.hits.ts()[k]);
                [length.min(f64::from(f32::MAX)) as f32]
            }),
            Aov::Normal => self.derived([f32::NAN; 3], |k| self.hits.normals()[k]),
            Aov::Position => self.derived([f32::NAN; 3], |k| {
                let ray = self.shot.pencil.ray(k);
                rounded(ray.origin + ray.direction * f64::from(self.hits.ts()[k]))
            }),
            Aov::Uv => self.derived([f32::NAN; 2], |k| self.hits.uvs()[k]),
            Aov::Bary | Aov::Object | Aov::Work => {
                return Err(Error::Usage(
                    "bary, object and work are of triangles; surfaces on demand have id, depth, distance, normal, position and uv".into(),
                ));
            }
        })
    }

    /// The points that are seen: one for each pixel with a hit, in the order of the pixels.
    ///
    /// # Errors
    /// None, as long as [`SurfaceBuffer::derive`] knows positions and normals.
    pub fn points(&self) -> Result<Vec<SeenPoint>, Error> {
        let (positions, normals) = (self.derive(Aov::Position)?, self.derive(Aov::Normal)?);
        let ids = spread(&self.shot, self.pixels, self.hits.ids(), &[NO_TRIANGLE]);
        Ok(seen_points(ids, &positions, &normals))
    }

    /// Numbers of each hit, or `miss`.
    fn derived<const C: usize>(&self, miss: [f32; C], derive: impl Fn(usize) -> [f32; C] + Sync) -> AovData {
        let of_ray = |k: usize| if self.hits.ids()[k] == NO_TRIANGLE { miss } else { derive(k) };
        let values: Vec<f32> = (0..self.hits.len()).into_par_iter().flat_map_iter(of_ray).collect();
        AovData::F32(C, spread(&self.shot, self.pixels, &values, &miss))
    }

    /// The linear preview of one pass.
    fn shade(&self, scene: &SurfaceScene, camera: &Camera) -> Vec<f32> {
        let of_ray = |k: usize| {
            let ray = self.shot.pencil.ray(k);
            if self.hits.ids()[k] == NO_TRIANGLE {
                return background_of(camera, k, &ray);
            }
            let viewer = -ray.direction.normalize_or_zero();
            let normal = widened(self.hits.normals()[k]);
            let normal = if normal.dot(viewer) < 0.0 { -normal } else { normal };
            let albedo = scene.colour(self.hits.ids()[k]).unwrap_or(CLAY);
            Appearance { albedo, normal, viewer, up: camera.up, lamps: None }.colour()
        };
        let values: Vec<f32> = (0..self.hits.len()).into_par_iter().flat_map_iter(of_ray).collect();
        spread(&self.shot, self.pixels, &values, &[0.0; 3])
    }
}
