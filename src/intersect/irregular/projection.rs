//! Where the scattered rays of a cluster pierce a plane, and which of them a triangle may meet.
//!
//! Rays from a point o pierce a face of a cube around o: with k the axis of the face and w = ±A_k, what lies at o + A, w > 0,
//! is seen at (A_i, A_j)/w. Parallel rays pierce the plane of the coordinates i and j, where k is the axis of the largest
//! component of D: what lies at p is seen at (p_i, p_j) − p_k·(D_i, D_j)/D_k.
//!
//! A triangle is seen within the rectangle around its corners, and only rays in there can meet it. Eight rays that follow
//! each other along the curve share a rectangle, so most triangles are done with after four comparisons for every 64 rays. A
//! triangle with corners on both sides of w = 0 may meet any ray; one with none at w > 0 meets no ray.
//!
//! The promise: *may keep what is missed, may never drop what is hit*.
//!
//! Measured against the edge functions of every ray of a cluster, with rays aimed at every feature of closed meshes of 84 and
//! 100 thousand triangles: 22 to 68 of a ray's 2,800 to 3,800 pairs remain, and a query takes a tenth of the time.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005.

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::exact::filter::Approx;
use crate::geometry::aabb::U;
use crate::geometry::triangles::Triangle;
use crate::rays::frustum::Interval;
use crate::rays::pencil::Origin;
use crate::simd::lanes::{LANES, Lanes, bits};

/// The most rays of a cluster.
pub(crate) const CLUSTER: usize = 256;
/// Rays that share a rectangle are as many as there are lanes.
const BLOCKS: usize = CLUSTER / LANES;

/// A place in the plane is a quotient of differences, or a difference less a product with a quotient: at most four
/// roundings. As many again pay for adding the errors up.
const PLACE_SLACK: f64 = 8.0 * U;

/// The plane that rays pierce.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    origin: Origin,
    /// k.
    axis: usize,
    /// Whether w = −A_k.
    negative: bool,
}

impl Plane {
    /// The plane that the ray through a sample pierces.
    pub(crate) fn of(origin: Origin, sample: DVec3) -> Self {
        let direction = match origin {
            Origin::Point(_) => sample,
            Origin::Infinity(direction) => direction,
        };
        let axis = largest_axis(direction);
        Self { origin, axis, negative: direction[axis] < 0.0 }
    }

    /// The plane with a number, see [`Plane::face`].
    pub(crate) fn numbered(origin: Origin, face: usize) -> Self {
        Self { origin, axis: face / 2, negative: face % 2 == 1 }
    }

    /// The number of the plane among those of one origin.
    pub(crate) fn face(&self) -> u64 {
        2 * self.axis as u64 + u64::from(self.negative)
    }

    /// The axis k, pointing to where rays go, and the two that span the plane.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let ahead = DVec3::AXES[self.axis];
        let [right, up] = [1, 2].map(|k| DVec3::AXES[(self.axis + k) % 3]);
        [if self.negative { -ahead } else { ahead }, right, up]
    }

    /// w of a vector from the origin.
    pub(crate) fn ahead(&self, v: DVec3) -> f64 {
        if self.negative { -v[self.axis] } else { v[self.axis] }
    }

    /// Where a vector is seen: from the origin, or from zero for parallel rays. For a point as origin, w > 0.
    pub(crate) fn place(&self, v: DVec3) -> [Approx; 2] {
        let k = self.axis;
        [(k + 1) % 3, (k + 2) % 3].map(|i| match self.origin {
            Origin::Point(_) => {
                let value = v[i] / self.ahead(v);
                Approx { value, error: value.abs() * PLACE_SLACK }
            }
            Origin::Infinity(d) => {
                // |D_i/D_k| ≤ 1.
                let value = v[i] - v[k] * (d[i] / d[k]);
                Approx { value, error: (v[i].abs() + v[k].abs()) * PLACE_SLACK }
            }
        })
    }
}

/// The axis of the largest component.
fn largest_axis(v: DVec3) -> usize {
    let [x, y, z] = v.abs().to_array();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}

