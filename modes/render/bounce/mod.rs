//! Reflections and refractions added to a rendered picture, bounce by bounce: all rays that one bounce spawns are one query of
//! arbitrary rays.
//!
//! A path is a camera ray's index and the share of light that still arrives there. A wave of paths is traced, each hit is
//! shaded as the preview shades it, with the shadows of all lights, and sends on what [`Bounces::spawn`] gives. The last bounce
//! shades a surface as if it were opaque. Paths whose share is too small to be seen end.
//!
//! What planar mirrors send back of the camera's rays is traced as pencils (`planar_mirror.rs`), the rest and all that comes
//! later as arbitrary rays.
//!
//! Waves are no longer than `WAVE`; what a wave spawns beyond that waits, so memory is bounded by waves per bounce.
//! Sums are made path by path in one order, so that threads do not matter.
//!
//! Based on: Turner Whitted, "An Improved Illumination Model for Shaded Display", 1980; Alexander Keller and Carsten Wächter,
//! "Efficient Ray Tracing without Auxiliary Acceleration Data Structure", 2011 (secondary rays added to rasterized images);
//! Roy Hall and Donald Greenberg, "A Testbed for Realistic Image Synthesis", 1983 (paths end by their share).

pub(crate) mod mirror_planes;
pub(crate) mod paths;
pub(crate) mod planar_mirror;
pub mod spawn;

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{GridFilm, Hit, Hits, Options, Origin, Pencil, Ray, Stats, Triangles, closest_hit};

use crate::error::Error;
use crate::render::bounce::mirror_planes::PlanarMirrors;
use crate::render::bounce::paths::{PATH_BYTES, Place, Sent, Wave, sent_on};
use crate::render::bounce::planar_mirror::{Front, grids};
use crate::render::bounce::spawn::{Bounces, Spawned};
use crate::render::lamps::Lamps;
use crate::render::queries::{Queries, timed};
use crate::render::shade::{Shader, background_toward};
use crate::scene::Scene;

/// The most paths of one query.
pub(crate) const WAVE: usize = 1 << 19;

/// The paths for which planar mirrors are traced at last.
const MIRRORED: usize = 1 << 21;

/// Camera rays whose hits spawn together.
const SPAWNING: usize = 1 << 15;

/// More bytes of a path that is being traced: its hit and its colour; and for each light its receiver, half of that again while
/// receivers are joined, and the answer.
const TRACED_BYTES: [u64; 2] = [8 + 12, 20 + 10 + 2];

/// What was followed behind the camera's rays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Followed {
    /// The rays of each bounce; it ends with the last bounce that had any.
    pub rays: Vec<u64>,
    /// The counters of their queries.
    pub stats: Stats,
}

impl Followed {
    /// Takes over what came after it.
    pub(crate) fn add(&mut self, next: &Self) {
        self.rays.resize(self.rays.len().max(next.rays.len()), 0);
        self.rays.iter_mut().zip(&next.rays).for_each(|(sum, rays)| *sum += rays);
        self.stats = self.stats.then(next.stats);
    }
}

impl Bounces {
    /// About how many bytes waves take at most, without the engine's own: for so many rays of each bounce, as
    /// [`Followed::rays`] tells them of a smaller picture, and so many lights.
    #[must_use]
    pub fn forecast(&self, rays: &[u64], lights: u64) -> u64 {
        let waves = rays.iter().map(|&rays| rays.min(WAVE as u64));
        // A wave and what it spawns, which is copied twice before it waits.
        let waiting: u64 = waves.clone().map(|rays| rays * PATH_BYTES).sum();
        let longest = waves.clone().max().unwrap_or(0);
        let traced = longest * (TRACED_BYTES[0] + lights * TRACED_BYTES[1]);
        let spawned = waves.skip(1).max().unwrap_or(0);
        waiting + traced + 2 * spawned * PATH_BYTES
    }
}

/// What paths are followed through.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) lights: &'a [Origin],
    pub(crate) bounces: Bounces,
    /// Up in the picture.
    pub(crate) up: DVec3,
    pub(crate) options: &'a Options,
    /// The most paths of one query.
    pub(crate) wave: usize,
}

