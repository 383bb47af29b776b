//! From how many rays on does a stored tree pay, or cease to? For each scene the times of the engines over the number of rays, and
//! the numbers at which umbel and another engine change places: with the build that a changing scene pays, and with a tree that is
//! there already.
//!
//! Between two numbers that were measured, times are straight lines in logarithms.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use serde_json::{Value, json};

use crate::Result;
use crate::commands::comparison::Row;
use crate::engines::rounds::Best;
use crate::report::plot;

/// Pixels of one scene's plot.
const PANEL: (u32, u32) = (560, 420);

/// Rays and milliseconds, by ascending rays.
type Points = Vec<(f64, f64)>;

/// The best times of one engine.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve {
    family: String,
    /// Build and trace.
    total: Points,
    /// Trace alone.
    trace: Points,
}

/// The times of all engines for one scene, and where umbel's curve crosses another.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Growth {
    scene: String,
    curves: Vec<Curve>,
}

/// Which of two curves is lower.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Crossover {
    /// Whether umbel's is, from there on.
    umbel: bool,
    /// From how many rays on, if not for all that were measured.
    from: Option<f64>,
}

/// The curves of every scene.
pub(crate) fn growths(rows: &[Row]) -> Vec<Growth> {
    let of_scene = |rows: &[Row]| {
        let families = rows[0].best.iter().map(|best| best.family.clone());
        let points = |family: &str, time: fn(&Best) -> &Option<(f64, String)>| {
            let of_row = |row: &Row| {
                let best = row.best.iter().find(|best| best.family == family)?;
                Some((row.rays as f64, time(best).as_ref()?.0))
            };
            rows.iter().filter_map(of_row).collect()
        };
        let curve = |family: String| {
            let (total, trace) = (points(&family, |best| &best.total), points(&family, |best| &best.trace));
            Curve { family, total, trace }
        };
        Growth { scene: rows[0].name.clone(), curves: families.map(curve).collect() }
    };
    rows.chunk_by(|a, b| a.name == b.name).map(of_scene).collect()
}

impl Growth {
    /// Where umbel's curve crosses that of each other engine: with its build, and without.
    fn crossovers(&self) -> Vec<(String, Crossover)> {
        let Some((umbel, others)) = self.curves.split_first() else {
            return Vec::new();
        };
        let of_engine = |other: &Curve| {
            let named = |name: &str, points: &Points| {
                Some((format!("{} {name}", other.family), crossover(&umbel.total, points)?))
            };
            [named("with its build", &other.total), named("with a tree made before", &other.trace)]
        };
        others.iter().flat_map(of_engine).flatten().collect()
    }
}

/// Which curve is lower in the end, and from where on. Both have the same numbers.
fn crossover(umbel: &Points, other: &Points) -> Option<Crossover> {
    // How far umbel is above the other, in logarithms.
    let above: Points =
        umbel.iter().zip(other).map(|(umbel, other)| (umbel.0, (umbel.1 / other.1).ln())).collect();
    let is_umbel = above.last()?.1 <= 0.0;
    let before = above.iter().rposition(|&(_, above)| (above <= 0.0) != is_umbel);
    let from = before.map(|last| {
        let ((x0, y0), (x1, y1)) = (above[last], above[last + 1]);
        (x0.ln() + (x1 / x0).ln() * y0 / (y0 - y1)).exp()
    });
    Some(Crossover { umbel: is_umbel, from })
}

/// Prints who is faster, from how many rays on.
pub(crate) fn print(growths: &[Growth]) {
    println!();
    for growth in growths {
        for (engine, Crossover { umbel, from }) in growth.crossovers() {
            let (faster, slower) =
                if umbel { ("umbel", engine.as_str()) } else { (engine.as_str(), "umbel") };
            let from =
                from.map_or("for all numbers of rays".into(), |rays| format!("from {rays:.0} rays on"));
            println!("{}: {faster} is faster than {slower} {from}", growth.scene);
        }
    }
}

