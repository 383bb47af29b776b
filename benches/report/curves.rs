//! A plot of growth: a curve for each subject, time against the number of triangles, both logarithmic. A straight guide shows
//! n log n.

use std::path::Path;

use plotters::coord::CoordTranslate;
use plotters::prelude::*;

use crate::Result;
use crate::report::plot;

/// In pixels.
const SIZE: (u32, u32) = (860, 620);

/// One line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve {
    pub(crate) name: String,
    /// By ascending x: triangles and milliseconds, of growth.
    pub(crate) points: Vec<(f64, f64)>,
}

/// Draws an SVG with all curves.
pub(crate) fn write(path: &Path, curves: &[Curve]) -> Result<()> {
    plot::save(path, SIZE, |area| {
        let points = || curves.iter().flat_map(|curve| &curve.points);
        let (x, y) = (plot::span(points().map(|p| p.0)), plot::span(points().map(|p| p.1)));
        let mut chart = ChartBuilder::on(area)
            .caption("median ms of one query from scratch", ("sans-serif", 17))
            .margin(10)
            .margin_right(40)
            .x_label_area_size(40)
            .y_label_area_size(60)
            .build_cartesian_2d((x.0..x.1).log_scale().base(2.0), (y.0 * 0.7..y.1 * 1.5).log_scale())?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .x_label_formatter(&|n| format!("{n}"))
            .y_label_formatter(&|ms| format!("{ms}"))
            .x_desc("triangles")
            .y_desc("milliseconds")
            .label_style(("sans-serif", 13))
            .draw()?;
        let grey = BLACK.mix(0.4);
        chart
            .draw_series([PathElement::new(guide(curves), grey.stroke_width(1))])?
            .label("n log n")
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], grey.stroke_width(1)));
        draw(&mut chart, curves)?;
        plot::legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}

/// Draws curves with dots at their points, each in its colour, and names them for the legend.
pub(crate) fn draw<'a, C>(chart: &mut ChartContext<'a, SVGBackend<'_>, C>, curves: &[Curve]) -> Result<()>
where
    C: CoordTranslate<From = (f64, f64)>,
{
    for (index, curve) in curves.iter().enumerate() {
        let colour = plot::colour(index);
        chart.draw_series([PathElement::new(curve.points.clone(), colour.stroke_width(2))])?;
        chart
            .draw_series(curve.points.iter().map(|&point| Circle::new(point, 3, colour.filled())))?
            .label(&curve.name)
            .legend(move |(x, y)| Circle::new((x + 10, y), 5, colour.filled()));
    }
    Ok(())
}

/// n log n from the lowest beginning on, as far as the curves reach.
fn guide(curves: &[Curve]) -> Vec<(f64, f64)> {
    let beginnings = curves.iter().filter_map(|curve| curve.points.first());
    let Some(&(n, ms)) = beginnings.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Vec::new();
    };
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let (most, longest) = (plot::span(points().map(|p| p.0)).1, plot::span(points().map(|p| p.1)).1);
    let at = |x: f64| (x, ms * x * x.log2() / (n * n.log2()));
    let steps = (0..=16).map(|k| at(n * (most / n).powf(f64::from(k) / 16.0)));
    steps.take_while(|&(_, ms)| ms <= longest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_guide_begins_with_the_lowest_curve_and_stays_in_the_picture() {
        let curve = |points: &[(f64, f64)]| Curve { name: String::new(), points: points.to_vec() };
        let curves = [curve(&[(1024.0, 2.0), (4096.0, 6.0)]), curve(&[(1024.0, 1.0), (4096.0, 3.0)])];
        let guide = guide(&curves);
        assert_eq!(guide.first(), Some(&(1024.0, 1.0)));
        assert!(guide.iter().all(|&(n, ms)| n <= 4096.0 * 1.0001 && ms <= 6.0));
        assert!(guide.last().is_some_and(|&(n, ms)| (ms - n * n.log2() / 10240.0).abs() < 1e-9 && ms > 4.5));
    }
}
