//! The leaf of scattered films: rays anywhere, kept in clusters along a space-filling curve.
//!
//! Directions from a point are sorted by cube face and, on the face, along Morton's curve; start points of parallel
//! rays along that curve in the plane across their direction. A cluster of consecutive rays on one face is bounded by a
//! frustum, and runs through the same recursion as a tile. With a cone around directions instead, 1.6 times as many
//! nodes are visited and a query takes 1.3 to 1.7 times as long, since a cone meets the ball around a box.
//!
//! Edge functions are evaluated in space, see [`crate::intersect::scattered::space_setup`], for the rays that
//! [`crate::intersect::irregular::projection`] leaves.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Chris Wyman, Rama Hoetzlein, Aaron Lefohn,
//! "Frustum-Traced Raster Shadows", 2015.

pub(crate) mod depth;
pub(crate) mod piercings;
pub(crate) mod space_setup;

use std::mem::size_of;

use fearless_simd::dispatch;
use glam::DVec3;
use rayon::prelude::*;

use crate::exact::predicates::covers;
use crate::geometry::aabb::{Aabb, U};
use crate::intersect::context::Context;
use crate::intersect::pencil::leaf::greatest_key;
use crate::intersect::pencil::{SubPencil, intersect_objects};
use crate::intersect::scattered::depth::{Candidate, DepthBuffer};
use crate::intersect::scattered::piercings::{CLUSTER, Piercings};
use crate::intersect::scattered::space_setup::SpaceSetup;
use crate::objects::boxes::Boxes;
use crate::objects::runs::Runs;
use crate::options::Accuracy;
use crate::rays::frustum::{Frustum, Interval, Projection};
use crate::rays::hits::{Hits, Row};
use crate::rays::origin::Origin;
use crate::rays::projection::Plane;
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// Finds the nearest, or any, hit of scattered rays, and counts the pairs of each if it is asked.
pub(crate) fn intersect(
    query: ScatteredQuery<'_>,
    runs: &Runs,
    ((all_ids, all_ts), pairs): (&mut Row<'_>, &mut [u32]),
) -> Stats {
    let ScatteredQuery { origin, samples, .. } = query;
    let order = along_curve(origin, samples);
    // A cluster sees one plane.
    let face = |place: &u32| Plane::of(origin, samples[*place as usize]).face();
    let clusters: Vec<&[u32]> =
        order.chunk_by(|one, other| face(one) == face(other)).flat_map(|face| face.chunks(CLUSTER)).collect();
    let found: Vec<(Hits, Vec<u32>, Stats)> = clusters
        .par_iter()
        .map(|places| {
            let mut cluster = Cluster::new(query, places);
            let stats = intersect_objects(&mut cluster, runs);
            (cluster.hits(), cluster.tested, stats)
        })
        .collect();
    let of_ray = size_of::<u32>() + size_of::<f32>() + if query.counts { size_of::<u32>() } else { 0 };
    let bytes = order.capacity() * size_of::<u32>() + samples.len() * of_ray;
    let mut stats = Stats { engine_bytes: bytes as u64, ..Stats::default() };
    for (places, (hits, tested, cluster)) in clusters.into_iter().zip(found) {
        stats = stats.plus(cluster);
        for (&place, (id, t)) in places.iter().zip(hits.ids.into_iter().zip(hits.ts)) {
            all_ids[place as usize] = id;
            all_ts[place as usize] = t;
        }
        for (&place, tested) in places.iter().zip(tested) {
            pairs[place as usize] = tested;
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
                let plane = Plane::of(origin, s);
                let [x, y] = plane.place(s).map(|place| place.value * 0.5 + 0.5);
                plane.face() << 32 | interleave(x, y)
            }
            Origin::Infinity(_) => {
                // The axis nearest to the direction is left out: the other two span a plane across it.
                let [_, right, up] = Plane::of(origin, s).axes();
                let extent = (hi - lo).max_element();
                let unit = |axis: DVec3| (s - lo).dot(axis) / extent;
                interleave(unit(right), unit(up))
            }
        }
    };
    // In range: a pencil has fewer than 2³² rays.
    let mut order: Vec<u32> = (0..samples.len() as u32).collect();
    order.par_sort_by_cached_key(|place| (code(*place), *place));
    order
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
    pub(crate) context: Context<'a>,
    pub(crate) origin: Origin,
    pub(crate) samples: &'a [DVec3],
    /// Whether any hit will do.
    pub(crate) any: bool,
    /// The box of all triangles.
    pub(crate) bounds: Aabb,
    /// Whether the pairs of each ray are counted.
    pub(crate) counts: bool,
}

