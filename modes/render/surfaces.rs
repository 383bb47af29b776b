//! What a camera sees of surfaces on demand: ids, distances and all that follows from them, and the shaded preview.
//!
//! A hit is that of a micropolygon: its normal is flat, and so small that a pixel sees about one or a few of them.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987.

use std::time::Duration;

use rayon::prelude::*;
use umbel_core::glam::DVec3;
use umbel_core::{
    Dicing, NO_TRIANGLE, Options, Origin, Stats, SurfaceHits, TileStats, TriangleId, Triangles,
    shadowed_on_demand,
};

use crate::error::Error;
use crate::formats::load_surfaces::SurfaceScene;
use crate::render::bounce::Followed;
use crate::render::lamps::Lamps;
use crate::render::point_cloud::{SeenPoint, seen_points};
use crate::render::queries::timed;
use crate::render::shade::{Appearance, background_of};
use crate::render::work::heat_of;
use crate::render::{Aov, AovData, Preview, numbers, spread};
use crate::scene::CLAY;
use crate::scene::camera::{Camera, Shot};
use crate::scene::hit_points::in_frame_of_file;
use crate::scene::hit_points::surface_distance;
use crate::shadow::Receivers;
use crate::shadow::receivers_of;
use crate::surfaces::extent::{rounded, widened};

/// What each ray of a camera hits of surfaces on demand, with the rays.
#[derive(Debug)]
pub struct SurfaceBuffer {
    /// The rays and the pixel of each.
    pub shot: Shot,
    /// What each ray hits.
    pub hits: SurfaceHits,
    /// Pixels of the picture.
    pub pixels: usize,
    /// What was taken from the positions of the scene's file, [`SurfaceScene::offset`].
    pub offset: DVec3,
}

/// How the preview of surfaces is made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceLook {
    /// Passes over sub-pixel positions; at least one is made.
    pub samples: u32,
    /// Jitters those positions by this seed, one for each pass; else they are the same in every run.
    pub jitter: Option<u64>,
    /// Lights with exact shadows: hits must keep corners, see [`Dicing::keep_corners`].
    pub lights: Vec<Origin>,
}

impl SurfaceLook {
    /// The rays of a pass, one of [`SurfaceLook::samples`].
    ///
    /// # Errors
    /// As [`Camera::shot`].
    pub fn shot(&self, camera: &Camera, pass: u32) -> Result<Shot, Error> {
        match self.jitter {
            Some(seed) => camera.jittered_shot(pass, self.samples.max(1), seed),
            None => camera.subpixel_shot(pass, self.samples.max(1)),
        }
    }
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
    let mut buffer = SurfaceBuffer { shot, hits: SurfaceHits::default(), pixels, offset: scene.offset };
    let stats = buffer.see(scene, dicing, options)?;
    Ok((buffer, stats))
}

/// The linear preview, (r, g, b) per pixel: the mean of all passes. Where there is one, it is what `buffer` sees.
///
/// # Errors
/// As [`surface_visibility`].
pub fn surface_preview(
    scene: &SurfaceScene,
    camera: &Camera,
    buffer: &SurfaceBuffer,
    look: &SurfaceLook,
    (dicing, options): (&Dicing, &Options),
    mut progress: impl FnMut(u32),
) -> Result<Preview, Error> {
    let (mut engine, followed) = (Duration::ZERO, Followed::default());
    let shade = |seen: &SurfaceBuffer, engine: &mut Duration| {
        let lamps = seen.lamps(scene, look, (dicing, options), engine)?;
        Ok::<_, Error>(seen.shade((scene, camera), &lamps))
    };
    if look.samples <= 1 && look.jitter.is_none() {
        let linear = shade(buffer, &mut engine)?;
        return Ok(Preview { linear, followed, engine });
    }
    let samples = look.samples.max(1);
    let mut linear = vec![0.0; buffer.pixels * 3];
    let (shot, hits) = (look.shot(camera, 0)?, SurfaceHits::default());
    let mut seen = SurfaceBuffer { shot, hits, pixels: buffer.pixels, offset: scene.offset };
    for pass in 0..samples {
        seen.shot = look.shot(camera, pass)?;
        timed(&mut engine, || seen.see(scene, dicing, options))?;
        let pixels = shade(&seen, &mut engine)?;
        linear.par_iter_mut().zip(pixels).for_each(|(sum, value)| *sum += value);
        progress(pass + 1);
    }
    let count = samples as f32;
    linear.par_iter_mut().for_each(|value| *value /= count);
    Ok(Preview { linear, followed, engine })
}

impl SurfaceBuffer {
    /// Finds what the rays of the shot hit, in the memory of the last hits.
    ///
    /// # Errors
    /// As [`surface_visibility`].
    pub fn see(&mut self, scene: &SurfaceScene, dicing: &Dicing, options: &Options) -> Result<Stats, Error> {
        Ok(self.hits.find(&scene.surfaces, &self.shot.pencil, dicing, options)?)
    }

