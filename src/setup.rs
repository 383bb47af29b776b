//! Triangle setup: everything about a triangle that the rays of one film share, for eight triangles at once.
//!
//! On a film the edge functions and the depth key are affine, v(X, Y) = c + xX + yY. For an origin at a point the edge
//! a→b has n = (A + B)×(b − a) = 2A×B and e = d·n, so (c, x, y) = (n·F, n·R, n·U), and the key is 1/t = (d·N)/(A·N). At
//! infinity n = D×(b − a) and 2e = ((p − a) + (p − b))·n, so c = ((F − a) + (F − b))·n, and the key is
//! −t = (p − a)·N/(D·N). Greater keys are nearer.
//!
//! n is formed from b − a and not from A×B, which would cancel. Both forms change nothing but their sign, to the bit, when
//! a and b are exchanged: even `fast` has no cracks along edges.
//!
//! Errors are bounded as in [`crate::approx`].
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997.

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::GridFilm;
use crate::approx::{Sign, TRIPLE_PRODUCT_ERROR};
use crate::bounds::U;
use crate::lanes::{Batch, CrossLanes, LANES, LaneMask, Lanes, Points, bits};
use crate::pencil::Origin;
use crate::predicates::{facing, orientation};
use crate::triangles::Triangle;

/// Evaluating c + xX + yY: one rounding per product, two for the sum. As much again pays for forming the bound and for
/// the sums and differences of value and bound in comparisons.
const AFFINE_ERROR: f64 = 6.0 * U;

/// Roundings of bounds of bounds: a handful of operations, each (1 + u).
const BOUND_SLACK: f64 = 1.0 + 16.0 * U;

/// An affine function on a film, scaled so that "inside" is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Affine {
    pub(crate) c: f64,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Bound of the error of evaluating it anywhere on the tile.
    pub(crate) error: f64,
}

impl Affine {
    /// The value at (X, Y).
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        self.c + self.x * x + self.y * y
    }
}

/// A triangle on a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TriangleSetup {
    /// Positive inside.
    pub(crate) edges: [Affine; 3],
    /// Whether a value of exactly zero counts as inside where no exact stage runs: true for one side of every edge.
    pub(crate) zero_is_inside: [bool; 3],
    /// 1/t for an origin at a point, −t for one at infinity.
    pub(crate) key: Affine,
}

/// Eight triangles on a film.
#[derive(Debug)]
pub(crate) struct BatchSetup {
    /// c, x, y and error of three edges and the key, lane by lane.
    values: [[[f64; LANES]; 4]; 4],
    zero_is_inside: [u64; 3],
    /// The lanes that any ray of the pencil can hit: not without area, not seen edge-on.
    pub(crate) lanes: u64,
}

impl BatchSetup {
    /// No triangles.
    pub(crate) const EMPTY: Self = Self { values: [[[0.0; LANES]; 4]; 4], zero_is_inside: [0; 3], lanes: 0 };

    /// One of the triangles.
    pub(crate) fn lane(&self, lane: usize) -> TriangleSetup {
        let affine = |k: usize| {
            let [c, x, y, error] = [0, 1, 2, 3].map(|part| self.values[k][part][lane]);
            Affine { c, x, y, error }
        };
        TriangleSetup {
            edges: [affine(0), affine(1), affine(2)],
            zero_is_inside: self.zero_is_inside.map(|mask| mask >> lane & 1 == 1),
            key: affine(3),
        }
    }
}

/// Sets up eight triangles for a tile within |X| ≤ `reach[0]` and |Y| ≤ `reach[1]`.
#[inline(always)]
pub(crate) fn set_up<S: Simd>(
    simd: S,
    origin: Origin,
    film: &GridFilm,
    batch: &Batch,
    reach: [f64; 2],
    setup: &mut BatchSetup,
) {
    let span = film.span();
    let base = match origin {
        Origin::Point(point) => point,
        Origin::Infinity(_) => span[0],
    };
    let [a, b, c] = [
        Points::load(simd, &batch.corners[0]),
        Points::load(simd, &batch.corners[1]),
        Points::load(simd, &batch.corners[2]),
    ];
    let corners = [a, b, c];
    let base = Points::splat(simd, base);
    let relative = [a.minus(base), b.minus(base), c.minus(base)];

    // The normal; the side of the origin, A·N or D·N, is the sign of a hit and the denominator of the key.
    let (ab, ac) = (b.minus(a), c.minus(a));
    let normal = CrossLanes::of(ab, ab.abs(), ac);
    let denominator = match origin {
        Origin::Point(_) => Product::of(normal, relative[0]),
        Origin::Infinity(d) => Product::of(normal, Points::splat(simd, d)),
    };
    let negative = sides(origin, batch, denominator);
    let zero = Lanes::simd_from(simd, 0.0);
    let negative_mask = LaneMask::from_bitmask(simd, negative.0);

    setup.lanes = negative.1;
    for edge in 0..3 {
        let next = (edge + 1) % 3;
        let along = corners[next].minus(corners[edge]);
        let ends = [relative[edge], relative[next]];
        let (lead, [first, right, up]) = edge_function(simd, origin, span, ends, along);
        let (first, right, up) =
            (first.signed(negative_mask), right.signed(negative_mask), up.signed(negative_mask));
        setup.values[edge] = affine(first, right, up, reach);
        setup.zero_is_inside[edge] = leads_positive(lead, zero) ^ negative.0;
    }

    let first = match origin {
        Origin::Point(_) => Product::with(normal, span[0]),
        Origin::Infinity(_) => Product::of(normal, relative[0]).negated(),
    };
    let (right, up) = (Product::with(normal, span[1]), Product::with(normal, span[2]));
    let (first, right) = (first.over(denominator, zero), right.over(denominator, zero));
    setup.values[3] = affine(first, right, up.over(denominator, zero), reach);
}

