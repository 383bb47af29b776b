//! What the commands share that compare engines: every scene at every size, a table for each, the report and the plot.

use serde_json::json;

use crate::Result;
use crate::cli::{Common, ComparisonArgs};
use crate::engines::Engines;
use crate::subject::Subject;
use crate::views::{Folder, View};
use crate::{machine, plot, report, rounds, table};

/// Measures the subjects that are made of every scene and every size.
pub(crate) fn run<S: Subject, Size: Copy>(
    command: &str,
    args: &ComparisonArgs,
    common: &Common,
    sizes: &[Size],
    subject: impl Fn(&View, Size) -> Result<S>,
) -> Result<()> {
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
            rows.push((format!("{} {}", subject.model().name, subject.layout()), best));
        }
    }

    if let Some(path) = &args.json {
        let head = json!({"schema": 1, "command": command, "machine": machine, "versions": versions});
        report::write(path, head, "subjects", subjects)?;
    }
    args.plot.as_deref().map_or(Ok(()), |path| plot::write(path, &rows))
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
