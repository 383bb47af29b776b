//! The limit surface over one quad: points, normals and bounds from the vertices around it.
//!
//! A regular shape is one bicubic patch. An irregular one is subdivided, and each parameter goes on into the quad that holds it,
//! (u, v) → (2u, 2v) seen from that quad's corner; so it reaches a regular quad after a few steps unless it is a corner. Most of
//! these patches are known as sums of the vertices around the first quad (`bezier_rows.rs`), and the steps are not taken. In a corner
//! the limit mask answers, and where there is none the vertex after [`DEEPEST`] steps: what remains falls by 4 with each.
//!
//! Bounds: all rows of a step are weights ≥ 0 with the sum 1, so the surface over a quad lies within the box of its neighbourhood;
//! over a regular quad, within that of its Bézier points.
//!
//! Based on: Jos Stam, "Exact Evaluation of Catmull-Clark Subdivision Surfaces at Arbitrary Parameter Values", 1998.

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;
use umbel_core::Domain;

use crate::surfaces::bezier::bicubic::Bicubic;
use crate::surfaces::extent::Extent;
use crate::surfaces::lanes::{LANES, Lanes, cross, splat};
use crate::surfaces::subdivision::bezier_rows::{BezierRows, Rings};
use crate::surfaces::subdivision::cage::{Rows, weighted};
use crate::surfaces::subdivision::limit_masks::Limit;
use crate::surfaces::subdivision::neighbourhood::{Shape, ShapeId, Shapes};

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
    pub(crate) level: Level,
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

/// Where parameters lie among the patches of an irregular quad.
enum Found {
    /// In the patch at a corner of a ring.
    Patch(usize, usize),
    /// In a child.
    Child(usize),
}

/// The patch or the child that holds parameters, and the parameters as seen there.
fn find(rings: &Rings, place: [f64; 2]) -> (Found, [f64; 2]) {
    let mut at = place;
    for ring in 0..rings.len() {
        let corner = quarter(at);
        let inside = seen_from(corner, at).map(|t| 2.0 * t);
        if rings.get(ring, corner).is_some() {
            return (Found::Patch(ring, corner), inside);
        }
        if ring + 1 < rings.len() && corner == 0 {
            at = inside;
        } else {
            break;
        }
    }
    let corner = quarter(place);
    (Found::Child(corner), seen_from(corner, place).map(|t| 2.0 * t))
}

