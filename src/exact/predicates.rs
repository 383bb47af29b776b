//! Every decision about one ray and one triangle, exact: f64 with a bound first, integers where the bound leaves doubt.
//!
//! With A = a − o and so on, the edge function of the oriented edge a→b is e = d·(A×B) = d·(A×(b − a)), the normal
//! N = (b − a)×(c − a), and t = (A·N)/(d·N), see [`crate::exact::distance`]. A triangle is hit iff its three edge signs agree
//! and t > 0. An edge function of zero takes the sign of the first non-zero component of n: A×B where the direction is
//! shifted (w = 1), d×(b − a) where the start point is (w = 0). A·N = 0 is never a hit: for w = 1 the plane holds the origin
//! (seen edge-on or degenerate), for w = 0 it means t = 0. For w = 0, d·N = 0 is dropped as well.
//!
//! The edge functions add up to d·N: where one of them is not zero and none has another sign, d·N has that sign. So d·N = 0 need
//! be looked for only where all three are zero.
//!
//! Coincidences are ordinary, so the exact stage is no more than about twice the work of the filter: see
//! [`crate::exact::integer`]. An origin at a corner, from where a triangle is never hit, is told by comparing bits.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997 (filters); Steven Fortune and Christopher Van Wyk, "Static Analysis Yields Efficient Exact Integer Arithmetic for
//! Computational Geometry", 1996; Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990; Sven Woop,
//! Carsten Benthin, Ingo Wald, "Watertight Ray/Triangle Intersection", 2013.

use glam::DVec3;
use robust::{Coord, orient2d};

use crate::exact::filter::{Cross, Sign};
use crate::exact::integer::{Number, Triple, difference, short_direction, short_points, small, wide};
use crate::geometry::ray::{Ray, Ties};
use crate::geometry::triangles::Triangle;
use crate::stats::Stats;

/// What the f64 filter says about a ray and a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coverage {
    Hit,
    Miss,
    /// Some of the signs are in doubt: of the three edges, and of the side of the origin.
    Ambiguous([Option<Sign>; 3], Option<Sign>),
}

/// Whether the ray hits the triangle at some t > 0, as far as f64 can tell.
#[inline]
fn covers_filtered(ray: &Ray, triangle: &Triangle) -> Coverage {
    let [a, b, c] = [triangle.a - ray.origin, triangle.b - ray.origin, triangle.c - ray.origin];
    let (ab, bc, ca) = (triangle.b - triangle.a, triangle.c - triangle.b, triangle.a - triangle.c);
    let edge = |from, along| Cross::of(from, along).dot(ray.direction).sign();
    let signs = [edge(a, ab), edge(b, bc), edge(c, ca)];
    let any = |sign| signs.contains(&Some(sign));
    if any(Sign::Positive) && any(Sign::Negative) {
        return Coverage::Miss;
    }
    // The side of the origin. It must have the sign of the edges.
    let normal = Cross::of(ab, ca);
    let side = normal.dot(-a);
    // The plane holds the origin. Common where receivers lie on walls.
    if side.is_zero() {
        return Coverage::Miss;
    }
    let side = side.sign();
    if side.is_some_and(|side| any(side.negated())) {
        return Coverage::Miss;
    }
    // For w = 0 the plane must not hold the direction: three certain edges of one sign say so too.
    let certain = side.is_some() && signs.iter().all(Option::is_some);
    if certain { Coverage::Hit } else { Coverage::Ambiguous(signs, side) }
}

/// Whether the ray hits the triangle at some t > 0: the filter, then the exact stage.
pub(crate) fn covers(ray: &Ray, triangle: &Triangle, ties: Ties, stats: &mut Stats) -> bool {
    match covers_filtered(ray, triangle) {
        Coverage::Hit => true,
        Coverage::Miss => false,
        Coverage::Ambiguous(edges, side) => {
            stats.ambiguous_coverage += 1;
            covers_exact(ray, triangle, ties, (edges, side), stats)
        }
    }
}