impl Surroundings<'_> {
    /// What a camera's hit sends on.
    pub(crate) fn spawn(&self, ray: &Ray, hit: &Hit) -> Spawned {
        if self.bounces.most == 0 {
            return Spawned::NOTHING;
        }
        self.bounces.spawn(self.scene, self.triangles, ray, hit)
    }

    /// Adds to each camera ray's colour, (r, g, b), what is mirrored and seen through what it hits.
    pub(crate) fn follow(
        &self,
        pencil: &Pencil,
        hits: &Hits,
        queries: &mut Queries,
        colours: &mut [f32],
    ) -> Result<Followed, Error> {
        let mut walk = Walk { around: *self, queries, colours, followed: Followed::default() };
        if self.bounces.most == 0 {
            return Ok(walk.followed);
        }
        let mirrors = PlanarMirrors::seen(self.scene, self.triangles, (pencil, hits), self.bounces);
        let mut waiting = Wave::default();
        let mut mirrored = vec![Vec::new(); mirrors.len()];
        for first in (0..hits.len()).step_by(SPAWNING) {
            let of_ray = |k: usize| {
                let ray = pencil.ray(k);
                // In range: a pencil has fewer than 2³² rays.
                let place = Place { ray: k as u32, share: [1.0; 3] };
                let spawned = hits.get(k).map(|hit| (self.spawn(&ray, &hit), mirrors.of(hit.id)));
                spawned.into_iter().flat_map(move |(spawned, mirror)| sent_on(&spawned, place, mirror))
            };
            let rays = first..hits.len().min(first + SPAWNING);
            let sent: Vec<Sent> = rays.into_par_iter().flat_map_iter(of_ray).collect();
            for (ray, place, mirror) in sent {
                match mirror {
                    Some(mirror) => mirrored[mirror].push(place),
                    None => waiting.push(ray, place),
                }
            }
            if waiting.rays.len() >= self.wave {
                walk.trace(std::mem::take(&mut waiting), 1)?;
            }
            if mirrored.iter().map(Vec::len).sum::<usize>() >= MIRRORED {
                walk.mirror(&mirrors, pencil, &mut mirrored)?;
            }
        }
        walk.trace(waiting, 1)?;
        walk.mirror(&mirrors, pencil, &mut mirrored)?;
        Ok(walk.followed)
    }
}

/// Paths on their way.
struct Walk<'a, 'b> {
    around: Surroundings<'a>,
    queries: &'b mut Queries,
    colours: &'b mut [f32],
    followed: Followed,
}

impl Walk<'_, '_> {
    /// Traces a wave, and what it spawns.
    fn trace(&mut self, wave: Wave, bounce: u32) -> Result<(), Error> {
        let count = wave.rays.len();
        if count == 0 {
            return Ok(());
        }
        self.count(count, bounce);
        for first in (0..count).step_by(self.around.wave) {
            let part = first..count.min(first + self.around.wave);
            let next = self.trace_part(&wave.rays[part.clone()], &wave.places[part], bounce)?;
            self.trace(next, bounce + 1)?;
        }
        Ok(())
    }

    /// Traces what planar mirrors send back of the camera's rays, and what that spawns. None of it is left to be traced.
    fn mirror(
        &mut self,
        mirrors: &PlanarMirrors,
        pencil: &Pencil,
        mirrored: &mut [Vec<Place>],
    ) -> Result<(), Error> {
        for (mirror, places) in mirrored.iter_mut().enumerate() {
            let (places, mut first) = (std::mem::take(places), 0_u32);
            if places.is_empty() {
                continue;
            }
            let front = Front::before(mirrors.get(mirror), self.around.scene, self.around.triangles);
            for film in grids(pencil) {
                let end = first + film.width() * film.height();
                let of_film = [first, end].map(|ray| places.partition_point(|place| place.ray < ray));
                let places = &places[of_film[0]..of_film[1]];
                if !places.is_empty() {
                    self.mirror_film(&front, (pencil.origin(), &film, first), places)?;
                }
                first = end;
            }
        }
        Ok(())
    }

    /// The same with the rays of one film, which begin with the camera's ray `first`.
    fn mirror_film(
        &mut self,
        front: &Front<'_>,
        (origin, film, first): (Origin, &GridFilm, u32),
        places: &[Place],
    ) -> Result<(), Error> {
        let wanted: Vec<u32> = places.iter().map(|place| place.ray - first).collect();
        let (reflection, stats) = front.reflect((origin, film), &wanted, self.around.options)?;
        self.followed.stats = self.followed.stats.then(stats);
        for start in (0..places.len()).step_by(self.around.wave) {
            let part = start..places.len().min(start + self.around.wave);
            let leaving = |k: usize| Some((reflection.ray(k)?, places[k], reflection.hit(k)));
            let leaving: Vec<_> = part.into_par_iter().filter_map(leaving).collect();
            let rays: Vec<Ray> = leaving.iter().map(|(ray, ..)| *ray).collect();
            let places: Vec<Place> = leaving.iter().map(|(_, place, _)| *place).collect();
            let hits: Hits = leaving.into_iter().map(|(.., hit)| hit).collect();
            self.count(rays.len(), 1);
            let next = self.see(&rays, &places, &hits, 1)?;
            self.trace(next, 2)?;
        }
        Ok(())
    }

    /// Counts the rays of a bounce.
    fn count(&mut self, rays: usize, bounce: u32) {
        let level = bounce as usize;
        self.followed.rays.resize(self.followed.rays.len().max(level), 0);
        self.followed.rays[level - 1] += rays as u64;
    }