/// What stands for all rays of a cluster.
#[derive(Debug)]
struct Bound {
    frustum: Frustum,
    /// Of all boxes, see [`Frustum::limits`].
    limits: [f64; 6],
    /// The most that the frustum's t grows by along a ray while its own grows by 1.
    speed: f64,
}

/// Rays of a scattered film that are near each other, with what they have hit so far.
#[derive(Debug)]
pub(crate) struct Cluster<'a> {
    query: ScatteredQuery<'a>,
    places: &'a [u32],
    /// `None` where rounding leaves no certain one.
    bound: Option<Bound>,
    piercings: Piercings,
    pub(crate) depth: DepthBuffer,
    /// Pairs of each ray; empty where nobody counts them.
    tested: Vec<u32>,
}

impl<'a> Cluster<'a> {
    fn new(query: ScatteredQuery<'a>, places: &'a [u32]) -> Self {
        let samples: Vec<DVec3> = places.iter().map(|&place| query.samples[place as usize]).collect();
        let plane = Plane::of(query.origin, samples[0]);
        let piercings = Piercings::new(plane, &samples);
        let bound = match query.origin {
            Origin::Point(_) => pyramid(query.origin, plane, &piercings, &samples),
            Origin::Infinity(direction) => beam(direction, &samples),
        };
        let bound =
            bound.map(|(frustum, speed)| Bound { limits: frustum.limits(&query.bounds), frustum, speed });
        let tested = vec![0; if query.counts { places.len() } else { 0 }];
        Self { query, places, bound, piercings, depth: DepthBuffer::new(places.len()), tested }
    }

    /// The boxes, as bits, that some ray may meet, and a lower bound of t within each.
    pub(crate) fn entered(&self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]) {
        stats.frustum_tests += LANES as u64;
        let (met, ts) = if let Some(Bound { frustum, limits, speed }) = &self.bound {
            let (met, ts) =
                dispatch!(self.query.context.level, simd => frustum.enter_lanes(simd, boxes, limits));
            // A quotient: one rounding.
            (met, ts.map(|t| t / speed - (t / speed).abs() * (2.0 * U)))
        } else {
            let met = (0..LANES).filter(|&lane| !boxes.get(lane).is_empty());
            (met.fold(0, |met, lane| met | 1 << lane), [0.0; LANES])
        };
        stats.culled_by_bound += LANES as u64 - u64::from(met.count_ones());
        (met, ts)
    }

    /// Tests one triangle against the rays that may meet it.
    pub(crate) fn intersect(&mut self, id: u32, stats: &mut Stats) {
        let ScatteredQuery { context: Context { triangles, level, .. }, origin, .. } = self.query;
        let triangle = triangles.triangle(id);
        let met = self.piercings.may_meet(level, &triangle);
        if met.iter().all(|&rays| rays == 0) {
            return;
        }
        stats.triangles_set_up += 1;
        let Some(setup) = SpaceSetup::new(origin, &triangle) else {
            return;
        };
        if self.query.counts {
            self.count(&met);
        }
        for (word, rays) in met.into_iter().enumerate() {
            for ray in bits(rays) {
                self.test(word * 64 + ray, id, &setup, stats);
            }
        }
    }

    /// Counts a pair of each ray, as bits, with a triangle.
    #[cold]
    fn count(&mut self, met: &[u64]) {
        for (word, &rays) in met.iter().enumerate() {
            for ray in bits(rays) {
                let tested = &mut self.tested[word * 64 + ray];
                *tested = tested.saturating_add(1);
            }
        }
    }

    /// Tests one ray against one triangle.
    fn test(&mut self, index: usize, id: u32, setup: &SpaceSetup, stats: &mut Stats) {
        let ScatteredQuery { context: Context { triangles, accuracy, .. }, origin, samples, any, .. } =
            self.query;
        let sample = samples[self.places[index] as usize];
        stats.samples_tested += 1;
        let inside = match accuracy {
            Accuracy::Exact => setup.inside(sample),
            Accuracy::Fast => setup.inside_rounded(sample).then_some(true),
        };
        let Some(certain) = inside else { return };
        let key = setup.key(sample);
        // Both sums round once; the error of a quotient has room for that.
        let candidate = Candidate { id, lo: key.value - key.error, hi: key.value + key.error };
        if self.depth.is_behind(index, &candidate) {
            return;
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
            _ => covers(&ray(), &setup.triangle, origin.ties(), &mut stats.ambiguous_coverage),
        };
        if !hit {
            return;
        }
        if any {
            self.depth.settle(index, id);
        } else {
            let exact: Option<&dyn Fn() -> crate::geometry::ray::Ray> =
                (accuracy == Accuracy::Exact).then_some(&ray as _);
            self.depth.offer(index, candidate, triangles, exact, &mut stats.ambiguous_order);
        }
    }

    /// The hits in the order of the cluster.
    fn hits(&self) -> Hits {
        let ScatteredQuery { context: Context { triangles, level, .. }, origin, samples, .. } = self.query;
        let Hits { mut ids, mut ts } = Hits::missed(self.places.len());
        let ray = |k: usize| origin.ray(samples[self.places[k] as usize]);
        for (eight, row) in ids.chunks_mut(LANES).zip(ts.chunks_mut(LANES)).enumerate() {
            let (mut row, first) = (row, eight * LANES);
            dispatch!(level, simd => {
                self.depth.write(simd, first, &mut row, origin, triangles, |k| ray(first + k))
            });
        }
        Hits { ids, ts }
    }
}

