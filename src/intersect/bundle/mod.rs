//! Arbitrary rays, in bundles: rays and objects divided together, with one bound for many rays.
//!
//! ```text
//! for each chunk of consecutive rays, in parallel: order them by their origins
//! for each window of these:
//!     cut the rays to the scene; sort them by the octant of their direction
//!     for each octant: descend(rays, all objects)
//!
//! descend(rays, objects):
//!     keep the parts of the objects, eight, that the shaft of the rays may meet
//!     ask each ray which of these it may meet, and list it there
//!     for each part, near ones first: descend(its list, part); a group of eight triangles is a leaf
//! ```
//!
//! A window has thousands of rays, so that what is prepared for a part, boxes and triangles, serves many. A part is divided when
//! the first rays enter it, see [`crate::intersect::bundle::lazy_bvh`]. The lists of rays are indices on a stack. All rays of a list have one
//! octant: for them the planes of a box that come first are the same, and so is the order of the parts.
//!
//! Measured with 2 million diffuse-bounce rays: with the runs of [`crate::objects::runs`] a ray asked 47 nodes and was tested with 48 times eight
//! triangles (sponza), 16 and 16 (koala); with [`crate::intersect::bundle::lazy_bvh`] it is 12 and 3.7, 8 and 2.3. A ray goes on into 1.6 of a
//! part's eight. Lists are made eight rays at a time: their answers are a matrix of bits, transposed, and each row
//! compresses the eight numbers. Ray by ray that took 1.2 times the time of the whole, most of it for branches guessed wrong.
//! Pairs that the filter of a leaf lets pass wait until they are eight ([`crate::intersect::bundle::pairs`]): one by one, in f64, they took a third.
//!
//! A quarter of the time is waiting for memory: parts, triangles and rays are asked for ahead (0.91 of the time).
//!
//! Windows of 2¹² to 2¹⁴ rays take the same time; ones of 2¹⁶ a fifth more. Tried and dropped: windows of one octant, of rays from a larger
//! place, meet half as many parts and groups, but take longer (1.0 to 1.15): their rays are read from farther away. Asking ahead for the
//! vertices of pairs (1.03); rays of 32 bytes for boxes apart from those for triangles (1.0); parts in the order in which the rays of a list
//! enter them on average (1.0); two rays at a time in the leaf, in vectors of sixteen
//! lanes, with errors that a group's box bounds (0.99 on Zen 5, whose vectors are that wide). On SSE2 alone, without a byte shuffle to compress with, lists and pairs made eight at a time are
//! slower than one by one: 1.13 (sponza) to 1.25 times (koala) the whole.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1; Rasmus Barringer and Tomas Akenine-Möller, "Dynamic Ray Stream Traversal", 2014 (lists of rays per
//! node); Alexander Reshetov, Alexei Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (one bound for many rays).

pub(crate) mod cull_space;
pub(crate) mod lazy_bvh;
pub(crate) mod leaf;
pub(crate) mod order;
pub(crate) mod pairs;
pub(crate) mod recursion;
pub(crate) mod sah;
pub(crate) mod shaft;

use std::mem::size_of;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::exact::distance::{Distance, saturate};
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::cull_space::{CulledRay, CullingSpace, OCTANTS, octant};
use crate::intersect::bundle::lazy_bvh::CostDivided;
use crate::intersect::bundle::order::{CHUNK, RayOrder};
use crate::intersect::bundle::pairs::Pairs;
use crate::intersect::bundle::recursion::{Bundle, Found, Query};
use crate::intersect::bundle::shaft::Shaft;
use crate::intersect::grid::tiles::Row;
use crate::intersect::ray_set::{A_RAY, Nearest, Probes};
use crate::rays::hits::Hits;
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// The most rays of a window. Indices of a list must fit u16.
pub(crate) const WINDOW: usize = 1 << 13;
/// The fewest rays for which a thread is worth its while.
const FEWEST: usize = 1 << 10;

/// Triangles, ready for rays.
#[derive(Debug)]
pub(crate) struct Objects<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) divided: CostDivided<'a>,
    space: CullingSpace,
    pub(crate) level: Level,
    /// The most places that the lists of a window took.
    lists: AtomicUsize,
}

