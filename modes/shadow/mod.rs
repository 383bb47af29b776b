//! Exact shadows: is the light seen from what a camera sees? No map, no resolution, no bias.
//!
//! A ray that hits a triangle sees one side of it. Where the light is not strictly on that side, decided exactly, the surface
//! turns away from it and is in shadow without a ray. Else the point at which the triangle is left to that side
//! ([`Triangles::leave`]) is a receiver: it lies on the triangle's plane or strictly on the light's side of it, and
//! [`Frame::shadowed`] decides whether anything stands between.
//!
//! A light is an [`Origin`], as that of a camera is. `Origin::Point(l)` is a point light. `Origin::Infinity(D)` is the
//! sun: D is the direction in which its light travels, so the sun stands toward −D.
//!
//! Based on: Arthur Appel, "Some Techniques for Shading Machine Renderings of Solids", 1968 (rays toward the light);
//! Carsten Wächter and Nikolaus Binder, "A Fast and Robust Method for Avoiding Self-Intersection", 2019.

pub mod casters;
pub mod compare;
pub mod lookup;
pub mod map;
pub mod samples;

pub use casters::Casters;
pub use compare::{MapErrors, compare_maps};
pub use lookup::CubeMap;
pub use map::{cube_map, cube_pencil, distances, face_matrices, in_pieces, sun_pencil, surface_distances};
pub use samples::cube_answers;

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{
    Frame, Hits, NO_TRIANGLE, Options, Origin, Pencil, Ray, Receiver, Side, TriangleId, Triangles,
};

use crate::error::Error;
use crate::scene::Scene;
use crate::scene::camera::{Camera, Shot, on_origin_grid};

/// The points that a camera sees and that may see a light: those of surfaces that turn to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Receivers {
    /// Where they lie, and on which triangles, in the order of the rays.
    pub points: Vec<Receiver>,
    /// The index of the ray that sees each.
    pub rays: Vec<u32>,
}

impl Receivers {
    /// Takes over those of others, which come behind.
    fn append(&mut self, mut others: Self) {
        self.points.append(&mut others.points);
        self.rays.append(&mut others.rays);
    }
}

/// A point light, on the grid that origins have: coordinates below 2⁻⁹⁶ move by at most 2⁻¹⁵⁰.
#[must_use]
pub fn point_light(position: DVec3) -> Origin {
    Origin::Point(on_origin_grid(position))
}

/// The sun in the direction `toward`, of any length.
#[must_use]
pub fn sun_light(toward: DVec3) -> Origin {
    Origin::Infinity(-toward)
}

/// Rays whose receivers are found together, before they join the others.
const TOGETHER: usize = 1 << 18;

/// The receivers of each light among the hits of a pencil. What is left out turns away from the light, and is in shadow.
///
/// # Errors
/// When a light is out of the range of origins and directions, see [`umbel_core::Ray`].
pub fn receivers(
    triangles: &Triangles<'_>,
    pencil: &Pencil,
    hits: &Hits,
    lights: &[Origin],
) -> Result<Vec<Receivers>, Error> {
    let of_ray = |ray: usize| hits.get(ray).map(|hit| hit.id);
    receivers_of(triangles, &|ray| pencil.ray(ray), (hits.len(), &of_ray), lights)
}

/// The same for the hits of so many rays, each given by its index.
pub(crate) fn receivers_of(
    triangles: &Triangles<'_>,
    ray: &(dyn Fn(usize) -> Ray + Sync),
    (rays, hit): (usize, &(dyn Fn(usize) -> Option<TriangleId> + Sync)),
    lights: &[Origin],
) -> Result<Vec<Receivers>, Error> {
    for &light in lights {
        Pencil::new(light, Vec::new())?;
    }
    let of_ray = |found: &mut [Receivers], ray_id: u32| {
        let Some(triangle) = hit(ray_id as usize) else { return };
        let ray = ray(ray_id as usize);
        // A ray that hits a triangle is never parallel to it.
        let Some(side) = triangles.side_toward(triangle, -ray.direction) else { return };
        let mut start = None;
        for (&light, found) in lights.iter().zip(found) {
            if turns_to(triangles, light, (triangle, side)) {
                let leave = || triangles.leave(triangle, triangles.barycentrics(triangle, &ray), side);
                let point = *start.get_or_insert_with(leave);
                found.points.push(Receiver { point, triangle });
                found.rays.push(ray_id);
            }
        }
    };
    // Room for all that may come: what is not used takes no memory, and a list that grows would be copied.
    let most = (0..rays).into_par_iter().filter(|&ray| hit(ray).is_some()).count();
    let room = || Receivers { points: Vec::with_capacity(most), rays: Vec::with_capacity(most) };
    let mut all: Vec<Receivers> = lights.iter().map(|_| room()).collect();
    let none = || vec![Receivers::default(); lights.len()];
    for first in (0..rays).step_by(TOGETHER) {
        // In range: a query has fewer than 2³² rays.
        let some = first as u32..rays.min(first + TOGETHER) as u32;
        let parts = some.into_par_iter().fold(none, |mut found, ray| {
            of_ray(&mut found, ray);
            found
        });
        for part in parts.collect::<Vec<_>>() {
            all.iter_mut().zip(part).for_each(|(all, part)| all.append(part));
        }
    }
    Ok(all)
}

