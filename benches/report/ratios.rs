//! A plot of ratios: a row for each scene with a dot for what coincides and a ring for what nearly does, and a line at the limit.

use std::path::Path;

use plotters::prelude::*;

use crate::Result;
use crate::report::plot;

/// Pixels from row to row, and above and below the rows.
const ROW: u32 = 15;
const FRAME: u32 = 110;
const WIDTH: u32 = 860;

/// The ratios of a scene: where things coincide, and where they nearly do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ratio<'a> {
    pub(crate) name: &'a str,
    pub(crate) ratios: [f64; 2],
}

/// Draws an SVG with a row for each scene.
pub(crate) fn write(path: &Path, rows: &[Ratio<'_>], limit: f64) -> Result<()> {
    let count = rows.len();
    plot::save(path, (WIDTH, FRAME + ROW * count as u32), |area| {
        let (least, most) = plot::span(rows.iter().flat_map(|row| row.ratios));
        // Row k is drawn around y = count - k, so that the first is on top.
        let mut chart = ChartBuilder::on(area)
            .caption("time over that of the same scene apart", ("sans-serif", 17))
            .margin(10)
            .x_label_area_size(40)
            .y_label_area_size(270)
            .build_cartesian_2d(
                (least.min(1.0) * 0.8..most.max(limit) * 1.25).log_scale(),
                0.0..count as f64 + 1.0,
            )?;
        let label = |y: &f64| {
            let row = count as f64 - y;
            let whole = row >= 0.0 && row.fract().abs() < 1e-9;
            whole.then(|| rows.get(row as usize)).flatten().map_or(String::new(), |row| row.name.to_owned())
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(count + 2)
            .y_label_formatter(&label)
            .x_label_formatter(&|ratio| format!("{ratio}"))
            .x_desc("ratio")
            .label_style(("sans-serif", 12))
            .draw()?;
        for (ratio, colour) in [(1.0, BLACK.mix(0.4)), (limit, plot::colour(0).mix(0.8))] {
            let line = [(ratio, 0.0), (ratio, count as f64 + 1.0)];
            chart.draw_series([PathElement::new(line, colour.stroke_width(1))])?;
        }
        let dots = |k: usize| {
            rows.iter().enumerate().map(move |(row, ratio)| (ratio.ratios[k], (count - row) as f64))
        };
        let (nearly, coincident) = (plot::colour(1), plot::colour(0));
        chart
            .draw_series(dots(1).map(|dot| Circle::new(dot, 4, nearly.stroke_width(1))))?
            .label("nearly coincident")
            .legend(move |(x, y)| Circle::new((x + 10, y), 4, nearly.stroke_width(1)));
        chart
            .draw_series(dots(0).map(|dot| Circle::new(dot, 4, coincident.filled())))?
            .label("coincident")
            .legend(move |(x, y)| Circle::new((x + 10, y), 4, coincident.filled()));
        plot::legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}
