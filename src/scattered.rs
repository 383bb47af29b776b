//! The leaf of scattered films: rays anywhere, kept in clusters along a space-filling curve.
//!
//! Directions from a point are sorted by cube face and, on the face, along Morton's curve; start points of parallel rays
//! along that curve in the plane across their direction. A cluster of consecutive rays is bounded by a cone (point) or a
//! frustum (infinity), and runs through the same recursion as a tile.
//!
//! Edge functions are evaluated per ray in space: e = d·n for a point, e = (p − a)·n at infinity; see [`crate::setup`] for n
//! and the depth key.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Chris Wyman, Rama Hoetzlein, Aaron Lefohn,
//! "Frustum-Traced Raster Shadows", 2015.

use std::mem::size_of;

use glam::DVec3;
use rayon::prelude::*;

use crate::approx::{Approx, Cross, Sign};
use crate::bounds::U;
use crate::depth::{Candidate, DepthBuffer};
use crate::frustum::{Frustum, Interval, Projection};
use crate::hits::NO_TRIANGLE;
use crate::pencil::Origin;
use crate::predicates::{covers, facing, orientation};
use crate::recursion::intersect_objects;
use crate::runs::Runs;
use crate::setup::precedes;
use crate::triangles::Triangle;
use crate::window::Window;
use crate::{Aabb, Accuracy, Cone, Stats, Triangles};

/// Rays per cluster.
const CLUSTER: usize = 256;

/// Finds the nearest, or any, hit of scattered rays. The window is one row.
pub(crate) fn intersect(
    triangles: &Triangles<'_>,
    runs: &Runs,
    origin: Origin,
    samples: &[DVec3],
    accuracy: Accuracy,
    any: bool,
    mut window: Window<'_>,
) -> Stats {
    let order = along_curve(origin, samples);
    let query = ScatteredQuery {
        triangles,
        origin,
        samples,
        accuracy,
        any,
    };
    let clusters: Vec<(Vec<u32>, Vec<f32>, Stats)> = order
        .par_chunks(CLUSTER)
        .map(|places| {
            let mut cluster = Cluster::new(query, places);
            let stats = intersect_objects(&mut cluster, runs);
            let (ids, ts) = cluster.hits();
            (ids, ts, stats)
        })
        .collect();
    let bytes =
        order.capacity() * size_of::<u32>() + samples.len() * (size_of::<u32>() + size_of::<f32>());
    let mut stats = Stats {
        engine_bytes: bytes as u64,
        ..Stats::default()
    };
    let Some((all_ids, all_ts)) = window.rows.first_mut() else {
        return stats;
    };
    for (places, (ids, ts, cluster)) in order.chunks(CLUSTER).zip(clusters) {
        stats = stats.add(cluster);
        for (&place, (id, t)) in places.iter().zip(ids.into_iter().zip(ts)) {
            all_ids[place as usize] = id;
            all_ts[place as usize] = t;
        }
    }
    stats
}

/// The rays in the order of a curve.
fn along_curve(origin: Origin, samples: &[DVec3]) -> Vec<u32> {
    let (lo, hi) = samples
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &s| {
            (lo.min(s), hi.max(s))
        });
    let code = |place: u32| {
        let s = samples[place as usize];
        match origin {
            Origin::Point(_) => {
                let face = largest_axis(s);
                let size = s[face].abs();
                let unit = |k: usize| s[(face + k) % 3] / size * 0.5 + 0.5;
                let side = u64::from(s[face] < 0.0);
                (2 * face as u64 + side) << 32 | interleave(unit(1), unit(2))
            }
            Origin::Infinity(direction) => {
                // The axis nearest to the direction is left out: the other two span a plane across it.
                let axis = largest_axis(direction);
                let extent = (hi - lo).max_element();
                let unit = |k: usize| (s[(axis + k) % 3] - lo[(axis + k) % 3]) / extent;
                interleave(unit(1), unit(2))
            }
        }
    };
    // In range: a pencil has fewer than 2³² rays.
    let mut order: Vec<u32> = (0..samples.len() as u32).collect();
    order.par_sort_by_cached_key(|place| (code(*place), *place));
    order
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

/// The Morton code of two numbers in [0, 1], 16 bits each.
fn interleave(x: f64, y: f64) -> u64 {
    let spread = |x: f64| {
        // The cast saturates; NaN becomes 0.
        let bits = u64::from((x * 65535.0) as u16);
        (0..16).fold(0, |code, k| code | (bits >> k & 1) << (2 * k))
    };
    spread(x) << 1 | spread(y)
}