/// What a triangle may cover of a plane.
enum Cover {
    Nothing,
    /// [x lo, x hi, y lo, y hi].
    Rect([f64; 4]),
    Everything,
}

/// Where the rays of a cluster pierce one plane.
#[derive(Debug)]
pub(crate) struct Piercings {
    plane: Plane,
    count: usize,
    /// x and y of the rays, in blocks.
    places: [[[f64; LANES]; BLOCKS]; 2],
    /// [x lo, x hi, y lo, y hi] of the blocks.
    blocks: [[[f64; LANES]; BLOCKS / LANES]; 4],
    /// The same of all rays.
    whole: [f64; 4],
    /// How far a ray may lie from its place.
    slack: f64,
}

impl Piercings {
    /// The places of at most [`CLUSTER`] rays, of one plane.
    pub(crate) fn new(plane: Plane, samples: &[DVec3]) -> Self {
        let empty = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        let mut places = [[[0.0; LANES]; BLOCKS]; 2];
        let mut blocks = empty.map(|bound| [[bound; LANES]; BLOCKS / LANES]);
        let (mut whole, mut slack) = (empty, 0.0_f64);
        for (block, eight) in samples.chunks(LANES).enumerate() {
            let mut rect = empty;
            for (lane, &sample) in eight.iter().enumerate() {
                for (k, place) in plane.place(sample).into_iter().enumerate() {
                    places[k][block][lane] = place.value;
                    slack = slack.max(place.error);
                    rect[2 * k] = rect[2 * k].min(place.value);
                    rect[2 * k + 1] = rect[2 * k + 1].max(place.value);
                }
            }
            for (k, bound) in rect.into_iter().enumerate() {
                blocks[k][block / LANES][block % LANES] = bound;
                whole[k] = if k % 2 == 0 { whole[k].min(bound) } else { whole[k].max(bound) };
            }
        }
        Self { plane, count: samples.len(), places, blocks, whole, slack }
    }

    /// Intervals that hold x and y of all rays: each place is rounded, and so are these.
    pub(crate) fn extent(&self) -> [Interval; 2] {
        let [x_lo, x_hi, y_lo, y_hi] = self.whole;
        [(x_lo, x_hi), (y_lo, y_hi)].map(|(lo, hi)| Interval { lo: lo - self.slack, hi: hi + self.slack })
    }

    /// The rays, as bits, that may meet a triangle.
    pub(crate) fn may_meet(&self, level: Level, triangle: &Triangle) -> [u64; CLUSTER / 64] {
        match self.cover(triangle) {
            Cover::Nothing => [0; CLUSTER / 64],
            Cover::Everything => self.all(),
            Cover::Rect([x_lo, x_hi, y_lo, y_hi]) => {
                let [left, right, low, high] = self.whole;
                if x_lo > right || x_hi < left || y_lo > high || y_hi < low {
                    return [0; CLUSTER / 64];
                }
                dispatch!(level, simd => self.within(simd, [x_lo, x_hi, y_lo, y_hi]))
            }
        }
    }

    /// All rays, as bits.
    fn all(&self) -> [u64; CLUSTER / 64] {
        let mut all = [0; CLUSTER / 64];
        for (word, rays) in all.iter_mut().enumerate() {
            let here = self.count.saturating_sub(word * 64);
            *rays = if here < 64 { (1 << here) - 1 } else { u64::MAX };
        }
        all
    }

    /// What the triangle may cover.
    fn cover(&self, triangle: &Triangle) -> Cover {
        let mut corners = [triangle.a, triangle.b, triangle.c];
        if let Origin::Point(origin) = self.plane.origin {
            corners = corners.map(|corner| corner - origin);
            match corners.iter().filter(|&&corner| self.plane.ahead(corner) > 0.0).count() {
                0 => return Cover::Nothing,
                3 => {}
                _ => return Cover::Everything,
            }
        }
        let [a, b, c] = corners.map(|corner| self.plane.place(corner));
        let lo =
            |k: usize| (a[k].value - a[k].error).min(b[k].value - b[k].error).min(c[k].value - c[k].error);
        let hi =
            |k: usize| (a[k].value + a[k].error).max(b[k].value + b[k].error).max(c[k].value + c[k].error);
        Cover::Rect([lo(0) - self.slack, hi(0) + self.slack, lo(1) - self.slack, hi(1) + self.slack])
    }

