//! The dial of `umbel bake`: as many rays as an error asks for, or as a time allows.
//!
//! *An error.* A seeded sample of the receivers is baked with few rays, which are the very ones that the whole bake would
//! take, and with at least eight times as many, seeded differently, as a reference. A power law through the errors says
//! about how many rays are needed; around there all of a fine ladder are tried, and the fewest are chosen whose error is below
//! the limit even at the upper end of its interval. The reference has an error of its own, which adds to those that are
//! measured: so they are too large rather than too small.
//!
//! *A time.* All receivers are baked with so few rays that it takes a small part of the time. From two such runs the time
//! of one ray follows, and so the number of rays for what is left. A few percent of the time go into errors of fewer rays;
//! that of the chosen number is read from their power law. Where no more rays fit than the last of those runs had, its
//! values are the answer: a time, however short, always gets one.
//!
//! Based on: Robert Marques et al., "Spherical Fibonacci Point Sets for Illumination Integrals", 2013 (how errors fall).

use std::time::Instant;

use umbel::bake::{Bake, BakeOptions, SampleSet};
use umbel::measure::{ErrorEstimate, PowerLaw};
use umbel::{Error, Frame, Triangles};

use crate::bake::run;
use crate::bake::sample::{Sample, item_values};
use crate::bake::source::{Results, Source};
use crate::common::Common;
use crate::options::dial::REFERENCE_SEED;
use crate::options::dial::{Choice, Clock, Goal, Tried, cheapest, ladder};
use crate::report::Times;

/// Receivers of a sample: the root of a mean square is known to a few percent.
const SAMPLE: usize = 1024;
/// Rays of a reference for each ray of what it is compared with. Errors fall about as K^(-3/4): its own is a fifth.
const REFERENCE: u32 = 8;
/// The fewest rays of a reference.
const LEAST_REFERENCE: u32 = 512;
/// The most rays that are chosen for an error: the reference has at most 65,536.
const MOST_RAYS: u32 = 65_536 / REFERENCE;
/// Rays from which the power law is found.
const FIRST_RAYS: [u32; 4] = [8, 16, 32, 64];
/// The fewest rays that are chosen for a time.
const LEAST_RAYS: u32 = 4;
/// Part of the time that is left as a reserve.
const RESERVED: f64 = 0.03;
/// Part of the time in which errors are estimated.
const ESTIMATING: f64 = 0.08;

/// What has been baked while a number of rays was looked for, with that number.
pub(crate) struct Done {
    pub(crate) found: Results,
    pub(crate) times: Times,
}

/// What is baked, and how, but for the number of rays.
pub(crate) struct Dial<'a> {
    pub(crate) options: BakeOptions,
    pub(crate) source: &'a Source<'a>,
    pub(crate) triangles: &'a Triangles<'a>,
    /// Units at once.
    pub(crate) piece: usize,
    pub(crate) common: &'a Common,
    /// When the command started.
    pub(crate) start: Instant,
}

