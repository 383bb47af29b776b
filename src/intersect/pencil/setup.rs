//! Triangle setup: everything about a triangle that the rays of one tile share, for eight triangles at once.
//!
//! On a tile, where column x and row y count from its first ray, the edge functions and the depth key are affine,
//! v = c + xv_x + yv_y. The rays are F + xR + yU (directions for an origin at a point, start points at infinity), with F the
//! first ray of the tile: all exact. For an origin at a point the edge a→b has n = (A + B)×(b − a) = 2A×B and v = d·n,
//! so (c, v_x, v_y) = (n·F, n·R, n·U), and the key is 1/t = (d·N)/(A·N). At infinity n = D×(b − a) and 2e = ((p − a) +
//! (p − b))·n, so c = ((F − a) + (F − b))·n, and the key is −t = (p − a)·N/(D·N). Greater keys are nearer.
//!
//! n is formed from b − a and not from A×B, which would cancel. Both forms change nothing but their sign, to the bit,
//! when a and b are exchanged: even `fast` has no cracks along edges.
//!
//! **Two filters.** Setup is f64; the rows of a tile are evaluated in f32. With u = 2⁻⁵³ and u₃₂ = 2⁻²⁴, an edge
//! function errs by at most E = 18u·Σ|d_k|·perm_k + 6u₃₂S, S = |c| + 63|v_x| + 63|v_y|: the first part is that of
//! [`crate::exact::filter`], with permanents bounded by the longest side of b − a times what the run's box allows for
//! A; the second is rounding the three coefficients (u₃₂S), two products and two sums (4u₃₂S). Every edge function is
//! scaled by the greatest power of two up to 1/E: doubt then begins at ±1 for all of them, no f32 overflows, and both
//! triangles at an edge still round alike. As c and S count from the tile's corner and not from the film's centre,
//! about 10⁻⁵ of a pixel along an edge is in doubt.
//!
//! **Lattices.** Where rays and corners lie on a lattice, rays meet edges exactly and all over. Once some ray of a film has, see
//! [`TileRays::on_lattice`], edge functions of short numbers are taken as what they are, integers: where f64 has formed c, v_x and v_y
//! without rounding, as multiples of a unit of at least 2⁻²¹S, that unit becomes 4. What f32 evaluates is then a multiple of 4, without
//! rounding, and the sign of a zero, one bit per edge and pencil, is added to c as ±2: nothing is in doubt any more.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997; Jonathan
//! Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997 (static
//! filters).

use fearless_simd::{prelude::*, u64x8};
use glam::DVec3;

use crate::exact::filter::{Sign, TRIPLE_PRODUCT_ERROR};
use crate::exact::integer::{SHORT_DIRECTION, SHORT_POINT, numbers_are_short, steps_of};
use crate::exact::predicates::{facing, orientation};
use crate::geometry::aabb::U;
use crate::geometry::triangles::Triangle;
use crate::intersect::pencil::rect::TILE_SIDE;
use crate::rays::film::Sampling;
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, LaneMask, Lanes, Points, bits, narrow};

/// The unit roundoff of f32.
const U32: f64 = 1.0 / (1 << 24) as f64;

/// Evaluating c + xv_x + yv_y in f32: one rounding of each coefficient, two products, two sums; one more pays for all
/// terms of second order and for forming the bound.
const AFFINE_ERROR: f64 = 6.0 * U32;

/// Columns and rows that are no whole numbers: rounding them to f32, and a part of that for their own error.
const PLACE_ERROR: f64 = 1.5 * U32;

/// Errors of keys count twice: a bound of the error is part of what is evaluated, and blocks add half of their range.
const KEY_FACTOR: f64 = 2.0;

/// Roundings of bounds of bounds: a handful of operations, each (1 + u).
const BOUND_SLACK: f64 = 1.0 + 16.0 * U;

/// Keys of f32 are subnormal below 2⁻¹²⁶: a few spacings there.
const KEY_UNDERFLOW: f64 = 1e-37;
/// Keys beyond this are as good as infinite.
const KEY_LIMIT: f64 = 1e37;

/// Keeps the divisor of edge functions that are zero everywhere from being zero.
const TINY: f64 = 1e-290;

/// Bits of edge functions that are taken as integers, without the 2 for the unit of 4 and 1 for the bit that is added.
const INTEGER_BITS: i32 = 21;

/// The greatest column or row of a tile.
const LAST: f64 = (TILE_SIDE - 1) as f64;