impl<'a> Objects<'a> {
    /// Begins to divide triangles. `None` where numbers are too large or too small for culling in f32.
    pub(crate) fn new(triangles: &'a Triangles<'a>, level: Level) -> Option<Self> {
        let space = CullingSpace::over(&triangles.position_bounds())?;
        let divided = CostDivided::new(triangles, space, level);
        Some(Self { triangles, divided, space, level, lists: AtomicUsize::new(0) })
    }

    /// Finds the nearest, or any, hit of each ray, and counts the pairs of each unless there is no room for that. `None` if a ray
    /// begins too far away for culling in f32.
    pub(crate) fn intersect(
        &self,
        probes: Probes<'_>,
        any: bool,
        (hits, pairs): (&mut Hits, &mut [u32]),
    ) -> Option<Stats> {
        let counts = !pairs.is_empty();
        let query = Query { objects: self, probes, any, counts };
        let threads = rayon::current_num_threads();
        let chunk = (probes.len() / (threads * 8)).clamp(FEWEST, CHUNK);
        let mut counted: Vec<&mut [u32]> = pairs.chunks_mut(chunk).collect();
        counted.resize_with(probes.len().div_ceil(chunk), Default::default);
        let chunks = hits.ids.par_chunks_mut(chunk).zip(hits.ts.par_chunks_mut(chunk));
        let chunks = chunks.zip(counted).enumerate();
        let of_chunk =
            |state: &mut (RayOrder, Workspace),
             (index, ((ids, ts), counted)): (usize, (Row<'_>, &mut [u32]))| {
                let (order, work) = state;
                // In range: there are fewer than 2³² rays.
                let first = (index * chunk) as u32;
                let rays = first..first + ids.len() as u32;
                let entries = dispatch!(self.level, simd => order.of(simd, &probes, rays, &self.space));
                let mut stats = Stats::default();
                for window in entries.chunks(WINDOW) {
                    let probes = window.iter().map(|entry| (entry.probe(first), entry.octant()));
                    stats = stats.plus(work.intersect(&query, probes)?);
                    stats = stats.plus(work.write(&query, |probe, id, t| {
                        let place = (probe - first) as usize;
                        (ids[place], ts[place]) = (id, t);
                    }));
                    work.tested().for_each(|(probe, pairs)| counted[(probe - first) as usize] = pairs);
                }
                Some(stats)
            };
        let stats = chunks.map_init(Default::default, of_chunk);
        let stats = stats.try_reduce(Stats::default, |one, other| Some(one.plus(other)))?;
        let window = chunk.min(WINDOW);
        let counted = if counts { window * size_of::<u32>() } else { 0 };
        let of_thread = self.workspace_bytes(window) + counted + RayOrder::bytes_for(chunk);
        let threads = threads.min(probes.len().div_ceil(chunk));
        Some(Stats { engine_bytes: (self.bytes() + threads * of_thread) as u64, ..stats })
    }

    /// Finds any hit of the rays of one window, at most [`WINDOW`], and tells those that hit something.
    pub(crate) fn any_of_window(
        &self,
        work: &mut Workspace,
        probes: Probes<'_>,
        mut hit: impl FnMut(u32),
    ) -> Option<Stats> {
        let query = Query { objects: self, probes, any: true, counts: false };
        // In range: a window is small.
        let rays = (0..probes.len() as u32).map(|probe| (probe, octant(probes.ray(probe).direction)));
        let stats = work.intersect(&query, rays)?;
        let rays = work.rays.iter().zip(&work.found);
        rays.filter(|(_, found)| found.nearest.is_hit()).for_each(|(ray, _)| hit(ray.probe));
        Some(stats)
    }

    /// Bytes of the objects.
    pub(crate) fn bytes(&self) -> usize {
        self.divided.bytes()
    }

    /// Bytes that a thread needed for windows of so many rays.
    pub(crate) fn workspace_bytes(&self, rays: usize) -> usize {
        let of_ray = size_of::<CulledRay>() + size_of::<Ray>() + size_of::<Found>() + size_of::<u32>();
        rays * of_ray + self.lists.load(Ordering::Relaxed) * size_of::<u16>()
    }
}

/// What a thread keeps of a window.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    rays: Vec<CulledRay>,
    /// The same rays as they were given.
    exact: Vec<Ray>,
    /// Probes by octant.
    sorted: [Vec<u32>; OCTANTS],
    /// Of each ray.
    found: Vec<Found>,
    /// Pairs of each ray, where they are counted.
    tested: Vec<u32>,
    /// Lists of rays, one behind the other.
    lists: Vec<u16>,
    stats: Stats,
}

