//! The subject of ambient occlusion: which rays leave points on surfaces into the half space above without meeting anything?

use std::str::FromStr;

use serde_json::{Value, json};
use umbel::engine::{Hemisphere, RaySample};
use umbel::glam::DVec3;
use umbel::{Options, Ray, Scene, Triangles, closest_hit};

use crate::Result;
use crate::engines::Engines;
use crate::engines::engine::Engine;
use crate::subjects::ambient_rays::{AmbientRays, EPSILON};
use crate::subjects::answer::{OpenBits, Share};
use crate::subjects::directions;
use crate::subjects::surface_points::{ReceiverSet, hemispheres};
use crate::subjects::{Model, Subject};

/// Differing rays that are looked into, evenly chosen from all.
const MOST_EXPLAINED: usize = 10_000;

/// How far occluders count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MaxDistance {
    /// In units of the scene.
    Length(f64),
    /// In parts of the scene's diagonal.
    OfDiagonal(f64),
}

impl FromStr for MaxDistance {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
        let distance = match text.strip_suffix('%') {
            Some(percent) => number(percent).map(|percent| Self::OfDiagonal(percent / 100.0)),
            None => number(text).map(Self::Length),
        };
        distance.ok_or_else(|| "expected a positive length, or a share such as 10%".into())
    }
}

impl MaxDistance {
    /// In units of a scene with this diagonal.
    fn in_scene(self, diagonal: f64) -> f32 {
        match self {
            Self::Length(length) => length as f32,
            Self::OfDiagonal(share) => (share * diagonal) as f32,
        }
    }
}

/// One scene with receivers that share their directions.
#[derive(Debug, Clone)]
pub(crate) struct Ambient {
    pub(crate) model: Model,
    set: ReceiverSet,
    /// The receivers as umbel takes them.
    pub(crate) hemispheres: Vec<Hemisphere>,
    /// The directions as umbel takes them, about half of which are above a receiver's horizon.
    pub(crate) samples: Vec<RaySample>,
    /// The same for the others.
    pub(crate) rays: AmbientRays,
}

impl Ambient {
    /// Receivers with so many rays above the horizon, on average.
    pub(crate) fn new(
        name: &str,
        scene: &Scene,
        set: ReceiverSet,
        rays: usize,
        max_distance: Option<MaxDistance>,
    ) -> Result<Self> {
        let model = Model::new(name, scene);
        let triangles = Triangles::new(&model.positions, &model.triangles)?;
        let hemispheres = hemispheres(&model, &triangles, set);
        let interval = interval(scene, max_distance);
        Self::along(model, set, hemispheres, directions::sphere(2 * rays), interval)
    }

    /// Receivers of a set, with these directions.
    pub(crate) fn along(
        model: Model,
        set: ReceiverSet,
        hemispheres: Vec<Hemisphere>,
        directions: Vec<[f32; 3]>,
        interval: [f32; 2],
    ) -> Result<Self> {
        let triangles = Triangles::new(&model.positions, &model.triangles)?;
        let sample = |direction: &[f32; 3]| RaySample {
            direction: DVec3::from_array(direction.map(f64::from)),
            t_min: 0.0,
            t_max: interval[1],
        };
        let samples = directions.iter().map(sample).collect();
        let rays = AmbientRays::new(&triangles, &hemispheres, directions, interval);
        Ok(Self { model, set, hemispheres, samples, rays })
    }
}

/// Where rays begin, but umbel's, and where they end.
pub(crate) fn interval(scene: &Scene, max_distance: Option<MaxDistance>) -> [f32; 2] {
    let diagonal = DVec3::from_array(scene.bounds().extent()).length();
    let end = max_distance.map_or(f32::INFINITY, |distance| distance.in_scene(diagonal));
    [(EPSILON * diagonal) as f32, end]
}

impl Subject for Ambient {
    type Answer = OpenBits;

    const RASTERIZED: bool = false;

    fn model(&self) -> &Model {
        &self.model
    }

    fn layout(&self) -> String {
        format!("{} x {}", self.set, self.samples.len() / 2)
    }

    fn facts(&self) -> Vec<(&'static str, Value)> {
        let [begin, end] = self.rays.interval;
        vec![
            ("receiver_set", json!(self.set.to_string())),
            ("receivers", json!(self.hemispheres.len())),
            ("directions", json!(self.samples.len())),
            ("epsilon", json!(begin)),
            // Infinite without a limit, which JSON has as null.
            ("max_distance", json!(end)),
        ]
    }

    fn rays(&self) -> usize {
        self.rays.len()
    }

    fn blank(&self) -> OpenBits {
        self.rays.blank()
    }

    /// Rays that the other has as open and that are blocked before its rays begin: exact arithmetic sees what is so near.
    fn explain(&self, umbel: &OpenBits, other: &OpenBits) -> Result<Vec<Share>> {
        let (count, some) = self.rays.opened(umbel, other, MOST_EXPLAINED);
        let widen = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        let rays: Vec<Ray> =
            some.iter().map(|&(point, direction)| Ray::new(widen(point), widen(direction))).collect();
        let triangles = Triangles::new(&self.model.positions, &self.model.triangles)?;
        let (hits, _) = closest_hit(&triangles, &rays[..], &Options::default())?;
        let near = hits.ts().iter().filter(|&&t| t <= self.rays.interval[0]).count();
        let of_all = count as f64 * near as f64 / (some.len().max(1) * self.rays().max(1)) as f64;
        Ok(vec![Share { heading: "near %", key: "it_alone_opens_before_epsilon", of_all }])
    }

    fn engines(
        &self,
        engines: &Engines,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Self>>>> {
        engines.for_ambient(self, wanted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engines::umbel::Umbel;
    use umbel::builtin;

    fn room(max_distance: &str) -> Ambient {
        let scene = builtin("cornell").expect("a scene");
        let limit = Some(max_distance.parse().expect("a distance"));
        Ambient::new("room", &scene, ReceiverSet::Random(300), 32, limit).expect("a subject")
    }

    fn open(subject: &Ambient, mut engine: impl Engine<Ambient>) -> OpenBits {
        let mut answer = subject.blank();
        engine.run(subject, &mut answer).expect("open rays");
        answer
    }

    #[test]
    fn groupings_agree_about_a_room() {
        let room = room("20%");
        let umbel = open(&room, Umbel::from_scratch());
        let count = umbel.words.iter().map(|word| word.count_ones() as usize).sum::<usize>();
        assert!((room.rays() / 4..room.rays()).contains(&count), "{count} of {}", room.rays());
        for grouped in Umbel::grouped() {
            assert_eq!(open(&room, grouped), umbel);
        }
    }

    #[cfg(feature = "obvhs")]
    #[test]
    fn engines_agree_about_a_room() {
        use crate::subjects::answer::Answer;

        let room = room("0.2%");
        let umbel = open(&room, Umbel::from_scratch());
        for mut engine in crate::engines::obvhs::variants(&room, |_| true) {
            let mut other = room.blank();
            engine.run(&room, &mut other).expect("open rays");
            assert!(umbel.agreement(&other)[0].of_all > 0.999, "{}", engine.name());
        }
    }

    #[test]
    fn distances_are_lengths_or_shares() {
        assert_eq!("10%".parse(), Ok(MaxDistance::OfDiagonal(0.1)));
        assert_eq!("2.5".parse(), Ok(MaxDistance::Length(2.5)));
        for text in ["", "%", "-1", "inf", "0"] {
            assert!(text.parse::<MaxDistance>().is_err(), "{text}");
        }
    }
}
