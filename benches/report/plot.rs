//! A plot of the medians: a row for each subject, a dot for each engine, milliseconds on a logarithmic axis.
//!
//! A filled dot is build and trace together, what a changing scene pays; a ring is trace alone. Other plots share the
//! colours, the legend and the file.

use std::path::Path;

use plotters::coord::{CoordTranslate, Shift};
use plotters::prelude::*;

use crate::Result;
use crate::engines::rounds::Best;

/// Pixels from row to row.
const ROW: u32 = 34;
/// Pixels above and below the rows, for the caption, the legend and the axis.
const FRAME: u32 = 200;
/// Rows of empty space above the first, for the legend.
const HEADROOM: f64 = 2.5;
const WIDTH: u32 = 860;

/// Colours that people with colour blindness can tell apart, in the order of the engines.
///
/// Based on: Masataka Okabe and Kei Ito, "Color Universal Design", 2008.
const COLOURS: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(90, 90, 90),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// The colour of a series.
pub(crate) fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// The least and the greatest of some positive numbers; never empty.
pub(crate) fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = values.fold((f64::MAX, 0.0_f64), |(least, most), x| (least.min(x), most.max(x)));
    if most > least { (least, most) } else { (1.0, 2.0) }
}

/// Writes an SVG of so many pixels, drawn on white.
pub(crate) fn save(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<()>,
) -> Result<()> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        area.present()?;
    }
    std::fs::write(path, svg).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// Draws the legend of the series drawn so far.
pub(crate) fn legend<'a, 'b: 'a, C: CoordTranslate>(
    chart: &mut ChartContext<'a, SVGBackend<'b>, C>,
    position: SeriesLabelPosition,
) -> Result<()> {
    chart
        .configure_series_labels()
        .position(position)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 13))
        .draw()?;
    Ok(())
}

/// Draws an SVG with a row for each name.
pub(crate) fn write(path: &Path, rows: &[(String, Vec<Best>)]) -> Result<()> {
    let count = rows.len();
    save(path, (WIDTH, FRAME + ROW * count as u32), |area| {
        let (least, most) = range(rows);
        // Row k is drawn around y = count - k, so that the first is on top.
        let mut chart = ChartBuilder::on(area)
            .caption(
                "median ms; filled: from scratch; ring: on a tree built before (umbel: with the order kept)",
                ("sans-serif", 17),
            )
            .margin(10)
            .x_label_area_size(40)
            .y_label_area_size(180)
            .build_cartesian_2d((least..most).log_scale(), 0.0..count as f64 + HEADROOM)?;
        let label = |y: &f64| {
            let row = count as f64 - y;
            let whole = row >= 0.0 && row.fract().abs() < 1e-9;
            whole.then(|| rows.get(row as usize)).flatten().map_or(String::new(), |(name, _)| name.clone())
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(count * 2 + 4)
            .y_label_formatter(&label)
            .x_label_formatter(&|ms| format!("{ms}"))
            .x_desc("milliseconds")
            .label_style(("sans-serif", 13))
            .draw()?;
        for (index, family) in families(rows).into_iter().enumerate() {
            let colour = colour(index);
            let (filled, rings) =
                (dots(rows, family, |best| &best.total), dots(rows, family, |best| &best.trace));
            chart.draw_series(rings.into_iter().map(|dot| Circle::new(dot, 6, colour.stroke_width(2))))?;
            chart
                .draw_series(filled.into_iter().map(|dot| Circle::new(dot, 6, colour.filled())))?
                .label(family)
                .legend(move |(x, y)| Circle::new((x + 10, y), 6, colour.filled()));
        }
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}

/// The engines of all rows, in their order.
fn families(rows: &[(String, Vec<Best>)]) -> Vec<&str> {
    rows.first().map_or(Vec::new(), |(_, best)| best.iter().map(|best| best.family.as_str()).collect())
}

/// The places of one engine's dots.
fn dots(
    rows: &[(String, Vec<Best>)],
    family: &str,
    time: impl Fn(&Best) -> &Option<(f64, String)>,
) -> Vec<(f64, f64)> {
    let of_row = |(k, (_, best)): (usize, &(String, Vec<Best>))| {
        let best = best.iter().find(|best| best.family == family)?;
        let (ms, _) = time(best).as_ref()?;
        Some((*ms, (rows.len() - k) as f64))
    };
    rows.iter().enumerate().filter_map(of_row).collect()
}

/// The axis: from below the least time to above the greatest.
fn range(rows: &[(String, Vec<Best>)]) -> (f64, f64) {
    let best = rows.iter().flat_map(|(_, best)| best);
    let times = best.flat_map(|best| [&best.total, &best.trace]).flatten().map(|(ms, _)| *ms);
    let (least, most) =
        times.fold((f64::MAX, 0.0), |(least, most): (f64, f64), ms| (least.min(ms), most.max(ms)));
    if most > 0.0 { (least * 0.7, most * 1.5) } else { (0.1, 1.0) }
}
