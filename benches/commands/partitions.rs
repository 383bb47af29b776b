//! `umbel-bench partitions`: the general path with each of its partitions, on diffuse-bounce rays, in turns: times, and what was
//! counted. Counts depend on neither the load of the machine nor the number of threads.

use serde_json::{Value, json};
use umbel::engine::Partition;
use umbel::{Options, Path, Stats, Triangles, closest_hit};

use crate::Result;
use crate::commands::cli::{Common, PartitionsArgs};
use crate::commands::comparison;
use crate::engines::engine::timed;
use crate::engines::rounds::median;
use crate::machine;
use crate::report;
use crate::subjects::Subject;
use crate::subjects::bounce::Bounce;
use crate::subjects::views::{Folder, View};

/// What is run: the default path, the partitions, and the given one without what the scene tells of its objects.
const RUNS: usize = 2 + Partition::ALL.len();

/// One way to find the hits, measured.
#[derive(Debug, Clone)]
struct Run {
    name: String,
    options: Options,
    /// Whether it is told where objects end.
    grouped: bool,
    /// One per round.
    ms: Vec<f64>,
    stats: Stats,
}

impl Run {
    fn median(&self) -> f64 {
        median(self.ms.iter().copied())
    }
}

/// The default path, and the general path with each partition.
fn runs() -> [Run; RUNS] {
    let run = |name: &str, options: Options, grouped: bool| Run {
        name: name.to_owned(),
        options,
        grouped,
        ms: Vec::new(),
        stats: Stats::default(),
    };
    let by = |partition| Options { path: Path::General, partition, ..Options::default() };
    std::array::from_fn(|k| match k.checked_sub(1).map(|k| Partition::ALL.get(k)) {
        None => run("default path", Options::default(), true),
        Some(Some(&partition)) => run(&format!("{partition:?}").to_lowercase(), by(partition), true),
        Some(None) => run("given, file", by(Partition::Given), false),
    })
}

/// Measures all scenes that are asked for.
pub(crate) fn run(args: &PartitionsArgs, common: &Common) -> Result<()> {
    let folder = args.folder.as_deref().map(Folder::read).transpose()?;
    let (machine, versions) = (machine::machine(), machine::versions(Vec::new()));
    println!("{machine}\n{versions}");
    let mut all = Vec::new();
    for name in comparison::names(&args.scenes, folder.as_ref()) {
        let bounce = Bounce::new(&View::find(&name, folder.as_ref())?, args.rays, args.seed, false)?;
        let runs = measure(&bounce, args.repeat)?;
        print(&bounce, &runs);
        all.push((name, bounce.model().triangles.len(), runs));
    }
    print_means(&all.iter().map(|(_, _, runs)| runs).collect::<Vec<_>>());
    let Some(path) = &args.json else { return Ok(()) };
    let head = json!({
        "schema": 1, "command": "partitions", "machine": machine, "versions": versions, "rays": args.rays,
        "threads": common.threads,
    });
    report::write(path, head, "scenes", all.iter().map(to_json).collect())
}

/// Runs all in turns; the first round does not count.
fn measure(bounce: &Bounce, repeat: u32) -> Result<[Run; RUNS]> {
    let ungrouped = Triangles::new(&bounce.model.positions, &bounce.model.triangles)?;
    let triangles = ungrouped.clone().with_groups(&bounce.model.group_ends)?;
    let mut runs = runs();
    let mut expected = None;
    for round in 0..=repeat {
        for run in &mut runs {
            let triangles = if run.grouped { &triangles } else { &ungrouped };
            let (ms, found) = timed(|| closest_hit(triangles, &bounce.exact[..], &run.options));
            let (hits, stats) = found?;
            if round > 0 {
                run.ms.push(ms);
            }
            run.stats = stats;
            if *expected.get_or_insert_with(|| hits.clone()) != hits {
                return Err(format!("{}: hits differ from those of the default path", run.name).into());
            }
        }
    }
    Ok(runs)
}

/// What all others are compared with: the partition of Algorithm 1.
fn middle(runs: &[Run; RUNS]) -> &Run {
    &runs[1]
}

/// What is counted per ray: boxes and pairs; and the two by their costs, 2 : 3, as the general path weighs them.
fn counts(run: &Run, rays: usize) -> [f64; 3] {
    let per_ray = |count: u64| count as f64 / rays.max(1) as f64;
    let (boxes, pairs) = (per_ray(run.stats.box_tests), per_ray(run.stats.samples_tested));
    [boxes, pairs, 2.0 * boxes + 3.0 * pairs]
}

/// Prints the table of one scene.
fn print(bounce: &Bounce, runs: &[Run; RUNS]) {
    let (rays, model) = (bounce.rays(), bounce.model());
    println!("\n{}, {rays} rays, {} triangles", model.name, model.triangles.len());
    println!(
        "{:<14}{:>10}{:>10}{:>12}{:>12}{:>12}{:>12}",
        "partition", "ms", "ratio", "boxes/ray", "pairs/ray", "work", "MB touched"
    );
    let [.., work] = counts(middle(runs), rays);
    for run in runs {
        let (ms, [boxes, pairs, of_run]) = (run.median(), counts(run, rays));
        let ratio = ms / middle(runs).median();
        let touched = run.stats.bytes_within_32k + run.stats.bytes_within_1m + run.stats.bytes_beyond_1m;
        let of_run =
            if run.options.path == Path::General { format!("{:.2}", of_run / work) } else { String::new() };
        println!(
            "{:<14}{ms:>10.1}{ratio:>10.2}{boxes:>12.1}{pairs:>12.1}{of_run:>12}{:>12}",
            run.name,
            touched >> 20
        );
    }
}

/// Prints the geometric means of the ratios of all scenes, and the largest.
fn print_means(all: &[&[Run; RUNS]]) {
    println!("\n{:<14}{:>10}{:>10}", "ratio", "mean", "worst");
    for k in 0..RUNS {
        let ratios: Vec<f64> = all.iter().map(|runs| runs[k].median() / middle(runs).median()).collect();
        let mean = (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp();
        println!("{:<14}{mean:>10.2}{:>10.2}", runs()[k].name, ratios.iter().copied().fold(0.0, f64::max));
    }
}

/// Everything about one scene.
fn to_json((name, triangles, runs): &(String, usize, [Run; RUNS])) -> Value {
    let of_run = |run: &Run| {
        let counters: serde_json::Map<String, Value> =
            run.stats.counters().into_iter().map(|(name, count)| (name.to_owned(), json!(count))).collect();
        json!({
            "partition": run.name, "ms": run.ms, "median_ms": run.median(),
            "ratio": run.median() / middle(runs).median(), "counters": counters,
        })
    };
    json!({"scene": name, "triangles": triangles, "partitions": runs.iter().map(of_run).collect::<Vec<_>>()})
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partitions_agree_about_a_room() {
        let view = View::find("builtin:cornell", None).expect("a scene");
        let bounce = Bounce::new(&view, 2000, 1, false).expect("a subject");
        let runs = measure(&bounce, 1).expect("the same hits");
        assert!(runs.iter().all(|run| run.ms.len() == 1 && run.stats.samples_tested > 0));
        assert_eq!(middle(&runs).options.partition, Partition::Middle);
        assert_eq!(middle(&runs).options.path, Path::General);
    }
}