    /// Traces paths in one query, and adds what they see. Returns what they spawn.
    fn trace_part(&mut self, rays: &[Ray], places: &[Place], bounce: u32) -> Result<Wave, Error> {
        let Surroundings { triangles, options, .. } = self.around;
        let (hits, stats) = timed(&mut self.queries.time, || closest_hit(triangles, rays, options))?;
        self.followed.stats = self.followed.stats.then(stats);
        self.see(rays, places, &hits, bounce)
    }

    /// Adds what paths see. Returns what they spawn.
    fn see(&mut self, rays: &[Ray], places: &[Place], hits: &Hits, bounce: u32) -> Result<Wave, Error> {
        let Surroundings { scene, triangles, lights, bounces, up, options, .. } = self.around;
        let lamps = Lamps::new(lights, triangles, (&|k| rays[k], hits), self.queries, options)?;
        let shader = Shader::new(scene, triangles);
        let is_last = bounce >= bounces.most;
        let spawned = |k: usize, hit: &Hit| match is_last {
            true => Spawned::NOTHING,
            false => bounces.spawn(scene, triangles, &rays[k], hit),
        };
        let seen = |k: usize| {
            let Some(hit) = hits.get(k) else {
                return background_toward(rays[k].direction, up);
            };
            let (own, colour) = (spawned(k, &hit).own, shader.shade((k, &rays[k]), &hit, up, &lamps));
            [0, 1, 2].map(|c| own[c] * colour[c])
        };
        let seen: Vec<[f32; 3]> = (0..rays.len()).into_par_iter().map(seen).collect();
        for (place, seen) in places.iter().zip(seen) {
            let first = place.ray as usize * 3;
            for (k, colour) in self.colours[first..first + 3].iter_mut().enumerate() {
                *colour += place.share[k] * seen[k];
            }
        }
        let mut next = Wave::default();
        if !is_last {
            let of_path = |k: usize| {
                let spawned = hits.get(k).map(|hit| spawned(k, &hit));
                spawned.into_iter().flat_map(move |spawned| sent_on(&spawned, places[k], None))
            };
            let sent: Vec<Sent> = (0..rays.len()).into_par_iter().flat_map_iter(of_path).collect();
            sent.into_iter().for_each(|(ray, place, _)| next.push(ray, place));
        }
        Ok(next)
    }
}

#[cfg(test)]
mod tests {
    use umbel_core::{Film, GridFilm};

    use super::*;
    use crate::builtin;
    use crate::scene::optics::Optics;

    /// What waves of a length add to a picture of a room with glass and mirrors.
    fn followed(wave: usize) -> (Vec<f32>, Vec<u64>) {
        let mut scene = builtin("cornell").expect("a scene");
        scene.set_optics("tall block", Optics::glass(1.5));
        scene.set_optics("back wall", Optics::MIRROR);
        let triangles = scene.geometry().expect("triangles");
        let film = GridFilm::new(20, 20, DVec3::Z, DVec3::NEG_X / 50.0, DVec3::Y / 50.0).expect("a film");
        let eye = Origin::Point(DVec3::new(278.0, 273.0, -600.0));
        let pencil = Pencil::new(eye, vec![Film::Grid(film)]).expect("rays");
        let options = Options::default();
        let (hits, _) = closest_hit(&triangles, &pencil, &options).expect("hits");
        let lights = [Origin::Point(DVec3::new(300.0, 500.0, 200.0))];
        let bounces = Bounces { reflect: true, refract: true, most: 5 };
        let around = Surroundings {
            scene: &scene,
            triangles: &triangles,
            lights: &lights,
            bounces,
            up: DVec3::Y,
            options: &options,
            wave,
        };
        let mut colours = vec![0.0; hits.len() * 3];
        let followed = around.follow(&pencil, &hits, &mut Queries::new(), &mut colours).expect("colours");
        (colours, followed.rays)
    }

    #[test]
    fn short_waves_add_the_same() {
        let (expected, rays) = followed(WAVE);
        assert!(rays.len() == 5 && rays[0] > 100, "{rays:?}");
        for wave in [1, 7, 64] {
            let (colours, counts) = followed(wave);
            assert_eq!(counts, rays);
            // A sum of few numbers in another order.
            assert!(colours.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5));
        }
    }

    #[test]
    fn forecasts_are_bounded() {
        let bounces = Bounces { reflect: true, refract: true, most: 4 };
        assert_eq!(bounces.forecast(&[], 3), 0);
        let deep = bounces.forecast(&[1 << 40; 4], 1);
        assert!(deep > 100_000_000, "{deep}");
        assert!(bounces.forecast(&[u64::MAX; 64], 1) < 16 * deep);
        assert!(bounces.forecast(&[1000], 0) < 1_000_000);
    }
}