/// n of an edge with two ends (from the base) and their difference, and twice (c, x, y) of its edge function.
#[inline(always)]
fn edge_function<S: Simd>(
    simd: S,
    origin: Origin,
    span: [DVec3; 3],
    [from, to]: [Points<S>; 2],
    along: Points<S>,
) -> (Points<S>, [Product<S>; 3]) {
    let size = from.abs().plus(to.abs());
    match origin {
        Origin::Point(_) => {
            let n = CrossLanes::of(from.plus(to), size, along);
            (n.value, [Product::with(n, span[0]), Product::with(n, span[1]), Product::with(n, span[2])])
        }
        Origin::Infinity(d) => {
            let d = Points::splat(simd, d);
            let n = CrossLanes::of(d, d.abs(), along);
            // The ends are a − F and b − F: their sum has the opposite sign of (F − a) + (F − b).
            let first = Product::sized(n, from.plus(to), size).negated();
            (n.value, [first, Product::with(n, span[1] * 2.0), Product::with(n, span[2] * 2.0)])
        }
    }
}

/// A value per lane, and a bound of its error.
#[derive(Clone, Copy)]
struct Product<S: Simd> {
    value: Lanes<S>,
    error: Lanes<S>,
}

impl<S: Simd> Product<S> {
    /// n·x for an exact x.
    #[inline(always)]
    fn with(n: CrossLanes<S>, x: DVec3) -> Self {
        Self { value: n.value.dot(x), error: n.permanent.dot(x.abs()) * TRIPLE_PRODUCT_ERROR }
    }

    /// n·x for an x per lane, rounded once.
    #[inline(always)]
    fn of(n: CrossLanes<S>, x: Points<S>) -> Self {
        Self::sized(n, x, x.abs())
    }

    /// n·x for an x per lane whose roundings are those of `size`.
    #[inline(always)]
    fn sized(n: CrossLanes<S>, x: Points<S>, size: Points<S>) -> Self {
        Self { value: n.value.dot_lanes(x), error: n.permanent.dot_lanes(size) * TRIPLE_PRODUCT_ERROR }
    }

    #[inline(always)]
    fn negated(self) -> Self {
        Self { value: -self.value, error: self.error }
    }

    /// −p in the lanes of the mask.
    #[inline(always)]
    fn signed(self, negative: LaneMask<S>) -> Self {
        Self { value: negative.select(-self.value, self.value), error: self.error }
    }

    /// The quotient; 0 with infinite error where the divisor may be zero.
    #[inline(always)]
    fn over(self, divisor: Self, zero: Lanes<S>) -> Self {
        let size = divisor.value.abs() - divisor.error;
        let certain = size.simd_gt(zero);
        let value = self.value / divisor.value;
        let error = (self.error + value.abs() * divisor.error) / size + value.abs() * U;
        Self {
            value: certain.select(value, zero),
            error: certain.select(error * BOUND_SLACK, zero + f64::INFINITY),
        }
    }
}

/// c, x, y and the error of evaluating them within `reach`.
#[inline(always)]
fn affine<S: Simd>(c: Product<S>, x: Product<S>, y: Product<S>, reach: [f64; 2]) -> [[f64; LANES]; 4] {
    // A reach of zero times an infinite error would be NaN, and minima of depths pass over NaN.
    let reach = reach.map(|reach| reach.max(1.0));
    let coefficients = c.error + x.error * reach[0] + y.error * reach[1];
    let size = c.value.abs() + x.value.abs() * reach[0] + y.value.abs() * reach[1];
    let error = (coefficients + size * AFFINE_ERROR) * BOUND_SLACK;
    [c.value.to_array(), x.value.to_array(), y.value.to_array(), error.to_array()]
}

/// The lanes where the first component that is not zero is positive.
#[inline(always)]
fn leads_positive<S: Simd>(n: Points<S>, zero: Lanes<S>) -> u64 {
    let (x, y, z) = (n.x.simd_eq(zero), n.y.simd_eq(zero), n.z.simd_gt(zero));
    let lead = n.x.simd_gt(zero) | (x & (n.y.simd_gt(zero) | (y & z)));
    lead.to_bitmask()
}

/// The lanes with a negative side, and those with a side at all: exactly, where the bound leaves doubt.
#[inline(always)]
fn sides<S: Simd>(origin: Origin, batch: &Batch, side: Product<S>) -> (u64, u64) {
    let positive = side.value.simd_gt(side.error).to_bitmask() & batch.lanes();
    let negative = (-side.value).simd_gt(side.error).to_bitmask() & batch.lanes();
    let doubtful = batch.lanes() & !positive & !negative;
    bits(doubtful).fold((negative, positive | negative), |(negative, any), lane| {
        match exact_side(origin, batch, lane) {
            Sign::Negative => (negative | 1 << lane, any | 1 << lane),
            Sign::Zero => (negative, any),
            Sign::Positive => (negative, any | 1 << lane),
        }
    })
}

/// The sign of A·N or D·N.
#[cold]
fn exact_side(origin: Origin, batch: &Batch, lane: usize) -> Sign {
    let [a, b, c] = batch.corners.each_ref().map(|corner| DVec3::from_array(corner.map(|x| x[lane])));
    match origin {
        Origin::Point(o) => orientation(a, b, c, o),
        Origin::Infinity(_) => facing(&origin.ray(DVec3::ZERO), &Triangle { a, b, c }),
    }
}
