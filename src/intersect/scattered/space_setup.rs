//! Triangle setup for scattered rays: what the rays of a pencil share where they lie on no grid.
//!
//! Edge functions are evaluated in space: 2e = d·((A + B)×(b − a)) for an origin at a point, and 2e = ((p − a) + (p −
//! b))·(D×(b − a)) at infinity. Exchanging a and b changes the sign and nothing else. The depth key is that of
//! [`crate::intersect::pencil::setup`]: 1/t = (d·N)/(A·N) or −t = ((p − a)·N)/(D·N).
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997.

use glam::DVec3;

use crate::exact::filter::{Approx, Cross, Sign};
use crate::exact::predicates::{facing, orientation};
use crate::geometry::triangles::Triangle;
use crate::rays::origin::Origin;

/// A triangle as the rays of a pencil see it.
#[derive(Debug)]
pub(crate) struct SpaceSetup {
    pub(crate) triangle: Triangle,
    at_infinity: bool,
    /// The edge normals.
    edges: [Cross; 3],
    /// Whether the signs of a hit are negative.
    negative: bool,
    normal: Cross,
    /// A·N or D·N.
    denominator: Approx,
}

impl SpaceSetup {
    /// `None` when no ray of the pencil can hit the triangle: it has no area, or is seen edge-on.
    pub(crate) fn new(origin: Origin, triangle: &Triangle) -> Option<Self> {
        let Triangle { a, b, c } = *triangle;
        let normal = Cross::of(b - a, c - a);
        let denominator = match origin {
            Origin::Point(o) => normal.dot(a - o),
            Origin::Infinity(d) => normal.dot(d),
        };
        let exact_side = || match origin {
            Origin::Point(o) => orientation(a, b, c, o),
            Origin::Infinity(_) => facing(&origin.ray(DVec3::ZERO), triangle),
        };
        let side = denominator.sign().unwrap_or_else(exact_side);
        if side == Sign::Zero {
            return None;
        }
        let edges = triangle.edges().map(|(a, b)| match origin {
            Origin::Point(o) => {
                let (a_part, b_part) = (a - o, b - o);
                Cross::sized(a_part + b_part, a_part.abs() + b_part.abs(), b - a)
            }
            Origin::Infinity(d) => Cross::of(d, b - a),
        });
        let at_infinity = matches!(origin, Origin::Infinity(_));
        let negative = side == Sign::Negative;
        Some(Self { triangle: *triangle, at_infinity, edges, negative, normal, denominator })
    }

    /// The edge functions, positive inside.
    fn edge_values(&self, sample: DVec3) -> [Approx; 3] {
        let corners = self.triangle.edges();
        [0, 1, 2].map(|k| {
            let e = if self.at_infinity {
                let (from_a, from_b) = (sample - corners[k].0, sample - corners[k].1);
                self.edges[k].dot_sized(from_a + from_b, from_a.abs() + from_b.abs())
            } else {
                self.edges[k].dot(sample)
            };
            Approx { value: if self.negative { -e.value } else { e.value }, ..e }
        })
    }

    /// `None` outside for certain, `Some(true)` inside for certain, `Some(false)` in doubt.
    pub(crate) fn inside(&self, sample: DVec3) -> Option<bool> {
        let signs = self.edge_values(sample).map(Approx::sign);
        if signs.contains(&Some(Sign::Negative)) {
            return None;
        }
        Some(signs.iter().all(Option::is_some))
    }

    /// The rounded decision; a value of zero belongs to one side of the edge.
    pub(crate) fn inside_rounded(&self, sample: DVec3) -> bool {
        let values = self.edge_values(sample);
        (0..3).all(|k| {
            let lead = self.edges[k].value.to_array().into_iter().find(|&x| x != 0.0).unwrap_or(0.0);
            values[k].value > 0.0 || (values[k].value == 0.0 && (lead > 0.0) != self.negative)
        })
    }

    /// 1/t or −t.
    pub(crate) fn key(&self, sample: DVec3) -> Approx {
        let slope = self.normal.dot(if self.at_infinity { sample - self.triangle.a } else { sample });
        slope.over(self.denominator)
    }
}