/// The same, given the signs that are known.
#[inline(never)]
fn covers_exact(
    ray: &Ray,
    triangle: &Triangle,
    ties: Ties,
    known: ([Option<Sign>; 3], Option<Sign>),
    stats: &mut Stats,
) -> bool {
    let Triangle { a, b, c } = *triangle;
    if known.1.is_none() && triangle.has_corner(ray.origin) {
        return false;
    }
    let points = [a, b, c, ray.origin];
    if let (Some(points), Some(d)) = (short_points(&points), short_direction(ray.direction)) {
        return covers_on_grid(&points, &d, ties, known, stats);
    }
    match (small(&points), small(&[ray.direction])) {
        (Some((points, _)), Some(([d], _))) => covers_on_grid(&points, &d, ties, known, stats),
        _ => covers_on_grid(&wide(&points).0, &wide(&[ray.direction]).0[0], ties, known, stats),
    }
}

/// The same with nothing known: for tests of filters.
#[cfg(test)]
pub(crate) fn covers_unfiltered(ray: &Ray, triangle: &Triangle, ties: Ties) -> bool {
    covers_exact(ray, triangle, ties, ([None; 3], None), &mut Stats::default())
}

/// The same for corners and origin, and a direction, on grids of their own.
#[inline]
fn covers_on_grid<N: Number>(
    [a, b, c, o]: &[[N; 3]; 4],
    d: &[N; 3],
    ties: Ties,
    (edges, side): ([Option<Sign>; 3], Option<Sign>),
    stats: &mut Stats,
) -> bool {
    let corners = [difference(a, o), difference(b, o), difference(c, o)];
    let side = side.unwrap_or_else(|| side_of(&corners));
    side != Sign::Zero && line_covers(&corners, d, ties, (edges, side), stats)
}

/// The sign of A·(B×C) = A·N.
#[inline]
fn side_of<N: Number>([a, b, c]: &[[N; 3]; 3]) -> Sign {
    N::triple(a, b, c).sign()
}

/// Whether all edge functions have the sign of the side of the origin, which is not zero, given the corners from there.
#[inline]
fn line_covers<N: Number>(
    corners: &[[N; 3]; 3],
    d: &[N; 3],
    ties: Ties,
    (edges, side): ([Option<Sign>; 3], Sign),
    stats: &mut Stats,
) -> bool {
    let mut zeros = [false; 3];
    for (k, edge) in edges.into_iter().enumerate() {
        let (from, to) = (&corners[k], &corners[(k + 1) % 3]);
        let sign = edge.unwrap_or_else(|| N::triple(d, from, to).sign());
        if sign == side.negated() {
            return false;
        }
        zeros[k] = sign == Sign::Zero;
    }
    // The plane holds the direction.
    if zeros == [true; 3] {
        return false;
    }
    (0..3).filter(|&k| zeros[k]).all(|k| {
        stats.edge_ties += 1;
        tie_sign(&corners[k], &corners[(k + 1) % 3], d, ties) == side
    })
}

/// The sign of the first non-zero component of the normal of an edge from A to B.
fn tie_sign<N: Number>(a: &[N; 3], b: &[N; 3], d: &[N; 3], ties: Ties) -> Sign {
    let along = difference(b, a);
    let (y, z) = match ties {
        Ties::Direction => (a, b),
        Ties::Origin => (d, &along),
    };
    let component = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        N::sign_of_minor(&y[i], &z[j], &y[j], &z[i])
    };
    (0..3).map(component).find(|&sign| sign != Sign::Zero).unwrap_or(Sign::Zero)
}

/// The sign of (a − d)·((b − d)×(c − d)), that of (a − d)·((b − a)×(c − a)).
#[inline]
pub(crate) fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Sign {
    let filtered = Cross::of(b - a, c - a).dot(a - d).sign_or_zero();
    filtered.unwrap_or_else(|| exact_orientation(a, b, c, d))
}

#[inline(never)]
fn exact_orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Sign {
    fn on_grid<N: Number>([a, b, c, d]: &[[N; 3]; 4]) -> Sign {
        N::triple(&difference(a, d), &difference(b, d), &difference(c, d)).sign()
    }
    if d == a || d == b || d == c {
        return Sign::Zero;
    }
    let points = [a, b, c, d];
    if let Some(points) = short_points(&points) {
        return on_grid(&points);
    }
    small(&points).map_or_else(|| on_grid(&wide(&points).0), |(points, _)| on_grid(&points))
}

/// The sign of d·N.
#[inline]
pub(crate) fn facing(direction: DVec3, triangle: &Triangle) -> Sign {
    let filtered = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a).dot(direction).sign_or_zero();
    filtered.unwrap_or_else(|| exact_facing(direction, triangle))
}

