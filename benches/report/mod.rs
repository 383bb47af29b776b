//! Everything that was measured, as JSON.

pub(crate) mod curves;
pub(crate) mod error_curves;
pub(crate) mod plot;
pub(crate) mod ratios;
pub(crate) mod table;

use std::path::Path;

use serde_json::{Value, json};

use crate::Result;
use crate::engines::engine::{Times, million_per_second};
use crate::engines::rounds::{Best, Measured};
use crate::subjects::Subject;

/// One subject: all times of all engines, and the best of each.
pub(crate) fn subject<S: Subject>(subject: &S, measured: &[Measured], best: &[Best]) -> Value {
    let umbel = measured.first().map_or(f64::NAN, |umbel| umbel.median(Times::total));
    let best: Vec<Value> = best.iter().map(of_best).collect();
    let (model, rays) = (subject.model(), subject.rays());
    let engines: Vec<Value> = measured.iter().map(|engine| of_engine(engine, rays, umbel)).collect();
    let mut value = json!({
        "scene": model.name,
        "triangles": model.triangles.len(),
        "without_area": model.dropped,
        "rays": rays,
    });
    for (name, fact) in subject.facts() {
        value[name] = fact;
    }
    value["engines"] = json!(engines);
    value["best"] = json!(best);
    value
}

/// One engine. `ratio` is its median total over umbel's.
fn of_engine(engine: &Measured, rays: usize, umbel: f64) -> Value {
    let all = |part: fn(&Times) -> f64| engine.times.iter().map(part).collect::<Vec<f64>>();
    let mut value = json!({
        "name": engine.name,
        "prebuilt": engine.prebuilt,
        "ms": {"build": all(|t| t.build), "trace": all(|t| t.trace)},
        "median_ms": {
            "build": engine.median(|t| t.build),
            "trace": engine.median(|t| t.trace),
            "total": engine.median(Times::total),
        },
        "million_rays_per_s": million_per_second(rays, engine.median(Times::total)),
        "ratio": engine.median(Times::total) / umbel,
    });
    for share in &engine.agreement {
        value[share.key] = json!(share.of_all);
    }
    value
}

/// The best of one engine.
fn of_best(best: &Best) -> Value {
    let time = |time: &Option<(f64, String)>| time.as_ref().map(|(ms, name)| json!({"ms": ms, "name": name}));
    json!({"engine": best.family, "build_and_trace": time(&best.total), "trace_alone": time(&best.trace)})
}

/// Writes a head and the values that belong to it, under a name.
pub(crate) fn write(path: &Path, mut head: Value, name: &str, values: Vec<Value>) -> Result<()> {
    head[name] = Value::Array(values);
    let text = serde_json::to_string_pretty(&head)? + "\n";
    std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()).into())
}
