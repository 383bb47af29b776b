//! Plots of `umbel trade`, as SVG: error against time with the front, and times against that of the default.
//!
//! Both axes of the first are logarithmic. An error of 0 has no logarithm: such points stand on a line of their own below the
//! axis.

use maud::{Markup, html};

use crate::trade::report::{Findings, Measured};
use crate::trade::settings::Changes;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 430.0;
/// Left, top, right and bottom of what the axes enclose.
const FRAME: [f64; 4] = [76.0, 16.0, 620.0, 380.0];
/// The height of a bar and of the space around it.
const BAR: f64 = 26.0;
/// Colours that people with colour blindness can tell apart.
///
/// Based on: Masataka Okabe and Kei Ito, "Color Universal Design", 2008.
const COLOURS: [&str; 5] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"];

/// A logarithmic axis.
struct Axis {
    least: f64,
    most: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// An axis over numbers above 0, with some space at both ends.
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|&value| value > 0.0) {
            (least, most) = (least.min(value), most.max(value));
        }
        if most == 0.0 {
            (least, most) = (0.1, 1.0);
        }
        // At least a factor of 4, so that there are marks.
        let space = (2.0 / (most / least).sqrt()).max(1.35);
        Self { least: least / space, most: most * space, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let log = |x: f64| libm::log10(x);
        let part = (log(value) - log(self.least)) / (log(self.most) - log(self.least));
        self.from + part * (self.to - self.from)
    }

    /// The numbers 1, 2 and 5 times powers of ten, as many as there is room for.
    fn marks(&self) -> Vec<f64> {
        let (low, high) =
            (libm::floor(libm::log10(self.least)) as i32, libm::ceil(libm::log10(self.most)) as i32);
        let decades = libm::log10(self.most / self.least);
        let steps: &[f64] = if decades > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        // Read from decimals, so that they are shown as such.
        let mark = |power: i32, step: f64| format!("{step}e{power}").parse::<f64>().unwrap_or(step);
        let all = (low..=high).flat_map(|power| steps.iter().map(move |&step| mark(power, step)));
        all.filter(|&mark| mark >= self.least && mark <= self.most).collect()
    }
}

/// A coordinate of a picture.
fn px(x: f64) -> String {
    format!("{x:.1}")
}

/// Error against time. Alone, for a file of its own, or as a part of a page.
pub(crate) fn front(found: &Findings, is_alone: bool) -> Markup {
    let points: Vec<&Measured> = found.of(Changes::Answer).collect();
    let [left, top, right, bottom] = FRAME;
    let has_zero = points.iter().any(|point| point.rmse == 0.0);
    let floor = if has_zero { bottom - 34.0 } else { bottom };
    let x = Axis::new(points.iter().map(|point| point.ms), left, right);
    let y = Axis::new(points.iter().map(|point| point.rmse), floor, top);
    let place = |point: &Measured| {
        let height = if point.rmse > 0.0 { y.at(point.rmse) } else { bottom - 12.0 };
        (x.at(point.ms.max(x.least)), height)
    };
    let mut series: Vec<&str> = Vec::new();
    for point in &points {
        if !series.contains(&point.series) {
            series.push(point.series);
        }
    }
    let colour =
        |name: &str| COLOURS[series.iter().position(|other| *other == name).unwrap_or(0) % COLOURS.len()];
    let mut on_front: Vec<&&Measured> = points.iter().filter(|point| point.is_on_front).collect();
    on_front.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let line: Vec<String> =
        on_front.iter().map(|point| place(point)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let title = format!("Error against time: {} of {}", found.mode.verb(), found.scene);
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" font-family="sans-serif" font-size="12"
            xmlns=[is_alone.then_some("http://www.w3.org/2000/svg")] {
            title { (title) }
            rect width=(WIDTH) height=(HEIGHT) fill="#ffffff" {}
            (axes(&x, &y, has_zero.then_some(bottom - 12.0)))
            polyline points=(line.join(" ")) fill="none" stroke="#222222" stroke-width="1.5" stroke-dasharray="5 3" {}
            @for point in &points {
                @let (cx, cy) = place(point);
                @let fill = if point.is_on_front { colour(point.series) } else { "#ffffff" };
                line x1=(px(x.at(point.ms_least.max(x.least)))) x2=(px(x.at(point.ms_most.min(x.most)))) y1=(px(cy)) y2=(px(cy))
                    stroke=(colour(point.series)) stroke-opacity="0.5" {}
                @if point.is_default { circle cx=(px(cx)) cy=(px(cy)) r="10" fill="none" stroke="#222222" stroke-width="1.5" {} }
                circle cx=(px(cx)) cy=(px(cy)) r="5" fill=(fill) stroke=(colour(point.series)) stroke-width="2" {
                    title { (format!("{}, {} ms, error {}", point.name(), point.ms, point.rmse)) }
                }
                @if point.label.parse::<u32>().is_ok() {
                    text x=(px(cx + 8.0)) y=(px(cy - 7.0)) fill=(colour(point.series)) font-size="11" { (point.label) }
                }
            }
            (legend(&series.iter().map(|name| (*name, colour(name))).collect::<Vec<_>>()))
        }
    }
}