/// Eight triangles on a tile, lane by lane.
#[derive(Debug)]
pub(crate) struct Setups {
    /// c, x and y of three edges, positive inside; beyond ±1 they are certain.
    pub(crate) edges: [[[f32; LANES]; 3]; 3],
    /// What the key adds to its c from column to column and row to row, as c (0), x and y.
    pub(crate) slope: [[f32; LANES]; 3],
    /// A lower and an upper bound of its c, errors of evaluation included.
    pub(crate) bounds: [[f32; LANES]; 2],
    /// c, x, y of the key, and the error of evaluating it anywhere on the tile.
    pub(crate) key: [[f64; LANES]; 4],
    /// The lanes that any ray of the pencil can hit: not without area, not seen edge-on.
    pub(crate) lanes: u64,
    /// Those with A·N < 0 or D·N < 0.
    pub(crate) negative: u64,
}

impl Setups {
    /// No triangles.
    pub(crate) const EMPTY: Self = Self {
        edges: [[[0.0; LANES]; 3]; 3],
        slope: [[0.0; LANES]; 3],
        bounds: [[0.0; LANES]; 2],
        key: [[0.0; LANES]; 4],
        lanes: 0,
        negative: 0,
    };
}

/// What setup needs to know of a tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileRays {
    pub(crate) origin: Origin,
    /// F, R and U: the first ray, the step to the next column and the step to the next row.
    pub(crate) span: [DVec3; 3],
    pub(crate) sampling: Sampling,
    /// Whether to look for edge functions that are exact: worth its while where rays meet edges.
    pub(crate) on_lattice: bool,
}

impl TileRays {
    /// What triangles are measured from: the origin, or the first start point.
    pub(crate) fn base(&self) -> DVec3 {
        match self.origin {
            Origin::Point(point) => point,
            Origin::Infinity(_) => self.span[0],
        }
    }

    /// The error of evaluating an affine function in f32, as a part of its size.
    fn affine_error(&self) -> f64 {
        match self.sampling {
            Sampling::Grid => AFFINE_ERROR,
            Sampling::Scattered => AFFINE_ERROR + PLACE_ERROR,
        }
    }

    /// |F| + 63|R| + 63|U|: bounds |d|, or |p| − |base|, on the tile.
    fn size(&self) -> DVec3 {
        let [f, r, u] = self.span.map(DVec3::abs);
        let range = (r + u) * LAST;
        match self.origin {
            Origin::Point(_) => f + range,
            Origin::Infinity(_) => range,
        }
    }

    /// Bounds of 18u·Σ|·||·|, to be multiplied by the sides of a triangle: of an edge function (one side), of the
    /// key's numerator and of its denominator (two sides). `reach` bounds |a − base|.
    fn errors(&self, reach: DVec3) -> [f64; 3] {
        // Σ_k x_k(y_i + y_j): a triple product whose third factor is at most 1 in each component.
        let with_unit = |x: DVec3, y: DVec3| x.x * (y.y + y.z) + x.y * (y.z + y.x) + x.z * (y.x + y.y);
        let sum = |x: DVec3| 2.0 * (x.x + x.y + x.z);
        let size = self.size();
        let errors = match self.origin {
            Origin::Point(_) => [with_unit(size, reach * 2.0), sum(size), sum(reach)],
            Origin::Infinity(d) => {
                let ends = (reach + size) * 2.0;
                [with_unit(ends, d.abs()), sum(reach + size), sum(d.abs())]
            }
        };
        errors.map(|error| error * (TRIPLE_PRODUCT_ERROR * BOUND_SLACK))
    }
}

/// c, v_x and v_y of eight affine functions.
#[derive(Clone, Copy)]
struct Affine<S: Simd>([Lanes<S>; 3]);

impl<S: Simd> Affine<S> {
    /// A bound of the magnitude on the tile.
    #[inline(always)]
    fn size(self) -> Lanes<S> {
        let [c, x, y] = self.0;
        c.abs() + (x.abs() + y.abs()) * LAST
    }

    #[inline(always)]
    fn times(self, factor: Lanes<S>) -> Self {
        let [c, x, y] = self.0;
        Self([c * factor, x * factor, y * factor])
    }
}

