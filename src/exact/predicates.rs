//! Every decision about one ray and one triangle, exact: f64 with a bound first, expansions where the bound leaves doubt.
//!
//! With A = a − o and so on, the edge function of the oriented edge a→b is e = d·(A×B) = d·(A×(b − a)), the normal
//! N = (b − a)×(c − a), and t = (A·N)/(d·N). A triangle is hit iff its three edge signs agree and t > 0. An edge function
//! of zero takes the sign of the first non-zero component of n: A×B where the direction is shifted (w = 1), d×(b − a)
//! where the start point is (w = 0). A·N = 0 is never a hit: for w = 1 the plane holds the origin (seen edge-on or
//! degenerate), for w = 0 it means t = 0. For w = 0, d·N = 0 is dropped as well.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997; Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990; Sven Woop, Carsten Benthin, Ingo Wald,
//! "Watertight Ray/Triangle Intersection", 2013.

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::exact::expansion::{Expansion, triple_product, two_sum};
use crate::exact::filter::{Approx, Cross, Sign};
use crate::geometry::ray::{Ray, Ties};
use crate::geometry::triangles::Triangle;

/// What the f64 filter says about a ray and a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coverage {
    Hit,
    Miss,
    Ambiguous,
}

/// Whether the ray hits the triangle at some t > 0, as far as f64 can tell.
pub(crate) fn covers_filtered(ray: &Ray, triangle: &Triangle) -> Coverage {
    let [a, b, c] = [triangle.a - ray.origin, triangle.b - ray.origin, triangle.c - ray.origin];
    let (ab, bc, ca) = (triangle.b - triangle.a, triangle.c - triangle.b, triangle.a - triangle.c);
    let signs =
        [(a, ab), (b, bc), (c, ca)].map(|(from, edge)| Cross::of(from, edge).dot(ray.direction).sign());
    let any = |sign| signs.contains(&Some(sign));
    if any(Sign::Positive) && any(Sign::Negative) {
        return Coverage::Miss;
    }
    // The side of the origin. It must have the sign of the edges.
    let normal = Cross::of(ab, ca);
    let side = normal.dot(-a).sign();
    if side.is_some_and(|side| any(side.negated())) {
        return Coverage::Miss;
    }
    // For w = 0 the plane must not hold the direction: three certain edges of one sign say so too.
    let certain = side.is_some() && signs.iter().all(Option::is_some);
    if certain { Coverage::Hit } else { Coverage::Ambiguous }
}

/// Whether the ray hits the triangle at some t > 0, decided exactly.
pub(crate) fn covers_exact(ray: &Ray, triangle: &Triangle, ties: Ties) -> bool {
    // A·(B×C) = A·N, the side of the origin.
    let side = orientation(triangle.a, triangle.b, triangle.c, ray.origin);
    if side == Sign::Zero {
        return false;
    }
    if ties == Ties::Origin && facing(ray, triangle) != side {
        return false;
    }
    triangle.edges().iter().all(|&(a, b)| edge_sign(ray, a, b, ties) == side)
}

/// Whether the ray hits the triangle at some t > 0: the filter, then the exact stage.
pub(crate) fn covers(ray: &Ray, triangle: &Triangle, ties: Ties, ambiguous: &mut u64) -> bool {
    match covers_filtered(ray, triangle) {
        Coverage::Hit => true,
        Coverage::Miss => false,
        Coverage::Ambiguous => {
            *ambiguous += 1;
            covers_exact(ray, triangle, ties)
        }
    }
}

/// The sign of (a − d)·((b − d)×(c − d)): robust's orientation.
pub(crate) fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Sign {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    Sign::of(orient3d(coord(a), coord(b), coord(c), coord(d)))
}

/// The sign of d·N.
pub(crate) fn facing(ray: &Ray, triangle: &Triangle) -> Sign {
    let (ab, ac) = (triangle.b - triangle.a, triangle.c - triangle.a);
    let filtered = Cross::of(ab, ac).dot(ray.direction).sign();
    filtered.unwrap_or_else(|| exact_facing(ray, triangle).sign())
}

