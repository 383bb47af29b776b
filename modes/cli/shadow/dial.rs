//! The dial of `umbel shadow`: the resolution of cube maps that an error asks for, or that a time allows.
//!
//! The error is that of shadows looked up in the map, in the picture of the camera: the share of wrong ones among the pixels
//! that show a surface. One is wrong where the map says lit and the exact mask says shadowed, or the other way round. The share
//! is estimated on a seeded sample of those pixels. For them alone texels are traced, see [`umbel::shadow::cube_answers`], so that a resolution is tried without making its
//! map. Surfaces that turn away from the light need no map and are right. With several lights the worst counts.
//!
//! *An error.* Resolutions are doubled until one is good enough, then a fine ladder below it is climbed. *A time.* Maps are
//! made that take a small part of it; their times grow linearly with the number of texels. Where loading has left no time, the
//! size of the first of those maps is taken, untried.

use std::time::Instant;

use umbel::engine::Receiver;
use umbel::measure::{ErrorEstimate, sample_key};
use umbel::shadow::{Receivers, cube_answers, cube_map};
use umbel::{Error, Frame, Options, Origin, Triangles};

use crate::options::dial::{Choice, Clock, Goal, Tried, cheapest, ladder};

/// The largest texel count along a side that is chosen.
const MOST: u32 = 8192;
/// Wrong pixels that a sample should have at the limit, so that their number is known to a tenth.
const WRONG: f64 = 400.0;
/// The fewest and the most pixels of a sample, for each light.
const SAMPLE: [usize; 2] = [1 << 15, 1 << 19];
/// The seed of samples.
const SEED: u64 = 0;
/// The size of the first map that is timed: the least that is chosen for a time.
const PILOT: u32 = 128;
/// Part of the time that is left as a reserve.
const RESERVED: f64 = 0.03;

/// Pixels of a light whose shadows are known.
struct Sample {
    light: glam::DVec3,
    receivers: Vec<Receiver>,
    shadowed: Vec<bool>,
    /// How many receivers there are.
    population: usize,
    /// How many pixels show a surface.
    surfaces: usize,
}

/// Lights, and what is seen of the scene.
pub(crate) struct Dial<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) options: Options,
    pub(crate) lights: &'a [Origin],
    /// The receivers of each.
    pub(crate) receivers: &'a [Receivers],
    /// How many pixels show a surface.
    pub(crate) surfaces: usize,
    /// The largest resolution that memory has room for.
    pub(crate) most: u32,
    /// When the command started.
    pub(crate) start: Instant,
}

