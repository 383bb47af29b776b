//! Polygons of many corners: cut in the time that their corners take, and covered once.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::{area, read};

/// More corners than a square of them could be tested for in the time of a test.
const CORNERS: usize = 50_000;

/// The triangles of a polygon, which must cover its area once: none is flipped.
fn check(points: &[(f64, f64)]) {
    let mut text = String::new();
    for (x, y) in points {
        writeln!(text, "v {x} {y} 0").unwrap();
    }
    let face: String = (1..=points.len()).map(|k| format!(" {k}")).collect();
    let scene = read(format!("{text}f{face}\n"));
    assert_eq!(scene.triangles.len(), points.len() - 2);
    let rounded: Vec<[f64; 2]> =
        scene.positions.iter().map(|&[x, y, _]| [f64::from(x), f64::from(y)]).collect();
    let ends = rounded.iter().zip(rounded.iter().cycle().skip(1));
    let whole: f64 = ends.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum::<f64>() / 2.0;
    let found = area(&scene);
    assert!((found - whole).abs() <= 1e-9 * whole.abs(), "{found} for {whole}");
}

fn around(k: usize, n: usize, radius: f64) -> (f64, f64) {
    let angle = TAU * k as f64 / n as f64;
    (radius * angle.cos(), radius * angle.sin())
}

#[test]
fn circles() {
    check(&(0..CORNERS).map(|k| around(k, CORNERS, 1.0)).collect::<Vec<_>>());
}

#[test]
fn waves_and_stars() {
    let wave = |k: usize| 10.0 + 3.0 * (TAU * 40.0 * k as f64 / CORNERS as f64).sin();
    check(&(0..CORNERS).map(|k| around(k, CORNERS, wave(k))).collect::<Vec<_>>());
    let star = |k: usize| if k.is_multiple_of(2) { 10.0 } else { 7.0 };
    check(&(0..CORNERS).map(|k| around(k, CORNERS, star(k))).collect::<Vec<_>>());
}

#[test]
fn combs() {
    let mut comb: Vec<(f64, f64)> =
        (0..CORNERS / 2).flat_map(|k| [(2.0 * k as f64, 100.0), (2.0 * k as f64 + 1.0, 1.0)]).collect();
    comb.extend([(CORNERS as f64, 0.0), (0.0, 0.0)]);
    comb.reverse();
    check(&comb);
}

#[test]
fn spirals() {
    let arm = |k: usize, width: f64| around(k, CORNERS / 100, 1.0 + k as f64 / 500.0 + width);
    let outer = (0..CORNERS / 2).map(|k| arm(k, 0.5));
    let inner = (0..CORNERS / 2).rev().map(|k| arm(k, 0.0));
    check(&outer.chain(inner).collect::<Vec<_>>());
}

#[test]
fn straight_sides_and_repeated_corners() {
    let side = CORNERS / 4;
    let along = |k: usize| k as f64;
    let mut square: Vec<(f64, f64)> = (0..side).map(|k| (along(k), 0.0)).collect();
    square.extend((0..side).map(|k| (along(side), along(k))));
    square.extend((0..side).map(|k| (along(side - k), along(side))));
    square.extend((0..side).map(|k| (0.0, along(side - k))));
    check(&square);
    let repeated: Vec<(f64, f64)> = (0..CORNERS).map(|k| around(k / 10 * 10, CORNERS, 1.0)).collect();
    check(&repeated);
}