/// The sign of the edge function of a→b, ties broken: never zero unless the triangle is dropped anyway.
fn edge_sign(ray: &Ray, a: DVec3, b: DVec3, ties: Ties) -> Sign {
    // Mostly only one of the three edges is in doubt.
    if let Some(sign) = Cross::of(a - ray.origin, b - a).dot(ray.direction).sign() {
        return sign;
    }
    match exact_edge_sign(ray, a, b) {
        Sign::Zero => tie_sign(ray, a, b, ties),
        sign => sign,
    }
}

/// The exact sign of d·((a − o)×(b − o)).
fn exact_edge_sign(ray: &Ray, a: DVec3, b: DVec3) -> Sign {
    let (from, to) = (exact_difference(a, ray.origin), exact_difference(b, ray.origin));
    if let (Some(from), Some(to)) = (from, to) {
        // A·(B×d) = d·(A×B), with exact A and B.
        return orientation(from, to, ray.direction, DVec3::ZERO);
    }
    let direction = ray.direction.to_array().map(Expansion::of);
    triple_product(&direction, &difference(a, ray.origin), &difference(b, ray.origin)).sign()
}

/// The sign of the first non-zero component of the edge's normal.
pub(crate) fn tie_sign(ray: &Ray, a: DVec3, b: DVec3, ties: Ties) -> Sign {
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let sign = match ties {
            Ties::Direction => {
                let coord = |p: DVec3| Coord { x: p[i], y: p[j] };
                Sign::of(orient2d(coord(a), coord(b), coord(ray.origin)))
            }
            Ties::Origin => {
                let d = ray.direction;
                let first = Expansion::difference(b[j], a[j]).scaled(d[i]);
                first.minus(&Expansion::difference(b[i], a[i]).scaled(d[j])).sign()
            }
        };
        if sign != Sign::Zero {
            return sign;
        }
    }
    Sign::Zero
}

/// a − b where f64 holds it exactly.
fn exact_difference(a: DVec3, b: DVec3) -> Option<DVec3> {
    let parts = [0, 1, 2].map(|k| two_sum(a[k], -b[k]));
    parts.iter().all(|&(_, tail)| tail == 0.0).then(|| DVec3::from_array(parts.map(|(sum, _)| sum)))
}

/// a − b exactly.
fn difference(a: DVec3, b: DVec3) -> [Expansion; 3] {
    [0, 1, 2].map(|k| Expansion::difference(a[k], b[k]))
}

/// d·N exactly.
fn exact_facing(ray: &Ray, triangle: &Triangle) -> Expansion {
    let (ab, ac) = (difference(triangle.b, triangle.a), difference(triangle.c, triangle.a));
    triple_product(&ray.direction.to_array().map(Expansion::of), &ab, &ac)
}

/// The hit distance t = (A·N)/(d·N) as a fraction with a positive denominator. The ray must cover the triangle.
pub(crate) struct Distance<'a> {
    ray: &'a Ray,
    triangle: &'a Triangle,
    numerator: Approx,
    denominator: Approx,
    /// The signs of A·N and d·N, where certain.
    signs: [Option<Sign>; 2],
}

impl<'a> Distance<'a> {
    /// Prepares the distance along a ray that covers the triangle.
    pub(crate) fn new(ray: &'a Ray, triangle: &'a Triangle) -> Self {
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        let (numerator, denominator) = (normal.dot(triangle.a - ray.origin), normal.dot(ray.direction));
        // t > 0, so both have the same sign, and the magnitudes are what matters.
        let absolute = |x: Approx| Approx { value: x.value.abs(), error: x.error };
        let signs = [numerator.sign(), denominator.sign()];
        Self { ray, triangle, numerator: absolute(numerator), denominator: absolute(denominator), signs }
    }

    /// The same for a ray that may not cover the triangle: `None` where its plane certainly does not lie ahead.
    #[inline]
    pub(crate) fn ahead(ray: &'a Ray, triangle: &'a Triangle) -> Option<Self> {
        let distance = Self::new(ray, triangle);
        let Self { signs, numerator, .. } = distance;
        // Where every product is zero nothing was rounded: the origin lies in the plane. Common where rays leave walls along an
        // axis.
        let within = numerator.value == 0.0 && numerator.error == 0.0;
        let behind = signs[0].is_some() && signs[0] == signs[1].map(Sign::negated);
        (!within && !behind).then_some(distance)
    }

