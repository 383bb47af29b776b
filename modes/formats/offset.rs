//! Scenes far from the origin: one offset that keeps their shape in f32.
//!
//! Positions are f32: a number of size M is rounded by up to M · 2⁻²⁴. Where maps put a house at 5 000 000 that is a quarter of
//! a unit. So the loader moves such a scene by one offset in f64, near its middle, before it rounds: what is left is as large
//! as the scene. A position of the file is the offset plus the position in f32. The offset is a multiple of a power of
//! two as large as the scene, so that subtracting it from coordinates of up to 53 bits is exact.
//!
//! A scene stays where it is, to the bit, when it is not far away (its greatest coordinate is at most [`NEAR`] times its
//! size), when f32 holds all of its positions exactly, or when rounding does it no harm up to [`FAR`] times its size. What no
//! offset can keep, such as a small thing far away from another, is counted and said.
//!
//! Based on: Peter Freese, "Solving Accuracy Problems in Large World Coordinates", Game Programming Gems 4, 2004.

use umbel_core::glam::DVec3;

use crate::scene::Scene;

/// A scene is not far away up to this ratio of its greatest coordinate to its size.
const NEAR: f64 = 4.0;
/// A scene is far away from this ratio on, even if no triangle is spoilt.
const FAR: f64 = 64.0;
/// How far rounding may move a corner, in lengths of the triangle's longest edge, before that is said.
const TOLERANCE: f64 = 0.01;
/// The greatest rounding error of a number in f32, in the number itself.
const HALF_ULP: f64 = 1.0 / 16_777_216.0;

/// Whether the positions in f64 must be looked at: the scene is far away, or rounding may have spoilt a triangle.
pub(crate) fn is_in_doubt(scene: &Scene) -> bool {
    ratio(scene) > FAR || scene.triangles.iter().any(|triangle| may_be_spoilt(scene, triangle))
}

/// Moves the scene, if that keeps its shape, given its positions in f64 as the file has them, and says what is lost.
/// Positions that are not finite stay what they are.
pub(crate) fn settle(scene: &mut Scene, wide: &[DVec3]) {
    let far = ratio(scene);
    if far > NEAR && (loss(scene, wide).count > 0 || (far > FAR && is_inexact(scene, wide))) {
        let offset = middle(scene);
        for (position, &wide) in scene.positions.iter_mut().zip(wide).filter(|(_, wide)| wide.is_finite()) {
            *position = (wide - offset).to_array().map(|x| x as f32);
        }
        scene.offset = offset;
        scene.warnings.push(format!(
            "the scene is far from the origin: {}, {}, {} is taken from its positions, and given back in outputs, where f32 \
             rounds it",
            offset.x, offset.y, offset.z
        ));
    }
    let Loss { count, worst } = loss(scene, wide);
    if count > 0 {
        scene.warnings.push(format!(
            "triangles that lose their shape where positions are rounded to f32: {count}, the worst is off by {:.2} of its longest edge",
            worst
        ));
    }
}

/// The greatest coordinate in sizes of the scene; 0 without a size.
fn ratio(scene: &Scene) -> f64 {
    let [least, greatest] = corners(scene);
    let size = (greatest - least).max_element();
    let reach = least.abs().max(greatest.abs()).max_element();
    if size > 0.0 && size.is_finite() { reach / size } else { 0.0 }
}

/// The box of what triangles use.
fn corners(scene: &Scene) -> [DVec3; 2] {
    let bounds = scene.bounds();
    [bounds.lo, bounds.hi].map(|corner| DVec3::from_array(corner.map(f64::from)))
}

/// The middle of the scene, but for a fraction of its size.
fn middle(scene: &Scene) -> DVec3 {
    let [least, greatest] = corners(scene);
    let step = power_of_two_from((greatest - least).max_element());
    ((least + greatest) / 2.0 / step).round() * step
}

/// The least power of two that is no less than a size.
fn power_of_two_from(size: f64) -> f64 {
    // Sizes of f32 lie within these.
    let (mut power, half) = (1.0_f64, 0.5);
    while power < size {
        power *= 2.0;
    }
    while power * half >= size && power > f64::from(f32::MIN_POSITIVE) {
        power *= half;
    }
    power
}

/// Whether f32 cannot hold a position.
fn is_inexact(scene: &Scene, wide: &[DVec3]) -> bool {
    let finite = scene.positions.iter().zip(wide).filter(|(_, wide)| wide.is_finite());
    finite.into_iter().any(|(position, wide)| wide.to_array() != position.map(f64::from))
}

/// Triangles that rounding spoils.
struct Loss {
    count: usize,
    /// How far it moves a corner, at most, in lengths of the longest edge.
    worst: f64,
}

fn loss(scene: &Scene, wide: &[DVec3]) -> Loss {
    let mut loss = Loss { count: 0, worst: 0.0 };
    for triangle in scene.triangles.iter().filter(|triangle| may_be_spoilt(scene, triangle)) {
        let [a, b, c] = triangle.map(|v| wide[v as usize]);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let error = |v: u32| {
            let kept = DVec3::from_array(scene.positions[v as usize].map(f64::from)) + scene.offset;
            (wide[v as usize] - kept).length()
        };
        let moved = triangle.iter().map(|&v| error(v)).fold(0.0, f64::max);
        // Without edges there is no shape to lose.
        if longest > 0.0 && moved > TOLERANCE * longest {
            loss.count += 1;
            loss.worst = loss.worst.max(moved / longest);
        }
    }
    loss
}

/// Whether rounding may have moved a corner farther than is tolerated: a bound that needs f32 alone.
fn may_be_spoilt(scene: &Scene, triangle: &[u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|v| scene.positions[v as usize].map(f64::from));
    if triangle[0] == triangle[1] && triangle[1] == triangle[2] {
        return false;
    }
    let apart = |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f64::max);
    let longest = apart(a, b).max(apart(b, c)).max(apart(c, a));
    let reach = [a, b, c].iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    // Both corners of the edge were rounded, and the error has three components.
    let rounding = reach * HALF_ULP;
    2.0 * rounding > TOLERANCE * (longest - 2.0 * rounding)
}
