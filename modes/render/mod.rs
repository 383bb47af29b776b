//! Primary visibility: what a camera sees.
//!
//! The visibility buffer, (id, t) per pixel, comes first. Everything else (depth, distance, normal, position, barycentrics,
//! object, the shaded preview) is derived from it, and only what was asked for.
//!
//! Based on: Christopher Burns and Warren Hunt, "The Visibility Buffer: A Cache-Friendly Approach to Deferred Shading",
//! 2013.

pub mod bounce;
pub(crate) mod lamps;
pub mod point_cloud;
pub(crate) mod queries;
pub(crate) mod raster;
pub(crate) mod shade;
pub(crate) mod shading_normal;
pub mod surfaces;
pub mod verify;
pub mod visible;
pub(crate) mod work;

pub use bounce::Followed;
pub use bounce::spawn::{Bounces, Spawned};
pub use point_cloud::{SeenPoint, write_ply};
pub use surfaces::{SurfaceBuffer, SurfaceLook, surface_preview, surface_visibility};
pub use verify::{Mark, Verification, verify, verify_buffer};
pub use visible::{Visible, visible};

use std::borrow::Cow;
use std::time::Duration;

use rayon::prelude::*;
use umbel_core::{Frame, Hit, Hits, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Stats, TileStats};

use crate::error::Error;
use crate::render::bounce::{Surroundings, WAVE};
use crate::render::lamps::Lamps;
use crate::render::queries::{Queries, timed};
use crate::render::shade::{Shader, background_of};
use crate::render::work::heat_of;
use crate::scene::Scene;
use crate::scene::camera::{Camera, Shot};
use crate::scene::hit_points::{distance, position};

/// (id, t) of each ray of a camera, with the rays.
#[derive(Debug, Clone, PartialEq)]
pub struct VisibilityBuffer {
    /// The rays and the pixel of each.
    pub shot: Shot,
    /// What each ray hits.
    pub hits: Hits,
    /// What each tile has cost.
    pub tiles: Vec<TileStats>,
    /// What each ray has cost, where its frame has counted that: [`Frame::pairs`].
    pub pairs: Vec<u32>,
    /// Pixels of the picture.
    pub pixels: usize,
}

/// A quantity per pixel that can be derived from the visibility buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Aov {
    /// The triangle id; 0xFFFFFFFF for a miss.
    Id,
    /// t along the camera's d: the z depth of a pinhole camera; +∞ for a miss.
    Depth,
    /// The Euclidean distance from the start of the ray; +∞ for a miss.
    Distance,
    /// The unit normal (b − a)×(c − a), not flipped toward the eye; NaN for a miss.
    Normal,
    /// The point that is seen, in world space; NaN for a miss.
    Position,
    /// The barycentric weights of b and c; NaN for a miss.
    Bary,
    /// The texture coordinates of the file, interpolated; of a surface on demand, (u, v) of its patch. NaN for a miss, and where
    /// there are none.
    Uv,
    /// The index of the object in file order; 0xFFFFFFFF for a miss.
    Object,
    /// Pairs of a ray and a triangle whose edge functions were evaluated, per ray ([`Stats::samples_tested`]): the mean of the pixel's
    /// tile of 64x64 rays. On the general path, and of a lens that bends straight lines, that of the pixel's own ray, where it
    /// was counted ([`Frame::counting_pairs`]); else NaN, and the mean of all rays of the lens.
    Work,
    /// Questions that were left to more exact arithmetic, per ray ([`Stats::doubts`]): the mean of the pixel's tile, or of all rays of a lens
    /// that bends straight lines. NaN on the general path.
    Doubts,
}

/// The values of an [`Aov`], pixel by pixel.
#[derive(Debug, Clone, PartialEq)]
pub enum AovData {
    /// One number per pixel.
    U32(Vec<u32>),
    /// `.0` numbers per pixel, one after the other.
    F32(usize, Vec<f32>),
}

