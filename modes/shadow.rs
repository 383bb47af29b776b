//! Exact shadows: is the light seen from what a camera sees? No map, no resolution, no bias.
//!
//! A ray that hits a triangle gives a receiver: the point at which the triangle is left to the side that the ray came from
//! ([`Triangles::leave`]), so that it lies on the triangle's plane or strictly on that side of it. Where the light is not
//! strictly on that side, decided exactly, the receiver turns away from it and is in shadow without a ray. Else the open
//! segment from the light to the point, or the ray from the point toward the sun, decides. The receiver's own triangle can
//! block neither: it has the point on its plane, or both ends on one side.
//!
//! A light is an [`Origin`], as that of a camera is. `Origin::Point(l)` is a point light. `Origin::Infinity(D)` is the
//! sun: D is the direction in which its light travels, so the sun stands toward −D.
//!
//! Based on: Arthur Appel, "Some Techniques for Shading Machine Renderings of Solids", 1968 (rays toward the light);
//! Carsten Wächter and Nikolaus Binder, "A Fast and Robust Method for Avoiding Self-Intersection", 2019.

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{
    Film, Frame, Hits, Options, Origin, Pencil, Segment, Side, Stats, TriangleId, Triangles, any_hit,
    blocked, closest_hit,
};

use crate::camera::{Camera, Shot, on_origin_grid};
use crate::{Error, Scene};

/// A point that a camera sees, and that light may reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenReceiver {
    /// The index of the ray that sees it.
    pub ray: u32,
    /// The triangle that it lies on.
    pub id: TriangleId,
    /// The side of the triangle that is seen.
    pub side: Side,
    /// The point from which rays leave that side.
    pub point: [f32; 3],
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

/// The receivers of a pencil's hits, in the order of the rays.
#[must_use]
pub fn receivers(triangles: &Triangles<'_>, pencil: &Pencil, hits: &Hits) -> Vec<SeenReceiver> {
    let receiver = |k: usize| {
        let (id, ray) = (hits.get(k)?.id, pencil.ray(k));
        // A ray that hits a triangle is never parallel to it.
        let side = triangles.side_toward(id, -ray.direction)?;
        let point = triangles.leave(id, triangles.barycentrics(id, &ray), side);
        // A pencil has fewer than 2³² rays.
        Some(SeenReceiver { ray: k as u32, id, side, point })
    };
    (0..hits.len()).into_par_iter().filter_map(receiver).collect()
}

/// Whether each receiver sees the light.
///
/// # Errors
/// When the light is out of the range of origins and directions, see [`umbel_core::Ray`].
pub fn lit(
    triangles: &Triangles<'_>,
    light: Origin,
    receivers: &[SeenReceiver],
    frame: &mut Frame,
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    check_light(light)?;
    let is_toward = |receiver: &SeenReceiver| turns_to(triangles, light, receiver);
    let toward: Vec<bool> = receivers.par_iter().map(is_toward).collect();
    let candidates = receivers.iter().zip(&toward).filter(|&(_, &toward)| toward);
    let points: Vec<[f32; 3]> = candidates.map(|(receiver, _)| receiver.point).collect();
    let (dark, stats) = shadowed(triangles, light, &points, frame, options)?;
    let mut dark = dark.into_iter();
    let lit = toward.into_iter().map(|toward| toward && dark.next() == Some(false));
    Ok((lit.collect(), stats))
}

/// Whether the side that is seen turns to the light: whether the light lies strictly on that side of the plane. Exact, for
/// a light in range.
#[must_use]
pub fn turns_to(triangles: &Triangles<'_>, light: Origin, receiver: &SeenReceiver) -> bool {
    let side = match light {
        Origin::Point(point) => triangles.side_of(receiver.id, point),
        Origin::Infinity(direction) => triangles.side_toward(receiver.id, -direction),
    };
    side == Some(receiver.side)
}

/// Refuses lights for which the exact stage could underflow or overflow.
pub(crate) fn check_light(light: Origin) -> Result<(), Error> {
    Pencil::new(light, Vec::new())?;
    Ok(())
}

/// Whether anything stands between the light and each point. The points lie on their receivers' planes, or strictly on the
/// light's side of them.
fn shadowed(
    triangles: &Triangles<'_>,
    light: Origin,
    points: &[[f32; 3]],
    _frame: &mut Frame,
    options: &Options,
) -> Result<(Vec<bool>, Stats), Error> {
    let widen = |point: &[f32; 3]| DVec3::from_array(point.map(f64::from));
    match light {
        Origin::Point(from) => {
            let segment = |point| Segment { from, to: widen(point), receiver: None };
            let segments: Vec<Segment> = points.par_iter().map(segment).collect();
            Ok(blocked(triangles, &segments, options)?)
        }
        Origin::Infinity(direction) => {
            let starts = points.par_iter().map(widen).collect();
            let toward = Pencil::new(Origin::Infinity(-direction), vec![Film::Scattered(starts)])?;
            Ok(any_hit(triangles, &toward, options)?)
        }
    }
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

    /// Adds the receivers of one pass.
    pub fn add_seen(&mut self, shot: &Shot, receivers: &[SeenReceiver]) {
        receivers.iter().for_each(|receiver| self.seen[pixel(shot, receiver)] += 1);
    }

    /// Adds what one light reaches of them.
    pub fn add_lit(&mut self, shot: &Shot, receivers: &[SeenReceiver], light: usize, lit: &[bool]) {
        let counts = &mut self.lit[light];
        let reached = receivers.iter().zip(lit).filter(|&(_, &lit)| lit);
        reached.for_each(|(receiver, _)| counts[pixel(shot, receiver)] += 1);
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

/// The pixel that sees a receiver.
fn pixel(shot: &Shot, receiver: &SeenReceiver) -> usize {
    let pixels = shot.pixels.as_ref();
    pixels.map_or(receiver.ray, |pixels| pixels[receiver.ray as usize]) as usize
}

/// The mask of a picture for each light, pixel by pixel: 1 = lit, 0 = shadowed, NaN = no surface; with more than one sample
/// the mean over those sub-pixel positions that see a surface.
///
/// ```
/// use umbel::{Camera, Lens, Options, builtin, glam::DVec3, point_light, shadow_masks};
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
    let mut frame = Frame::keeping_order();
    let samples = u32::from(samples.max(1));
    for pass in 0..samples {
        let shot = camera.subpixel_shot(pass, samples)?;
        let (hits, _) = closest_hit(&triangles, &shot.pencil, options)?;
        let seen = receivers(&triangles, &shot.pencil, &hits);
        counts.add_seen(&shot, &seen);
        for (index, &light) in lights.iter().enumerate() {
            let (lit, _) = lit(&triangles, light, &seen, &mut frame, options)?;
            counts.add_lit(&shot, &seen, index, &lit);
        }
    }
    Ok((0..lights.len()).map(|light| counts.mask(light)).collect())
}