impl SubPencil for Cluster<'_> {
    fn enter(&mut self, boxes: &Boxes, stats: &mut Stats) -> (u64, [f64; LANES]) {
        self.depth.refresh();
        self.entered(boxes, stats)
    }

    fn hides(&self, t: f64) -> bool {
        self.depth.hides(greatest_key(self.query.origin, t))
    }

    fn directly_intersect(&mut self, runs: &Runs, run: usize, _: &Aabb, stats: &mut Stats) {
        let (ids, count) = runs.ids(run);
        ids[..count].iter().for_each(|&id| self.intersect(id, stats));
    }

    fn finish(&mut self, _: &mut Stats) {}
}

/// The frustum around rays from a point through one face of a cube.
fn pyramid(
    origin: Origin,
    plane: Plane,
    piercings: &Piercings,
    directions: &[DVec3],
) -> Option<(Frustum, f64)> {
    let projection = Projection::new(origin, plane.axes())?;
    let [x, y] = piercings.extent();
    let frustum = Frustum::new(&projection, x, y, Interval { lo: 0.0, hi: 0.0 });
    let speed = directions.iter().map(|&d| plane.ahead(d)).fold(0.0, f64::max);
    Some((frustum, speed))
}

/// The frustum around parallel rays, or `None` where rounding leaves no certain one.
fn beam(direction: DVec3, starts: &[DVec3]) -> Option<(Frustum, f64)> {
    let [_, right, up] = Plane::of(Origin::Infinity(direction), starts[0]).axes();
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
    Some((Frustum::new(&projection, x, y, t), 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangles::Triangles;
    use crate::options::{Options, Path};
    use crate::query::closest_hit;
    use crate::rays::film::{Film, GridFilm};
    use crate::rays::pencil::Pencil;
    use crate::simd::isa::Isa;

    /// A tent and a floor, small enough for an interpreter of the compiler's own code.
    #[test]
    fn films_agree_with_single_rays() {
        let positions = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0]];
        let indices = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 2]];
        let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
        let grid = GridFilm::new(3, 3, DVec3::Z, DVec3::X * 0.25, DVec3::Y * 0.25).expect("a valid film");
        let samples = positions.map(|p| DVec3::from_array(p.map(f64::from)));
        for origin in [Origin::Point(DVec3::ZERO), Origin::Infinity(DVec3::Z)] {
            let films = vec![Film::Grid(grid), Film::Scattered(samples.to_vec())];
            let pencil = Pencil::new(origin, films).expect("rays in range");
            for isa in [Isa::Auto, Isa::Sse2, Isa::Sse42, Isa::Avx2] {
                let ask =
                    |path| closest_hit(&triangles, &pencil, &Options { path, isa, ..Options::default() });
                if isa.level().is_ok() {
                    let [(films, _), (single, _)] =
                        [Path::Pencil, Path::General].map(|p| ask(p).expect("in range"));
                    assert_eq!((films.ids(), films.ts()), (single.ids(), single.ts()));
                    assert!((0..films.len()).any(|ray| films.get(ray).is_some()));
                }
            }
        }
    }
}