/// Whether a side of a triangle turns to the light: whether the light lies strictly on that side of the plane. Exact.
fn turns_to(triangles: &Triangles<'_>, light: Origin, (triangle, side): (TriangleId, Side)) -> bool {
    let lit_side = match light {
        Origin::Point(point) => triangles.side_of(triangle, point),
        Origin::Infinity(direction) => triangles.side_toward(triangle, -direction),
    };
    lit_side == Some(side)
}

/// How much of each pixel's surface each of several lights reaches: counts of samples, so that their order does not matter.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskCounts {
    /// Samples of each pixel that see a surface.
    seen: Vec<u16>,
    /// Those of them that a light reaches, light by light.
    lit: Vec<Vec<u16>>,
}

impl MaskCounts {
    /// No sample yet. At most 65,535 may be added to a pixel.
    #[must_use]
    pub fn new(camera: &Camera, lights: usize) -> Self {
        let pixels = camera.width as usize * camera.rows() as usize;
        Self { seen: vec![0; pixels], lit: vec![vec![0; pixels]; lights] }
    }

    /// Adds what one pass sees, given the id that each ray has hit.
    pub fn add_seen(&mut self, shot: &Shot, ids: &[u32]) {
        let seen = (0..).zip(ids).filter(|&(_, &id)| id != NO_TRIANGLE);
        seen.for_each(|(ray, _)| self.seen[pixel(shot, ray)] += 1);
    }

    /// Adds what one light reaches of it: its receivers, as far as they are not in shadow.
    pub fn add_lit(&mut self, shot: &Shot, light: usize, receivers: &Receivers, shadowed: &[bool]) {
        let counts = &mut self.lit[light];
        let reached = receivers.rays.iter().zip(shadowed).filter(|&(_, &shadowed)| !shadowed);
        reached.for_each(|(&ray, _)| counts[pixel(shot, ray)] += 1);
    }

    /// The mask of a light: 1 = lit, 0 = shadowed, between them where samples differ, NaN = no surface.
    #[must_use]
    pub fn mask(&self, light: usize) -> Vec<f32> {
        // The bits of 0/0 differ from machine to machine.
        let part = |(&lit, &seen): (&u16, &u16)| {
            if seen == 0 { f32::NAN } else { f32::from(lit) / f32::from(seen) }
        };
        self.lit[light].iter().zip(&self.seen).map(part).collect()
    }
}

/// The pixel of a ray.
fn pixel(shot: &Shot, ray: u32) -> usize {
    shot.pixels.as_ref().map_or(ray, |pixels| pixels[ray as usize]) as usize
}

/// The mask of a picture for each light, pixel by pixel: 1 = lit, 0 = shadowed, NaN = no surface; with more than one sample
/// the mean over those sub-pixel positions that see a surface.
///
/// ```
/// use umbel::{builtin, Camera, Lens, Options};
/// use umbel::glam::DVec3;
/// use umbel::shadow::{point_light, shadow_masks};
///
/// let scene = builtin("cornell")?;
/// let camera = Camera {
///     eye: DVec3::new(278.0, 273.0, -800.0),
///     target: DVec3::new(278.0, 273.0, 0.0),
///     up: DVec3::Y,
///     lens: Lens::Pinhole { fov: 39.3 },
///     width: 64,
///     height: 64,
/// };
/// let lamp = point_light(DVec3::new(278.0, 548.0, 279.5));
/// let masks = shadow_masks(&scene, &camera, &[lamp], 1, &Options::default())?;
/// assert!(masks[0].contains(&1.0) && masks[0].contains(&0.0));
/// # Ok::<(), umbel::Error>(())
/// ```
///
/// # Errors
/// When the camera, the scene or a light is refused.
pub fn shadow_masks(
    scene: &Scene,
    camera: &Camera,
    lights: &[Origin],
    samples: u16,
    options: &Options,
) -> Result<Vec<Vec<f32>>, Error> {
    let triangles = scene.geometry()?;
    let mut counts = MaskCounts::new(camera, lights.len());
    let (mut seen, mut frame) = (Frame::keeping_order(), Frame::keeping_order());
    let samples = u32::from(samples.max(1));
    for pass in 0..samples {
        let shot = camera.subpixel_shot(pass, samples)?;
        seen.closest_hit(&triangles, &shot.pencil, options)?;
        let receivers = receivers(&triangles, &shot.pencil, seen.hits(), lights)?;
        counts.add_seen(&shot, seen.hits().ids());
        for (index, (&light, receivers)) in lights.iter().zip(&receivers).enumerate() {
            let (shadowed, _) = frame.shadowed(&triangles, light, &receivers.points, options)?;
            counts.add_lit(&shot, index, receivers, &shadowed);
        }
    }
    Ok((0..lights.len()).map(|light| counts.mask(light)).collect())
}
