//! The lights of a preview: which of them each ray's hit sees, and how much of their light it gets.
//!
//! E = Σ c·max(0, n·l)·V / count, with l the direction toward the light and V exact visibility, 1 or 0 ([`crate::shadow::receivers`]).
//! Light does not fall off with distance, and all lights together are as bright as one: a preview shows where shadows are,
//! and is well exposed whatever the units of the scene.
//!
//! Based on: Johann Heinrich Lambert, "Photometria", 1760 (the cosine law).

use glam::DVec3;
use umbel_core::{Hits, Options, Origin, Ray, Receiver, Triangles};

use crate::error::Error;
use crate::render::queries::{Queries, timed};
use crate::shadow::Receivers;
use crate::shadow::receivers_of;

/// The light of all lamps together: warm.
const LAMP: [f64; 3] = [0.80, 0.75, 0.68];

/// Lights, and the hits that see them.
#[derive(Debug)]
pub(crate) struct Lamps<'a> {
    lights: &'a [Origin],
    /// For each light, whether the hit of each ray sees it.
    seen: Vec<Vec<bool>>,
}

impl<'a> Lamps<'a> {
    /// Casts the shadows of the lights on what rays have hit.
    pub(crate) fn new(
        lights: &'a [Origin],
        triangles: &Triangles<'_>,
        (ray, hits): (&(dyn Fn(usize) -> Ray + Sync), &Hits),
        queries: &mut Queries,
        options: &Options,
    ) -> Result<Self, Error> {
        if lights.is_empty() {
            return Ok(Self { lights, seen: Vec::new() });
        }
        let of_ray = |ray: usize| hits.get(ray).map(|hit| hit.id);
        let receivers = receivers_of(triangles, ray, (hits.len(), &of_ray), lights)?;
        let Queries { lit, time } = queries;
        Self::of((lights, receivers), hits.len(), |light, points| {
            Ok(timed(time, || lit.shadowed(triangles, light, points, options))?.0)
        })
    }

    /// Lights with the receivers of each among the hits of so many rays; `shadowed` tells which are in shadow.
    pub(crate) fn of(
        (lights, receivers): (&'a [Origin], Vec<Receivers>),
        rays: usize,
        mut shadowed: impl FnMut(Origin, &[Receiver]) -> Result<Vec<bool>, Error>,
    ) -> Result<Self, Error> {
        let mut seen = Vec::new();
        for (&light, receivers) in lights.iter().zip(receivers) {
            let shadowed = shadowed(light, &receivers.points)?;
            let mut of_rays = vec![false; rays];
            for (ray, shadowed) in receivers.rays.into_iter().zip(shadowed) {
                of_rays[ray as usize] = !shadowed;
            }
            seen.push(of_rays);
        }
        Ok(Self { lights, seen })
    }

    /// Whether there is no light.
    pub(crate) fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// The light that arrives at a ray's hit: at a point with a unit normal.
    pub(crate) fn light_at(&self, ray: usize, point: DVec3, normal: DVec3) -> [f64; 3] {
        let mut cosines = 0.0;
        for (light, seen) in self.lights.iter().zip(&self.seen) {
            let toward = match *light {
                Origin::Point(position) => position - point,
                Origin::Infinity(direction) => -direction,
            };
            if seen[ray] {
                cosines += normal.dot(toward.normalize_or_zero()).max(0.0);
            }
        }
        let share = if self.is_empty() { 0.0 } else { cosines / self.lights.len() as f64 };
        LAMP.map(|c| c * share)
    }
}