/// Lines, numbers and names of both axes.
fn axes(x: &Axis, y: &Axis, zero: Option<f64>) -> Markup {
    let [left, top, right, bottom] = FRAME;
    html! {
        @for mark in x.marks() {
            @let at = x.at(mark);
            line x1=(px(at)) x2=(px(at)) y1=(top) y2=(bottom) stroke="#e4e4e4" {}
            text x=(px(at)) y=(bottom + 17.0) text-anchor="middle" fill="#444444" { (mark) }
        }
        @for mark in y.marks() {
            @let at = y.at(mark);
            line x1=(left) x2=(right) y1=(px(at)) y2=(px(at)) stroke="#e4e4e4" {}
            text x=(left - 7.0) y=(px(at + 4.0)) text-anchor="end" fill="#444444" { (mark) }
        }
        @if let Some(at) = zero {
            line x1=(left) x2=(right) y1=(px(at)) y2=(px(at)) stroke="#bbbbbb" stroke-dasharray="2 3" {}
            text x=(left - 7.0) y=(px(at + 4.0)) text-anchor="end" fill="#444444" { "0" }
        }
        rect x=(left) y=(top) width=(right - left) height=(bottom - top) fill="none" stroke="#888888" {}
        text x=((left + right) / 2.0) y=(bottom + 38.0) text-anchor="middle" { "milliseconds (median): left is faster" }
        text transform=(format!("translate(18 {}) rotate(-90)", (top + bottom) / 2.0)) text-anchor="middle" {
            "error (RMSE): lower is better"
        }
    }
}

/// What the marks mean.
fn legend(series: &[(&str, &str)]) -> Markup {
    let x = FRAME[2] + 24.0;
    let y = |k: usize| FRAME[1] + 14.0 + 22.0 * k as f64;
    let count = series.len();
    html! {
        @for (k, (name, colour)) in series.iter().enumerate() {
            circle cx=(x) cy=(y(k) - 4.0) r="5" fill=(colour) stroke=(colour) {}
            text x=(x + 14.0) y=(y(k)) { (name) }
        }
        circle cx=(x) cy=(y(count + 1) - 4.0) r="5" fill="#ffffff" stroke="#555555" stroke-width="2" {}
        text x=(x + 14.0) y=(y(count + 1)) { "another is faster and no worse" }
        line x1=(x - 8.0) x2=(x + 8.0) y1=(y(count + 2) - 4.0) y2=(y(count + 2) - 4.0) stroke="#222222" stroke-width="1.5"
            stroke-dasharray="5 3" {}
        text x=(x + 14.0) y=(y(count + 2)) { "front: the ones to choose from" }
        circle cx=(x) cy=(y(count + 3) - 4.0) r="8" fill="none" stroke="#222222" stroke-width="1.5" {}
        text x=(x + 14.0) y=(y(count + 3)) { "default" }
        line x1=(x - 8.0) x2=(x + 8.0) y1=(y(count + 4) - 4.0) y2=(y(count + 4) - 4.0) stroke="#0072b2" stroke-opacity="0.5" {}
        text x=(x + 14.0) y=(y(count + 4)) { "fastest to slowest run" }
    }
}

/// Times of settings that may change nothing else, as bars over that of the default.
pub(crate) fn times(found: &Findings) -> Markup {
    let points: Vec<&Measured> = found.of(Changes::TimeOnly).collect();
    let most = points.iter().map(|point| point.ratio).fold(1.0, f64::max);
    let (left, right) = (170.0, WIDTH - 90.0);
    let at = |ratio: f64| left + ratio / most * (right - left);
    let height = BAR * points.len() as f64 + 30.0;
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {height}")) role="img" font-family="sans-serif" font-size="12" {
            title { "Times of settings that change nothing else, over the default's" }
            rect width=(WIDTH) height=(height) fill="#ffffff" {}
            @for (k, point) in points.iter().enumerate() {
                @let y = BAR * k as f64 + 4.0;
                text x=(left - 8.0) y=(y + 14.0) text-anchor="end" { (point.label) }
                rect x=(left) y=(y) width=(px(at(point.ratio) - left)) height=(BAR - 8.0)
                    fill=(if point.same_bytes { COLOURS[0] } else { "#c00000" }) {}
                text x=(px(at(point.ratio) + 6.0)) y=(y + 14.0) { (point.ratio) " ×" }
            }
            line x1=(px(at(1.0))) x2=(px(at(1.0))) y1="0" y2=(height - 24.0) stroke="#222222" stroke-dasharray="3 3" {}
            text x=(px(at(1.0))) y=(height - 8.0) text-anchor="middle" { "default" }
        }
    }
}
