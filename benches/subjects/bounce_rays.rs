//! Diffuse-bounce rays: one from each of many points that a camera sees, in a random direction.
//!
//! A point is where the ray through a pixel centre hits a triangle; [`umbel::Triangles::leave`] moves it to an f32 point on the
//! side that is seen. Directions have a probability in proportion to the cosine around that side's normal, and f32
//! components, so that all engines get the same rays. They come in image order, row by row, or shuffled.
//!
//! Engines but umbel begin a ray at [`crate::subjects::ambient_rays::EPSILON`] of the scene's diagonal, lest it hit the surface that it
//! leaves.
//!
//! Based on: Donald Knuth, "The Art of Computer Programming", volume 2 (algorithm P: shuffling).

use rayon::prelude::*;
use umbel::engine::Side;
use umbel::glam::DVec3;
use umbel::{Hits, Pencil, Ray, TriangleId, Triangles};

use crate::subjects::ambient_rays::Departure;
use crate::subjects::answer;
use crate::subjects::directions::{Axes, Random};

/// Rays that one task takes: whole packets.
const RAYS_OF_TASK: usize = 4096;

/// Rays for engines that know f32 only.
#[derive(Debug, Clone)]
pub(crate) struct BounceRays {
    pub(crate) departures: Vec<Departure>,
    /// Where they begin, in units of the scene: directions have the length 1 up to rounding.
    pub(crate) epsilon: f32,
}

impl BounceRays {
    /// So many rays from the points that a pencil sees, evenly chosen from all; there are at least so many.
    pub(crate) fn new(
        triangles: &Triangles<'_>,
        (pencil, hits): (&Pencil, &Hits),
        rays: usize,
        seed: u64,
        epsilon: f32,
    ) -> Self {
        let seen: Vec<usize> = (0..hits.len()).filter(|&ray| hits.get(ray).is_some()).collect();
        let departure = |k: usize| {
            let ray = seen[(k as u128 * seen.len() as u128 / rays as u128) as usize];
            let mut random = Random::new(seed.wrapping_mul(1 << 32).wrapping_add(k as u64));
            bounce(triangles, TriangleId(hits.ids()[ray]), &pencil.ray(ray), &mut random)
        };
        Self { departures: (0..rays).into_par_iter().map(departure).collect(), epsilon }
    }

    /// Forgets which rays are neighbours.
    pub(crate) fn shuffle(&mut self, seed: u64) {
        let mut random = Random::new(seed);
        for last in (1..self.departures.len()).rev() {
            self.departures.swap(last, random.below(last + 1));
        }
    }

    /// The same rays as umbel takes them: from the very point on.
    pub(crate) fn exact(&self) -> Vec<Ray> {
        let widen = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        let ray = |&(point, direction): &Departure| Ray::new(widen(point), widen(direction));
        self.departures.par_iter().map(ray).collect()
    }

    /// Lets all threads trace consecutive rays, and write their ids and distances.
    pub(crate) fn trace_chunks(
        &self,
        answer: &mut answer::Hits,
        trace: impl Fn(&[Departure], &mut [u32], &mut [f32]) + Sync + Send,
    ) {
        let departures = self.departures.par_chunks(RAYS_OF_TASK);
        let (ids, ts) = (answer.ids.par_chunks_mut(RAYS_OF_TASK), answer.ts.par_chunks_mut(RAYS_OF_TASK));
        let tasks = departures.zip(ids.zip(ts)).with_max_len(1);
        tasks.for_each(|(departures, (ids, ts))| trace(departures, ids, ts));
    }

    /// Lets all threads trace single rays. `hit` gives the id and the distance.
    pub(crate) fn trace_singly(
        &self,
        answer: &mut answer::Hits,
        hit: impl Fn([f32; 3], [f32; 3]) -> (u32, f32) + Sync + Send,
    ) {
        self.trace_chunks(answer, |departures, ids, ts| {
            for ((&(point, direction), id), t) in departures.iter().zip(ids).zip(ts) {
                (*id, *t) = hit(point, direction);
            }
        });
    }
}

/// A random ray from where a ray hits a triangle, to the side that the ray comes from.
fn bounce(triangles: &Triangles<'_>, id: TriangleId, ray: &Ray, random: &mut Random) -> Departure {
    let side = match triangles.side_toward(id, ray.direction) {
        Some(Side::Front) => Side::Back,
        _ => Side::Front,
    };
    let normal = triangles.normal(id).as_vec3().to_array();
    let normal = if side == Side::Front { normal } else { normal.map(|x| -x) };
    let point = triangles.leave(id, triangles.barycentrics(id, ray), side);
    let axes = Axes::around(normal);
    let leaves = |direction: [f32; 3]| {
        let direction = DVec3::from_array(direction.map(f64::from));
        // The engines take no components closer to zero than this, but zero itself.
        let fits = direction.to_array().iter().all(|x| *x == 0.0 || x.abs() > f64::from(f32::MIN_POSITIVE));
        fits && triangles.side_toward(id, direction) == Some(side)
    };
    // Rounding takes directions close to the plane to its other side.
    loop {
        let direction = axes.cosine(random.pair());
        if leaves(direction) {
            return (point, direction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shuffling_keeps_all_rays() {
        let departures: Vec<Departure> = (0..1000).map(|k| ([k as f32; 3], [1.0, 0.0, 0.0])).collect();
        let mut rays = BounceRays { departures: departures.clone(), epsilon: 0.0 };
        rays.shuffle(3);
        assert_ne!(rays.departures, departures);
        rays.departures.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        assert_eq!(rays.departures, departures);
    }
}
