//! Leaving a surface: where rays from a triangle start, so that they need no epsilon.
//!
//! The point p = Σ w_k v_k is moved toward the centroid until it lies 8 ulp (of its largest coordinate) from every
//! edge, or to the centroid where the triangle is too thin for that, and rounded to f32. While orient3d shows it
//! strictly on the wrong side of the plane it steps one ulp u_k along the axis with the largest |N_k|·u_k. Where the
//! coordinates of the corners cancel, an ulp of p_k can be far less than the error of p_k in f64: u_k is then that
//! error. A rounded point is at most u_k/2 + u_k/4 away from the true one per axis, so that a few such steps are
//! enough. N_k are orientations in the coordinate planes: of a sliver's rounded normal not even the signs would be
//! sure.
//!
//! Promised: the ray from there to its side never hits the triangle itself, nor any triangle in its plane, nor anything
//! in the closed half space behind that plane; what lies farther from the true point than ρ = inset + 5 ulp per axis is
//! decided exactly for the ray that starts at the returned point. Not promised: surfaces nearer than ρ (thin sheets,
//! acute folds), and neighbours that f32 vertices really raise above the plane: those are true hits of grazing rays.
//!
//! Based on: Carsten Wächter and Nikolaus Binder, "A Fast and Robust Method for Avoiding Self-Intersection", 2019
//! (offsets in ulp); Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
//! Predicates", 1997.

use glam::DVec3;
use robust::{Coord, orient2d};

use crate::exact::filter::{Approx, Cross, Sign};
use crate::exact::predicates::{collinear, facing, orientation};
use crate::geometry::aabb::widen;
use crate::geometry::ray::{Ray, in_range};
use crate::geometry::triangles::{Triangle, TriangleId, Triangles};

/// The distance from every edge, in ulp of the largest coordinate.
const INSET_ULPS: f64 = 8.0;

/// Steps after which a point would have to be on the right side many times over: 4 are enough in exact arithmetic.
const MOST_STEPS: u32 = 16;

/// Σ w_k v_k in f64 is at most four roundings of the largest coordinate from the true point, 2⁻⁵¹ of it. Steps are at
/// least four times as long.
const LEAST_STEP: f64 = 8.0 * f64::EPSILON;

/// A side of a triangle's plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The side that (b − a)×(c − a) points to.
    Front,
    /// The other one.
    Back,
}

impl Triangles<'_> {
    /// The side of a triangle that a direction leaves to, exactly; `None` for a direction in the plane, for one that is zero or not
    /// finite, and for a triangle without area.
    ///
    /// Directions may be longer or shorter than [`Ray::direction`] may be; parts below 2⁻²⁴⁰ of the greatest then count as zero.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn side_toward(&self, id: TriangleId, direction: DVec3) -> Option<Side> {
        let triangle = self.triangle(id.0);
        match facing(in_range(direction)?, &triangle) {
            Sign::Positive => Some(Side::Front),
            Sign::Negative => Some(Side::Back),
            Sign::Zero => None,
        }
    }

    /// The side of a triangle's plane that a point lies on, exactly; `None` for a point in the plane, and for a
    /// triangle without area.
    ///
    /// The point is in the range of [`Ray::origin`].
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn side_of(&self, id: TriangleId, point: DVec3) -> Option<Side> {
        let Triangle { a, b, c } = self.triangle(id.0);
        // orient3d is positive for points on the back.
        match orientation(a, b, c, point) {
            Sign::Positive => Some(Side::Back),
            Sign::Negative => Some(Side::Front),
            Sign::Zero => None,
        }
    }

    /// Whether a point lies on a side of a triangle's plane, or in the plane, exactly. So it does for a triangle without area.
    pub(crate) fn is_on_side(&self, id: u32, point: DVec3, side: Side) -> bool {
        let triangle = self.triangle(id);
        let height = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a).dot(point - triangle.a);
        let wrong = if side == Side::Front { Sign::Negative } else { Sign::Positive };
        match height.sign() {
            Some(sign) => sign != wrong,
            // Nothing was rounded: common on walls along an axis.
            None if height == (Approx { value: 0.0, error: 0.0 }) => true,
            // orient3d is positive for points on the back.
            None => orientation(triangle.a, triangle.b, triangle.c, point) != wrong.negated(),
        }
    }

    /// The ray that leaves a triangle at barycentric weights (of a, b, c; not negative, with sum 1): it starts at
    /// [`Triangles::leave`], and its t_min is 0. `None` as [`Triangles::side_toward`].
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn ray_from(&self, id: TriangleId, weights: [f64; 3], direction: DVec3) -> Option<Ray> {
        let side = self.side_toward(id, direction)?;
        Some(Ray::new(widen(self.leave(id, weights, side)), direction))
    }

    /// The point from which rays leave a triangle to one side: on its plane or on that side of it, exactly.
    ///
    /// A triangle without area has no sides; its rounded point is returned.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn leave(&self, id: TriangleId, weights: [f64; 3], side: Side) -> [f32; 3] {
        let triangle = self.triangle(id.0);
        let weights = inset(&triangle, weights);
        let point = triangle.a * weights[0] + triangle.b * weights[1] + triangle.c * weights[2];
        // The weighted mean of f32 numbers is in the range of f32.
        let mut point = point.to_array().map(|x| x as f32);
        if collinear(&triangle) {
            return point;
        }
        let normal = normal_toward(&triangle, side);
        let least = LEAST_STEP * largest_coordinate(&triangle);
        // orient3d is positive for points on the back.
        let wrong = if side == Side::Front { Sign::Positive } else { Sign::Negative };
        let is_wrong = |p: [f32; 3]| orientation(triangle.a, triangle.b, triangle.c, widen(p)) == wrong;
        let mut steps = 0;
        while steps < MOST_STEPS && is_wrong(point) {
            point = step(point, normal, least);
            steps += 1;
        }
        point
    }
}

