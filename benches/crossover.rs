//! From how many rays on does a stored tree pay? For each scene the times of the engines over the number of rays, and the
//! number at which umbel, which builds nothing, begins to take longer than another engine's build and trace together.
//!
//! Between two numbers that were measured, times are straight lines in logarithms.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;
use serde_json::{Value, json};

use crate::Result;
use crate::comparison::Row;
use crate::plot;
use crate::rounds::Best;

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

/// Where one curve crosses another.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Crossover {
    /// The other is lower from the least number of rays on.
    Before(f64),
    /// The other is lower from this number of rays on.
    At(f64),
    /// The other is not lower at the greatest number of rays.
    Beyond(f64),
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
    /// Where umbel's curve crosses the totals of each other engine that built in these runs.
    fn crossovers(&self) -> Vec<(&str, Crossover)> {
        let Some((umbel, others)) = self.curves.split_first() else {
            return Vec::new();
        };
        let crossed = |other: &'_ Curve| crossover(&umbel.total, &other.total);
        others.iter().filter_map(|other| Some((other.family.as_str(), crossed(other)?))).collect()
    }
}

/// From which number of rays on the second curve stays lower. Both have the same numbers.
fn crossover(umbel: &Points, other: &Points) -> Option<Crossover> {
    // How far umbel is above the other, in logarithms.
    let above: Points =
        umbel.iter().zip(other).map(|(umbel, other)| (umbel.0, (umbel.1 / other.1).ln())).collect();
    let (&(least, _), &(most, _)) = above.first().zip(above.last())?;
    Some(match above.iter().rposition(|&(_, above)| above <= 0.0) {
        None => Crossover::Before(least),
        Some(last) if last + 1 == above.len() => Crossover::Beyond(most),
        Some(last) => {
            let ((x0, y0), (x1, y1)) = (above[last], above[last + 1]);
            Crossover::At((x0.ln() + (x1 / x0).ln() * y0 / (y0 - y1)).exp())
        }
    })
}

/// Prints from how many rays on each engine is faster.
pub(crate) fn print(growths: &[Growth]) {
    println!();
    for growth in growths {
        for (family, crossover) in growth.crossovers() {
            let text = match crossover {
                Crossover::Before(rays) => format!("less than {rays} rays on, the fewest measured"),
                Crossover::At(rays) => format!("{rays:.0} rays on"),
                Crossover::Beyond(rays) => format!("more than {rays} rays on, the most measured"),
            };
            println!("{}: {family} with its build is faster than umbel from {text}", growth.scene);
        }
    }
}

/// The crossovers of all scenes: `rays` is null where the curves do not cross, and `at_most` or `at_least` the number that
/// is known.
pub(crate) fn report(growths: &[Growth]) -> Value {
    let of_growth = |growth: &Growth| {
        let of_family = |(family, crossover): (&str, Crossover)| match crossover {
            Crossover::Before(rays) => json!({"engine": family, "rays": null, "at_most": rays}),
            Crossover::At(rays) => json!({"engine": family, "rays": rays.round()}),
            Crossover::Beyond(rays) => json!({"engine": family, "rays": null, "at_least": rays}),
        };
        let engines: Vec<Value> = growth.crossovers().into_iter().map(of_family).collect();
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
    let crossed = growth.crossovers().into_iter().filter_map(|(_, crossover)| match crossover {
        Crossover::At(rays) => Some(rays),
        _ => None,
    });
    if let Some(rays) = crossed.min_by(f64::total_cmp) {
        let grey = BLACK.mix(0.5);
        chart
            .draw_series([PathElement::new([(rays, y.0), (rays, y.1)], grey.stroke_width(1))])?
            .label(format!("a tree pays: {rays:.0} rays"))
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
        let Some(Crossover::At(rays)) = crossover(&umbel, &flat(20.0)) else { panic!("no crossover") };
        assert!((rays - 2e4).abs() < 1.0, "{rays}");
        assert_eq!(crossover(&umbel, &flat(0.5)), Some(Crossover::Before(1e3)));
        assert_eq!(crossover(&umbel, &flat(200.0)), Some(Crossover::Beyond(1e5)));
        assert_eq!(crossover(&Vec::new(), &Vec::new()), None);
    }
}