#[inline(never)]
fn exact_facing(direction: DVec3, triangle: &Triangle) -> Sign {
    fn on_grid<N: Number>([a, b, c]: &[[N; 3]; 3], d: &[N; 3]) -> Sign {
        N::triple(d, &difference(b, a), &difference(c, a)).sign()
    }
    let points = [triangle.a, triangle.b, triangle.c];
    if let (Some(points), Some(d)) = (short_points(&points), short_direction(direction)) {
        return on_grid(&points, &d);
    }
    match (small(&points), small(&[direction])) {
        (Some((points, _)), Some(([d], _))) => on_grid(&points, &d),
        _ => on_grid(&wide(&points).0, &wide(&[direction]).0[0]),
    }
}

/// Whether a triangle lies between two points: they are strictly on opposite sides of its plane, and the line from l through p
/// covers it. All of that are orientations of given points, with d = p − l.
pub(crate) fn separates(triangle: &Triangle, l: DVec3, p: DVec3, stats: &mut Stats) -> bool {
    let Triangle { a, b, c } = *triangle;
    if triangle.has_corner(l) || triangle.has_corner(p) {
        return false;
    }
    let normal = Cross::of(b - a, c - a);
    let sides = [normal.dot(a - l).sign_or_zero(), normal.dot(a - p).sign_or_zero()];
    if sides.contains(&Some(Sign::Zero)) || sides[0].is_some() && sides[0] == sides[1] {
        return false;
    }
    let d = p - l;
    let edge = |from: DVec3, to: DVec3| Cross::of(from - l, to - from).dot(d).sign();
    let edges = [edge(a, b), edge(b, c), edge(c, a)];
    let any = |sign| edges.contains(&Some(sign));
    let [of_l, of_p] = sides;
    if any(Sign::Positive) && any(Sign::Negative)
        || of_l.is_some_and(|side| any(side.negated()))
        || of_p.is_some_and(any)
    {
        return false;
    }
    if of_l.is_some() && of_p.is_some() && edges.iter().all(Option::is_some) {
        return true;
    }
    stats.ambiguous_coverage += 1;
    separates_exactly(triangle, [l, p], (edges, sides), stats)
}

/// The same, given the signs that are known.
#[inline(never)]
fn separates_exactly(
    triangle: &Triangle,
    [l, p]: [DVec3; 2],
    known: ([Option<Sign>; 3], [Option<Sign>; 2]),
    stats: &mut Stats,
) -> bool {
    fn on_grid<N: Number>(
        [a, b, c, l, p]: &[[N; 3]; 5],
        (edges, [of_l, of_p]): ([Option<Sign>; 3], [Option<Sign>; 2]),
        stats: &mut Stats,
    ) -> bool {
        let corners = |from| [difference(a, from), difference(b, from), difference(c, from)];
        let from_l = corners(l);
        let side = of_l.unwrap_or_else(|| side_of(&from_l));
        side != Sign::Zero
            && of_p.unwrap_or_else(|| side_of(&corners(p))) == side.negated()
            && line_covers(&from_l, &difference(p, l), Ties::Direction, (edges, side), stats)
    }
    let Triangle { a, b, c } = *triangle;
    let points = [a, b, c, l, p];
    if let Some(points) = short_points(&points) {
        return on_grid(&points, known, stats);
    }
    match small(&points) {
        Some((points, _)) => on_grid(&points, known, stats),
        None => on_grid(&wide(&points).0, known, stats),
    }
}

/// Whether two triangles with area lie in one plane, exactly. Such triangles have the same t along every ray.
pub(crate) fn coplanar(first: &Triangle, second: &Triangle) -> bool {
    let Triangle { a, b, c } = *first;
    [second.a, second.b, second.c].iter().all(|&p| orientation(a, b, c, p) == Sign::Zero)
}

/// Whether the corners of a triangle lie on one line, exactly: no component of its normal differs from zero.
pub(crate) fn collinear(triangle: &Triangle) -> bool {
    (0..3).all(|k| {
        let coord = |p: DVec3| Coord { x: p[(k + 1) % 3], y: p[(k + 2) % 3] };
        orient2d(coord(triangle.a), coord(triangle.b), coord(triangle.c)) == 0.0
    })
}