    /// Derives one quantity: id (of the surface), depth, distance, normal (of the micropolygon), position, uv (of the patch), or work.
    /// O(pixels).
    ///
    /// # Errors
    /// [`Error::Usage`] for what only triangles have.
    pub fn derive(&self, aov: Aov) -> Result<AovData, Error> {
        Ok(match aov {
            Aov::Id => AovData::U32(spread(&self.shot, self.pixels, self.hits.ids(), &[NO_TRIANGLE])),
            Aov::Depth => AovData::F32(1, spread(&self.shot, self.pixels, self.hits.ts(), &[f32::INFINITY])),
            Aov::Distance => self.derived([f32::INFINITY], |k| {
                [surface_distance(&self.shot.pencil.ray(k), self.hits.ts()[k])]
            }),
            Aov::Normal => self.derived([f32::NAN; 3], |k| self.hits.normals()[k]),
            Aov::Position => self.derived([f32::NAN; 3], |k| {
                let ray = self.shot.pencil.ray(k);
                rounded(in_frame_of_file(
                    ray.origin + ray.direction * f64::from(self.hits.ts()[k]),
                    self.offset,
                ))
            }),
            Aov::Uv => self.derived([f32::NAN; 2], |k| self.hits.uvs()[k]),
            Aov::Work => {
                let tiles = self.hits.tiles();
                let work = heat_of(&self.shot.pencil, (tiles, TileStats::samples_per_ray), self.hits.pairs());
                AovData::F32(1, spread(&self.shot, self.pixels, work, &[f32::NAN]))
            }
            Aov::Doubts => {
                let tiles = self.hits.tiles();
                let doubts = heat_of(&self.shot.pencil, (tiles, TileStats::doubts_per_ray), &[]);
                AovData::F32(1, spread(&self.shot, self.pixels, doubts, &[f32::NAN]))
            }
            Aov::Bary | Aov::Object => {
                return Err(Error::Usage(
                    "bary and object are of triangles; surfaces on demand have id, depth, distance, normal, position, uv, work and doubts".into(),
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
        AovData::F32(C, spread(&self.shot, self.pixels, numbers(self.hits.len(), of_ray), &miss))
    }

    /// The receivers of each light among what is seen. They lie on micropolygons, which have no ids.
    ///
    /// # Errors
    /// When a light is out of range, or hits have kept no corners.
    pub fn receivers(&self, lights: &[Origin]) -> Result<Vec<Receivers>, Error> {
        let (ids, corners) = (self.hits.ids(), self.hits.corners());
        let too_many = |_| umbel_core::Error::TooManyTriangles { triangles: ids.len() };
        let end = u32::try_from(3 * ids.len()).map_err(too_many)?;
        if corners.len() < ids.len() {
            return Err(Error::Usage(
                "shadows need hits that keep their corners: Dicing::keep_corners".into(),
            ));
        }
        // A triangle for each ray.
        let indices: Vec<[u32; 3]> = (0..end).step_by(3).map(|first| [first, first + 1, first + 2]).collect();
        let triangles = Triangles::new(corners.as_flattened(), &indices)?;
        // In range: there are as many as rays.
        let of_ray = |ray: usize| (ids[ray] != NO_TRIANGLE).then_some(TriangleId(ray as u32));
        let mut found =
            receivers_of(&triangles, &|ray| self.shot.pencil.ray(ray), (ids.len(), &of_ray), lights)?;
        for receiver in found.iter_mut().flat_map(|found| &mut found.points) {
            receiver.triangle = TriangleId(NO_TRIANGLE);
        }
        Ok(found)
    }

    /// The lights of a preview, with their shadows.
    fn lamps<'a>(
        &self,
        scene: &SurfaceScene,
        look: &'a SurfaceLook,
        (dicing, options): (&Dicing, &Options),
        engine: &mut Duration,
    ) -> Result<Lamps<'a>, Error> {
        let lights = &look.lights[..];
        let receivers = if lights.is_empty() { Vec::new() } else { self.receivers(lights)? };
        let view = (&self.shot.pencil, dicing);
        Lamps::of((lights, receivers), self.hits.len(), |light, points| {
            Ok(timed(engine, || shadowed_on_demand(&scene.surfaces, view, light, points, options))?.0)
        })
    }

    /// The linear preview of one pass.
    fn shade(&self, (scene, camera): (&SurfaceScene, &Camera), lamps: &Lamps<'_>) -> Vec<f32> {
        let of_ray = |k: usize| {
            let ray = self.shot.pencil.ray(k);
            if self.hits.ids()[k] == NO_TRIANGLE {
                return background_of(camera, k, &ray);
            }
            let viewer = -ray.direction.normalize_or_zero();
            let normal = widened(self.hits.normals()[k]);
            let normal = if normal.dot(viewer) < 0.0 { -normal } else { normal };
            let albedo = scene.colour(self.hits.ids()[k]).unwrap_or(CLAY);
            let point = ray.origin + ray.direction * f64::from(self.hits.ts()[k]);
            let lamps = (!lamps.is_empty()).then(|| lamps.light_at(k, point, normal));
            Appearance { albedo, normal, viewer, up: camera.up, lamps }.colour()
        };
        spread(&self.shot, self.pixels, numbers(self.hits.len(), of_ray), &[0.0; 3])
    }
}
