//! The leaf of scattered films: rays anywhere, kept in clusters along a space-filling curve.
//!
//! Directions from a point are sorted by cube face and, on the face, along Morton's curve; start points of parallel rays
//! along that curve in the plane across their direction. A cluster of consecutive rays is bounded by a cone (point) or a
//! frustum (infinity), and runs through the same recursion as a tile.
//!
//! Edge functions are evaluated per ray in space, see [`crate::space_setup`].
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Chris Wyman, Rama Hoetzlein, Aaron Lefohn,
//! "Frustum-Traced Raster Shadows", 2015.

use std::mem::size_of;

use fearless_simd::{Level, dispatch};
use glam::DVec3;
use rayon::prelude::*;

use crate::bounds::U;
use crate::depth::{Candidate, DepthBuffer};
use crate::frustum::{Frustum, Interval, Projection};
use crate::hits::NO_TRIANGLE;
use crate::lanes::{Boxes, LANES};
use crate::pencil::Origin;
use crate::predicates::covers;
use crate::recursion::intersect_objects;
use crate::runs::Runs;
use crate::space_setup::SpaceSetup;
use crate::window::Window;
use crate::{Accuracy, Cone, Stats, Triangles};

/// Rays per cluster.
const CLUSTER: usize = 256;

/// Finds the nearest, or any, hit of scattered rays. The window is one row.
pub(crate) fn intersect(query: ScatteredQuery<'_>, runs: &Runs, mut window: Window<'_>) -> Stats {
    let ScatteredQuery { origin, samples, .. } = query;
    let order = along_curve(origin, samples);
    let clusters: Vec<(Vec<u32>, Vec<f32>, Stats)> = order
        .par_chunks(CLUSTER)
        .map(|places| {
            let mut cluster = Cluster::new(query, places);
            let stats = intersect_objects(&mut cluster, runs);
            let (ids, ts) = cluster.hits();
            (ids, ts, stats)
        })
        .collect();
    let bytes = order.capacity() * size_of::<u32>() + samples.len() * (size_of::<u32>() + size_of::<f32>());
    let mut stats = Stats { engine_bytes: bytes as u64, ..Stats::default() };
    let Some((all_ids, all_ts)) = window.rows.first_mut() else {
        return stats;
    };
    for (places, (ids, ts, cluster)) in order.chunks(CLUSTER).zip(clusters) {
        stats = stats.plus(cluster);
        for (&place, (id, t)) in places.iter().zip(ids.into_iter().zip(ts)) {
            all_ids[place as usize] = id;
            all_ts[place as usize] = t;
        }
    }
    stats
}

/// The rays in the order of a curve.
fn along_curve(origin: Origin, samples: &[DVec3]) -> Vec<u32> {
    let (lo, hi) =
        samples.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &s| (lo.min(s), hi.max(s)));
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
pub(crate) struct ScatteredQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) origin: Origin,
    pub(crate) samples: &'a [DVec3],
    pub(crate) accuracy: Accuracy,
    pub(crate) level: Level,
    /// Whether any hit will do.
    pub(crate) any: bool,
}

/// What stands for all rays of a cluster.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one per cluster of 256 rays, on the stack")]
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
        let samples: Vec<DVec3> = places.iter().map(|&place| query.samples[place as usize]).collect();
        let bound = match query.origin {
            Origin::Point(apex) => Bound::Cone(Cone::around(apex, &samples)),
            Origin::Infinity(direction) => {
                beam(direction, &samples).map_or(Bound::Everything, Bound::Frustum)
            }
        };
        Self { query, places, bound, depth: DepthBuffer::new(places.len()) }
    }

    /// The common origin.
    pub(crate) fn origin(&self) -> Origin {
        self.query.origin
    }

    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each.
    pub(crate) fn entered(&self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]) {
        let (mut met, mut ts) = (0, [0.0; LANES]);
        for (lane, t) in ts.iter_mut().enumerate() {
            let bounds = boxes.get(lane);
            if bounds.is_empty() {
                continue;
            }
            let entered = match &self.bound {
                Bound::Cone(cone) => {
                    stats.cone_tests += 1;
                    cone.enter(&bounds)
                }
                Bound::Frustum(frustum) => {
                    stats.frustum_tests += 1;
                    frustum.enter(&bounds)
                }
                Bound::Everything => Some(0.0),
            };
            match entered {
                Some(least) => (*t, met) = (least, met | 1 << lane),
                None => stats.culled_by_bound += 1,
            }
        }
        (met, ts)
    }

    /// Tests one triangle against all rays of the cluster.
    pub(crate) fn intersect(&mut self, id: u32, stats: &mut Stats) {
        let ScatteredQuery { triangles, origin, samples, accuracy, any, .. } = self.query;
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
            // Both sums round once; the error of a quotient has room for that.
            let candidate = Candidate { id, lo: key.value - key.error, hi: key.value + key.error };
            if self.depth.is_behind(index, &candidate) {
                continue;
            }
            let ray = || origin.ray(sample);
            // A start point at or beyond the plane: t ≤ 0.
            let ahead = match origin {
                Origin::Point(_) => Some(true),
                Origin::Infinity(_) if candidate.lo > 0.0 => Some(false),
                Origin::Infinity(_) => (candidate.hi < 0.0 || accuracy == Accuracy::Fast).then_some(true),
            };
            let hit = match (certain, ahead) {
                (_, Some(false)) => false,
                (true, Some(true)) => true,
                _ => covers(&ray(), &triangle, origin.ties(), &mut stats.ambiguous_coverage),
            };
            if !hit {
                continue;
            }
            if any {
                self.depth.settle(index, id);
            } else {
                let exact: Option<&dyn Fn() -> crate::Ray> =
                    (accuracy == Accuracy::Exact).then_some(&ray as _);
                self.depth.offer(index, candidate, triangles, exact, &mut stats.ambiguous_order);
            }
        }
    }

    /// Ids and distances in the order of the cluster.
    fn hits(&self) -> (Vec<u32>, Vec<f32>) {
        let ScatteredQuery { triangles, origin, samples, level, .. } = self.query;
        let (mut ids, mut ts) =
            (vec![NO_TRIANGLE; self.places.len()], vec![f32::INFINITY; self.places.len()]);
        let ray = |k: usize| origin.ray(samples[self.places[k] as usize]);
        for (eight, row) in ids.chunks_mut(LANES).zip(ts.chunks_mut(LANES)).enumerate() {
            let (mut row, first) = (row, eight * LANES);
            dispatch!(level, simd => {
                self.depth.write(simd, first, &mut row, origin, triangles, |k| ray(first + k))
            });
        }
        (ids, ts)
    }
}

/// The frustum around parallel rays, or `None` where rounding leaves no certain one.
fn beam(direction: DVec3, starts: &[DVec3]) -> Option<Frustum> {
    let axis = largest_axis(direction);
    let [right, up] = [DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]];
    let projection = Projection::new(Origin::Infinity(direction), [starts[0], right, up])?;
    let empty = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    let (mut x, mut y, mut t) = (empty, empty, empty);
    for &start in starts {
        let [at_x, at_y] = projection.project(start)?;
        let depth = projection.depth(start);
        let at_t = Interval { lo: depth.value - depth.error, hi: depth.value + depth.error };
        for (range, at) in [(&mut x, at_x), (&mut y, at_y), (&mut t, at_t)] {
            // One rounding each way pays for the sums.
            range.lo = range.lo.min(at.lo - at.lo.abs() * U);
            range.hi = range.hi.max(at.hi + at.hi.abs() * U);
        }
    }
    Some(Frustum::new(&projection, x, y, t))
}
