//! Frusta: one test of a box for a whole sub-pencil over a rectangle of a film.
//!
//! A film spans space by R, U and V, where V is F for an origin at a point and D for one at infinity. With the dual
//! basis
//!
//! g_X = (U×V)/δ,  g_Y = (V×R)/δ,  g_W = (R×U)/δ,  δ = R·(U×V),
//!
//! a point x at A = x − base (base = o, or F at infinity) has film coordinates (g_X·A, g_Y·A)/(g_W·A) (point) or
//! (g_X·A, g_Y·A) (infinity), and t = g_W·A along its ray. So every side of a frustum is one linear functional, and so
//! is the least t of a box. A box is outside iff a functional is negative at its most positive corner, rounding
//! included.
//!
//! The promise: *may keep what is missed, may never drop what is hit*. Boxes and frusta are closed sets.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997; Alexander
//! Reshetov, Alexei Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (frusta for many rays).

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::exact::filter::{Approx, Cross};
use crate::geometry::aabb::{Aabb, U};
use crate::objects::boxes::Boxes;
use crate::rays::film::GridFilm;
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, Lanes, Points};

/// Evaluating g·A: one rounding of A, one of the product, two of the sum; one more pays for forming the bound.
const DOT_SLACK: f64 = 5.0 * U;

/// Roundings of bounds of bounds: a handful of operations, each (1 + u).
const BOUND_SLACK: f64 = 1.0 + 16.0 * U;

/// A linear functional g·A, and per component of A the error it may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Functional {
    pub(crate) g: DVec3,
    slack: DVec3,
}

impl Functional {
    /// (y×z)/δ with its error: two roundings per product and difference, those of δ, and the division.
    fn dual(y: DVec3, z: DVec3, delta: Approx) -> Self {
        let cross = Cross::of(y, z);
        let size = delta.value.abs() - delta.error;
        let g = cross.value / delta.value;
        let relative = delta.error / size + 2.0 * U;
        let own = (cross.permanent * (2.0 * U) / size + g.abs() * relative) * BOUND_SLACK;
        Self { g, slack: (own + g.abs() * DOT_SLACK) * BOUND_SLACK }
    }

    /// self − x·other for an exact x.
    pub(crate) fn minus(&self, other: &Self, x: f64) -> Self {
        let g = self.g - other.g * x;
        // Two roundings of magnitudes that do not exceed |g| + |x·g'|.
        let rounding = (self.g.abs() + other.g.abs() * x.abs()) * (2.0 * U);
        Self { g, slack: (self.slack + other.slack * x.abs() + rounding + g.abs() * DOT_SLACK) * BOUND_SLACK }
    }

    /// The same with the opposite sign.
    fn negated(&self) -> Self {
        Self { g: -self.g, slack: self.slack }
    }

    /// The greatest values over eight boxes [lo, hi] of A, but for the error.
    #[inline(always)]
    fn greatest_lanes<S: Simd>(&self, lo: Points<S>, hi: Points<S>) -> Lanes<S> {
        let g = self.g;
        let x = if g.x < 0.0 { lo.x } else { hi.x } * g.x;
        let y = if g.y < 0.0 { lo.y } else { hi.y } * g.y;
        let z = if g.z < 0.0 { lo.z } else { hi.z } * g.z;
        x + y + z
    }

    /// The functional times a power of two.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { g: self.g * factor, slack: self.slack * factor.abs() }
    }

    /// The error of the value anywhere within |A| ≤ `reach`.
    pub(crate) fn slack_within(&self, reach: DVec3) -> f64 {
        let m = self.slack * reach;
        (m.x + m.y + m.z) * BOUND_SLACK
    }

    /// An upper bound over the box [lo, hi] of A.
    fn upper(&self, lo: DVec3, hi: DVec3) -> f64 {
        let (p, q) = (self.g * lo, self.g * hi);
        let greatest = |k: usize| if p[k] > q[k] { p[k] } else { q[k] };
        let m = self.slack * lo.abs().max(hi.abs());
        greatest(0) + greatest(1) + greatest(2) + (m.x + m.y + m.z)
    }
}

/// Film coordinates of points, with bounds of their error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projection {
    /// What A is measured from.
    pub(crate) base: DVec3,
    /// Whether the origin is a point, so that film coordinates are divided by t.
    pub(crate) perspective: bool,
    /// Axes across which planes are parallel to all rays: those that a common direction has no part of.
    pub(crate) level: [bool; 3],
    pub(crate) x: Functional,
    pub(crate) y: Functional,
    pub(crate) t: Functional,
}

/// A closed interval of film coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interval {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

impl Projection {
    /// The projection onto the film spanned by [F, R, U], or `None` where it spans no volume for certain.
    pub(crate) fn new(origin: Origin, [f, r, u]: [DVec3; 3]) -> Option<Self> {
        let (base, v, perspective) = match origin {
            Origin::Point(point) => (point, f, true),
            Origin::Infinity(direction) => (f, direction, false),
        };
        let delta = Cross::of(u, v).dot(r);
        delta.sign()?;
        let x = Functional::dual(u, v, delta);
        let y = Functional::dual(v, r, delta);
        let t = Functional::dual(r, u, delta);
        let level = v.to_array().map(|part| !perspective && part == 0.0);
        Some(Self { base, perspective, level, x, y, t })
    }
}

/// A side of a frustum: points with functional ≥ offset are inside.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Side {
    functional: Functional,
    offset: f64,
}

