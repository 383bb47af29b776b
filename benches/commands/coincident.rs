//! `umbel-bench coincident`: what it costs that things coincide, as ratios to the same scenes where nothing does.
//!
//! The places of a scene are asked in turns. The least time counts: noise only adds. `ratio` is coincident over apart, `nearly` is turned
//! with its rays over apart, see [`crate::subjects::coincident`].

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use umbel::Stats;

use crate::Result;
use crate::commands::cli::CoincidentArgs;
use crate::engines::engine::timed;
use crate::machine;
use crate::report;
use crate::report::ratios;
use crate::report::ratios::Ratio;
use crate::subjects::coincident::{Coincidence, Place, all};

/// How long a place is asked in a round, at least.
const ROUND: Duration = Duration::from_millis(20);
/// What is marked.
const STEEP: f64 = 1.5;

/// One scene at its places.
#[derive(Debug)]
struct Measured {
    name: &'static str,
    /// The least milliseconds of each place, in the order of [`Place::ALL`].
    ms: [f64; 3],
    stats: [Stats; 3],
}

impl Measured {
    fn ratio(&self) -> f64 {
        self.ms[0] / self.ms[2]
    }

    fn nearly(&self) -> f64 {
        self.ms[1] / self.ms[2]
    }
}

/// The counters of what filters left open.
fn doubts(stats: &Stats) -> [(&'static str, u64); 6] {
    [
        ("doubtful_samples", stats.doubtful_samples),
        ("ambiguous_coverage", stats.ambiguous_coverage),
        ("edge_ties", stats.edge_ties),
        ("ambiguous_order", stats.ambiguous_order),
        ("ambiguous_limit", stats.ambiguous_limit),
        ("ambiguous_distance", stats.ambiguous_distance),
    ]
}

/// Measures all scenes that are asked for.
pub(crate) fn run(args: &CoincidentArgs) -> Result<()> {
    let wanted =
        |name: &str| args.names.is_empty() || args.names.iter().any(|part| name.contains(part.as_str()));
    let scenes: Vec<Coincidence> = all().filter(|scene| wanted(scene.name)).collect();
    if scenes.is_empty() {
        let names = all().map(|scene| scene.name).collect::<Vec<_>>().join(", ");
        return Err(format!("no scene has such a name; there are {names}").into());
    }
    let (machine, versions) = (machine::machine(), machine::versions(Vec::new()));
    println!("{machine}\n{versions}\n");
    println!(
        "{:<38}{:>12}{:>10}{:>10}{:>8}{:>8}{:>12}",
        "scene", "coincident", "nearly", "apart ms", "ratio", "nearly", "doubts"
    );
    let mut measured = Vec::new();
    for scene in scenes {
        let of_scene = measure(scene, args.repeat)?;
        print(&of_scene);
        measured.push(of_scene);
    }
    summarize(&measured);
    if let Some(path) = &args.json {
        let head = json!({"schema": 1, "command": "coincident", "machine": machine, "versions": versions});
        report::write(path, head, "scenes", measured.iter().map(to_json).collect())?;
    }
    if let Some(path) = &args.plot {
        let ratio = |scene: &Measured| Ratio { name: scene.name, ratios: [scene.ratio(), scene.nearly()] };
        ratios::write(path, &measured.iter().map(ratio).collect::<Vec<_>>(), STEEP)?;
    }
    let worst = measured.iter().map(Measured::ratio).fold(0.0, f64::max);
    match args.limit {
        Some(limit) if worst > limit => Err(format!("the worst ratio is {worst:.2}, above {limit}").into()),
        _ => Ok(()),
    }
}

/// Asks the places of a scene in turns. The first run of each does not count.
fn measure(scene: Coincidence, repeat: u32) -> Result<Measured> {
    let mut queries = Vec::new();
    for place in Place::ALL {
        queries.push((scene.query)(place)?);
    }
    let (mut ms, mut stats) = ([f64::MAX; 3], [Stats::default(); 3]);
    for (query, stats) in queries.iter_mut().zip(&mut stats) {
        *stats = query()?;
    }
    for _ in 0..repeat {
        for (query, least) in queries.iter_mut().zip(&mut ms) {
            let start = Instant::now();
            while start.elapsed() < ROUND {
                let (ms, stats) = timed(&mut *query);
                stats?;
                *least = least.min(ms);
            }
        }
    }
    Ok(Measured { name: scene.name, ms, stats })
}

fn print(scene: &Measured) {
    let [coincident, nearly, apart] = scene.ms;
    let (ratio, of_nearly) = (scene.ratio(), scene.nearly());
    let doubts: u64 = doubts(&scene.stats[0]).iter().map(|(_, count)| count).sum();
    let steep = if ratio > STEEP { "  steep" } else { "" };
    println!(
        "{:<38}{coincident:>12.3}{nearly:>10.3}{apart:>10.3}{ratio:>8.2}{of_nearly:>8.2}{doubts:>12}{steep}",
        scene.name
    );
}

/// The worst, the geometric mean, and how many are steep.
fn summarize(measured: &[Measured]) {
    for (what, ratio) in [("ratio", Measured::ratio as fn(&Measured) -> f64), ("nearly", Measured::nearly)] {
        let ratios = || measured.iter().map(ratio);
        let mean = (ratios().map(f64::ln).sum::<f64>() / measured.len() as f64).exp();
        let (worst, steep) = (ratios().fold(0.0, f64::max), ratios().filter(|&ratio| ratio > STEEP).count());
        println!("{what}: worst {worst:.2}, mean {mean:.2}, {steep} of {} above {STEEP}", measured.len());
    }
}

/// Everything about one scene.
fn to_json(scene: &Measured) -> Value {
    let place = |k: usize| {
        let doubts: serde_json::Map<_, _> = doubts(&scene.stats[k])
            .into_iter()
            .map(|(name, count)| (name.to_owned(), json!(count)))
            .collect();
        json!({"ms": scene.ms[k], "doubts": doubts})
    };
    json!({
        "scene": scene.name,
        "coincident": place(0),
        "nearly": place(1),
        "apart": place(2),
        "ratio": scene.ratio(),
        "ratio_nearly": scene.nearly(),
    })
}