    /// The rays, as bits, in a rectangle.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, [x_lo, x_hi, y_lo, y_hi]: [f64; 4]) -> [u64; CLUSTER / 64] {
        let splat = |x: f64| Lanes::simd_from(simd, x);
        let load = |lanes| Lanes::load_array_ref(simd, lanes);
        let mut met = [0; CLUSTER / 64];
        for (word, rays) in met.iter_mut().enumerate() {
            let [left, right, low, high] = [0, 1, 2, 3].map(|k: usize| load(&self.blocks[k][word]));
            let outside = left.simd_gt(splat(x_hi))
                | right.simd_lt(splat(x_lo))
                | low.simd_gt(splat(y_hi))
                | high.simd_lt(splat(y_lo));
            for block in bits(!outside.to_bitmask() & 0xFF) {
                let [x, y] = [0, 1].map(|k: usize| load(&self.places[k][word * LANES + block]));
                let outside = x.simd_gt(splat(x_hi))
                    | x.simd_lt(splat(x_lo))
                    | y.simd_gt(splat(y_hi))
                    | y.simd_lt(splat(y_lo));
                *rays |= (!outside.to_bitmask() & 0xFF) << (block * LANES);
            }
        }
        // The last block may have lanes without a ray.
        let (last, rest) = (self.count / 64, self.count % 64);
        if rest > 0 {
            met[last] &= (1 << rest) - 1;
        }
        met
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::predicates::covers_unfiltered;
    use crate::geometry::ray::Ray;
    use crate::simd::isa::Isa;

    /// Sets of 100 rays, and triangles that each set is tested with. An interpreter takes its time.
    const ROUNDS: [usize; 2] = if cfg!(miri) { [3, 4] } else { [200, 50] };

    /// Coordinates in [-2, 2]: mostly small integers, so that rays pass exactly through corners and edges.
    fn coordinate(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let random = (*state >> 33) as f64 / f64::from(1 << 30) - 1.0;
        let narrow = f64::from((random * 2.0) as f32);
        if *state >> 24 & 3 == 0 { narrow } else { narrow.round() }
    }

    #[test]
    fn keeps_every_ray_that_hits() {
        let level = Isa::Auto.level().expect("any machine will do");
        let mut state = 1;
        let mut point = || DVec3::from_array([(); 3].map(|()| coordinate(&mut state)));
        let (mut hits, mut dropped) = (0, 0);
        for round in 0..ROUNDS[0] {
            let direction = point() + DVec3::new(0.0, 0.0, 0.125);
            let origin = if round % 2 == 0 { Origin::Point(point()) } else { Origin::Infinity(direction) };
            let samples: Vec<DVec3> = (0..400).map(|_| point()).filter(|&s| s != DVec3::ZERO).collect();
            let plane = Plane::of(origin, samples[0]);
            let samples = samples.into_iter().filter(|&s| Plane::of(origin, s).face() == plane.face());
            let samples: Vec<DVec3> = samples.take(100).collect();
            let piercings = Piercings::new(plane, &samples);
            for _ in 0..ROUNDS[1] {
                let triangle = Triangle { a: point(), b: point(), c: point() };
                let met = piercings.may_meet(level, &triangle);
                for (k, &sample) in samples.iter().enumerate() {
                    let ray: Ray = origin.ray(sample);
                    let kept = met[k / 64] >> (k % 64) & 1 == 1;
                    let hit = covers_unfiltered(&ray, &triangle, origin.ties());
                    assert!(kept || !hit, "{ray:?} hits {triangle:?}");
                    hits += usize::from(hit);
                    dropped += usize::from(!kept);
                }
                assert!((samples.len()..CLUSTER).all(|k| met[k / 64] >> (k % 64) & 1 == 0), "no such ray");
            }
        }
        assert!(hits > 0 && dropped > hits, "{hits} {dropped}");
    }
}
