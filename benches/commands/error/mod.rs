//! `umbel-bench error`: how long does openness take that is right to within an error? Embree with random rays, and umbel
//! and Embree with sets of directions that receivers share, by more and more rays.
//!
//! The error is the root mean square, over all receivers, of the difference from a reference of many rays; the greatest
//! difference is told too. The time for the error that is asked for lies on the straight line, in logarithms, between the numbers of rays around it.

mod estimates;
mod reference;

use serde_json::{Value, json};

use crate::Result;
use crate::commands::cli::{Common, ErrorArgs};
use crate::commands::comparison::names;
use crate::commands::error::estimates::Surface;
use crate::commands::error::reference::reference;
use crate::engines::Engines;
use crate::engines::engine::Times;
use crate::engines::rounds::median;
use crate::machine;
use crate::report;
use crate::report::curves::Curve;
use crate::report::error_curves::{self, Panel};
use crate::subjects::views::{Folder, View};

/// One way of estimating, with one number of rays.
#[derive(Debug, Clone)]
struct Point {
    name: &'static str,
    rays: u32,
    /// One per round.
    times: Vec<Times>,
    /// The root mean square of the differences, and the greatest.
    errors: [f64; 2],
}

impl Point {
    /// The median of building and tracing, in milliseconds.
    fn ms(&self) -> f64 {
        median(self.times.iter().map(Times::total))
    }
}

/// Measures every scene.
pub(crate) fn run(args: &ErrorArgs, common: &Common) -> Result<()> {
    let folder = args.folder.as_deref().map(Folder::read).transpose()?;
    let engines = Engines::open(common, |_| false)?;
    let (machine, versions) = (machine::machine(), engines.versions());
    println!("{machine}\n{versions}");
    let (mut subjects, mut panels) = (Vec::new(), Vec::new());
    for name in names(&args.scenes, folder.as_ref()) {
        let view = View::find(&name, folder.as_ref())?;
        let surface = Surface::new(&view.name, &view.scene, args.receivers, args.max_distance)?;
        let exact = reference(&surface, args.reference as usize)?;
        println!("\n{}, {}, reference of {} rays", view.name, args.receivers, args.reference);
        println!(
            "{:<28}{:>8}{:>12}{:>12}{:>10}{:>10}",
            "estimate", "rays", "build ms", "total ms", "RMSE", "greatest"
        );
        let mut points = Vec::new();
        for &rays in &args.rays {
            let of_rays = measure(&surface, &engines, rays, &exact, args)?;
            of_rays.iter().for_each(print);
            points.extend(of_rays);
        }
        subjects.push(summary(&surface, &points, args));
        panels.push(panel(&surface, &points));
    }
    args.plot.as_deref().map_or(Ok(()), |path| error_curves::write(path, &panels))?;
    let head = json!({"schema": 1, "command": "error", "machine": machine, "versions": versions});
    args.json.as_deref().map_or(Ok(()), |path| report::write(path, head, "subjects", subjects))
}

/// All estimates with one number of rays, in turns; the first round warms up and does not count.
fn measure(
    surface: &Surface,
    engines: &Engines,
    rays: u32,
    exact: &[f32],
    args: &ErrorArgs,
) -> Result<Vec<Point>> {
    let wanted = |name: &str| {
        args.estimates.is_empty() || args.estimates.iter().any(|beginning| name.starts_with(beginning))
    };
    let mut estimates = surface.estimates(engines, (rays, args.group), &wanted)?;
    let blank = |name| Point { name, rays, times: Vec::new(), errors: [f64::NAN; 2] };
    let mut points: Vec<Point> = estimates.iter().map(|&(name, _)| blank(name)).collect();
    for round in 0..=args.repeat {
        for ((_, estimate), point) in estimates.iter_mut().zip(&mut points) {
            let (times, openness) = estimate()?;
            if round > 0 {
                point.times.push(times);
            }
            point.errors = errors(&openness, exact);
        }
    }
    Ok(points)
}

/// The root mean square of the differences, and the greatest.
fn errors(openness: &[f32], exact: &[f32]) -> [f64; 2] {
    let differences = || openness.iter().zip(exact).map(|(a, b)| f64::from(a - b).abs());
    let squares: f64 = differences().map(|difference| difference.powi(2)).sum();
    [(squares / exact.len().max(1) as f64).sqrt(), differences().fold(0.0, f64::max)]
}