impl Workspace {
    /// Finds the hits of a window of probes, each with the octant of its ray. `None` if a ray begins too far away.
    fn intersect(&mut self, query: &Query<'_>, probes: impl Iterator<Item = (u32, usize)>) -> Option<Stats> {
        self.stats = Stats::default();
        self.sorted.iter_mut().for_each(Vec::clear);
        probes.for_each(|(probe, octant)| self.sorted[octant].push(probe));
        let ends = dispatch!(query.objects.level, simd => self.cut(simd, query))?;
        self.tested.clear();
        self.tested.resize(if query.counts { self.rays.len() } else { 0 }, 0);
        let mut first = 0;
        for (octant, end) in ends.into_iter().enumerate() {
            if first < end {
                self.descend_octant(query, octant, first, end);
            }
            first = end;
        }
        query.objects.lists.fetch_max(self.lists.len(), Ordering::Relaxed);
        Some(self.stats)
    }

    /// Cuts the sorted rays to the scene. Returns where each octant ends.
    #[inline(always)]
    fn cut<S: Simd>(&mut self, simd: S, query: &Query<'_>) -> Option<[usize; OCTANTS]> {
        self.exact.clear();
        self.rays.clear();
        self.found.clear();
        let mut ends = [0; OCTANTS];
        for (sorted, end) in self.sorted.iter().zip(&mut ends) {
            for (number, probes) in sorted.chunks(LANES).enumerate() {
                let later = sorted.iter().skip((number + 2) * LANES).take(LANES);
                later.for_each(|&probe| query.probes.prefetch(probe));
                let mut eight = [probes[0]; LANES];
                eight[..probes.len()].copy_from_slice(probes);
                let mut space = [A_RAY; LANES];
                let eight = query.probes.eight(eight, &mut space);
                let cut = query.objects.space.cut(simd, &eight);
                if cut.far != 0 {
                    return None;
                }
                for lane in bits(cut.meeting & ((1 << probes.len()) - 1)) {
                    let (culled, parameter) = cut.get(lane, probes[lane]);
                    self.rays.push(culled);
                    self.exact.push(*eight[lane]);
                    self.found.push(Found { nearest: Nearest::none(eight[lane].t_max), parameter });
                }
            }
            *end = self.rays.len();
        }
        Some(ends)
    }

    /// All rays of an octant.
    fn descend_octant(&mut self, query: &Query<'_>, octant: usize, first: usize, end: usize) {
        let Self { rays, exact, found, tested, lists, stats, .. } = self;
        lists.resize(lists.len().max(end - first), 0);
        // In range: a window has at most 2¹³ rays.
        (0..).zip(&mut lists[..end - first]).for_each(|(ray, place)| *place = ray);
        let mut bundle = Bundle {
            query,
            octant,
            shaft: Shaft::around(&rays[first..end], octant),
            rays: &mut rays[first..end],
            exact: &exact[first..end],
            found: &mut found[first..end],
            tested: if query.counts { &mut tested[first..end] } else { &mut [] },
            lists,
            pairs: Pairs::default(),
            stats,
        };
        bundle.descend(query.objects.divided.all(), 0..end - first, end - first);
    }

    /// The pairs of each probe of a window, where they are counted. What does not meet the scene is left out.
    fn tested(&self) -> impl Iterator<Item = (u32, u32)> {
        self.rays.iter().map(|ray| ray.probe).zip(self.tested.iter().copied())
    }

    /// Tells the hits of a window: the probe, the triangle, and t, infinite unless the nearest was asked for. Counts what was rounded
    /// exactly.
    fn write(&self, query: &Query<'_>, mut hit: impl FnMut(u32, u32, f32)) -> Stats {
        let mut stats = Stats::default();
        for ((culled, ray), Found { nearest, .. }) in self.rays.iter().zip(&self.exact).zip(&self.found) {
            if !nearest.is_hit() {
                continue;
            }
            let (low, high) = (saturate(nearest.lo), saturate(nearest.hi));
            let t = if query.any {
                f32::INFINITY
            } else if low == high {
                low
            } else {
                Distance::new(ray, &query.objects.triangles.triangle(nearest.id)).rounded(&mut stats)
            };
            hit(culled.probe, nearest.id, t);
        }
        stats
    }
}