/// What all clusters of one film share.
#[derive(Debug, Clone, Copy)]
struct ScatteredQuery<'a> {
    triangles: &'a Triangles<'a>,
    origin: Origin,
    samples: &'a [DVec3],
    accuracy: Accuracy,
    any: bool,
}

/// What stands for all rays of a cluster.
#[derive(Debug)]
enum Bound {
    Cone(Cone),
    Frustum(Frustum),
    /// Rays that nothing bounds.
    Everything,
}

/// Rays of a scattered film that are near each other, with what they have hit so far.
#[derive(Debug)]
pub(crate) struct Cluster<'a> {
    query: ScatteredQuery<'a>,
    places: &'a [u32],
    bound: Bound,
    pub(crate) depth: DepthBuffer,
}

impl<'a> Cluster<'a> {
    fn new(query: ScatteredQuery<'a>, places: &'a [u32]) -> Self {
        let samples: Vec<DVec3> = places
            .iter()
            .map(|&place| query.samples[place as usize])
            .collect();
        let bound = match query.origin {
            Origin::Point(apex) => Bound::Cone(Cone::around(apex, &samples)),
            Origin::Infinity(direction) => {
                beam(direction, &samples).map_or(Bound::Everything, Bound::Frustum)
            }
        };
        Self {
            query,
            places,
            bound,
            depth: DepthBuffer::new(places.len()),
        }
    }

    /// The common origin.
    pub(crate) fn origin(&self) -> Origin {
        self.query.origin
    }

    /// A lower bound of t within a box, or `None` when no ray meets it.
    pub(crate) fn enter(&self, bounds: &Aabb, stats: &mut Stats) -> Option<f64> {
        match &self.bound {
            Bound::Cone(cone) => {
                stats.cone_tests += 1;
                cone.enter(bounds)
            }
            Bound::Frustum(frustum) => {
                stats.frustum_tests += 1;
                frustum.enter(bounds)
            }
            Bound::Everything => Some(0.0),
        }
    }

    /// Tests one triangle against all rays of the cluster.
    pub(crate) fn intersect(&mut self, id: u32, stats: &mut Stats) {
        let ScatteredQuery {
            triangles,
            origin,
            samples,
            accuracy,
            any,
        } = self.query;
        let triangle = triangles.triangle(id);
        stats.triangles_set_up += 1;
        let Some(setup) = SpaceSetup::new(origin, &triangle) else {
            return;
        };
        for (index, &place) in self.places.iter().enumerate() {
            let sample = samples[place as usize];
            stats.samples_tested += 1;
            let inside = match accuracy {
                Accuracy::Exact => setup.inside(sample),
                Accuracy::Fast => setup.inside_rounded(sample).then_some(true),
            };
            let certain = match inside {
                Some(certain) => certain,
                None => continue,
            };
            let key = setup.key(sample);
            let candidate = Candidate {
                id,
                key: key.value,
                error: key.error,
            };
            if self.depth.is_behind(index, &candidate) {
                continue;
            }
            let ray = || origin.ray(sample);
            // A start point at or beyond the plane: t ≤ 0.
            let ahead = match origin {
                Origin::Point(_) => Some(true),
                Origin::Infinity(_) if key.value > key.error => Some(false),
                Origin::Infinity(_) => {
                    (key.value < -key.error || accuracy == Accuracy::Fast).then_some(true)
                }
            };
            let hit = match (certain, ahead) {
                (_, Some(false)) => false,
                (true, Some(true)) => true,
                _ => covers(
                    &ray(),
                    &triangle,
                    origin.ties(),
                    &mut stats.ambiguous_coverage,
                ),
            };
            if !hit {
                continue;
            }
            if any {
                self.depth.settle(index, id);
            } else {
                let exact: Option<&dyn Fn() -> crate::Ray> =
                    (accuracy == Accuracy::Exact).then_some(&ray as _);
                self.depth.offer(
                    index,
                    candidate,
                    triangles,
                    exact,
                    &mut stats.ambiguous_order,
                );
            }
        }
    }

    /// Ids and distances in the order of the cluster.
    fn hits(&self) -> (Vec<u32>, Vec<f32>) {
        let ScatteredQuery {
            triangles,
            origin,
            samples,
            ..
        } = self.query;
        let (mut ids, mut ts) = (
            vec![NO_TRIANGLE; self.places.len()],
            vec![f32::INFINITY; self.places.len()],
        );
        let ray = |k: usize| origin.ray(samples[self.places[k] as usize]);
        self.depth
            .write(0, &mut (&mut ids, &mut ts), origin, triangles, ray);
        (ids, ts)
    }
}