/// Finds what a camera sees through its pixel centres.
///
/// # Errors
/// When the camera or the scene is refused.
pub fn visibility(
    scene: &Scene,
    camera: &Camera,
    options: &Options,
) -> Result<(VisibilityBuffer, Stats), Error> {
    let shot = camera.shot()?;
    let triangles = scene.geometry()?;
    let mut frame = Frame::new();
    if options.path == Path::General {
        frame = frame.counting_pairs();
    }
    let stats = frame.closest_hit(&triangles, &shot.pencil, options)?;
    Ok((VisibilityBuffer::new(shot, camera.pixels(), frame), stats))
}

/// The depth of each pixel, row by row from the top: t along the camera's d, the z depth of a pinhole camera in world units;
/// +∞ where nothing is seen.
///
/// [`visibility`] and [`VisibilityBuffer::derive`] give more at once, and take [`Options`].
///
/// ```
/// use umbel::{Camera, Lens, builtin, glam::DVec3, render};
///
/// let scene = builtin("cornell")?;
/// let camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, Lens::Pinhole { fov: 40.0 }, 64, 48);
/// let depth = render::depth(&scene, &camera)?;
/// assert_eq!(depth.len(), 64 * 48);
/// assert!(depth[24 * 64 + 32] > 0.0);
/// # Ok::<(), umbel::Error>(())
/// ```
///
/// # Errors
/// When the camera or the scene is refused.
pub fn depth(scene: &Scene, camera: &Camera) -> Result<Vec<f32>, Error> {
    Ok(visibility(scene, camera, &Options::default())?.0.ts())
}

/// The id of the triangle that each pixel sees, row by row from the top: an index into [`Scene::triangles`];
/// [`NO_TRIANGLE`] where nothing is seen.
///
/// ```
/// use umbel::{Camera, Lens, NO_TRIANGLE, builtin, glam::DVec3, render};
///
/// let scene = builtin("cornell")?;
/// let camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, Lens::Pinhole { fov: 40.0 }, 64, 48);
/// let ids = render::ids(&scene, &camera)?;
/// assert!(ids.iter().any(|&id| id != NO_TRIANGLE));
/// # Ok::<(), umbel::Error>(())
/// ```
///
/// # Errors
/// When the camera or the scene is refused.
pub fn ids(scene: &Scene, camera: &Camera) -> Result<Vec<u32>, Error> {
    Ok(visibility(scene, camera, &Options::default())?.0.ids())
}

/// The linear preview, (r, g, b) per pixel: the mean of `samples` passes over sub-pixel positions.
///
/// The pass through the pixel centres is the visibility buffer where there is one sample.
///
/// # Errors
/// When the camera or the scene is refused.
pub fn preview(
    scene: &Scene,
    camera: &Camera,
    buffer: &VisibilityBuffer,
    samples: u32,
    options: &Options,
    progress: impl FnMut(u32),
) -> Result<Vec<f32>, Error> {
    preview_lit(scene, camera, buffer, samples, &[], options, progress)
}

/// The preview with lights and their shadows, which are exact at every sample. See [`crate::shadow::receivers`].
///
/// # Errors
/// When the camera, the scene or a light is refused.
pub fn preview_lit(
    scene: &Scene,
    camera: &Camera,
    buffer: &VisibilityBuffer,
    samples: u32,
    lights: &[Origin],
    options: &Options,
    progress: impl FnMut(u32),
) -> Result<Vec<f32>, Error> {
    let look = Look { samples, lights: lights.to_vec(), bounces: Bounces::default() };
    Ok(preview_with(scene, camera, buffer, &look, options, progress)?.linear)
}

/// How a preview is lit, and what is followed behind the camera's rays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Look {
    /// Passes over sub-pixel positions; at least one is made.
    pub samples: u32,
    /// Lights with exact shadows.
    pub lights: Vec<Origin>,
    /// Reflections and refractions.
    pub bounces: Bounces,
}

/// A preview, and what it took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Preview {
    /// Linear (r, g, b) of each pixel, row by row from the top.
    pub linear: Vec<f32>,
    /// What was followed behind the camera's rays, over all samples.
    pub followed: Followed,
    /// The time of the engine's queries: what further samples, lights and bounces see. The rest is shading.
    pub engine: Duration,
}

