//! The limit surface over one quad: points, normals and bounds from the vertices around it.
//!
//! A regular shape is a bicubic B-spline. An irregular one is subdivided, and each parameter goes on into the quad that holds it,
//! (u, v) → (2u, 2v) seen from that quad's corner; so it reaches a regular quad after a few steps unless it is a corner. There the
//! limit mask answers, and where there is none the vertex after [`DEEPEST`] steps: what remains falls by 4 with each.
//!
//! Bounds: all rows of a step are weights ≥ 0 with the sum 1, so the surface over a quad lies within the box of its neighbourhood;
//! over a regular quad, within that of its Bézier points.
//!
//! Based on: Jos Stam, "Exact Evaluation of Catmull-Clark Subdivision Surfaces at Arbitrary Parameter Values", 1998.

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;
use umbel_core::Domain;

use crate::bicubic::Bicubic;
use crate::cage::weighted;
use crate::extent::Extent;
use crate::limit_masks::Limit;
use crate::neighbourhood::{Shape, ShapeId, Shapes};
use crate::point_lanes::{LANES, Lanes, PointLanes, cross, splat};

/// Steps after which a quad is taken to be flat: 4⁻²⁷ is the unit roundoff of f64.
const DEEPEST: u32 = 27;

/// More room for rounding than one sum needs, because the points of a step are made from those of the step before.
const STEPS: f64 = 8.0;

/// A point of the limit surface and a normal there, of any length; 0 where there is none, or it was not asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub(crate) point: DVec3,
    pub(crate) normal: DVec3,
}

/// A parameter and where its sample goes.
pub(crate) type Place = (usize, [f64; 2]);

/// A quad and what is around it.
#[derive(Clone, Copy)]
pub(crate) struct LimitQuad<'a> {
    pub(crate) shapes: &'a Shapes,
    pub(crate) shape: ShapeId,
    pub(crate) points: &'a [DVec3],
    pub(crate) depth: u32,
}

/// Parameters as seen from a corner: from it to the next corner, and to the one before.
fn seen_from(corner: usize, [u, v]: [f64; 2]) -> [f64; 2] {
    match corner {
        0 => [u, v],
        1 => [v, 1.0 - u],
        2 => [1.0 - u, 1.0 - v],
        _ => [1.0 - v, u],
    }
}

/// The corner whose quarter holds parameters.
fn quarter([u, v]: [f64; 2]) -> usize {
    match (u <= 0.5, v <= 0.5) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    }
}

/// The corner at parameters, if there is one.
fn corner_at(place: [f64; 2]) -> Option<usize> {
    place.iter().all(|&t| t == 0.0 || t == 1.0).then(|| quarter(place))
}

impl LimitQuad<'_> {
    /// Samples at parameters; normals only where they are asked for.
    pub(crate) fn samples(&self, places: &[Place], normals: bool, level: Level, out: &mut [Sample]) {
        let (children, limits) = match self.shapes.get(self.shape) {
            Shape::Regular(rows) => {
                let patch =
                    Bicubic::of_b_spline(&std::array::from_fn(|k| weighted(rows.row(k), self.points)));
                return regular(&patch, places, normals, level, out);
            }
            Shape::Irregular { children, limits } => (children, limits),
        };
        let mut rest: [Vec<Place>; 4] = std::array::from_fn(|_| Vec::new());
        for &(index, place) in places {
            let limit = corner_at(place).and_then(|corner| limits[corner].as_ref());
            if let Some(sample) = limit.and_then(|limit| self.limit(limit, normals)) {
                out[index] = sample;
            } else if self.depth >= DEEPEST {
                out[index] = self.flat(place);
            } else {
                let corner = quarter(place);
                rest[corner].push((index, seen_from(corner, place).map(|t| 2.0 * t)));
            }
        }
        for (places, (rows, shape)) in
            rest.iter().zip(children.iter()).filter(|(places, _)| !places.is_empty())
        {
            let points = rows.apply(self.points);
            let child =
                LimitQuad { shapes: self.shapes, shape: *shape, points: &points, depth: self.depth + 1 };
            child.samples(places, normals, level, out);
        }
    }

    /// The sample of a mask, if it has all that is asked for.
    fn limit(&self, limit: &Limit, normals: bool) -> Option<Sample> {
        let point = weighted(&limit.point, self.points);
        let tangents =
            limit.tangents.as_ref().map(|rows| rows.each_ref().map(|row| weighted(row, self.points)));
        match (normals, tangents) {
            (false, _) => Some(Sample { point, normal: DVec3::ZERO }),
            (true, Some([t, s])) => Some(Sample { point, normal: t.cross(s) }),
            (true, None) => None,
        }
    }

    /// A sample of the four corners as a bilinear patch.
    fn flat(&self, [u, v]: [f64; 2]) -> Sample {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.points[k]);
        let (lower, upper) = (a * (1.0 - u) + b * u, d * (1.0 - u) + c * u);
        let across = (b - a) * (1.0 - v) + (c - d) * v;
        let along = (d - a) * (1.0 - u) + (c - b) * u;
        Sample { point: lower * (1.0 - v) + upper * v, normal: across.cross(along) }
    }

    /// Calls `take` with boxes around points and around normals over all that `domain` holds: one call, or one for each part.
    pub(crate) fn extents(&self, domain: Domain, take: &mut impl FnMut(Extent, Extent)) {
        let children = match self.shapes.get(self.shape) {
            Shape::Regular(rows) => {
                let patch =
                    Bicubic::of_b_spline(&std::array::from_fn(|k| weighted(rows.row(k), self.points)));
                let reach = STEPS * Extent::of(self.points.iter().copied()).reach();
                let part = patch.part(domain);
                let points = Extent::of(part.0).with_slack(reach);
                return take(points, normals(&part, reach));
            }
            Shape::Irregular { children, .. } => children,
        };
        if domain == Domain::UNIT || self.depth >= DEEPEST {
            let points = Extent::of(self.points.iter().copied());
            let anywhere = Extent { lo: DVec3::NEG_ONE, hi: DVec3::ONE };
            return take(points.with_slack(STEPS * points.reach()), anywhere);
        }
        for (corner, (rows, shape)) in children.iter().enumerate() {
            let Some(part) = within(corner, domain) else {
                continue;
            };
            let points = rows.apply(self.points);
            let child =
                LimitQuad { shapes: self.shapes, shape: *shape, points: &points, depth: self.depth + 1 };
            child.extents(part, take);
        }
    }
}

