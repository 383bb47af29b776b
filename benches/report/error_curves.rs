//! A plot of errors: a panel for each scene, the error of each estimate against rays per receiver, both logarithmic. A
//! straight guide falls as random rays do, by 1/√n.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::Result;
use crate::report::curves::{self, Curve};
use crate::report::plot;

/// Pixels of a panel.
const PANEL: (u32, u32) = (430, 340);
/// Panels side by side.
const COLUMNS: usize = 2;

/// A scene.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// Rays and errors.
    pub(crate) curves: Vec<Curve>,
}

/// Draws an SVG with all panels, which have one scale.
pub(crate) fn write(path: &Path, panels: &[Panel]) -> Result<()> {
    let rows = panels.len().div_ceil(COLUMNS).max(1);
    let columns = panels.len().clamp(1, COLUMNS);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let points = || panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
    let spans = [plot::span(points().map(|point| point.0)), plot::span(points().map(|point| point.1))];
    plot::save(path, size, |area| {
        let parts = area.split_evenly((rows, columns));
        parts.iter().zip(panels).try_for_each(|(part, panel)| draw(part, panel, spans))
    })
}

/// Draws one scene within the spans of all.
fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel, [x, y]: [(f64, f64); 2]) -> Result<()> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 17))
        .margin(8)
        .margin_right(24)
        .x_label_area_size(36)
        .y_label_area_size(54)
        .build_cartesian_2d((x.0..x.1 * 1.1).log_scale().base(2.0), (y.0 * 0.7..y.1 * 1.5).log_scale())?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .x_label_formatter(&|rays| format!("{rays}"))
        .y_label_formatter(&label)
        .x_desc("rays per receiver")
        .y_desc("RMSE of openness")
        .label_style(("sans-serif", 13))
        .draw()?;
    let grey = BLACK.mix(0.4);
    let guide = [(x.0, y.1), (x.1, y.1 * (x.0 / x.1).sqrt())];
    chart
        .draw_series([PathElement::new(guide, grey.stroke_width(1))])?
        .label("1/√n")
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], grey.stroke_width(1)));
    curves::draw(&mut chart, &panel.curves)?;
    plot::legend(&mut chart, SeriesLabelPosition::LowerLeft)
}

/// Numbers that begin with 1, 2 or 5; others would overlap.
fn label(error: &f64) -> String {
    let text = format!("{error}");
    let is_shown = text.trim_start_matches(['0', '.']).starts_with(['1', '2', '5']);
    if is_shown { text } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_numbers_are_shown() {
        assert_eq!([0.02, 0.1, 5.0].map(|error| label(&error)), ["0.02", "0.1", "5"]);
        assert_eq!([0.03, 0.9].map(|error| label(&error)), ["", ""]);
    }
}