/// The preview with lights, and with what mirrors and glass show. Further samples take one query each, in the memory and
/// the order of the first.
///
/// # Errors
/// When the camera, the scene or a light is refused.
pub fn preview_with(
    scene: &Scene,
    camera: &Camera,
    buffer: &VisibilityBuffer,
    look: &Look,
    options: &Options,
    mut progress: impl FnMut(u32),
) -> Result<Preview, Error> {
    let triangles = scene.geometry()?;
    let shader = Shader::new(scene, &triangles);
    let (lights, bounces, up) = (&look.lights[..], look.bounces, camera.up);
    let around = Surroundings { scene, triangles: &triangles, lights, bounces, up, options, wave: WAVE };
    let (mut queries, mut followed) = (Queries::new(), Followed::default());
    let mut shade = |shot: &Shot, hits: &Hits, queries: &mut Queries| {
        let pencil = &shot.pencil;
        let lamps = Lamps::new(lights, &triangles, (&|ray| pencil.ray(ray), hits), queries, options)?;
        let mut colours = shade_rays(pencil, hits, (&shader, &lamps, &around), camera);
        followed.add(&around.follow(pencil, hits, queries, &mut colours)?);
        Ok::<_, Error>(spread(shot, buffer.pixels, colours, &[0.0; 3]))
    };
    if look.samples <= 1 {
        let linear = shade(&buffer.shot, &buffer.hits, &mut queries)?;
        return Ok(Preview { linear, followed, engine: queries.time });
    }
    let mut linear = vec![0.0; buffer.pixels * 3];
    let mut seen = Frame::keeping_order();
    for pass in 0..look.samples {
        let shot = camera.subpixel_shot(pass, look.samples)?;
        timed(&mut queries.time, || seen.closest_hit(&triangles, &shot.pencil, options))?;
        let pixels = shade(&shot, seen.hits(), &mut queries)?;
        linear.par_iter_mut().zip(pixels).for_each(|(sum, value)| *sum += value);
        progress(pass + 1);
    }
    let count = look.samples as f32;
    linear.par_iter_mut().for_each(|value| *value /= count);
    Ok(Preview { linear, followed, engine: queries.time })
}