/// Sets up those of eight triangles whose lanes are asked for. `reach` bounds |a − base| of all corners; `exact_side`
/// gives the sign of A·N or D·N where f64 leaves doubt.
#[inline(always)]
pub(crate) fn set_up<S: Simd>(
    simd: S,
    rays: &TileRays,
    (corners, lanes): ([Points<S>; 3], u64),
    reach: DVec3,
    exact_side: impl Fn(usize) -> Sign,
    setups: &mut Setups,
) {
    let [edge_error, numerator_error, denominator_error] = rays.errors(reach);
    let base = Points::splat(simd, rays.base());
    let [a, b, c] = corners;
    let sides = [b.minus(a), c.minus(b), a.minus(c)];
    let relative = [a.minus(base), b.minus(base), c.minus(base)];
    let zero = Lanes::simd_from(simd, 0.0);
    let longest = [longest(sides[0]), longest(sides[1]), longest(sides[2])];
    let short =
        if rays.on_lattice { are_short(simd, rays, &corners) } else { LaneMask::simd_from(simd, false) };

    // The normal (b − a)×(c − a); the side of the origin, A·N or D·N, is the sign of a hit and the denominator of the key.
    let normal = cross(sides[2], sides[0]);
    let denominator = match rays.origin {
        Origin::Point(_) => normal.dot_lanes(relative[0]),
        Origin::Infinity(d) => normal.dot(d),
    };
    let product = longest[0] * longest[2];
    let denominator_error = product * denominator_error;
    (setups.negative, setups.lanes) = signs(exact_side, lanes, denominator, denominator_error);
    let negative = LaneMask::from_bitmask(simd, setups.negative);

    for edge in 0..3 {
        let next = (edge + 1) % 3;
        let ends = relative[edge].plus(relative[next]);
        let (function, normal) = edge_function(simd, rays, ends, sides[edge]);
        let error = longest[edge] * edge_error + function.size() * rays.affine_error() + TINY;
        let scale = power_of_two_below((zero + 1.0) / error);
        let mut scaled = function.times(negative.select(-scale, scale)).0;
        if rays.on_lattice {
            scaled = as_integers(short, (function, normal), negative, scaled);
        }
        for (stored, part) in setups.edges[edge].iter_mut().zip(scaled) {
            narrow(part).store_slice(stored);
        }
    }

    let numerator = match rays.origin {
        Origin::Point(_) => normal.dot(rays.span[0]),
        Origin::Infinity(_) => -normal.dot_lanes(relative[0]),
    };
    let numerator = Affine([numerator, normal.dot(rays.span[1]), normal.dot(rays.span[2])]);
    let quotient = [product * numerator_error, denominator, denominator_error];
    store_key(zero, numerator, quotient, rays.affine_error() * KEY_FACTOR, setups);
}

/// c, v_x and v_y of an edge function, and n, given the sum of its ends (from the base) and their difference.
#[inline(always)]
fn edge_function<S: Simd>(
    simd: S,
    rays: &TileRays,
    ends: Points<S>,
    along: Points<S>,
) -> (Affine<S>, Points<S>) {
    let [f, r, u] = rays.span;
    match rays.origin {
        Origin::Point(_) => {
            let n = cross(ends, along);
            (Affine([n.dot(f), n.dot(r), n.dot(u)]), n)
        }
        Origin::Infinity(d) => {
            // The ends are a − F and b − F: their sum has the opposite sign of (F − a) + (F − b).
            let n = cross(Points::splat(simd, d), along);
            (Affine([-n.dot_lanes(ends), n.dot(r * 2.0), n.dot(u * 2.0)]), n)
        }
    }
}

/// The lanes in which f64 forms c, v_x and v_y of edge functions exactly. What is a point has at most 14 bits on a common grid, what is
/// a direction 18: ends have 16, differences 15, n 32 from a point and 34 at infinity, and the dot products at most 52.
#[inline(always)]
fn are_short<S: Simd>(simd: S, rays: &TileRays, [a, b, c]: &[Points<S>; 3]) -> LaneMask<S> {
    let [f, r, u] = rays.span;
    let (points, directions) = match rays.origin {
        Origin::Point(o) => ([o; 3], [f, r, u]),
        // Twice the steps are what is used.
        Origin::Infinity(d) => ([f, r * 2.0, u * 2.0], [d; 3]),
    };
    let mut short = LaneMask::simd_from(simd, numbers_are_short(&directions, SHORT_DIRECTION));
    let mut greatest = a.greatest().max(b.greatest()).max(c.greatest());
    for point in points {
        greatest = greatest.max(Lanes::simd_from(simd, point.abs().max_element()));
    }
    let exponents = greatest.bitcast::<u64x8<S>>() & 0x7FF0_0000_0000_0000_u64;
    let steps = exponents.bitcast::<Lanes<S>>() * steps_of(SHORT_POINT - 1);
    let [f, r, u] = points.map(|point| Points::splat(simd, point));
    for point in [*a, *b, *c, f, r, u] {
        for x in [point.x, point.y, point.z] {
            short &= ((x + steps) - steps).simd_eq(x);
        }
    }
    short
}