impl LimitQuad<'_> {
    /// Samples at parameters; normals only where they are asked for.
    pub(crate) fn samples(&self, places: &[Place], normals: bool, out: &mut [Sample]) {
        let (children, rings, limits) = match self.shapes.get(self.shape) {
            Shape::Regular(rows) => {
                let patch = rows.patch(self.points, self.level);
                return regular(&patch, (places, |&place| place), normals, self.level, out);
            }
            Shape::Irregular { children, rings, limits } => (children, rings, limits),
        };
        let mut inside: Vec<(usize, Place)> = Vec::with_capacity(places.len());
        let mut rest: [Vec<Place>; 4] = std::array::from_fn(|_| Vec::new());
        for &(index, place) in places {
            let limit = corner_at(place).and_then(|corner| limits[corner].as_ref());
            if let Some(sample) = limit.and_then(|limit| self.limit(limit, normals)) {
                out[index] = sample;
            } else if self.depth >= DEEPEST {
                out[index] = self.flat(place);
            } else {
                match find(rings, place) {
                    (Found::Patch(ring, corner), place) => inside.push((4 * ring + corner, (index, place))),
                    (Found::Child(corner), place) => rest[corner].push((index, place)),
                }
            }
        }
        if inside.iter().any(|&(patch, _)| patch != inside[0].0) {
            inside.sort_unstable_by_key(|&(patch, _)| patch);
        }
        for some in inside.chunk_by(|one, other| one.0 == other.0) {
            if let Some(rows) = rings.get(some[0].0 / 4, some[0].0 % 4) {
                let patch = rows.patch(self.points, self.level);
                regular(&patch, (some, |&(_, place)| place), normals, self.level, out);
            }
        }
        for (places, (rows, shape)) in
            rest.iter().zip(children.iter()).filter(|(places, _)| !places.is_empty())
        {
            let points = rows.apply(self.points);
            self.child(*shape, &points).samples(places, normals, out);
        }
    }

    /// A child with the points of its neighbourhood.
    fn child<'c>(&'c self, shape: ShapeId, points: &'c [DVec3]) -> LimitQuad<'c> {
        LimitQuad { shapes: self.shapes, shape, points, depth: self.depth + 1, level: self.level }
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
        let (children, rings) = match self.shapes.get(self.shape) {
            Shape::Regular(rows) => return self.patch_extents(rows, domain, take),
            Shape::Irregular { children, rings, .. } => (children, rings),
        };
        if domain == Domain::UNIT || self.depth >= DEEPEST {
            let points = Extent::of(self.points.iter().copied());
            let anywhere = Extent { lo: DVec3::NEG_ONE, hi: DVec3::ONE };
            return take(points.with_slack(STEPS * points.reach()), anywhere);
        }
        // As the quad sees it whose corners the ring has.
        let mut domain = domain;
        for ring in 0..rings.len() {
            let mut inner = None;
            for corner in 0..4 {
                match (within(corner, domain), rings.get(ring, corner)) {
                    (Some(part), Some(rows)) => self.patch_extents(rows, part, take),
                    (Some(part), None) if rings.spirals() => inner = Some(part),
                    (Some(part), None) => self.child_extents(&children[corner], part, take),
                    (None, _) => {}
                }
            }
            match inner {
                Some(part) => domain = part,
                None => return,
            }
        }
        if rings.spirals() {
            let (step, shape) = &children[0];
            let points = (0..rings.len()).fold(self.points.to_vec(), |points, _| step.apply(&points));
            let depth = self.depth + rings.len() as u32;
            return LimitQuad { shape: *shape, points: &points, depth, ..*self }.extents(domain, take);
        }
        for (corner, child) in children.iter().enumerate() {
            if let Some(part) = within(corner, domain) {
                self.child_extents(child, part, take);
            }
        }
    }

    /// The same of a child.
    fn child_extents(
        &self,
        (step, shape): &(Rows, ShapeId),
        domain: Domain,
        take: &mut impl FnMut(Extent, Extent),
    ) {
        let points = step.apply(self.points);
        self.child(*shape, &points).extents(domain, take);
    }

    /// The same of one patch.
    fn patch_extents(&self, rows: &BezierRows, domain: Domain, take: &mut impl FnMut(Extent, Extent)) {
        let part = rows.patch(self.points, self.level).part(domain);
        let reach = STEPS * Extent::of(self.points.iter().copied()).reach();
        take(Extent::of(part.0).with_slack(reach), normals(&part, reach));
    }
}

/// Samples of one patch, at places that some things have.
fn regular<T>(
    patch: &Bicubic,
    places: (&[T], fn(&T) -> Place),
    normals: bool,
    level: Level,
    out: &mut [Sample],
) {
    dispatch!(level, simd => match normals {
        true => sample_all::<_, _, true>(simd, patch, places, out),
        false => sample_all::<_, _, false>(simd, patch, places, out),
    });
}

#[inline(always)]
fn sample_all<S: Simd, T, const NORMALS: bool>(
    simd: S,
    patch: &Bicubic,
    (places, place): (&[T], fn(&T) -> Place),
    out: &mut [Sample],
) {
    for some in places.chunks(LANES) {
        let ([mut u, mut v], mut indices) = ([[0.0; LANES]; 2], [0; LANES]);
        for (lane, at) in some.iter().enumerate() {
            (indices[lane], [u[lane], v[lane]]) = place(at);
        }
        let parameters = [Lanes::load_array(simd, u), Lanes::load_array(simd, v)];
        let [point, across, along] = patch.frames::<S, NORMALS>(simd, parameters);
        let normal = if NORMALS { cross(across, along) } else { splat(simd, DVec3::ZERO) };
        let mut found = [[[0.0; LANES]; 3]; 2];
        for k in 0..3 {
            (found[0][k], found[1][k]) = (*point[k].as_array(), *normal[k].as_array());
        }
        for (lane, &index) in indices[..some.len()].iter().enumerate() {
            let at = |[x, y, z]: &[[f64; LANES]; 3]| DVec3::new(x[lane], y[lane], z[lane]);
            out[index] = Sample { point: at(&found[0]), normal: at(&found[1]) };
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