impl Dial<'_> {
    /// Chooses the resolution.
    pub(crate) fn choose(&self, goal: Goal) -> Result<Choice, Error> {
        goal.choose(|limit| self.for_error(limit), |seconds| self.for_time(seconds))
    }

    /// Pixels of each light, and whether they are in shadow.
    fn samples(&self, limit: f64) -> Result<Vec<Sample>, Error> {
        let count = (WRONG / limit).clamp(SAMPLE[0] as f64, SAMPLE[1] as f64) as usize;
        let mut samples = Vec::new();
        for (&light, receivers) in self.lights.iter().zip(self.receivers) {
            let Origin::Point(position) = light else { continue };
            let mut keyed: Vec<(u64, Receiver)> = receivers
                .rays
                .iter()
                .zip(&receivers.points)
                .map(|(&ray, &receiver)| (sample_key(SEED, u64::from(ray)), receiver))
                .collect();
            keyed.sort_by_key(|(key, _)| *key);
            keyed.truncate(count);
            let sampled: Vec<Receiver> = keyed.into_iter().map(|(_, receiver)| receiver).collect();
            let (shadowed, _) = Frame::new().shadowed(self.triangles, light, &sampled, &self.options)?;
            let (population, surfaces) = (receivers.rays.len(), self.surfaces);
            samples.push(Sample { light: position, receivers: sampled, shadowed, population, surfaces });
        }
        Ok(samples)
    }

    /// The error of a resolution: that of the light for which it is greatest.
    fn error(&self, samples: &[Sample], size: u32) -> Result<ErrorEstimate, Error> {
        let mut worst = ErrorEstimate::of_rate(0, 0, 0);
        for sample in samples {
            let Sample { light, receivers, shadowed, population, surfaces } = sample;
            let lit =
                cube_answers(self.triangles, *light, size, receivers, &mut Frame::new(), &self.options)?;
            let wrong = lit.iter().zip(shadowed).filter(|(lit, shadowed)| lit == shadowed).count();
            let error = ErrorEstimate::of_rate(wrong, receivers.len(), *population).among(*surfaces);
            if error.upper >= worst.upper {
                worst = error;
            }
        }
        Ok(worst)
    }

    /// The smallest maps for an error.
    fn for_error(&self, limit: f64) -> Result<Choice, Error> {
        let samples = self.samples(limit)?;
        let (mut tried, most) = (Vec::new(), self.most.min(MOST));
        // Where the ladder is to be climbed: above the last that is not good enough.
        let mut guess = 16;
        while 2 * guess <= most {
            let error = self.error(&samples, 2 * guess)?;
            tried.push(Tried { setting: 2 * guess, error });
            if error.upper <= limit {
                break;
            }
            guess *= 2;
        }
        let rungs: Vec<u32> = ladder(16, most, 8);
        let mut climbed = Vec::new();
        let found =
            cheapest(&rungs, f64::from(guess), limit, &mut climbed, |size| self.error(&samples, size))?;
        tried.append(&mut climbed);
        let Some(Tried { setting, error }) = found else {
            let least = tried.last().map_or(0.0, |tried| tried.error.error);
            return Err(Error::Limit(format!(
                "--max-error {limit}: even a cube of {most} x {most} texels has about {least:.2e} of the pixels wrong here; \
                 give a larger share, or take --mask, which is exact"
            )));
        };
        let why = format!(
            "the smallest cube whose error is at most {limit}: below {:.2e} with 97.5 % confidence",
            error.upper
        );
        Ok(choice(Goal::MaxError(limit), setting, Some(error), tried, why))
    }

    /// The largest maps for a time.
    fn for_time(&self, seconds: f64) -> Result<Choice, Error> {
        let until = seconds * 1000.0 * (1.0 - RESERVED);
        let left = || until - self.start.elapsed().as_secs_f64() * 1000.0;
        let (goal, most) = (Goal::TimeBudget(seconds), self.most.min(MOST));
        if left() <= 0.0 {
            return Ok(hurried(goal, PILOT.min(most), self.start));
        }
        // Half of the largest error: the sample is large enough for any.
        let sampled = Instant::now();
        let samples = self.samples(0.05)?;
        let estimate_ms = sampled.elapsed().as_secs_f64() * 1000.0;
        let (mut clock, mut size) = (Clock::default(), PILOT.min(most));
        let fitting = loop {
            let (run, mut frame) = (Instant::now(), Frame::keeping_order());
            for &light in self.lights {
                let Origin::Point(position) = light else { continue };
                cube_map(self.triangles, position, size, &mut frame, &self.options)?;
            }
            clock.push(f64::from(size) * f64::from(size), run);
            let fitting = clock.work_in(left() - estimate_ms);
            let next = (fitting / 8.0).max(0.0).sqrt().min(f64::from(most)) as u32;
            if f64::from(next) < 1.4 * f64::from(size) {
                break fitting.max(0.0).sqrt().min(f64::from(most)) as u32;
            }
            size = next;
        };
        if fitting < PILOT.min(most) {
            return Ok(hurried(goal, PILOT.min(most), self.start));
        }
        let error = self.error(&samples, fitting)?;
        let why = if fitting == most {
            "the largest cube that is made; it takes less time than there is".to_owned()
        } else {
            format!("the largest cube for which {seconds} s are enough")
        };
        Ok(choice(goal, fitting, Some(error), Vec::new(), why))
    }
}

/// The choice where there is no time for another.
fn hurried(goal: Goal, setting: u32, start: Instant) -> Choice {
    let why = "the least that is chosen for a time; nothing has been estimated".to_owned();
    Choice { warning: Some(goal.too_short(start)), ..choice(goal, setting, None, Vec::new(), why) }
}

fn choice(goal: Goal, setting: u32, error: Option<ErrorEstimate>, tried: Vec<Tried>, why: String) -> Choice {
    Choice { option: "--cube-size", goal, setting, error, tried, why, warning: None, milliseconds: 0.0 }
}
