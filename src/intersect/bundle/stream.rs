//! Streams of rays: all rays of a query are ordered in chunks, and taken from there stream by stream, each sorted by
//! octant.
//!
//! What is then done with the rays of one octant is in [`crate::intersect::bundle`].
//!
//! Based on: Rasmus Barringer and Tomas Akenine-Möller, "Dynamic Ray Stream Traversal", 2014.

use std::mem::size_of;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::exact::distance::{Distance, saturate};
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::cull_space::{CulledRay, CullingSpace, OCTANTS, octant};
use crate::intersect::bundle::lazy_bvh::LazyBvh;
use crate::intersect::bundle::order::{CHUNK, RayOrder};
use crate::intersect::bundle::pairs::Pairs;
use crate::intersect::bundle::shaft::Shaft;
use crate::intersect::bundle::{Bundle, Found, Query};
use crate::intersect::general;
use crate::intersect::ray_set::{A_RAY, Nearest, Question, RaySet};
use crate::options::Partition;
use crate::rays::hits::{Hits, Row};
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// The most rays of a stream. Indices of a list must fit u16.
pub(crate) const STREAM: usize = 1 << 13;
/// The fewest rays for which a thread is worth its while.
const FEWEST: usize = 1 << 10;

/// Finds hits where all of them are misses yet, and counts the pairs of each ray unless there is no room for that. Ray
/// by ray where numbers are too large or too small for bundles.
pub(crate) fn intersect(
    question: Question<'_>,
    level: Level,
    ((ids, ts), pairs): (Row<'_>, &mut [u32]),
) -> Stats {
    let Question { triangles, set, any } = question;
    let objects = Objects::new(triangles, level);
    let found = objects.and_then(|objects| objects.intersect(set, any, ((ids, ts), pairs)));
    found.unwrap_or_else(|| {
        let mut hits = Hits::missed(set.len());
        let stats = general::intersect_by(Partition::default(), question, (&mut hits, pairs));
        ids.copy_from_slice(&hits.ids);
        ts.copy_from_slice(&hits.ts);
        stats
    })
}

/// Triangles, ready for rays.
#[derive(Debug)]
pub(crate) struct Objects<'a> {
    triangles: &'a Triangles<'a>,
    divided: LazyBvh<'a>,
    space: CullingSpace,
    level: Level,
    /// The most places that the lists of a stream took.
    lists: AtomicUsize,
}

impl<'a> Objects<'a> {
    /// Begins to divide triangles. `None` where numbers are too large or too small for culling in f32.
    pub(crate) fn new(triangles: &'a Triangles<'a>, level: Level) -> Option<Self> {
        let space = CullingSpace::over(&triangles.position_bounds())?;
        let divided = LazyBvh::new(triangles, space, level);
        Some(Self { triangles, divided, space, level, lists: AtomicUsize::new(0) })
    }

