//! Surfaces on demand: bounds, borders, limits and formulas, without the engine that drives them.

mod borders;
mod bounds;
mod catmull_clark;
mod detail;
mod displacement;
mod meshes;
mod patches;
mod plain;

use umbel::engine::{Aabb, Detail, Domain, OnDemand};

/// All patches of a surface, at the finest level of detail.
fn patches<S: OnDemand>(surface: &S) -> Vec<S::Object> {
    let (mut open, mut patches, mut parts) = (surface.roots(), Vec::new(), Vec::new());
    while let Some(object) = open.pop() {
        parts.clear();
        match surface.expand(&object, 0.0, &Detail::all(), &mut parts) {
            true => open.append(&mut parts),
            false => patches.push(object),
        }
    }
    patches
}

/// Points of a patch, with all their detail.
fn points<S: OnDemand>(surface: &S, patch: &S::Object, parameters: &[[f64; 2]]) -> Vec<[f32; 3]> {
    points_for(surface, patch, parameters, &Detail::all())
}

/// Points of a patch, with what rays can tell apart.
fn points_for<S: OnDemand>(
    surface: &S,
    patch: &S::Object,
    parameters: &[[f64; 2]],
    detail: &Detail,
) -> Vec<[f32; 3]> {
    let mut points = Vec::new();
    surface.evaluate(patch, parameters, detail, &mut points);
    assert_eq!(points.len(), parameters.len());
    points
}

/// Whether a box holds a point.
fn holds(bounds: &Aabb, point: [f32; 3]) -> bool {
    (0..3).all(|k| bounds.lo[k] <= point[k] && point[k] <= bounds.hi[k])
}

/// A domain of a power of two.
fn domain(levels: [u32; 2], places: [u32; 2]) -> Domain {
    let span = |k: usize| {
        let side = 1.0 / f64::from(1_u32 << levels[k]);
        let place = f64::from(places[k] % (1 << levels[k]));
        [place * side, (place + 1.0) * side]
    };
    Domain { u: span(0), v: span(1) }
}
