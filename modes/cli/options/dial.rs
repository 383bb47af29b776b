//! The dial on the command line: how wrong an output may be, or how long it may take.

use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};
use umbel::Error;
use umbel::measure::ErrorEstimate;

use crate::common::Common;
use crate::options::camera::refuse_first;

/// What the seed of a reference differs by.
pub(crate) const REFERENCE_SEED: u64 = 0x5eed_0000_0000_0001;

/// Options that have the command choose a setting by itself.
#[derive(Debug, Args)]
#[command(next_help_heading = "Dial")]
pub(crate) struct DialArgs {
    /// Choose --rays (bake) or --cube-size (shadow): the cheapest whose error is at most E, estimated on a sample. For bake it
    /// is the root mean square of the differences from many rays, where 1 is the whole range; for shadow the share of pixels
    /// whose shadow is wrong, such as 0.05
    #[arg(long, value_name = "E", value_parser = parse_positive, conflicts_with = "time_budget")]
    pub(crate) max_error: Option<f64>,

    /// Choose --rays (bake) or --cube-size (shadow): the most that take about T seconds, from the start of the command
    /// until its numbers are found; writing them is not counted. Where T is too short for anything, the least there is is
    /// done all the same, with a warning
    #[arg(long, value_name = "T", value_parser = parse_positive)]
    pub(crate) time_budget: Option<f64>,
}

/// What is asked of the dial.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Goal {
    /// An RMSE, or a share of wrong pixels.
    MaxError(f64),
    /// Seconds.
    TimeBudget(f64),
}

impl Goal {
    /// The warning of a time that is over before anything could be chosen.
    pub(crate) fn too_short(self, start: Instant) -> String {
        let gone = start.elapsed().as_secs_f64();
        let asked = match self {
            Self::TimeBudget(seconds) => format!("--time-budget {seconds}"),
            Self::MaxError(error) => format!("--max-error {error}"),
        };
        format!(
            "{asked}: after {gone:.2} s there is no time left for more than the least, which is done all the same"
        )
    }

    /// Chooses by the rule for an error or by the rule for a time, and notes how long it took.
    pub(crate) fn choose(
        self,
        for_error: impl FnOnce(f64) -> Result<Choice, Error>,
        for_time: impl FnOnce(f64) -> Result<Choice, Error>,
    ) -> Result<Choice, Error> {
        let started = Instant::now();
        let choice = match self {
            Self::MaxError(limit) => for_error(limit)?,
            Self::TimeBudget(seconds) => for_time(seconds)?,
        };
        Ok(Choice { milliseconds: started.elapsed().as_secs_f64() * 1000.0, ..choice })
    }
}

impl DialArgs {
    /// What is asked, if anything.
    pub(crate) fn goal(&self) -> Option<Goal> {
        self.max_error.map(Goal::MaxError).or_else(|| self.time_budget.map(Goal::TimeBudget))
    }

    /// Refuses the option that the dial is to choose.
    pub(crate) fn refuse_beside(&self, chosen: &str, is_given: bool) -> Result<(), Error> {
        let what = format!("--max-error and --time-budget choose {chosen}: leave it out");
        refuse_first(&[(self.goal().is_some() && is_given, &what)])
    }
}

/// A setting that was looked at.
pub(crate) struct Tried {
    pub(crate) setting: u32,
    pub(crate) error: ErrorEstimate,
}

/// What the dial has chosen, and why.
pub(crate) struct Choice {
    /// The option: --rays or --cube-size.
    pub(crate) option: &'static str,
    pub(crate) goal: Goal,
    pub(crate) setting: u32,
    /// The error of the setting, once it is known.
    pub(crate) error: Option<ErrorEstimate>,
    pub(crate) tried: Vec<Tried>,
    pub(crate) why: String,
    /// Why what was asked for cannot be had, where this is the best that can.
    pub(crate) warning: Option<String>,
    /// What it took to find out.
    pub(crate) milliseconds: f64,
}

