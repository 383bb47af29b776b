//! `umbel-bench reyes-growth`: what on-demand surfaces cost while a scene grows.
//!
//! Memory: one sheet that fills the picture, diced more and more finely. Time: more and more sheets behind each other, of which
//! the first hides all others; once by their rule, and once as the triangles that the same density asks for.

use std::path::Path;

use plotters::prelude::*;
use serde_json::json;
use umbel::engine::{Dicing, SurfaceHits, dice_all};
use umbel::{Frame, Options, Stats, Triangles};

use crate::Result;
use crate::commands::cli::ReyesGrowthArgs;
use crate::engines::engine::timed;
use crate::engines::rounds::median;
use crate::machine;
use crate::report;
use crate::report::curves::{Curve, draw};
use crate::report::plot;
use crate::subjects::sheets::Sheets;

/// In pixels.
const SIZE: (u32, u32) = (860, 480);
/// The shading rate of the sheets behind each other: their triangles must fit memory.
const COARSE: f64 = 2.0;
/// The most sheets that are given as triangles.
const MOST_DICED: u32 = 16;

/// Measures both, and draws what files are named for.
pub(crate) fn run(args: &ReyesGrowthArgs) -> Result<()> {
    let (machine, versions) = (machine::machine(), machine::versions(Vec::new()));
    println!("{machine}\n{versions}");
    let memory = memory(args)?;
    let times = times(args)?;
    if let Some(path) = &args.json {
        let head = json!({
            "schema": 1, "command": "reyes-growth", "machine": machine, "versions": versions,
            "size": [args.size.0, args.size.1],
        });
        let curves = memory.iter().chain(&times);
        let values = curves.map(|curve| json!({"name": curve.name, "points": curve.points})).collect();
        report::write(path, head, "curves", values)?;
    }
    if let Some(path) = &args.memory {
        let words = ["memory of the engine", "micropolygons", "MB"];
        draw_plot(path, words, &memory, (0.03, 300.0))?;
    }
    if let Some(path) = &args.depth {
        let words = ["one frame, the first sheet hides all others", "sheets behind each other", "ms"];
        let most = times.iter().flat_map(|curve| &curve.points).map(|point| point.1).fold(1.0, f64::max);
        let least = times.iter().flat_map(|curve| &curve.points).map(|point| point.1).fold(most, f64::min);
        draw_plot(path, words, &times, (least * 0.5, most * 3.0))?;
    }
    Ok(())
}

/// Megabytes over micropolygons.
fn memory(args: &ReyesGrowthArgs) -> Result<Vec<Curve>> {
    let sheets = Sheets::new(1, args.size);
    let pencil = sheets.pencil(args.size)?;
    println!("\n{:>14}{:>14}{:>10}{:>12}", "shading rate", "micropolygons", "MB", "ms");
    let mut points = Vec::new();
    // A rate is halved per step: four times the micropolygons.
    let (mut shading_rate, mut hits) = (2.0, SurfaceHits::default());
    loop {
        let dicing = Dicing { shading_rate, ..Dicing::default() };
        let (ms, found) = timed(|| hits.find(&sheets, &pencil, &dicing, &Options::default()));
        let Stats { micropolygons, engine_bytes, .. } = found?;
        let megabytes = engine_bytes as f64 / 1e6;
        println!("{shading_rate:>14}{micropolygons:>14}{megabytes:>10.3}{ms:>12.1}");
        points.push((micropolygons as f64, megabytes));
        if micropolygons as f64 > args.most {
            break;
        }
        shading_rate *= 0.5;
    }
    let name = format!("umbel reyes, {} threads", rayon::current_num_threads());
    Ok(vec![Curve { name, points }])
}

/// Milliseconds over the number of sheets.
fn times(args: &ReyesGrowthArgs) -> Result<Vec<Curve>> {
    println!(
        "\n{:>10}{:>14}{:>12}{:>14}{:>14}",
        "sheets", "micropolygons", "reyes ms", "triangles", "umbel ms"
    );
    let (mut own, mut diced) = (Vec::new(), Vec::new());
    let dicing = Dicing { shading_rate: COARSE, ..Dicing::default() };
    for count in (0..=10).map(|k| 1 << k) {
        let sheets = Sheets::new(count, args.size);
        let pencil = sheets.pencil(args.size)?;
        let triangles = if count <= MOST_DICED { Some(dice_all(&sheets, &pencil, &dicing)?) } else { None };
        let (mut frame, mut hits) = (Frame::new(), SurfaceHits::default());
        let (mut ms, mut micropolygons) = ([Vec::new(), Vec::new()], 0);
        for _ in 0..=args.repeat {
            let (time, found) = timed(|| hits.find(&sheets, &pencil, &dicing, &Options::default()));
            ms[0].push(time);
            micropolygons = found?.micropolygons;
            if let Some(made) = &triangles {
                let made = Triangles::new(made.positions(), made.indices())?;
                let (time, found) = timed(|| frame.closest_hit(&made, &pencil, &Options::default()));
                found?;
                ms[1].push(time);
            }
        }
        // The first round does not count.
        let [time, umbel] = ms.map(|ms| median(ms.into_iter().skip(1)));
        let made = triangles.map_or(0, |made| made.indices().len());
        println!("{count:>10}{micropolygons:>14}{time:>12.1}{made:>14}{umbel:>14.1}");
        own.push((f64::from(count), time));
        if umbel.is_finite() {
            diced.push((f64::from(count), umbel));
        }
    }
    Ok(vec![
        Curve { name: "umbel reyes: nothing made beforehand".into(), points: own },
        Curve { name: "umbel render: triangles of all sheets, made before".into(), points: diced },
    ])
}

/// Draws curves, both axes logarithmic: a caption and what the axes are.
fn draw_plot(
    path: &Path,
    [caption, x, y]: [&str; 3],
    curves: &[Curve],
    (least, most): (f64, f64),
) -> Result<()> {
    plot::save(path, SIZE, |area| {
        let points = curves.iter().flat_map(|curve| &curve.points);
        let (first, last) = plot::span(points.map(|point| point.0));
        let mut chart = ChartBuilder::on(area)
            .caption(caption, ("sans-serif", 17))
            .margin(10)
            .margin_right(40)
            .x_label_area_size(40)
            .y_label_area_size(60)
            .build_cartesian_2d((first * 0.8..last * 1.25).log_scale(), (least..most).log_scale())?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .x_label_formatter(&|n| if *n >= 1e6 { format!("{} million", n / 1e6) } else { format!("{n}") })
            .y_label_formatter(&|value| format!("{value}"))
            .x_desc(x)
            .y_desc(y)
            .label_style(("sans-serif", 13))
            .draw()?;
        draw(&mut chart, curves)?;
        plot::legend(&mut chart, SeriesLabelPosition::UpperLeft)
    })
}
