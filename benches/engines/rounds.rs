//! Rounds: every engine runs once in each, so that all of them meet the same moods of the machine.

use crate::Result;
use crate::engines::engine::{Engine, Times};
use crate::subjects::Subject;
use crate::subjects::answer::{Answer, Share};

/// What was measured of one engine.
#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub(crate) name: String,
    pub(crate) prebuilt: bool,
    /// One per round.
    pub(crate) times: Vec<Times>,
    /// With umbel's answer.
    pub(crate) agreement: Vec<Share>,
}

impl Measured {
    /// The median of a part of the times, in milliseconds.
    pub(crate) fn median(&self, part: impl Fn(&Times) -> f64) -> f64 {
        median(self.times.iter().map(part))
    }

    /// The engine without its settings: `embree` of `embree-medium-16`.
    pub(crate) fn family(&self) -> &str {
        self.name.split('-').next().unwrap_or(&self.name)
    }
}

/// The value in the middle, or the mean of the two that are; NaN of none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return f64::NAN;
    }
    values.sort_by(f64::total_cmp);
    let (low, high) = ((values.len() - 1) / 2, values.len() / 2);
    (values[low] + values[high]) / 2.0
}

/// Runs all engines round by round; the first round warms up and does not count. The first engine is umbel, with whose
/// answer the others are compared in the last round.
pub(crate) fn measure<S: Subject>(
    engines: &mut [Box<dyn Engine<S> + '_>],
    subject: &S,
    repeat: u32,
) -> Result<Vec<Measured>> {
    let mut measured: Vec<Measured> = engines.iter().map(|engine| blank(engine.as_ref())).collect();
    let mut answer = subject.blank();
    let mut reference = answer.clone();
    for round in 0..=repeat {
        for (k, (engine, measured)) in engines.iter_mut().zip(&mut measured).enumerate() {
            let times = engine.run(subject, &mut answer)?;
            if round > 0 {
                measured.times.push(times);
            }
            if round == repeat {
                if k == 0 {
                    reference.clone_from(&answer);
                }
                measured.agreement = reference.agreement(&answer);
                measured.agreement.extend(subject.explain(&reference, &answer)?);
            }
        }
    }
    Ok(measured)
}

/// An engine before it ran.
fn blank<S: Subject>(engine: &dyn Engine<S>) -> Measured {
    let (times, agreement) = (Vec::new(), Vec::new());
    Measured { name: engine.name().to_owned(), prebuilt: engine.prebuilt(), times, agreement }
}

/// The best times of an engine over its settings, in milliseconds, with the setting's name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Best {
    pub(crate) family: String,
    /// The least median of build and trace together.
    pub(crate) total: Option<(f64, String)>,
    /// The least median of trace alone, whatever the build cost; for umbel, with the order kept.
    pub(crate) trace: Option<(f64, String)>,
}

/// The best of each engine, in the order in which they ran.
pub(crate) fn best(measured: &[Measured]) -> Vec<Best> {
    let mut families: Vec<&str> = measured.iter().map(Measured::family).collect();
    families.dedup();
    let least = |times: &mut dyn Iterator<Item = (f64, String)>| times.min_by(|a, b| a.0.total_cmp(&b.0));
    let of_family = |family: &str| {
        let members = || measured.iter().filter(|engine| engine.family() == family);
        let built = members().filter(|engine| !engine.prebuilt);
        let total = least(&mut built.map(|engine| (engine.median(Times::total), engine.name.clone())));
        let trace = least(&mut members().map(|engine| (engine.median(|t| t.trace), engine.name.clone())));
        Best { family: family.to_owned(), total, trace }
    };
    families.into_iter().map(of_family).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn engine(name: &str, prebuilt: bool, times: &[(f64, f64)]) -> Measured {
        let times = times.iter().map(|&(build, trace)| Times { build, trace }).collect();
        Measured { name: name.into(), prebuilt, times, agreement: Vec::new() }
    }

    #[test]
    fn medians_of_odd_and_even_counts() {
        let odd = engine("a", false, &[(0.0, 3.0), (0.0, 1.0), (0.0, 2.0)]);
        assert_eq!(odd.median(|t| t.trace), 2.0);
        let even = engine("a", false, &[(0.0, 4.0), (0.0, 1.0)]);
        assert_eq!(even.median(|t| t.trace), 2.5);
    }

    #[test]
    fn the_best_total_comes_from_engines_that_build() {
        let measured = [
            engine("x-a", false, &[(1.0, 5.0)]),
            engine("x-b", false, &[(9.0, 4.0)]),
            engine("x-c", true, &[(0.0, 3.0)]),
        ];
        let best = best(&measured);
        assert_eq!(best.len(), 1);
        assert_eq!(best[0].total, Some((6.0, "x-a".into())));
        assert_eq!(best[0].trace, Some((3.0, "x-c".into())));
    }
}