/// Samples of a regular quad.
fn regular(patch: &Bicubic, places: &[Place], normals: bool, level: Level, out: &mut [Sample]) {
    dispatch!(level, simd => match normals {
        true => sample_all::<_, true>(simd, patch, places, out),
        false => sample_all::<_, false>(simd, patch, places, out),
    });
}

#[inline(always)]
fn sample_all<S: Simd, const NORMALS: bool>(simd: S, patch: &Bicubic, places: &[Place], out: &mut [Sample]) {
    for some in places.chunks(LANES) {
        let [mut u, mut v] = [[0.0; LANES]; 2];
        for (lane, &(_, place)) in some.iter().enumerate() {
            [u[lane], v[lane]] = place;
        }
        let parameters = [Lanes::load_array(simd, u), Lanes::load_array(simd, v)];
        let [point, across, along] = patch.frames::<S, NORMALS>(simd, parameters);
        let normal = if NORMALS { cross(across, along) } else { splat(simd, DVec3::ZERO) };
        for (lane, &(index, _)) in some.iter().enumerate() {
            let at = |numbers: &PointLanes<S>| {
                DVec3::new(
                    numbers[0].as_array()[lane],
                    numbers[1].as_array()[lane],
                    numbers[2].as_array()[lane],
                )
            };
            out[index] = Sample { point: at(&point), normal: at(&normal) };
        }
    }
}

/// A box around the cross products of the tangents of a part, up to a positive factor.
fn normals(part: &Bicubic, reach: f64) -> Extent {
    let differences = |step: usize, holds: fn(usize) -> bool| {
        let pairs = (0..16).filter(|&k| holds(k)).map(|k| part.0[k + step] - part.0[k]);
        Extent::of(pairs).with_slack(reach)
    };
    let (across, along) = (differences(1, |k| k % 4 < 3), differences(4, |k| k < 12));
    let cross = across.cross(along);
    cross.with_slack(across.reach() * along.reach())
}

/// The part of a domain in the quarter of a corner, as that quad sees it.
fn within(corner: usize, domain: Domain) -> Option<Domain> {
    let half = |[from, to]: [f64; 2], upper: bool| {
        let (from, to) = if upper { (from.max(0.5), to) } else { (from, to.min(0.5)) };
        (from < to).then_some([from, to])
    };
    let u = half(domain.u, corner == 1 || corner == 2)?;
    let v = half(domain.v, corner >= 2)?;
    let [a, b] = [seen_from(corner, [u[0], v[0]]), seen_from(corner, [u[1], v[1]])];
    let span = |k: usize| [2.0 * a[k].min(b[k]), 2.0 * a[k].max(b[k])];
    Some(Domain { u: span(0), v: span(1) })
}
