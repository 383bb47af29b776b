//! The page of `umbel trade`: one HTML file that holds all it shows. It needs no script, no network and no other file.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, html};

use crate::machine::Machine;
use crate::trade::plot;
use crate::trade::report::{Findings, Measured};
use crate::trade::settings::Changes;
use crate::trade::words::{choices, glossary, picture_legend, what_was_measured};

const STYLE: &str = "body{font:16px/1.5 sans-serif;color:#222;background:#fff;max-width:64em;margin:2em auto;padding:0 1em}\
h1{font-size:1.5em}h2{font-size:1.2em;margin-top:2em}\
svg{max-width:100%;height:auto}\
div.wide{overflow-x:auto}table{border-collapse:collapse;font-size:.85em;width:100%}\
th,td{padding:.25em .6em;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}\
th:first-child,td:first-child,td.text{text-align:left}\
tr.default td{background:#f2f6fb}\
td.text{white-space:normal}\
code{font-size:.9em;background:#f4f4f4;padding:0 .2em}\
ul.pictures{display:flex;flex-wrap:wrap;gap:1em;padding:0;list-style:none}\
ul.pictures li{width:18em;font-size:.85em}ul.pictures img{width:100%;image-rendering:pixelated}\
dt{font-weight:bold}.bad{color:#c00000;font-weight:bold}";

/// The page.
pub(crate) fn page(found: &Findings) -> Markup {
    let (verb, scene) = (found.mode.verb(), &found.scene);
    let title = format!("Speed against accuracy: umbel {verb} on {scene}");
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (maud::PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                p {
                    @if found.triangles > 0 {
                        "The scene has " (found.triangles) " triangles and " (found.vertices) " vertices. "
                    }
                    (what_was_measured(found))
                }
                (answer(found))
                h2 { "Error against time" }
                (plot::front(found, false))
                h2 { "All settings" }
                (points(found))
                (fast(found))
                h2 { "Settings that change the time and nothing else" }
                (time_only(found))
                (pictures(found))
                (meanings(found))
                (machine(found))
            }
        }
    }
}

/// What to do, in a few sentences.
fn answer(found: &Findings) -> Markup {
    let mut front: Vec<&Measured> = found.of(Changes::Answer).filter(|point| point.is_on_front).collect();
    front.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let default = found.of(Changes::Answer).find(|point| point.is_default);
    let sentence = |point: &Measured| {
        html! { (point.ms) " ms with an error of " (point.rmse) }
    };
    html! {
        @if let Some(default) = default {
            p {
                "The default, " code { (default.command) } ", takes " (sentence(default)) "."
                @if default.is_on_front { " No setting that was measured is both faster and better." }
            }
            @if let Some(fastest) = front.first().filter(|point| !point.is_default) {
                p { "Fastest: " code { (fastest.command) } " takes " (sentence(fastest)) "." }
            }
            @if let Some(best) = front.last().filter(|point| !point.is_default) {
                p { "Best: " code { (best.command) } " takes " (sentence(best)) "." }
            }
        }
        @if found.points.iter().any(|point| !point.same_bytes) {
            p.bad { "Something is wrong: see the settings that are marked FAILED below. Please report this." }
        }
    }
}

/// The table of points.
fn points(found: &Findings) -> Markup {
    html! {
        div.wide { table {
            thead {
                tr {
                    th { "setting" } th { "ms" } th { "fastest" } th { "slowest" } th { "time / default" } th { "RMSE" }
                    th { "greatest error" } th { "differ" } th { "%" } th { "front" }
                }
            }
            tbody {
                @for point in found.of(Changes::Answer) {
                    tr.default[point.is_default] {
                        td { (point.name()) @if point.is_default { " (default)" } }
                        td { (point.ms) } td { (point.ms_least) } td { (point.ms_most) } td { (point.ratio) }
                        td { (point.rmse) } td { (point.greatest) } td { (point.differing) }
                        td { (point.differing_percent) } td { @if point.is_on_front { "yes" } }
                    }
                    tr.default[point.is_default] {
                        td.text colspan="10" {
                            code { (point.command) }
                            @if !point.same_bytes { " " span.bad { "FAILED: another answer each time" } }
                        }
                    }
                }
            }
        } }
    }
}

/// What rounded decisions change.
fn fast(found: &Findings) -> Markup {
    let changed = found.points.iter().find_map(|point| point.changed);
    let items = found.items_name();
    html! {
        @if let Some([ids, ts, values]) = changed {
            p {
                "Against the default, " code { "--accuracy fast" } " changed the value of " (values) " " (items)
                @if matches!(found.mode, crate::trade::args::ModeArg::Render) {
                    ", the triangle that is seen in " (ids) " and the distance in " (ts)
                }
                "."
            }
        }
    }
}

/// The table of settings that may change the time only.
fn time_only(found: &Findings) -> Markup {
    html! {
        p {
            "These choose how the same answer is computed. Each was compared with the default, byte by byte: anything but "
            "\"same\" is a fault of the program."
        }
        (plot::times(found))
        div.wide { table {
            thead {
                tr {
                    th { "setting" } th { "ms" } th { "fastest" } th { "slowest" } th { "time / default" } th { "bytes" }
                }
            }
            tbody {
                @for point in found.of(Changes::TimeOnly) {
                    tr {
                        td { code { (point.command) } }
                        td { (point.ms) } td { (point.ms_least) } td { (point.ms_most) } td { (point.ratio) }
                        td { @if point.same_bytes { "same" } @else { span.bad { "FAILED: they differ" } } }
                    }
                }
            }
        } }
    }
}

/// Where settings are wrong.
fn pictures(found: &Findings) -> Markup {
    html! {
        @if found.points.iter().any(|point| point.picture.is_some()) {
            h2 { "Where the errors are" }
            p { (picture_legend(found.mode)) }
            ul.pictures {
                @for point in &found.points {
                    @if let Some(bytes) = &point.picture {
                        li {
                            img alt=(format!("Errors of {}", point.name()))
                                src=(format!("data:image/png;base64,{}", STANDARD.encode(bytes)));
                            (point.name()) ": RMSE " (point.rmse)
                        }
                    }
                }
            }
        }
    }
}

/// Words, and knobs that are no trade.
fn meanings(found: &Findings) -> Markup {
    html! {
        h2 { "Words" }
        dl {
            @for (word, meaning) in glossary() {
                dt { (word) } dd { (meaning) }
            }
        }
        h2 { "Settings that are not measured" }
        p { "These change what is asked for, so that no answer is right or wrong." }
        ul {
            @for (option, meaning) in choices(found.mode) {
                li { code { (option) } ": " (meaning) "." }
            }
        }
    }
}

/// What the times depend on.
fn machine(found: &Findings) -> Markup {
    let Machine { processor, system, processors, threads, isa, version } = Machine::here();
    html! {
        h2 { "Machine" }
        p {
            "umbel " (version) ", " (system) ", " (processor) ", " (processors) " processors, " (threads)
            " threads, " (isa) " instructions, " (found.rounds) " rounds. Times on another machine differ; errors do not."
        }
    }
}