/// The frustum around parallel rays, or `None` where rounding leaves no certain one.
fn beam(direction: DVec3, starts: &[DVec3]) -> Option<Frustum> {
    let axis = largest_axis(direction);
    let [right, up] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
    let projection = Projection::new(Origin::Infinity(direction), [starts[0], right, up])?;
    let empty = Interval {
        lo: f64::INFINITY,
        hi: f64::NEG_INFINITY,
    };
    let (mut x, mut y, mut t) = (empty, empty, empty);
    for &start in starts {
        let [at_x, at_y] = projection.project(start)?;
        let depth = projection.depth(start);
        let at_t = Interval {
            lo: depth.value - depth.error,
            hi: depth.value + depth.error,
        };
        for (range, at) in [(&mut x, at_x), (&mut y, at_y), (&mut t, at_t)] {
            // One rounding each way pays for the sums.
            range.lo = range.lo.min(at.lo - at.lo.abs() * U);
            range.hi = range.hi.max(at.hi + at.hi.abs() * U);
        }
    }
    Some(Frustum::new(&projection, x, y, t))
}

/// A triangle as the rays of a pencil see it, in space.
#[derive(Debug)]
struct SpaceSetup {
    at_infinity: bool,
    /// Edge normals, and the points that parallel rays are measured from.
    edges: [(Cross, DVec3); 3],
    /// The sign that makes "inside" positive, edge by edge.
    flipped: [bool; 3],
    normal: Cross,
    /// A corner.
    corner: DVec3,
    /// A·N or D·N.
    denominator: Approx,
}

impl SpaceSetup {
    /// `None` when no ray of the pencil can hit the triangle.
    fn new(origin: Origin, triangle: &Triangle) -> Option<Self> {
        let normal = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
        let Triangle { a, b, c } = *triangle;
        let (denominator, side) = match origin {
            Origin::Point(o) => {
                let volume = normal.dot(a - o);
                (
                    volume,
                    volume.sign().unwrap_or_else(|| orientation(a, b, c, o)),
                )
            }
            Origin::Infinity(d) => {
                let slope = normal.dot(d);
                (
                    slope,
                    slope
                        .sign()
                        .unwrap_or_else(|| facing(&origin.ray(DVec3::ZERO), triangle)),
                )
            }
        };
        if side == Sign::Zero {
            return None;
        }
        let mut flipped = [false; 3];
        let mut corner = 0;
        let edges = triangle.edges().map(|(a, b)| {
            let (a, b, swapped) = if precedes(a, b) {
                (a, b, false)
            } else {
                (b, a, true)
            };
            flipped[corner] = swapped != (side == Sign::Negative);
            corner += 1;
            match origin {
                Origin::Point(o) => (Cross::of(a - o, b - a), DVec3::ZERO),
                Origin::Infinity(d) => (Cross::of(d, b - a), a),
            }
        });
        let at_infinity = matches!(origin, Origin::Infinity(_));
        Some(Self {
            at_infinity,
            edges,
            flipped,
            normal,
            corner: a,
            denominator,
        })
    }

    /// The edge functions, positive inside.
    fn edge_values(&self, sample: DVec3) -> [Approx; 3] {
        [0, 1, 2].map(|k| {
            let (n, base) = &self.edges[k];
            let e = n.dot(if self.at_infinity {
                sample - *base
            } else {
                sample
            });
            Approx {
                value: if self.flipped[k] { -e.value } else { e.value },
                ..e
            }
        })
    }

    /// `None` outside for certain, `Some(true)` inside for certain, `Some(false)` in doubt.
    fn inside(&self, sample: DVec3) -> Option<bool> {
        let signs = self.edge_values(sample).map(Approx::sign);
        if signs.contains(&Some(Sign::Negative)) {
            return None;
        }
        Some(signs.iter().all(Option::is_some))
    }

    /// The rounded decision; an edge function of zero belongs to one side of the edge.
    fn inside_rounded(&self, sample: DVec3) -> bool {
        let values = self.edge_values(sample);
        (0..3).all(|k| values[k].value > 0.0 || (values[k].value == 0.0 && !self.flipped[k]))
    }

    /// 1/t or −t.
    fn key(&self, sample: DVec3) -> Approx {
        let slope = self.normal.dot(if self.at_infinity {
            sample - self.corner
        } else {
            sample
        });
        slope.over(self.denominator)
    }
}
