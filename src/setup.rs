//! Triangle setup: everything about a triangle that the rays of one film share.
//!
//! On a film the edge functions and the depth key are affine, v(X, Y) = c + xX + yY. For an origin at a point the edge
//! a→b has n = A×(b − a) and e = d·n, so (c, x, y) = (n·F, n·R, n·U), and the key is 1/t = (d·N)/(A·N). At infinity
//! n = D×(b − a) and e = (p − a)·n, so c = n·(F − a), and the key is −t = (p − a)·N/(D·N). Greater keys are nearer.
//!
//! n is formed from b − a and not from A×B, which would cancel. Edges are evaluated in one direction for both of their
//! triangles, so that rounded values are exactly opposite: even `fast` has no cracks along edges.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997.

use glam::DVec3;

use crate::GridFilm;
use crate::approx::{Approx, Cross, Sign};
use crate::bounds::U;
use crate::pencil::Origin;
use crate::predicates::{facing, orientation};
use crate::triangles::Triangle;

/// Evaluating c + xX + yY: one rounding per product, two for the sum. As much again pays for forming the bound and for
/// the sums and differences of value and bound in comparisons.
const AFFINE_ERROR: f64 = 6.0 * U;

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
    /// From coefficients with errors, for |X| ≤ `reach[0]` and |Y| ≤ `reach[1]`.
    fn new([c, x, y]: [Approx; 3], reach: [f64; 2]) -> Self {
        let coefficients = c.error + x.error * reach[0] + y.error * reach[1];
        let size = c.value.abs() + x.value.abs() * reach[0] + y.value.abs() * reach[1];
        let error = (coefficients + size * AFFINE_ERROR) * (1.0 + 8.0 * U);
        Self {
            c: c.value,
            x: x.value,
            y: y.value,
            error,
        }
    }

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

/// Sets up a triangle for a tile within |X| ≤ `reach[0]` and |Y| ≤ `reach[1]`; `None` when no ray of the pencil can hit it:
/// it has no area, or is seen edge-on.
pub(crate) fn set_up(
    origin: Origin,
    film: &GridFilm,
    triangle: &Triangle,
    reach: [f64; 2],
) -> Option<TriangleSetup> {
    let [f, r, u] = film.span();
    let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
    // The common sign of the three edge functions of a hit, and the denominator of the key.
    let (side, denominator) = match origin {
        Origin::Point(o) => {
            let volume = normal.dot(triangle.a - o);
            (
                volume
                    .sign()
                    .unwrap_or_else(|| orientation(triangle.a, triangle.b, triangle.c, o)),
                volume,
            )
        }
        Origin::Infinity(d) => {
            let slope = normal.dot(d);
            (
                slope
                    .sign()
                    .unwrap_or_else(|| facing(&origin.ray(f), triangle)),
                slope,
            )
        }
    };
    if side == Sign::Zero {
        return None;
    }
    let key = match origin {
        Origin::Point(_) => [normal.dot(f), normal.dot(r), normal.dot(u)],
        Origin::Infinity(_) => [normal.dot(f - triangle.a), normal.dot(r), normal.dot(u)],
    };
    let mut zero_is_inside = [false; 3];
    let mut corner = 0;
    let edges = triangle.edges().map(|(a, b)| {
        // One direction for both triangles of an edge; the sign puts it right.
        let (a, b, swapped) = if precedes(a, b) {
            (a, b, false)
        } else {
            (b, a, true)
        };
        let flipped = swapped != (side == Sign::Negative);
        zero_is_inside[corner] = !flipped;
        corner += 1;
        let coefficients = match origin {
            Origin::Point(o) => {
                let n = Cross::of(a - o, b - a);
                [n.dot(f), n.dot(r), n.dot(u)]
            }
            Origin::Infinity(d) => {
                let n = Cross::of(d, b - a);
                [n.dot(f - a), n.dot(r), n.dot(u)]
            }
        };
        let signed = coefficients.map(|v| Approx {
            value: if flipped { -v.value } else { v.value },
            ..v
        });
        Affine::new(signed, reach)
    });
    Some(TriangleSetup {
        edges,
        zero_is_inside,
        key: Affine::new(key.map(|v| v.over(denominator)), reach),
    })
}

/// A strict order of points that does not depend on the triangle: lexicographic.
pub(crate) fn precedes(a: DVec3, b: DVec3) -> bool {
    let first_difference = (0..3).find(|&k| a[k] != b[k]);
    first_difference.is_some_and(|k| a[k] < b[k])
}
