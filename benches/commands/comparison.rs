//! What the commands share that compare engines: every scene at every size, a table for each, the report and the plot.

use std::path::Path;

use serde_json::{Value, json};

use crate::Result;
use crate::commands::cli::{Common, ComparisonArgs};
use crate::engines::Engines;
use crate::engines::rounds;
use crate::engines::rounds::Best;
use crate::machine;
use crate::report;
use crate::report::plot;
use crate::report::table;
use crate::subjects::Subject;
use crate::subjects::views::{Folder, View};

/// The best times for one subject.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// The scene's.
    pub(crate) name: String,
    pub(crate) layout: String,
    pub(crate) rays: usize,
    pub(crate) best: Vec<Best>,
}

/// What was measured of all subjects.
#[derive(Debug)]
pub(crate) struct Compared {
    /// What the report begins with.
    pub(crate) head: Value,
    subjects: Vec<Value>,
    pub(crate) rows: Vec<Row>,
}

impl Compared {
    /// Writes the report, if a file is named.
    pub(crate) fn write(&self, json: Option<&Path>) -> Result<()> {
        json.map_or(Ok(()), |path| report::write(path, self.head.clone(), "subjects", self.subjects.clone()))
    }
}

/// Measures the subjects that are made of every scene and every size, writes the report and draws the plot.
pub(crate) fn run<S: Subject, Size: Copy>(
    command: &str,
    args: &ComparisonArgs,
    common: &Common,
    sizes: &[Size],
    subject: impl Fn(&View, Size) -> Result<S>,
) -> Result<()> {
    let compared = measure(command, args, common, sizes, subject)?;
    compared.write(args.json.as_deref())?;
    let rows = compared.rows.into_iter().map(|row| (format!("{} {}", row.name, row.layout), row.best));
    args.plot.as_deref().map_or(Ok(()), |path| plot::write(path, &rows.collect::<Vec<_>>()))
}

/// Measures the subjects that are made of every scene and every size, and prints a table for each.
pub(crate) fn measure<S: Subject, Size: Copy>(
    command: &str,
    args: &ComparisonArgs,
    common: &Common,
    sizes: &[Size],
    subject: impl Fn(&View, Size) -> Result<S>,
) -> Result<Compared> {
    let folder = args.folder.as_deref().map(Folder::read).transpose()?;
    let engines = Engines::open(common, |name| S::RASTERIZED && wanted(args, name))?;
    let (machine, versions) = (machine::machine(), engines.versions());
    println!("{machine}\n{versions}");

    let (mut subjects, mut rows) = (Vec::new(), Vec::new());
    for name in names(&args.scenes, folder.as_ref()) {
        let view = View::find(&name, folder.as_ref())?;
        for &size in sizes {
            let subject = subject(&view, size)?;
            let mut prepared = subject.engines(&engines, &|name| wanted(args, name))?;
            let ran =
                |start: &&String| prepared.iter().any(|engine| engine.name().starts_with(start.as_str()));
            if let Some(unknown) = args.engines.iter().find(|start| !ran(start)) {
                return Err(format!("--engines {unknown}: no engine here has a name that begins so").into());
            }
            let measured = rounds::measure(&mut prepared, &subject, args.repeat)?;
            let best = rounds::best(&measured);
            table::print(&subject, &measured, &best);
            subjects.push(report::subject(&subject, &measured, &best));
            let (name, layout) = (subject.model().name.clone(), subject.layout());
            rows.push(Row { name, layout, rays: subject.rays(), best });
        }
    }
    let head = json!({"schema": 1, "command": command, "machine": machine, "versions": versions});
    Ok(Compared { head, subjects, rows })
}

/// The scenes that are asked for, or all there are.
pub(crate) fn names(scenes: &[String], folder: Option<&Folder>) -> Vec<String> {
    match (scenes.is_empty(), folder) {
        (false, _) => scenes.to_vec(),
        (true, Some(folder)) => folder.names(),
        (true, None) => vec!["builtin:umbel".to_owned()],
    }
}

/// Whether an engine of this name is asked for.
fn wanted(args: &ComparisonArgs, name: &str) -> bool {
    args.engines.is_empty() || args.engines.iter().any(|start| name.starts_with(start.as_str()))
}
