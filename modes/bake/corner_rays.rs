//! Rays that leave a vertex by another face than its owner's: found, asked for in their turn, and put among the others.
//!
//! They are few where a surface is smooth: those between the horizon of the normal and that of the owner. Which they are and why
//! is in [`crate::bake::receivers::fans`].

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{
    Above, Frame, Grouping, Hemisphere, Occlusion, OpenRays, Options, RaySample, RaySamples, Side, Stats,
};

use crate::bake::occluders::BakeOccluders;
use crate::bake::openness::dot;
use crate::bake::receivers::BakeReceivers;
use crate::bake::receivers::fans::{CALL, Leaves, Planes, USUAL_RAYS};
use crate::error::Error;

/// A ray that leaves by another face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CornerRay {
    /// The place of its receiver.
    pub(crate) place: usize,
    pub(crate) ray: usize,
    /// Where it starts.
    pub(crate) hemisphere: Hemisphere,
    sample: RaySample,
}

/// What asks for these rays.
pub(crate) struct CornerRays<'a> {
    pub(crate) occluders: BakeOccluders<'a>,
    pub(crate) receivers: &'a BakeReceivers,
    pub(crate) samples: RaySamples<'a>,
    pub(crate) back_faces: bool,
}

impl CornerRays<'_> {
    /// Puts what becomes of these rays among the rays that are open. Hands them to `tell`, receiver by receiver.
    pub(crate) fn put(
        &self,
        open: &mut OpenRays,
        (frame, options): (&mut Frame, &Options),
        mut tell: impl FnMut(&CornerRay),
    ) -> Result<Stats, Error> {
        let mut stats = Stats::default();
        if self.receivers.fans.is_empty() {
            return Ok(stats);
        }
        let (count, mut waiting) = (self.receivers.len(), Vec::new());
        let call = (USUAL_RAYS * count).clamp(CALL[0], CALL[1]);
        let block = (call / open.rays().max(1)).max(1);
        for first in (0..count).step_by(block) {
            let end = count.min(first + block);
            let found = (first..end).into_par_iter().flat_map_iter(|place| self.of(place, open.rays()));
            waiting.par_extend(found);
            if waiting.len() >= call || (end == count && !waiting.is_empty()) {
                stats = stats.then(self.ask(&waiting, open, (&mut *frame, options))?);
                waiting.drain(..).for_each(|ray| tell(&ray));
            }
        }
        Ok(stats)
    }

    /// The rays of one receiver, in their order.
    fn of(&self, place: usize, rays: usize) -> Vec<CornerRay> {
        let (receivers, triangles) = (self.receivers, self.occluders.triangles);
        let (hemisphere, up) = (&receivers.hemispheres[place], receivers.normals[place]);
        let owner = triangles.normal(hemisphere.receiver.triangle);
        let owner = if hemisphere.above == Above::Side(Side::Back) { -owner } else { owner };
        let up_wide = DVec3::from_array(up.map(f64::from));
        let Some(planes) = Planes::of(&receivers.fans, place, triangles, owner, up_wide) else {
            return Vec::new();
        };
        let leaving = |ray: usize| {
            let sample = match self.samples {
                RaySamples::Shared(samples) => samples[ray],
                RaySamples::Own { of, .. } => of(place, ray),
            };
            let d = sample.direction;
            if dot(up, d.to_array().map(|x| x as f32)) <= 0.0 {
                return None;
            }
            if planes.leaves_by_owner(d) {
                return None;
            }
            match planes.leaves(d, hemisphere.is_above(triangles, d)) {
                Leaves::Other(face) => {
                    Some(CornerRay { place, ray, hemisphere: planes.hemisphere(face, triangles), sample })
                }
                Leaves::Owner | Leaves::Nowhere => None,
            }
        };
        (0..rays).filter_map(leaving).collect()
    }

    /// Asks the engine.
    fn ask(
        &self,
        rays: &[CornerRay],
        open: &mut OpenRays,
        (frame, options): (&mut Frame, &Options),
    ) -> Result<Stats, Error> {
        let hemispheres: Vec<Hemisphere> = rays.iter().map(|ray| ray.hemisphere).collect();
        let of = |ray: usize, _: usize| rays[ray].sample;
        let occlusion = Occlusion {
            hemispheres: &hemispheres,
            samples: RaySamples::Own { count: 1, of: &of },
            back_faces: self.back_faces,
            grouping: Grouping::Auto,
        };
        let (found, stats) = self.occluders.open_rays(&occlusion, frame, options)?;
        for (number, ray) in rays.iter().enumerate() {
            open.set(ray.place, ray.ray, found.is_open(number, 0));
        }
        Ok(stats)
    }
}
