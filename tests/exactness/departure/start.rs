//! Where rays should start, and whether they do: the side is exact, the distance from the true point at most 4 steps.
//!
//! Based on: section 5 of the design, "Leaving a surface".

use common::generators::{Mesh, widen};
use common::random::Random;
use common::sides;
use umbel::TriangleId;
use umbel::engine::Side;
use umbel::glam::DVec3;

/// The spacing of f32 at a number.
fn ulp(x: f64) -> f64 {
    let x = (x.abs() as f32).min(f32::MAX.next_down());
    f64::from(x.next_up()) - f64::from(x)
}

/// Weights anywhere, near or on an edge, near or on a vertex.
pub(crate) fn weights(random: &mut Random) -> [f64; 3] {
    let fraction = |random: &mut Random| (random.signed() + 1.0) * 0.5;
    let (p, q) = (fraction(random), fraction(random));
    let small = random.pick(&[0.0, 1e-12, 1e-7, 1e-4]) * q;
    let mut weights = match random.below(6) {
        0 => [1.0 - 2.0 * small, small, small],
        1 => [p * (1.0 - small), (1.0 - p) * (1.0 - small), small],
        2 => [0.5, 0.5, 0.0],
        3 => [1.0 / 3.0; 3],
        _ => [p * q, (1.0 - p) * q, 1.0 - q],
    };
    weights.rotate_left(random.below(3));
    weights
}

/// Σ w_k v_k.
pub(crate) fn mix(corners: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// The points that may be the one to be rounded: moved toward the centroid until 8 ulp from every edge, and the centroid
/// where the triangle is too thin for that, or so nearly that f64 may differ. None without area in f64.
fn inset_points(corners: [DVec3; 3], weights: [f64; 3]) -> Vec<DVec3> {
    let largest = largest(corners);
    let [a, b, c] = corners.map(|p| p / largest);
    let double_area = (b - a).cross(c - a).length();
    if double_area < 1e-12 {
        return vec![];
    }
    // The weight of a corner is the distance from the opposite edge over the height.
    let needed = [c - b, a - c, b - a].map(|edge| 8.0 * ulp(largest) / largest * edge.length() / double_area);
    let at = |s: f64| weights.map(|w| (1.0 - s) * w + s / 3.0);
    let far = |s: f64, factor: f64| at(s).iter().zip(needed).all(|(&w, n)| w >= n * factor);
    let share = |(&w, &n): (&f64, &f64)| if w < n { (n - w) / (1.0 / 3.0 - w) } else { 0.0 };
    let s = weights.iter().zip(&needed).map(share).fold(0.0, f64::max);
    let mut points = Vec::new();
    if (0.0..=1.0).contains(&s) && far(s, 1.0 - 1e-6) {
        points.push(mix(corners, at(s)));
    }
    if !far(s, 1.0 - 1e-12) || needed.iter().any(|n| *n > 0.333_333) {
        points.push(mix(corners, [1.0 / 3.0; 3]));
    }
    points
}

/// The largest coordinate, without its sign.
fn largest(corners: [DVec3; 3]) -> f64 {
    corners.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// The start point lies where it should: on the side, exactly, and at most 4 steps from the rounded point.
pub(crate) fn check_point(mesh: &Mesh, id: u32, weights: [f64; 3], side: Side) -> DVec3 {
    let corners = mesh.corners(id as usize);
    let p = widen(mesh.geometry().leave(TriangleId(id), weights, side));
    assert!(p.is_finite());
    let sign = if side == Side::Front { 1 } else { -1 };
    assert!(sides::side(corners, p) * sign >= 0, "{corners:?} {weights:?} {side:?} {p:?}: on the wrong side");
    let largest = largest(corners);
    // Half an ulp per axis for rounding, 4 for steps; what f64 does not hold counts as the spacing of f32.
    let spacing = |x: f64| ulp(x).max(largest * 2_f64.powi(-49));
    let steps = |exact: &DVec3| -> f64 {
        let on_axis = |k: usize| (p[k] - exact[k]).abs() / spacing(p[k].abs().max(exact[k].abs()));
        (0..3).map(|k| (on_axis(k) - 0.5).max(0.0)).sum()
    };
    let points = inset_points(corners, weights);
    let least = points.iter().map(steps).fold(f64::INFINITY, f64::min);
    assert!(points.is_empty() || least < 4.01, "{corners:?} {weights:?} {side:?}: {p:?} {points:?} {least}");
    let near = |exact: &DVec3| (p - exact).abs().max_element() <= 5.0 * ulp(largest);
    assert!(points.is_empty() || points.iter().any(near), "{corners:?} {p:?} {points:?}");
    p
}
