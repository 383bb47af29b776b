//! What `umbel trade` has found, as JSON and CSV.
//!
//! Numbers are rounded to four digits once, and are the same everywhere.

use serde_json::{Value, json};
use umbel::Error;

use crate::machine::Machine;
use crate::trade::args::ModeArg;
use crate::trade::settings::Changes;

/// What is known about a setting.
pub(crate) struct Measured {
    pub(crate) series: &'static str,
    pub(crate) label: String,
    pub(crate) command: String,
    pub(crate) changes: Changes,
    pub(crate) is_default: bool,
    pub(crate) is_on_front: bool,
    /// The median of its times.
    pub(crate) ms: f64,
    pub(crate) ms_least: f64,
    pub(crate) ms_most: f64,
    /// The median over that of the default.
    pub(crate) ratio: f64,
    pub(crate) rmse: f64,
    pub(crate) greatest: f64,
    pub(crate) differing: usize,
    pub(crate) differing_percent: f64,
    /// For rounded decisions: items that differ from the default's in the triangle, in t, in a value.
    pub(crate) changed: Option<[usize; 3]>,
    /// Whether every run gave the bytes that it has to give.
    pub(crate) same_bytes: bool,
    /// Its difference from the reference, as a PNG file.
    pub(crate) picture: Option<Vec<u8>>,
}

impl Measured {
    /// What it is called where its series is not clear.
    pub(crate) fn name(&self) -> String {
        if self.label == self.series {
            self.label.clone()
        } else {
            format!("{}: {}", self.series, self.label)
        }
    }
}

/// All that was found.
pub(crate) struct Findings {
    pub(crate) mode: ModeArg,
    pub(crate) scene: String,
    pub(crate) triangles: usize,
    pub(crate) vertices: usize,
    /// Pixels that see something, or receivers.
    pub(crate) items: usize,
    pub(crate) rounds: u32,
    /// Samples or rays of the reference; the exact answer itself has none.
    pub(crate) reference: Option<u32>,
    /// Those that change the answer, then those that may not.
    pub(crate) points: Vec<Measured>,
}

impl Findings {
    /// The settings of one kind.
    pub(crate) fn of(&self, changes: Changes) -> impl Iterator<Item = &Measured> {
        self.points.iter().filter(move |point| point.changes == changes)
    }

    /// What an item is, in the plural.
    pub(crate) fn items_name(&self) -> &'static str {
        if self.mode == ModeArg::Bake { "receivers" } else { "pixels" }
    }
}

/// Four digits are more than any time or error is known to.
pub(crate) trait Rounded {
    fn rounded(self) -> f64;
}

impl Rounded for f64 {
    fn rounded(self) -> f64 {
        format!("{self:.3e}").parse().unwrap_or(self)
    }
}

/// The middle of sorted numbers, or the mean of the two that are.
pub(crate) fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => (sorted[n / 2 - 1] + sorted[n / 2]) / 2.0,
    }
}

/// All as JSON.
pub(crate) fn json(found: &Findings) -> Value {
    let machine = Machine::here();
    json!({
        "schema": 1,
        "command": "trade",
        "mode": found.mode.verb(),
        "scene": { "name": found.scene, "triangles": found.triangles, "vertices": found.vertices },
        "items": found.items,
        "items_are": found.items_name(),
        "rounds": found.rounds,
        "reference": found.reference,
        "machine": {
            "processor": machine.processor,
            "system": machine.system,
            "processors": machine.processors,
            "threads": machine.threads,
            "isa": machine.isa,
        },
        "version": machine.version,
        "points": found.of(Changes::Answer).map(point_json).collect::<Vec<_>>(),
        "time_only": found.of(Changes::TimeOnly).map(time_json).collect::<Vec<_>>(),
    })
}