impl Side {
    /// Whether the box [lo, hi] of A lies strictly outside.
    fn excludes(&self, lo: DVec3, hi: DVec3) -> bool {
        self.functional.upper(lo, hi) + self.offset.abs() * DOT_SLACK < self.offset
    }
}

/// The closed set of points on the rays through a rectangle of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    base: DVec3,
    sides: [Side; 5],
    t: Functional,
    /// The greatest t-coordinate of a start point: 0 but for scattered start points.
    start: f64,
}

impl Frustum {
    /// The frustum over the rays of a grid film with columns `columns` and rows `rows` (both ends inclusive), or `None`
    /// when the film spans no volume.
    #[must_use]
    pub fn over_grid(origin: Origin, film: &GridFilm, columns: [u32; 2], rows: [u32; 2]) -> Option<Self> {
        let projection = Projection::new(origin, film.span())?;
        let x = Interval { lo: film.x(columns[0]), hi: film.x(columns[1]) };
        let y = Interval { lo: film.y(rows[1]), hi: film.y(rows[0]) };
        Some(Self::new(&projection, x, y, Interval { lo: 0.0, hi: 0.0 }))
    }

    /// The frustum over film coordinates x, y of a projection, for rays that start at t-coordinates `start`.
    pub(crate) fn new(projection: &Projection, x: Interval, y: Interval, start: Interval) -> Self {
        let Projection { base, perspective, x: gx, y: gy, t, .. } = *projection;
        let side = |g: &Functional, bound: f64, upper: bool| {
            // g ≥ bound·t or g ≤ bound·t for a point; without t at infinity.
            let (functional, offset) = if perspective { (g.minus(&t, bound), 0.0) } else { (*g, bound) };
            if upper {
                Side { functional: functional.negated(), offset: -offset }
            } else {
                Side { functional, offset }
            }
        };
        let front = Side { functional: t, offset: start.lo };
        let sides = [
            side(&gx, x.lo, false),
            side(&gx, x.hi, true),
            side(&gy, y.lo, false),
            side(&gy, y.hi, true),
            front,
        ];
        Self { base, sides, t, start: start.hi }
    }

    /// A lower bound of t on the rays within the box, or `None` when the box lies strictly outside.
    #[must_use]
    pub fn enter(&self, bounds: &Aabb) -> Option<f64> {
        let (lo, hi) = bounds.corners();
        self.enter_box(lo, hi)
    }

    /// The same for the box [lo, hi] in f64.
    fn enter_box(&self, lo: DVec3, hi: DVec3) -> Option<f64> {
        let (lo, hi) = (lo - self.base, hi - self.base);
        if self.sides.iter().any(|side| side.excludes(lo, hi)) {
            return None;
        }
        let least = -self.t.negated().upper(lo, hi) - self.start;
        Some(least - least.abs() * (2.0 * U))
    }

    /// What the tests of eight boxes compare with, for boxes within `bounds`: the sides' offsets and the start, each
    /// less the error there.
    pub(crate) fn limits(&self, bounds: &Aabb) -> [f64; 6] {
        let reach = bounds.reach(self.base);
        let mut limits = [0.0; 6];
        for (limit, Side { functional, offset }) in limits.iter_mut().zip(&self.sides) {
            // Rounded down once more: an offset minus a slack of at least 5u of it.
            *limit = *offset - (functional.slack_within(reach) + offset.abs() * DOT_SLACK);
        }
        limits[5] = -(self.start + (self.t.slack_within(reach) + self.start.abs() * DOT_SLACK));
        limits
    }

    /// The boxes, as bits, that are not strictly outside, and a lower bound of t within each. `limits` are those of
    /// [`Frustum::limits`].
    #[inline(always)]
    pub(crate) fn enter_lanes<S: Simd>(
        &self,
        simd: S,
        boxes: &Boxes,
        limits: &[f64; 6],
    ) -> (u64, [f64; LANES]) {
        let [lo, hi] = boxes.corners(simd, self.base);
        // Empty lanes are infinite, and their bounds would be NaN.
        let mut outside = hi.x.simd_lt(lo.x).to_bitmask();
        for (Side { functional, .. }, limit) in self.sides.iter().zip(limits) {
            let upper = functional.greatest_lanes(lo, hi);
            outside |= upper.simd_lt(Lanes::simd_from(simd, *limit)).to_bitmask();
        }
        let least = -self.t.negated().greatest_lanes(lo, hi) + limits[5];
        let least = least - least.abs() * (2.0 * U);
        (!outside & 0xFF, least.to_array())
    }

    /// The triangles, as bits, whose corners all lie strictly outside one side. Corners are given as A; `reach` bounds
    /// their magnitudes.
    #[inline(always)]
    pub(crate) fn excluded<S: Simd>(&self, simd: S, corners: &[Points<S>; 3], reach: DVec3) -> u64 {
        let [a, b, c] = *corners;
        let mut excluded = 0;
        for Side { functional, offset } in &self.sides {
            let slack = functional.slack_within(reach) + offset.abs() * DOT_SLACK;
            // Rounded down once more: an offset minus a slack of at least 5u of it.
            let limit = Lanes::simd_from(simd, *offset - slack);
            let (a, b, c) = (a.dot(functional.g), b.dot(functional.g), c.dot(functional.g));
            excluded |= (a.simd_lt(limit) & b.simd_lt(limit) & c.simd_lt(limit)).to_bitmask();
        }
        excluded
    }
}