/// The crossovers of all scenes: who is faster in the end, and from how many `rays` on; null for all that were measured.
pub(crate) fn report(growths: &[Growth]) -> Value {
    let of_growth = |growth: &Growth| {
        let of_engine = |(engine, Crossover { umbel, from }): (String, Crossover)| json!({"engine": engine, "umbel_is_faster": umbel, "rays": from.map(f64::round)});
        let engines: Vec<Value> = growth.crossovers().into_iter().map(of_engine).collect();
        json!({"scene": growth.scene, "engines": engines})
    };
    growths.iter().map(of_growth).collect()
}

/// Draws an SVG with a panel for each scene, two in a row.
pub(crate) fn plot(path: &Path, growths: &[Growth]) -> Result<()> {
    let columns = growths.len().clamp(1, 2);
    let rows = growths.len().div_ceil(columns).max(1);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    plot::save(path, size, |area| {
        let panels = area.split_evenly((rows, columns));
        growths.iter().zip(&panels).try_for_each(|(growth, panel)| draw(panel, growth))
    })
}

/// Draws the curves of one scene: dots and thick lines are from scratch, thin lines trace alone. A vertical line marks the
/// first crossover.
fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, growth: &Growth) -> Result<()> {
    let points = || growth.curves.iter().flat_map(|curve| curve.total.iter().chain(&curve.trace));
    let (x, y) = (plot::span(points().map(|p| p.0)), plot::span(points().map(|p| p.1)));
    let y = (y.0 * 0.7, y.1 * 1.5);
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("{}: median ms; thick: from scratch, thin: tree built before", growth.scene),
            ("sans-serif", 15),
        )
        .margin(10)
        .margin_right(30)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .x_label_formatter(&|n| format!("{n}"))
        .y_label_formatter(&|ms| format!("{ms}"))
        .x_desc("rays")
        .y_desc("milliseconds")
        .label_style(("sans-serif", 13))
        .draw()?;
    for (index, curve) in growth.curves.iter().enumerate() {
        let colour = plot::colour(index);
        if index > 0 {
            chart.draw_series([PathElement::new(curve.trace.clone(), colour.mix(0.6).stroke_width(1))])?;
        }
        chart.draw_series([PathElement::new(curve.total.clone(), colour.stroke_width(2))])?;
        chart
            .draw_series(curve.total.iter().map(|&point| Circle::new(point, 3, colour.filled())))?
            .label(&curve.family)
            .legend(move |(x, y)| Circle::new((x + 10, y), 5, colour.filled()));
    }
    let crossed = growth.crossovers().into_iter().find(|(_, crossover)| crossover.from.is_some());
    if let Some((engine, Crossover { umbel, from: Some(rays) })) = crossed {
        let text = if umbel {
            format!("umbel before {engine}: {rays:.0} rays")
        } else {
            format!("{engine} before umbel: {rays:.0} rays")
        };
        let grey = BLACK.mix(0.5);
        chart
            .draw_series([PathElement::new([(rays, y.0), (rays, y.1)], grey.stroke_width(1))])?
            .label(text)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], grey.stroke_width(1)));
    }
    plot::legend(&mut chart, SeriesLabelPosition::UpperLeft)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_cross_between_two_numbers() {
        let umbel = vec![(1e3, 1.0), (1e4, 10.0), (1e5, 100.0)];
        let flat = |ms: f64| vec![(1e3, ms), (1e4, ms), (1e5, ms)];
        let found = crossover(&umbel, &flat(20.0)).expect("curves");
        assert!(!found.umbel && found.from.is_some_and(|rays| (rays - 2e4).abs() < 1.0), "{found:?}");
        let found = crossover(&flat(20.0), &umbel).expect("curves");
        assert!(found.umbel && found.from.is_some_and(|rays| (rays - 2e4).abs() < 1.0), "{found:?}");
        assert_eq!(crossover(&umbel, &flat(0.5)), Some(Crossover { umbel: false, from: None }));
        assert_eq!(crossover(&umbel, &flat(200.0)), Some(Crossover { umbel: true, from: None }));
        assert_eq!(crossover(&Vec::new(), &Vec::new()), None);
    }
}