/// The linear colours of all rays: what surfaces look like themselves, as far as they show that.
fn shade_rays(
    pencil: &Pencil,
    hits: &Hits,
    (shader, lamps, around): (&Shader<'_>, &Lamps<'_>, &Surroundings<'_>),
    camera: &Camera,
) -> Vec<f32> {
    let of_ray = |k: usize| {
        let ray = pencil.ray(k);
        match hits.get(k) {
            Some(hit) => {
                let own = around.spawn(&ray, &hit).own;
                let colour = shader.shade((k, &ray), &hit, camera.up, lamps);
                [0, 1, 2].map(|c| own[c] * colour[c])
            }
            None => background_of(camera, k, &ray),
        }
    };
    numbers(hits.len(), of_ray)
}

impl VisibilityBuffer {
    /// What a frame holds of a shot that makes up `pixels` pixels.
    #[must_use]
    pub fn new(shot: Shot, pixels: usize, frame: Frame) -> Self {
        let (tiles, pairs) = (frame.tiles().to_vec(), frame.pairs().to_vec());
        Self { shot, hits: frame.into_hits(), tiles, pairs, pixels }
    }

    /// The ids of all pixels.
    #[must_use]
    pub fn ids(&self) -> Vec<u32> {
        self.spread(self.hits.ids(), &[NO_TRIANGLE])
    }

    /// t of all pixels.
    #[must_use]
    pub fn ts(&self) -> Vec<f32> {
        self.spread(self.hits.ts(), &[f32::INFINITY])
    }

    /// Derives one quantity. O(pixels).
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn derive(&self, aov: Aov, scene: &Scene) -> Result<AovData, Error> {
        let triangles = scene.geometry()?;
        Ok(match aov {
            Aov::Id => AovData::U32(self.ids()),
            Aov::Depth => AovData::F32(1, self.ts()),
            Aov::Object => AovData::U32(self.objects(scene)),
            Aov::Distance => self.derived([f32::INFINITY], |ray, hit| [distance(&triangles, ray, hit)]),
            Aov::Normal => {
                self.derived([f32::NAN; 3], |_, hit| triangles.normal(hit.id).to_array().map(|x| x as f32))
            }
            Aov::Position => {
                self.derived([f32::NAN; 3], |ray, hit| position(&triangles, scene.offset, ray, hit))
            }
            Aov::Work => {
                let work = heat_of(&self.shot.pencil, (&self.tiles, TileStats::samples_per_ray), &self.pairs);
                AovData::F32(1, self.spread(work, &[f32::NAN]))
            }
            Aov::Doubts => {
                let doubts = heat_of(&self.shot.pencil, (&self.tiles, TileStats::doubts_per_ray), &[]);
                AovData::F32(1, self.spread(doubts, &[f32::NAN]))
            }
            Aov::Uv => self.derived([f32::NAN; 2], |ray, hit| {
                let weights = triangles.barycentrics(hit.id, ray);
                scene.uv_corners(hit.id).map_or([f32::NAN; 2], |uvs| {
                    let weighted =
                        |k: usize| (0..3).map(move |corner| weights[corner] * f64::from(uvs[corner][k]));
                    [0, 1].map(|k| weighted(k).fold(0.0, |sum, part| sum + part) as f32)
                })
            }),
            Aov::Bary => self.derived([f32::NAN; 2], |ray, hit| {
                let [_, b, c] = triangles.barycentrics(hit.id, ray);
                [b as f32, c as f32]
            }),
        })
    }

    /// The object of each pixel.
    fn objects(&self, scene: &Scene) -> Vec<u32> {
        let object = |&id: &u32| {
            scene.object_of(id).and_then(|index| u32::try_from(index).ok()).unwrap_or(NO_TRIANGLE)
        };
        let objects: Vec<u32> = self.hits.ids().par_iter().map(object).collect();
        self.spread(objects, &[NO_TRIANGLE])
    }

    /// C numbers per pixel from each ray and hit, or `miss`.
    fn derived<const C: usize>(
        &self,
        miss: [f32; C],
        derive: impl Fn(&Ray, &Hit) -> [f32; C] + Sync,
    ) -> AovData {
        let of_ray = |k: usize| self.hits.get(k).map_or(miss, |hit| derive(&self.shot.pencil.ray(k), &hit));
        AovData::F32(C, self.spread(numbers(self.hits.len(), of_ray), &miss))
    }

    /// Values of rays, each of `miss.len()` numbers, as values of pixels; pixels without a ray get `miss`.
    fn spread<'a, T: Copy + 'a>(&self, of_rays: impl Into<Cow<'a, [T]>>, miss: &[T]) -> Vec<T> {
        spread(&self.shot, self.pixels, of_rays, miss)
    }
}

/// C numbers for each of so many rays, found in parallel. The list has its full length from the start: lists of parts that are
/// joined would take twice the memory.
pub(crate) fn numbers<const C: usize>(rays: usize, of_ray: impl Fn(usize) -> [f32; C] + Sync) -> Vec<f32> {
    let mut values = vec![0.0; rays * C];
    values.par_chunks_exact_mut(C).enumerate().for_each(|(k, values)| values.copy_from_slice(&of_ray(k)));
    values
}

/// Values of the rays of a shot, each of `miss.len()` numbers, as values of pixels; pixels without a ray get `miss`. Where every
/// ray has its pixel, values that are given away are not copied.
pub(crate) fn spread<'a, T: Copy + 'a>(
    shot: &Shot,
    count: usize,
    of_rays: impl Into<Cow<'a, [T]>>,
    miss: &[T],
) -> Vec<T> {
    let of_rays = of_rays.into();
    let Some(pixels) = &shot.pixels else {
        return of_rays.into_owned();
    };
    let mut of_pixels = miss.repeat(count);
    for (&pixel, values) in pixels.iter().zip(of_rays.chunks(miss.len())) {
        let first = pixel as usize * miss.len();
        of_pixels[first..first + miss.len()].copy_from_slice(values);
    }
    of_pixels
}