/// A row of the table.
fn print(point: &Point) {
    let build = median(point.times.iter().map(|times| times.build));
    let (ms, [rmse, greatest]) = (point.ms(), point.errors);
    println!("{:<28}{:>8}{build:>12.2}{ms:>12.2}{rmse:>10.5}{greatest:>10.5}", point.name, point.rays);
}

/// Prints the time of each estimate for the error that is asked for. All of it as JSON.
fn summary(surface: &Surface, points: &[Point], args: &ErrorArgs) -> Value {
    let mut names: Vec<&str> = points.iter().map(|point| point.name).collect();
    names.sort_unstable();
    names.dedup();
    let of_name = |name: &str| {
        let own: Vec<&Point> = points.iter().filter(|point| point.name == name).collect();
        let curve: Vec<(f64, f64)> = own.iter().map(|point| (point.ms(), point.errors[0])).collect();
        let ms = time_to(args.target, &curve).filter(|ms| ms.is_finite());
        match ms {
            _ if args.repeat == 0 => {}
            Some(ms) => println!("RMSE {} by {name}: {ms:.2} ms", args.target),
            None => println!("RMSE {} by {name}: not between the numbers of rays", args.target),
        }
        json!({"name": name, "ms_to_target": ms, "points": own.iter().map(|point| of_point(point)).collect::<Vec<_>>()})
    };
    let estimates: Vec<Value> = names.into_iter().map(of_name).collect();
    json!({
        "scene": surface.model.name,
        "triangles": surface.model.triangles.len(),
        "receiver_set": args.receivers.to_string(),
        "receivers": surface.receivers.len(),
        "max_distance": surface.interval[1],
        "reference_rays": args.reference,
        "target_rmse": args.target,
        "estimates": estimates,
    })
}

/// The curves of a scene. Embree's estimates with shared directions have umbel's error, and are left out.
fn panel(surface: &Surface, points: &[Point]) -> Panel {
    let mut curves: Vec<Curve> = Vec::new();
    for point in points.iter().filter(|point| !point.name.starts_with("embree-shared")) {
        let place = (f64::from(point.rays), point.errors[0]);
        match curves.iter_mut().find(|curve| curve.name == point.name) {
            Some(curve) => curve.points.push(place),
            None => curves.push(Curve { name: point.name.to_owned(), points: vec![place] }),
        }
    }
    Panel { title: surface.model.name.clone(), curves }
}

/// One number of rays.
fn of_point(point: &Point) -> Value {
    let all = |part: fn(&Times) -> f64| point.times.iter().map(part).collect::<Vec<f64>>();
    json!({
        "rays": point.rays,
        "ms": {"build": all(|times| times.build), "trace": all(|times| times.trace)},
        "median_ms": point.ms(),
        "rmse": point.errors[0],
        "greatest_error": point.errors[1],
    })
}

/// The time at which the error first falls to a target, on a curve of times and errors by ascending numbers of rays.
/// Nothing, where it is lower from the beginning on or never gets there.
fn time_to(target: f64, curve: &[(f64, f64)]) -> Option<f64> {
    let steps = curve.windows(2).map(|pair| (pair[0], pair[1]));
    let mut across = steps.filter(|(before, after)| before.1 > target && after.1 <= target);
    across.next().map(|((ms_before, error_before), (ms_after, error_after))| {
        let share = (error_before / target).ln() / (error_before / error_after).ln();
        ms_before * (ms_after / ms_before).powf(share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_lie_on_lines_of_logarithms() {
        let curve = [(1.0, 0.16), (4.0, 0.08), (16.0, 0.01)];
        let near = |time: Option<f64>, ms: f64| time.is_some_and(|time| (time / ms - 1.0).abs() < 1e-9);
        assert!(near(time_to(0.08, &curve), 4.0));
        assert!(near(time_to(0.04, &curve), 4.0_f64.powf(4.0 / 3.0)));
        assert_eq!((time_to(0.2, &curve), time_to(0.001, &curve)), (None, None));
    }
}