    /// Bounds of t, rounded outward. The upper one may be infinite.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        let (n, d) = (self.numerator, self.denominator);
        // A sum or difference and a quotient: three roundings, 4u.
        let slack = 4.0 * crate::geometry::aabb::U;
        let least = (n.value - n.error) / (d.value + d.error) * (1.0 - slack);
        let greatest = (n.value + n.error) / (d.value - d.error) * (1.0 + slack);
        let least = if least > 0.0 { least } else { 0.0 };
        (least, if greatest >= least { greatest } else { f64::INFINITY })
    }

    /// Numerator and denominator exactly, the denominator positive.
    fn exact(&self) -> (Expansion, Expansion) {
        let triangle = self.triangle;
        let (ab, ac) = (difference(triangle.b, triangle.a), difference(triangle.c, triangle.a));
        let numerator = triple_product(&difference(triangle.a, self.ray.origin), &ab, &ac);
        let denominator = exact_facing(self.ray, triangle);
        match denominator.sign() {
            Sign::Negative => (numerator.negated(), denominator.negated()),
            _ => (numerator, denominator),
        }
    }

    /// The sign of t − x for finite x ≥ 0, decided exactly.
    pub(crate) fn compare_to(&self, x: f64) -> Sign {
        let (least, greatest) = self.bounds();
        if greatest < x {
            return Sign::Negative;
        }
        if least > x {
            return Sign::Positive;
        }
        let (numerator, denominator) = self.exact();
        numerator.minus(&denominator.scaled(x)).sign()
    }

    /// The sign of t − s for the distance s of another triangle along the same ray, decided exactly.
    pub(crate) fn compare(&self, other: &Self, ambiguous: &mut u64) -> Sign {
        let filtered = self.numerator.times(other.denominator).minus(other.numerator.times(self.denominator));
        if let Some(sign) = filtered.sign() {
            return sign;
        }
        *ambiguous += 1;
        if coplanar(self.triangle, other.triangle) {
            return Sign::Zero;
        }
        let ((n, d), (other_n, other_d)) = (self.exact(), other.exact());
        n.times(&other_d).minus(&other_n.times(&d)).sign()
    }

    /// t rounded to the nearest f32, ties to even, at least 2⁻¹⁴⁹ and at most `f32::MAX`.
    pub(crate) fn rounded(&self) -> f32 {
        let (least, greatest) = self.bounds();
        let (mut low, mut high) = (saturate(least), saturate(greatest));
        // The f32 of a non-negative number grow with their bits: bisect until no rounding boundary lies between.
        while low != high {
            let middle = f32::from_bits(low.to_bits() + (high.to_bits() - low.to_bits()) / 2);
            let above = f32::from_bits(middle.to_bits() + 1);
            let boundary = (f64::from(middle) + f64::from(above)) * 0.5;
            let up = match self.compare_to(boundary) {
                Sign::Negative => false,
                Sign::Positive => true,
                Sign::Zero => middle.to_bits() % 2 == 1,
            };
            if up {
                low = above;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// x to the nearest f32 in [2⁻¹⁴⁹, `f32::MAX`].
pub(crate) fn saturate(x: f64) -> f32 {
    let smallest = f32::from_bits(1);
    let rounded = x as f32;
    if rounded >= f32::MAX {
        f32::MAX
    } else if rounded >= smallest {
        rounded
    } else {
        smallest
    }
}

/// Whether two triangles with area lie in one plane, exactly. Such triangles have the same t along every ray.
fn coplanar(first: &Triangle, second: &Triangle) -> bool {
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

/// Whether the ray meets the triangle within its open interval. The ray must cover the triangle.
pub(crate) fn within_interval(ray: &Ray, distance: &Distance<'_>) -> bool {
    let after = ray.t_min == 0.0 || distance.compare_to(ray.t_min) == Sign::Positive;
    after && (ray.t_max == f64::INFINITY || distance.compare_to(ray.t_max) == Sign::Negative)
}
