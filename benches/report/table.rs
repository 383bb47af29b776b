//! The table that is printed for each subject.

use crate::engines::engine::{Times, million_per_second};
use crate::engines::rounds::{Best, Measured};
use crate::engines::umbel::KEEPING;
use crate::subjects::Subject;

/// Prints all engines, and the best of each.
pub(crate) fn print<S: Subject>(subject: &S, measured: &[Measured], best: &[Best]) {
    print_rows(subject, measured);
    print_best(measured, best);
}

/// Prints all engines.
pub(crate) fn print_rows<S: Subject>(subject: &S, measured: &[Measured]) {
    let model = subject.model();
    let dropped =
        if model.dropped > 0 { format!(" ({} without area left out)", model.dropped) } else { String::new() };
    println!(
        "\n{}, {}, {} rays, {} triangles{dropped}",
        model.name,
        subject.layout(),
        subject.rays(),
        model.triangles.len()
    );
    let shares = measured.first().map_or(&[][..], |umbel| &umbel.agreement);
    let headings: String = shares.iter().map(|share| format!("{:>12}", share.heading)).collect();
    println!(
        "{:<38}{:>10}{:>10}{:>10}{:>9}{:>9}{headings}",
        "engine", "build ms", "trace ms", "total ms", "Mrays/s", "ratio"
    );
    let umbel = measured.first().map_or(f64::NAN, |umbel| umbel.median(Times::total));
    for engine in measured {
        let total = engine.median(Times::total);
        let build = match engine.prebuilt {
            true => "before".to_owned(),
            false => format!("{:.2}", engine.median(|times| times.build)),
        };
        let shares = engine.agreement.iter();
        let shares: String = shares.map(|share| format!("{:>12.4}", 100.0 * share.of_all)).collect();
        println!(
            "{:<38}{:>10}{:>10.2}{:>10.2}{:>9.1}{:>9.2}{shares}",
            engine.name,
            build,
            engine.median(|times| times.trace),
            total,
            million_per_second(subject.rays(), total),
            total / umbel,
        );
    }
}

/// Prints the best of each engine.
fn print_best(measured: &[Measured], best: &[Best]) {
    let umbel = measured.first().map_or(f64::NAN, |umbel| umbel.median(Times::total));
    // Where umbel does not keep the order, it is compared as it is.
    let kept = measured.iter().find(|engine| engine.name == KEEPING).or(measured.first());
    let (kept, keeping) = kept.map_or((f64::NAN, KEEPING), |kept| (kept.median(Times::total), &kept.name));
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
            text(&best.trace, kept, keeping).unwrap_or_else(none)
        );
    }
}