/// A point of error against time.
fn point_json(point: &Measured) -> Value {
    json!({
        "series": point.series,
        "label": point.label,
        "command": point.command,
        "default": point.is_default,
        "front": point.is_on_front,
        "ms": point.ms,
        "ms_least": point.ms_least,
        "ms_most": point.ms_most,
        "ratio": point.ratio,
        "rmse": point.rmse,
        "greatest": point.greatest,
        "differing": point.differing,
        "differing_percent": point.differing_percent,
        "changed": point.changed.map(|[ids, ts, values]| json!({ "ids": ids, "t": ts, "values": values })),
        "same_bytes": point.same_bytes,
    })
}

/// A setting that may change the time only.
fn time_json(point: &Measured) -> Value {
    json!({
        "label": point.label,
        "command": point.command,
        "ms": point.ms,
        "ms_least": point.ms_least,
        "ms_most": point.ms_most,
        "ratio": point.ratio,
        "same_bytes": point.same_bytes,
    })
}

/// The table, with a line of names.
pub(crate) fn csv(found: &Findings) -> String {
    let mut text =
        "series,label,default,front,ms,ms_least,ms_most,ratio,rmse,greatest,differing,differing_percent,\
                    same_bytes,command\n"
            .to_owned();
    for point in &found.points {
        let Measured { series, label, is_default, is_on_front, ms, ms_least, ms_most, ratio, .. } = point;
        let Measured { rmse, greatest, differing, differing_percent, same_bytes, command, .. } = point;
        text += &format!(
            "{},{},{is_default},{is_on_front},{ms},{ms_least},{ms_most},{ratio},{rmse},{greatest},{differing},\
             {differing_percent},{same_bytes},{}\n",
            quoted(series),
            quoted(label),
            quoted(command)
        );
    }
    text
}

/// A field of comma-separated values, as RFC 4180 has it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Fails where a setting, given by its command line, did not give the bytes that it has to give.
pub(crate) fn verdict<'a>(
    checked: impl Iterator<Item = (&'a str, bool)>,
    page: &std::path::Path,
) -> Result<(), Error> {
    let broken: Vec<&str> =
        checked.filter(|(_, same_bytes)| !same_bytes).map(|(command, _)| command).collect();
    if broken.is_empty() {
        return Ok(());
    }
    Err(Error::Difference(format!(
        "these settings changed the answer, or gave another one each time, and may change the time only:\n  {}\n\
         {} says more; please report this",
        broken.join("\n  "),
        page.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::subject::Answer;

    /// What a time-only setting may not do, down to one bit of one number, ends the command with exit code 5.
    #[test]
    fn other_bytes_are_a_failure() {
        let default = Answer { values: vec![0.0, 0.5], ids: vec![7], ts: vec![1.0], milliseconds: 1.0 };
        let again = Answer { values: vec![0.0, 0.5], ids: vec![7], ts: vec![1.0], milliseconds: 2.0 };
        let others = [
            Answer { values: vec![-0.0, 0.5], ids: vec![7], ts: vec![1.0], milliseconds: 1.0 },
            Answer { values: vec![0.0, 0.5], ids: vec![8], ts: vec![1.0], milliseconds: 1.0 },
            Answer { values: vec![0.0, 0.5], ids: vec![7], ts: vec![1.0_f32.next_up()], milliseconds: 1.0 },
        ];
        let page = std::path::Path::new("trade.html");
        let command = "umbel render builtin:umbel --threads 2";
        let judged = |changes: Changes, answer: &Answer| {
            verdict([(command, changes.allows(answer, &default))].into_iter(), page)
        };
        assert!(judged(Changes::TimeOnly, &again).is_ok());
        for other in &others {
            assert!(judged(Changes::Answer, other).is_ok());
            let failed = judged(Changes::TimeOnly, other).expect_err("other bytes");
            assert!(matches!(failed, Error::Difference(_)));
            assert!(failed.to_string().contains(command) && failed.to_string().contains("trade.html"));
        }
    }
}