impl Choice {
    /// What the error is.
    fn measure(&self) -> &'static str {
        if self.option == "--rays" { "RMSE" } else { "share of wrong pixels" }
    }

    /// The choice for the report.
    pub(crate) fn json(&self) -> Value {
        let estimate = |error: &ErrorEstimate| {
            let ErrorEstimate { error, lower, upper, sample, population } = error;
            json!({
                "error": error,
                "measure": self.measure(),
                "lower": lower,
                "upper": upper,
                "sample": sample,
                "population": population,
            })
        };
        let (asked, limit) = match self.goal {
            Goal::MaxError(limit) => ("max_error", limit),
            Goal::TimeBudget(limit) => ("time_budget", limit),
        };
        let tried: Vec<Value> = self
            .tried
            .iter()
            .map(|tried| json!({ "setting": tried.setting, "estimate": estimate(&tried.error) }))
            .collect();
        json!({
            "asked": asked,
            "limit": limit,
            "option": self.option,
            "setting": self.setting,
            "why": self.why,
            "warning": self.warning,
            "estimate": self.error.as_ref().map(estimate),
            "tried": tried,
            "ms": self.milliseconds,
        })
    }

    /// Says on stderr what was chosen.
    pub(crate) fn say(&self, common: &Common) {
        if common.quiet {
            return;
        }
        let measure = self.measure();
        let error = self.error.map_or(String::new(), |ErrorEstimate { error, lower, upper, .. }| {
            format!("; {measure} about {error:.2e} ({lower:.2e} to {upper:.2e})")
        });
        if let Some(warning) = &self.warning {
            anstream::eprintln!("warning: {warning}");
        }
        anstream::eprintln!("{} {}: {}{error}", self.option, self.setting, self.why);
    }
}

/// Finds the first of some settings, cheapest first, whose error is at most a limit with 97.5 % confidence: from a guess
/// upward, or downward as long as that holds. `None` where even the last one is worse.
pub(crate) fn cheapest(
    settings: &[u32],
    guess: f64,
    limit: f64,
    tried: &mut Vec<Tried>,
    mut estimate: impl FnMut(u32) -> Result<ErrorEstimate, Error>,
) -> Result<Option<Tried>, Error> {
    let mut at = settings.partition_point(|&setting| f64::from(setting) < guess).min(settings.len() - 1);
    let mut found: Option<Tried> = None;
    loop {
        let setting = settings[at];
        let error = estimate(setting)?;
        tried.push(Tried { setting, error });
        if error.upper <= limit {
            found = Some(Tried { setting, error });
            if at == 0 || tried.iter().any(|tried| tried.setting < setting) {
                return Ok(found);
            }
            at -= 1;
        } else if found.is_some() || at + 1 == settings.len() {
            return Ok(found);
        } else {
            at += 1;
        }
    }
}

/// Whole numbers from `first` to `last` at even ratios: `per_octave` for each factor of 2.
pub(crate) fn ladder(first: u32, last: u32, per_octave: u32) -> Vec<u32> {
    let rung = |k: u32| f64::from(first) * libm::exp2(f64::from(k) / f64::from(per_octave));
    let mut rungs: Vec<u32> =
        (0..).map(|k| rung(k).round() as u32).take_while(|&rung| rung <= last).collect();
    rungs.dedup();
    rungs
}

/// Time that grows linearly with work: a + b·w through the last two of some runs, or b·w through a single one.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    /// Work and milliseconds.
    runs: Vec<[f64; 2]>,
}

impl Clock {
    pub(crate) fn push(&mut self, work: f64, start: Instant) {
        self.runs.push([work, start.elapsed().as_secs_f64() * 1000.0]);
    }

    /// How much work fits into a time.
    pub(crate) fn work_in(&self, milliseconds: f64) -> f64 {
        match self.runs[..] {
            [] => 0.0,
            [[work, taken]] => work * milliseconds / taken,
            [.., [w0, t0], [w1, t1]] => {
                // What disturbs the shorter run must not make the longer one look free.
                let slope = ((t1 - t0) / (w1 - w0)).max(0.5 * t1 / w1);
                (w1 + (milliseconds - t1) / slope).max(0.0)
            }
        }
    }

    /// The work of the last run.
    pub(crate) fn last(&self) -> f64 {
        self.runs.last().map_or(0.0, |run| run[0])
    }
}

/// A number above 0.
fn parse_positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "expected a number above 0".into())
}
