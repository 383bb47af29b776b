//! The table that is printed for each subject.

use crate::engine::Times;
use crate::rounds::{Best, Measured};
use crate::subject::Subject;
use crate::umbel_engine::KEEPING;

/// Prints all engines, and the best of each.
pub(crate) fn print(subject: &Subject, measured: &[Measured], best: &[Best]) {
    let dropped = if subject.dropped > 0 {
        format!(" ({} without area left out)", subject.dropped)
    } else {
        String::new()
    };
    println!("\n{}, {}, {} triangles{dropped}", subject.name, subject.size(), subject.triangles.len());
    println!(
        "{:<28}{:>10}{:>10}{:>10}{:>9}{:>10}{:>10}",
        "engine", "build ms", "trace ms", "total ms", "ratio", "ids eq %", "t eq %"
    );
    let umbel = measured.first().map_or(f64::NAN, |umbel| umbel.median(Times::total));
    for engine in measured {
        let total = engine.median(Times::total);
        let build = match engine.prebuilt {
            true => "before".to_owned(),
            false => format!("{:.2}", engine.median(|times| times.build)),
        };
        println!(
            "{:<28}{:>10}{:>10.2}{:>10.2}{:>9.2}{:>10.4}{:>10.4}",
            engine.name,
            build,
            engine.median(|times| times.trace),
            total,
            total / umbel,
            100.0 * engine.agreement.ids_equal,
            100.0 * engine.agreement.ts_equal,
        );
    }
    let kept = measured.iter().find(|engine| engine.name == KEEPING);
    let kept = kept.map_or(f64::NAN, |kept| kept.median(Times::total));
    for best in best.iter().filter(|best| best.family != "umbel") {
        let text = |time: &Option<(f64, String)>, own: f64, with: &str| {
            let (ms, name) = time.as_ref()?;
            Some(format!("{ms:.2} ms = {:.2} {with} ({name})", ms / own))
        };
        let none = || "not measured".to_owned();
        println!(
            "best {}: build + trace {}, trace alone {}",
            best.family,
            text(&best.total, umbel, "umbel").unwrap_or_else(none),
            text(&best.trace, kept, KEEPING).unwrap_or_else(none)
        );
    }
}
