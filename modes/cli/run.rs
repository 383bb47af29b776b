//! What every verb does: reads a scene, says what it notices, shows how far it is, and prints.

use std::ffi::OsStr;
use std::io::Write as _;

use indicatif::{ProgressBar, ProgressStyle};
use umbel::{Error, Scene, Stats, load};

use crate::common::Common;
use crate::refusal::{printable, with_flags};
use crate::report::{Times, timed};

/// Reads a scene and says what was noticed.
pub(crate) fn load_scene(name: &OsStr, common: &Common, times: &mut Times) -> Result<Scene, Error> {
    let options = common.load_options();
    let scene = timed(&mut times.load, || load(name, options))?;
    print_warnings(&scene, common);
    Ok(scene)
}

/// Says what the reader of a scene has noticed.
pub(crate) fn print_warnings(scene: &Scene, common: &Common) {
    say(&scene.warnings, common);
}

/// Prints warnings, unless only errors are wanted.
pub(crate) fn say(warnings: &[String], common: &Common) {
    if !common.quiet {
        warnings
            .iter()
            .for_each(|warning| anstream::eprintln!("warning: {}", printable(&with_flags(warning))));
    }
}

/// A bar over passes: on stderr, on a terminal, and only when there is more than one.
pub(crate) fn progress(passes: u32, what: &str, common: &Common) -> ProgressBar {
    if common.quiet || passes <= 1 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(u64::from(passes));
    match ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left")) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// Prints times and counters on stderr.
pub(crate) fn print_run(times: &Times, stats: &Stats) {
    let engine: Vec<String> = times.engine.iter().map(|ms| format!("{ms:.2}")).collect();
    anstream::eprintln!(
        "load {:.1} ms, engine {} ms, shade {:.1} ms, write {:.1} ms",
        times.load,
        engine.join(" "),
        times.shade,
        times.write
    );
    for (name, count) in stats.counters() {
        anstream::eprintln!("{name:20} {count}");
    }
}

/// Writes data to stdout. A reader that has gone away is no failure.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "stdout".into(), problem: error.to_string() })
        }
        _ => Ok(()),
    }
}