/// Exact edge functions as multiples of 4 below 2²³, and ±2 more: positive where the triangle owns the edge. Those of other lanes, and
/// those of more bits, as they are.
#[inline(always)]
fn as_integers<S: Simd>(
    short: LaneMask<S>,
    (function, n): (Affine<S>, Points<S>),
    negative: LaneMask<S>,
    [c, x, y]: [Lanes<S>; 3],
) -> [Lanes<S>; 3] {
    let power = power_of_two_below(function.size());
    let mut fits = short;
    for value in function.0 {
        let steps = power * steps_of(INTEGER_BITS);
        fits &= ((value + steps) - steps).simd_eq(value);
    }
    // The unit is 2^(1 − 21) of that power.
    let scale = power.simd_gt(0.0).select(f64::from(1 << (INTEGER_BITS + 1)) / power, power);
    let [exact_c, exact_x, exact_y] = function.times(negative.select(-scale, scale)).0;
    let last = n.y.simd_eq(0.0).select(n.z, n.y);
    let tie = n.x.simd_eq(0.0).select(last, n.x);
    let owned = tie.simd_lt(0.0) ^ !negative;
    let bias = owned.select(power * 0.0 + 2.0, power * 0.0 - 2.0);
    [fits.select(exact_c + bias, c), fits.select(exact_x, x), fits.select(exact_y, y)]
}

/// The key as a quotient, and its bounds in f32. Where the divisor may be zero the bounds are infinite.
#[inline(always)]
fn store_key<S: Simd>(
    zero: Lanes<S>,
    numerator: Affine<S>,
    [numerator_error, denominator, denominator_error]: [Lanes<S>; 3],
    affine_error: f64,
    setups: &mut Setups,
) {
    let inverse = (zero + 1.0) / denominator;
    let key = numerator.times(inverse);
    let size = key.size();
    let certain = denominator.abs() - denominator_error;
    // Three roundings of the quotient and four of its evaluation in f64, each of at most the size.
    let error = (numerator_error + size * denominator_error) / certain * BOUND_SLACK + size * (8.0 * U);
    let slack = error + size * affine_error + KEY_UNDERFLOW;
    // Comparisons with NaN are false.
    let sound = certain.simd_gt(zero) & (size + slack).simd_lt(zero + KEY_LIMIT);
    let infinite = zero + f64::INFINITY;
    let [c, x, y] = key.0;
    narrow(sound.select(c - slack, -infinite)).store_slice(&mut setups.bounds[0]);
    narrow(sound.select(c + slack, infinite)).store_slice(&mut setups.bounds[1]);
    narrow(sound.select(x, zero)).store_slice(&mut setups.slope[1]);
    narrow(sound.select(y, zero)).store_slice(&mut setups.slope[2]);
    for (part, value) in [c, x, y].into_iter().enumerate() {
        sound.select(value, zero).store_slice(&mut setups.key[part]);
    }
    sound.select(error, infinite).store_slice(&mut setups.key[3]);
}

/// The greatest powers of two up to some positive normal numbers.
#[inline(always)]
fn power_of_two_below<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    let exponent_bits = 0x7FF0_0000_0000_0000_u64;
    (x.bitcast::<u64x8<S>>() & exponent_bits).bitcast()
}

/// y×z per lane.
#[inline(always)]
fn cross<S: Simd>(y: Points<S>, z: Points<S>) -> Points<S> {
    Points { x: y.y * z.z - y.z * z.y, y: y.z * z.x - y.x * z.z, z: y.x * z.y - y.y * z.x }
}

/// The greatest component, per lane.
#[inline(always)]
fn longest<S: Simd>(side: Points<S>) -> Lanes<S> {
    side.x.abs().max(side.y.abs()).max(side.z.abs())
}

/// The lanes with a negative side, and those with a side at all: exactly, where the bound leaves doubt.
#[inline(always)]
fn signs<S: Simd>(
    exact_side: impl Fn(usize) -> Sign,
    lanes: u64,
    side: Lanes<S>,
    error: Lanes<S>,
) -> (u64, u64) {
    let positive = side.simd_gt(error).to_bitmask() & lanes;
    let negative = (-side).simd_gt(error).to_bitmask() & lanes;
    let doubtful = lanes & !positive & !negative;
    bits(doubtful).fold((negative, positive | negative), |(negative, any), lane| match exact_side(lane) {
        Sign::Negative => (negative | 1 << lane, any | 1 << lane),
        Sign::Zero => (negative, any),
        Sign::Positive => (negative, any | 1 << lane),
    })
}

/// The sign of A·N or D·N, exactly.
#[cold]
pub(crate) fn exact_side(origin: Origin, triangle: &Triangle) -> Sign {
    match origin {
        Origin::Point(o) => orientation(triangle.a, triangle.b, triangle.c, o),
        Origin::Infinity(direction) => facing(direction, triangle),
    }
}
