//! `umbel-bench cliffs`: how the time of one query grows with the number of triangles, for subjects that are hard on purpose.
//!
//! The exponent e of a doubling says t ~ nᵉ: 0 where the film decides, 1 where every triangle costs the same; n log n has
//! 1.14 at 1,024 triangles and 1.07 at 1,048,576. What is above 1.15 grows faster.

use serde_json::{Value, json};
use umbel::{Frame, Options, Pencil, Triangles};

use crate::Result;
use crate::commands::cli::CliffsArgs;
use crate::engines::engine::timed;
use crate::machine;
use crate::report;
use crate::report::curves;
use crate::report::curves::Curve;
use crate::subjects::cliffs::{CLIFFS, Cliff, Window};
use crate::subjects::mesh::Mesh;

/// The fewest triangles of each subject.
const SMALLEST: u32 = 1 << 10;
/// Over so many doublings together a busy machine shows less than over one.
const SMOOTH: usize = 3;
/// Growth over them that n log n does not explain.
const STEEP: f64 = 1.15;
/// Runs of more milliseconds are not repeated.
const LONG: f64 = 1000.0;

/// What was measured at one size.
#[derive(Debug, Clone, PartialEq)]
struct Point {
    triangles: u32,
    /// One per run.
    ms: Vec<f64>,
}

/// One subject at growing sizes.
#[derive(Debug)]
struct Growth {
    cliff: Cliff,
    points: Vec<Point>,
    /// Whether a run took longer than the limit, and no larger size was tried.
    stopped: bool,
}

impl Point {
    fn median(&self) -> f64 {
        let mut sorted = self.ms.clone();
        sorted.sort_by(f64::total_cmp);
        let (low, high) = ((sorted.len() - 1) / 2, sorted.len() / 2);
        (sorted[low] + sorted[high]) / 2.0
    }

    fn ns_per_triangle(&self) -> f64 {
        self.median() * 1e6 / f64::from(self.triangles)
    }
}

impl Growth {
    /// The exponent from so many sizes before to size k.
    fn exponent(&self, k: usize, sizes: usize) -> Option<f64> {
        let (before, point) = (self.points.get(k.checked_sub(sizes)?)?, self.points.get(k)?);
        let larger = f64::from(point.triangles) / f64::from(before.triangles);
        Some((point.median() / before.median()).ln() / larger.ln())
    }
}

/// Measures all subjects that are asked for.
pub(crate) fn run(args: &CliffsArgs) -> Result<()> {
    let known = |name: &&String| CLIFFS.iter().any(|cliff| cliff.name == name.as_str());
    if let Some(unknown) = args.subjects.iter().find(|name| !known(name)) {
        let names = CLIFFS.map(|cliff| cliff.name).join(", ");
        return Err(format!("{unknown}: no such subject; there are {names}").into());
    }
    let (machine, versions) = (machine::machine(), machine::versions(Vec::new()));
    println!("{machine}\n{versions}");
    println!("{}x{}", args.size.0, args.size.1);
    let mut all = Vec::new();
    for cliff in CLIFFS {
        if args.subjects.is_empty() || args.subjects.iter().any(|name| name == cliff.name) {
            let growth = grow(cliff, args)?;
            print(&growth, args.limit);
            all.push(growth);
        }
    }
    if let Some(path) = &args.json {
        let head = json!({
            "schema": 1, "command": "cliffs", "machine": machine, "versions": versions,
            "size": [args.size.0, args.size.1], "limit_s": args.limit,
        });
        report::write(path, head, "subjects", all.iter().map(to_json).collect())?;
    }
    args.plot
        .as_deref()
        .map_or(Ok(()), |path| curves::write(path, &all.iter().map(curve).collect::<Vec<_>>()))
}

/// Doubles the triangles until there are enough of them, or a run takes too long.
fn grow(cliff: Cliff, args: &CliffsArgs) -> Result<Growth> {
    let window = Window::new(args.size);
    let pencil = window.pencil()?;
    let mut growth = Growth { cliff, points: Vec::new(), stopped: false };
    let mut triangles = SMALLEST;
    while triangles <= args.largest && !growth.stopped {
        let ms = measure(&(cliff.mesh)(triangles, &window), &pencil, args.repeat)?;
        growth.stopped = ms.iter().any(|&ms| ms > args.limit * 1e3);
        growth.points.push(Point { triangles, ms });
        triangles *= 2;
    }
    Ok(growth)
}

/// The milliseconds of each run, from scratch but for the memory. The first run does not count, unless it is a long one.
fn measure(mesh: &Mesh, pencil: &Pencil, repeat: u32) -> Result<Vec<f64>> {
    let triangles = Triangles::new(&mesh.positions, &mesh.triangles)?;
    let mut frame = Frame::new();
    let mut once = || {
        let (ms, stats) = timed(|| frame.closest_hit(&triangles, pencil, &Options::default()));
        stats.map(|_| ms)
    };
    let first = once()?;
    if first > LONG {
        return Ok(vec![first]);
    }
    Ok((0..repeat).map(|_| once()).collect::<std::result::Result<_, _>>()?)
}

/// Prints the table of one subject.
fn print(growth: &Growth, limit: f64) {
    println!("\n{}: {}", growth.cliff.name, growth.cliff.what);
    println!("{:>10}{:>12}{:>14}{:>10}{:>10}", "triangles", "ms", "ns/triangle", "exponent", "of three");
    for (k, point) in growth.points.iter().enumerate() {
        let text = |sizes: usize| growth.exponent(k, sizes).map_or(String::new(), |e| format!("{e:.2}"));
        let steep = if growth.exponent(k, SMOOTH).is_some_and(|e| e > STEEP) { "  steep" } else { "" };
        let (ms, ns) = (point.median(), point.ns_per_triangle());
        println!("{:>10}{ms:>12.2}{ns:>14.1}{:>10}{:>10}{steep}", point.triangles, text(1), text(SMOOTH));
    }
    if growth.stopped {
        println!("stopped here: a run took more than {limit} s");
    }
}

/// Everything about one subject.
fn to_json(growth: &Growth) -> Value {
    let of_point = |(k, point): (usize, &Point)| {
        json!({
            "triangles": point.triangles,
            "ms": point.ms,
            "median_ms": point.median(),
            "ns_per_triangle": point.ns_per_triangle(),
            "exponent": growth.exponent(k, 1),
            "exponent_of_three": growth.exponent(k, SMOOTH),
        })
    };
    json!({
        "subject": growth.cliff.name,
        "what": growth.cliff.what,
        "stopped": growth.stopped,
        "points": growth.points.iter().enumerate().map(of_point).collect::<Vec<_>>(),
    })
}

/// The curve of one subject.
fn curve(growth: &Growth) -> Curve {
    let place = |point: &Point| (f64::from(point.triangles), point.median());
    Curve { name: growth.cliff.name.to_owned(), points: growth.points.iter().map(place).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_times_the_time_for_twice_the_triangles_is_square() {
        let point = |triangles, ms: &[f64]| Point { triangles, ms: ms.to_vec() };
        let points = vec![point(1024, &[1.0, 2.0, 9.0]), point(2048, &[7.0, 9.0])];
        let growth = Growth { cliff: CLIFFS[0], points, stopped: false };
        assert_eq!(growth.exponent(0, 1), None);
        assert!((growth.exponent(1, 1).unwrap_or_default() - 2.0).abs() < 1e-12);
        assert_eq!(growth.points[0].ns_per_triangle(), 2e6 / 1024.0);
    }
}