    /// Finds the nearest, or any, hit of each ray, and counts the pairs of each unless there is no room for that.
    /// `None` if a ray begins too far away for culling in f32.
    pub(crate) fn intersect(
        &self,
        set: RaySet<'_>,
        any: bool,
        ((ids, ts), pairs): (Row<'_>, &mut [u32]),
    ) -> Option<Stats> {
        let counts = !pairs.is_empty();
        let query = self.query(set, any, counts);
        let threads = rayon::current_num_threads();
        let chunk = (set.len() / (threads * 8)).clamp(FEWEST, CHUNK);
        let mut counted: Vec<&mut [u32]> = pairs.chunks_mut(chunk).collect();
        counted.resize_with(set.len().div_ceil(chunk), Default::default);
        let chunks = ids.par_chunks_mut(chunk).zip(ts.par_chunks_mut(chunk));
        let chunks = chunks.zip(counted).enumerate();
        let of_chunk =
            |state: &mut (RayOrder, Workspace),
             (index, ((ids, ts), counted)): (usize, (Row<'_>, &mut [u32]))| {
                let (order, work) = state;
                // In range: there are fewer than 2³² rays.
                let first = (index * chunk) as u32;
                let rays = first..first + ids.len() as u32;
                let entries = dispatch!(self.level, simd => order.of(simd, &set, rays, &self.space));
                let mut stats = Stats::default();
                for stream in entries.chunks(STREAM) {
                    let numbers = stream.iter().map(|entry| (entry.number(first), entry.octant()));
                    stats = stats.plus(work.intersect(self, &query, numbers)?);
                    stats = stats.plus(work.write(&query, |number, id, t| {
                        let place = (number - first) as usize;
                        (ids[place], ts[place]) = (id, t);
                    }));
                    work.tested().for_each(|(number, pairs)| counted[(number - first) as usize] = pairs);
                }
                Some(stats)
            };
        let stats = chunks.map_init(Default::default, of_chunk);
        let stats = stats.try_reduce(Stats::default, |one, other| Some(one.plus(other)))?;
        let stream = chunk.min(STREAM);
        let counted = if counts { stream * size_of::<u32>() } else { 0 };
        let of_thread = self.workspace_bytes(stream) + counted + RayOrder::bytes_for(chunk);
        let threads = threads.min(set.len().div_ceil(chunk));
        Some(Stats { engine_bytes: (self.bytes() + threads * of_thread) as u64, ..stats })
    }

    /// Finds any hit of the rays of one stream, at most [`STREAM`], and tells those that hit something.
    pub(crate) fn any_of_stream(
        &self,
        work: &mut Workspace,
        set: RaySet<'_>,
        mut hit: impl FnMut(u32),
    ) -> Option<Stats> {
        let query = self.query(set, true, false);
        // In range: a stream is small.
        let rays = (0..set.len() as u32).map(|number| (number, octant(set.ray(number).direction)));
        let stats = work.intersect(self, &query, rays)?;
        let rays = work.rays.iter().zip(&work.found);
        rays.filter(|(_, found)| found.nearest.is_hit()).for_each(|(ray, _)| hit(ray.number));
        Some(stats)
    }

    /// A query of these objects.
    fn query<'q>(&'q self, set: RaySet<'q>, any: bool, counts: bool) -> Query<'q> {
        let question = Question { triangles: self.triangles, set, any };
        Query { question, objects: &self.divided, level: self.level, counts }
    }

    /// Bytes of the objects.
    pub(crate) fn bytes(&self) -> usize {
        self.divided.bytes()
    }

    /// Bytes that a thread needed for streams of so many rays.
    pub(crate) fn workspace_bytes(&self, rays: usize) -> usize {
        let of_ray = size_of::<CulledRay>() + size_of::<Ray>() + size_of::<Found>() + size_of::<u32>();
        rays * of_ray + self.lists.load(Ordering::Relaxed) * size_of::<u16>()
    }
}

/// What a thread keeps of a stream.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    rays: Vec<CulledRay>,
    /// The same rays as they were given.
    exact: Vec<Ray>,
    /// Numbers of rays by octant.
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
    /// Finds the hits of a stream of rays: the number and the octant of each. `None` if a ray begins too far away.
    fn intersect(
        &mut self,
        objects: &Objects<'_>,
        query: &Query<'_>,
        numbers: impl Iterator<Item = (u32, usize)>,
    ) -> Option<Stats> {
        self.stats = Stats::default();
        self.sorted.iter_mut().for_each(Vec::clear);
        numbers.for_each(|(number, octant)| self.sorted[octant].push(number));
        let ends = dispatch!(query.level, simd => self.cut(simd, query.question.set, &objects.space))?;
        self.tested.clear();
        self.tested.resize(if query.counts { self.rays.len() } else { 0 }, 0);
        let mut first = 0;
        for (octant, end) in ends.into_iter().enumerate() {
            if first < end {
                self.descend_octant(query, octant, first, end);
            }
            first = end;
        }
        objects.lists.fetch_max(self.lists.len(), Ordering::Relaxed);
        Some(self.stats)
    }

    /// Cuts the sorted rays to the scene. Returns where each octant ends.
    #[inline(always)]
    fn cut<S: Simd>(&mut self, simd: S, all: RaySet<'_>, space: &CullingSpace) -> Option<[usize; OCTANTS]> {
        self.exact.clear();
        self.rays.clear();
        self.found.clear();
        let mut ends = [0; OCTANTS];
        for (sorted, end) in self.sorted.iter().zip(&mut ends) {
            for (place, numbers) in sorted.chunks(LANES).enumerate() {
                let later = sorted.iter().skip((place + 2) * LANES).take(LANES);
                later.for_each(|&number| all.prefetch(number));
                let mut eight = [numbers[0]; LANES];
                eight[..numbers.len()].copy_from_slice(numbers);
                let mut made = [A_RAY; LANES];
                let eight = all.eight(eight, &mut made);
                let cut = space.cut(simd, &eight);
                if cut.far != 0 {
                    return None;
                }
                for lane in bits(cut.meeting & ((1 << numbers.len()) - 1)) {
                    let (culled, parameter) = cut.get(lane, numbers[lane]);
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
        // In range: a stream has at most 2¹³ rays.
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
        bundle.descend(query.objects.all(), 0..end - first, end - first);
    }

    /// The pairs of each ray of a stream, where they are counted. What does not meet the scene is left out.
    fn tested(&self) -> impl Iterator<Item = (u32, u32)> {
        self.rays.iter().map(|ray| ray.number).zip(self.tested.iter().copied())
    }

    /// Tells the hits of a stream: the number of the ray, the triangle, and t, infinite unless the nearest was asked
    /// for. Counts what was rounded exactly.
    fn write(&self, query: &Query<'_>, mut hit: impl FnMut(u32, u32, f32)) -> Stats {
        let mut stats = Stats::default();
        for ((culled, ray), Found { nearest, .. }) in self.rays.iter().zip(&self.exact).zip(&self.found) {
            if !nearest.is_hit() {
                continue;
            }
            let (low, high) = (saturate(nearest.lo), saturate(nearest.hi));
            let t = if query.question.any {
                f32::INFINITY
            } else if low == high {
                low
            } else {
                Distance::new(ray, &query.question.triangles.triangle(nearest.id)).rounded(&mut stats)
            };
            hit(culled.number, nearest.id, t);
        }
        stats
    }
}