impl Dial<'_> {
    /// Chooses the number of rays. Where they have been baked on the way, what was found comes with them.
    pub(crate) fn choose(&self, goal: Goal) -> Result<(Choice, Option<Done>), Error> {
        let mut done = None;
        let for_time = |seconds: f64| {
            let (choice, found) = self.for_time(seconds)?;
            done = found;
            Ok(choice)
        };
        let choice = goal.choose(|limit| self.for_error(limit), for_time)?;
        Ok((choice, done))
    }

    /// The values of the items of a sample, with some rays.
    fn bake(&self, sample: &Sample, options: BakeOptions) -> Result<Vec<f64>, Error> {
        let bake = Bake::new(BakeOptions { bent: false, traced: false, ..options })?;
        let receivers = sample.receivers();
        let found = bake.run(self.triangles, &receivers, &mut Frame::new(), &self.common.options())?;
        Ok(item_values(&receivers, &found.values))
    }

    /// The options of a reference for so many rays, and its own number of them.
    fn reference(&self, rays: u32) -> BakeOptions {
        let rays = (rays * REFERENCE).clamp(LEAST_REFERENCE, MOST_RAYS * REFERENCE);
        let seed = self.options.seed ^ REFERENCE_SEED;
        BakeOptions { rays, seed, set: SampleSet::Shared, ..self.options }
    }

    /// The fewest rays for an error.
    fn for_error(&self, limit: f64) -> Result<Choice, Error> {
        let sample = Sample::new(self.source, self.piece, SAMPLE, self.options.seed);
        let mut reference = (self.reference(0), Vec::new());
        reference.1 = self.bake(&sample, reference.0)?;
        let mut estimate = |rays: u32| -> Result<ErrorEstimate, Error> {
            let needed = self.reference(rays);
            if needed.rays > reference.0.rays {
                // With room for the next few.
                let rays = needed.rays.saturating_mul(2).min(MOST_RAYS * REFERENCE);
                reference = (BakeOptions { rays, ..needed }, Vec::new());
                reference.1 = self.bake(&sample, reference.0)?;
            }
            let found = self.bake(&sample, BakeOptions { rays, ..self.options })?;
            Ok(estimate_of(&sample, &found, &reference.1))
        };
        let mut tried = Vec::new();
        for rays in FIRST_RAYS {
            tried.push(Tried { setting: rays, error: estimate(rays)? });
        }
        let law =
            PowerLaw::fit(&tried.iter().map(|t| (f64::from(t.setting), t.error.error)).collect::<Vec<_>>());
        let guess = law.map_or(0.0, |law| law.count(limit) / 1.25);
        let rungs = ladder(4, MOST_RAYS, 6);
        let Some(found) = cheapest(&rungs, guess, limit, &mut Vec::new(), |rays| {
            let error = estimate(rays)?;
            tried.push(Tried { setting: rays, error });
            Ok(error)
        })?
        else {
            let least = tried.last().map_or(0.0, |tried| tried.error.error);
            return Err(Error::Limit(format!(
                "--max-error {limit}: even {MOST_RAYS} rays have an error of about {least:.2e} here; give a larger one, \
                 or --rays"
            )));
        };
        let (rays, upper) = (found.setting, found.error.upper);
        let why = format!(
            "the fewest rays whose error is at most {limit}: below {upper:.2e} with 97.5 % confidence"
        );
        Ok(choice(Goal::MaxError(limit), rays, Some(found.error), tried, why))
    }

    /// The most rays for a time.
    fn for_time(&self, seconds: f64) -> Result<(Choice, Option<Done>), Error> {
        if self.common.repeat > 1 {
            return Err(Error::Usage("--time-budget is for one run: leave out --repeat".into()));
        }
        let until = seconds * 1000.0 * (1.0 - RESERVED);
        let left = || until - self.start.elapsed().as_secs_f64() * 1000.0;
        let per_ray = if self.options.set == SampleSet::Independent { 1 } else { 2 };
        let most = 65_536 * per_ray;
        if left() <= 0.0 {
            return Ok((self.hurried(seconds, LEAST_RAYS), None));
        }
        let (mut clock, mut directions) = (Clock::default(), LEAST_RAYS * per_ray);
        loop {
            let rays = directions / per_ray;
            let (bake, run) = (Bake::new(BakeOptions { rays, ..self.options })?, Instant::now());
            let pieces = run::Pieces { piece: self.piece, with_bent: self.options.bent, near: None };
            let mut times = Times::default();
            let found = run::run(&bake, (self.source, self.triangles), &pieces, self.common, &mut times)?;
            clock.push(f64::from(bake.directions() as u32), run);
            let fitting = clock.work_in(left());
            // One more run that takes an eighth of the time, for as long as the last one was shorter.
            let next = (fitting / 8.0).min(f64::from(most)) as u32;
            if f64::from(next) >= 2.0 * clock.last() {
                directions = next;
                continue;
            }
            let fitting = |clock: &Clock| clock.work_in(left()).min(f64::from(most)) as u32 / per_ray;
            if fitting(&clock) <= rays && rays < 65_536 {
                return Ok((self.hurried(seconds, rays), Some(Done { found, times })));
            }
            let (tried, law) = self.measured(fitting(&clock).min(MOST_RAYS), ESTIMATING * seconds)?;
            let enough = fitting(&clock);
            let done = (enough <= rays).then_some(Done { found, times });
            return Ok((self.fitting(seconds, enough.max(rays), tried, law), done));
        }
    }

    /// Errors of few rays, then of twice as many, for as long as there is time; and the law of them.
    fn measured(&self, most: u32, seconds: f64) -> Result<(Vec<Tried>, Option<PowerLaw>), Error> {
        let started = Instant::now();
        let sample = Sample::new(self.source, self.piece, SAMPLE / 4, self.options.seed);
        let (mut tried, mut rays, mut taken) = (Vec::<Tried>::new(), FIRST_RAYS[0].min(most.max(1)), 0.0);
        while rays <= most && started.elapsed().as_secs_f64() + 2.0 * taken <= seconds {
            let step = Instant::now();
            let reference = BakeOptions { rays: rays * REFERENCE, ..self.reference(rays) };
            let (reference, found) =
                (self.bake(&sample, reference)?, self.bake(&sample, BakeOptions { rays, ..self.options })?);
            tried.push(Tried { setting: rays, error: estimate_of(&sample, &found, &reference) });
            taken = step.elapsed().as_secs_f64();
            rays = if rays < most { (2 * rays).min(most) } else { u32::MAX / REFERENCE };
        }
        let pairs: Vec<_> = tried.iter().map(|tried| (f64::from(tried.setting), tried.error.error)).collect();
        let law = PowerLaw::fit(&pairs);
        Ok((tried, law))
    }

    /// So many rays fit into the time. Their error is that of the most rays that were measured, moved along the law.
    fn fitting(&self, seconds: f64, rays: u32, tried: Vec<Tried>, law: Option<PowerLaw>) -> Choice {
        let why = if rays >= 65_536 {
            "the most rays that there can be; they take less time than there is".to_owned()
        } else {
            format!("the most rays for which {seconds} s are enough")
        };
        let error = tried.last().map(|last| {
            let moved =
                law.map_or(1.0, |law| law.error(f64::from(rays)) / law.error(f64::from(last.setting)));
            let ErrorEstimate { error, lower, upper, .. } = last.error;
            ErrorEstimate { error: error * moved, lower: lower * moved, upper: upper * moved, ..last.error }
        });
        choice(Goal::TimeBudget(seconds), rays, error, tried, why)
    }

    /// The choice where there is no time for more rays than have been tried, or for any.
    fn hurried(&self, seconds: f64, rays: u32) -> Choice {
        let goal = Goal::TimeBudget(seconds);
        let why = "the fewest that are chosen for a time; their error has not been estimated".to_owned();
        let chosen = choice(goal, rays, None, Vec::new(), why);
        Choice { warning: Some(goal.too_short(self.start)), ..chosen }
    }
}

fn choice(goal: Goal, setting: u32, error: Option<ErrorEstimate>, tried: Vec<Tried>, why: String) -> Choice {
    Choice { option: "--rays", goal, setting, error, tried, why, warning: None, milliseconds: 0.0 }
}

/// The error of a sample's values against those of a reference.
fn estimate_of(sample: &Sample, found: &[f64], reference: &[f64]) -> ErrorEstimate {
    let squares: Vec<f64> = found.iter().zip(reference).map(|(a, b)| (a - b) * (a - b)).collect();
    ErrorEstimate::of_squares(&squares, sample.population)
}