/// Weights moved toward the centroid until the point lies [`INSET_ULPS`] from every edge.
fn inset(triangle: &Triangle, weights: [f64; 3]) -> [f64; 3] {
    let Triangle { a, b, c } = *triangle;
    let distance = INSET_ULPS * ulp(largest_coordinate(triangle) as f32);
    let double_area = length(Cross::of(b - a, c - a).value);
    // The weight of a corner is the distance from the opposite edge over the height.
    let needed = [c - b, a - c, b - a].map(|edge| distance * length(edge) / double_area);
    let mut amount: f64 = 0.0;
    for (&weight, &needed) in weights.iter().zip(&needed) {
        if weight < needed {
            let share = (needed - weight) / (1.0 / 3.0 - weight);
            amount = if (0.0..1.0).contains(&share) { amount.max(share) } else { 1.0 };
        }
    }
    let moved = |amount: f64| weights.map(|weight| weight + amount * (1.0 / 3.0 - weight));
    // A large weight shrinks on the way: too thin for it at the centroid may mean too thin where the others have enough.
    let too_thin = |(&weight, &needed): (&f64, &f64)| needed > 1.0 / 3.0 && weight < needed;
    if moved(amount).iter().zip(&needed).any(too_thin) { moved(1.0) } else { moved(amount) }
}

/// The point one step farther along the axis on which that gets it farthest along the normal. Steps that would leave
/// the range of f32 are none.
fn step(mut point: [f32; 3], normal: DVec3, least: f64) -> [f32; 3] {
    let next = [0, 1, 2].map(|k| {
        let length = ulp(point[k]).max(least);
        (f64::from(point[k]) + if normal[k] > 0.0 { length } else { -length }) as f32
    });
    let gain = |k: usize| {
        if next[k].is_finite() { normal[k].abs() * ulp(point[k]).max(least) } else { -1.0 }
    };
    let axis = (0..3).fold(0, |best, k| if gain(k) > gain(best) { k } else { best });
    if next[axis].is_finite() {
        point[axis] = next[axis];
    }
    point
}

/// The normal toward a side: the signs of its components are exact. f32 coordinates keep it in the range of f64.
fn normal_toward(triangle: &Triangle, side: Side) -> DVec3 {
    let component = |k: usize| {
        let coord = |p: DVec3| Coord { x: p[(k + 1) % 3], y: p[(k + 2) % 3] };
        orient2d(coord(triangle.a), coord(triangle.b), coord(triangle.c))
    };
    let normal = DVec3::new(component(0), component(1), component(2));
    if side == Side::Front { normal } else { -normal }
}

/// The largest coordinate of the corners, without its sign.
fn largest_coordinate(triangle: &Triangle) -> f64 {
    [triangle.a, triangle.b, triangle.c].iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// The spacing of f32 at a number.
fn ulp(x: f32) -> f64 {
    let x = x.abs().min(f32::MAX.next_down());
    f64::from(x.next_up()) - f64::from(x)
}

/// |v|; coordinates are f32-like, so squares stay in range.
fn length(v: DVec3) -> f64 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}
