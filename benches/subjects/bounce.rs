//! The subject of bounces: what do diffuse-bounce rays hit, which share nothing?

use serde_json::{Value, json};
use umbel::glam::DVec3;
use umbel::{Hits, Options, Pencil, Ray, Triangles, closest_hit};

use crate::Result;
use crate::engines::Engines;
use crate::engines::engine::Engine;
use crate::subjects::ambient_rays::EPSILON;
use crate::subjects::answer::{self, Share};
use crate::subjects::bounce_rays::BounceRays;
use crate::subjects::views::View;
use crate::subjects::{Model, Subject};

/// The width of the camera's picture over its height.
const ASPECT: f64 = 16.0 / 9.0;

/// The widest picture.
const WIDEST: f64 = 16384.0;

/// One scene with rays from what a camera sees.
#[derive(Debug, Clone)]
pub(crate) struct Bounce {
    pub(crate) model: Model,
    shuffled: bool,
    /// The rays as umbel takes them.
    pub(crate) exact: Vec<Ray>,
    /// The same for the others.
    pub(crate) rays: BounceRays,
}

impl Bounce {
    /// So many rays.
    pub(crate) fn new(view: &View, rays: usize, seed: u64, shuffled: bool) -> Result<Self> {
        let model = Model::new(&view.name, &view.scene);
        let triangles = Triangles::new(&model.positions, &model.triangles)?;
        let (pencil, hits) = seen(view, &triangles, rays)?;
        let epsilon = (EPSILON * DVec3::from_array(view.scene.bounds().extent()).length()) as f32;
        let mut rays = BounceRays::new(&triangles, (&pencil, &hits), rays, seed, epsilon);
        if shuffled {
            rays.shuffle(seed);
        }
        Ok(Self { model, shuffled, exact: rays.exact(), rays })
    }
}

/// A picture in which at least so many pixels see a triangle.
fn seen(view: &View, triangles: &Triangles<'_>, rays: usize) -> Result<(Pencil, Hits)> {
    let mut pixels = rays as f64;
    loop {
        let width = (pixels * ASPECT).sqrt().ceil();
        let height = (pixels / width).ceil();
        if width > WIDEST {
            return Err(format!("{}: the camera sees too little for {rays} rays", view.name).into());
        }
        let pencil = view.camera((width as u32, height as u32)).shot()?.pencil;
        let (hits, _) = closest_hit(triangles, &pencil, &Options::default())?;
        let count = (0..hits.len()).filter(|&ray| hits.get(ray).is_some()).count();
        if count >= rays {
            return Ok((pencil, hits));
        }
        // Without a hit the width is soon too large.
        pixels *= 1.01 * rays as f64 / count.max(1) as f64;
    }
}

impl Subject for Bounce {
    type Answer = answer::Hits;

    const RASTERIZED: bool = false;

    fn model(&self) -> &Model {
        &self.model
    }

    fn layout(&self) -> String {
        if self.shuffled { "shuffled".into() } else { "image order".into() }
    }

    fn facts(&self) -> Vec<(&'static str, Value)> {
        vec![("shuffled", json!(self.shuffled)), ("epsilon", json!(self.rays.epsilon))]
    }

    fn rays(&self) -> usize {
        self.exact.len()
    }

    fn blank(&self) -> answer::Hits {
        answer::Hits::missed(self.exact.len())
    }

    /// Rays with another id that umbel has hit something before the other's rays begin: exact arithmetic sees what is so near.
    fn explain(&self, umbel: &answer::Hits, other: &answer::Hits) -> Result<Vec<Share>> {
        let pairs = umbel.ids.iter().zip(&umbel.ts).zip(&other.ids);
        let near = pairs.filter(|((id, t), other)| id != other && **t <= self.rays.epsilon).count();
        let of_all = near as f64 / self.rays().max(1) as f64;
        Ok(vec![Share { heading: "near %", key: "ids_differ_before_epsilon", of_all }])
    }

    fn engines(
        &self,
        engines: &Engines,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Self>>>> {
        engines.for_bounces(self, wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engines::umbel::Umbel;

    fn room(rays: usize, shuffled: bool) -> Bounce {
        let view = View::find("builtin:cornell", None).expect("a scene");
        Bounce::new(&view, rays, 1, shuffled).expect("a subject")
    }

    fn hits(subject: &Bounce, engine: &mut dyn Engine<Bounce>) -> answer::Hits {
        let mut answer = subject.blank();
        engine.run(subject, &mut answer).expect("hits");
        answer
    }

    #[test]
    fn an_order_does_not_change_the_hits() {
        let count = |shuffled| {
            let room = room(500, shuffled);
            assert_eq!(room.rays(), 500);
            let mut ids = hits(&room, &mut Umbel::from_scratch()).ids;
            ids.sort_unstable();
            ids
        };
        assert_eq!(count(false), count(true));
    }

    #[cfg(feature = "obvhs")]
    #[test]
    fn engines_agree_about_a_room() {
        use crate::subjects::answer::Answer;

        let room = room(2000, false);
        let umbel = hits(&room, &mut Umbel::from_scratch());
        for mut engine in crate::engines::obvhs::variants(&room, |_| true) {
            let other = hits(&room, engine.as_mut());
            // By distance: the light lies in the plane of the ceiling.
            assert!(umbel.agreement(&other)[1].of_all > 0.998, "{}", engine.name());
        }
    }
}
