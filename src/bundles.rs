//! Arbitrary rays, in bundles: rays and objects divided together, with one bound for many rays.
//!
//! ```text
//! for each window of consecutive rays, in parallel:
//!     cut the rays to the scene; sort them by the octant of their direction
//!     for each octant: descend(rays, all objects)
//!
//! descend(rays, objects):
//!     keep the parts of the objects, eight, that the shaft of the rays may meet
//!     ask each ray which of these it may meet, and list it there
//!     for each part, near ones first: descend(its list, part); a group of eight triangles is a leaf
//! ```
//!
//! A window has thousands of rays, so that what is prepared for a part, boxes and triangles, serves many. The lists of rays
//! are indices on a stack; nothing of the recursion is stored. All rays of a list have one octant: for them the planes of a box
//! that come first are the same, and so is the order of the parts.
//!
//! Measured with 2 million diffuse-bounce rays: with the runs of [`crate::runs`] a ray asked 47 nodes and was tested with 48 times eight
//! triangles (sponza), 16 and 16 (koala); with [`crate::cost_groups`] it is 18 and 5, 8 and 2.5. A ray goes on into 1.3 of a
//! node's eight parts, so it is put on their lists at once: looking through all rays for each part took a quarter of all
//! instructions. Windows of 2¹³ rays take a fifth less time than ones of 2¹⁶: they stay in the cache.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1; Rasmus Barringer and Tomas Akenine-Möller, "Dynamic Ray Stream Traversal", 2014 (lists of rays per
//! node); Alexander Reshetov, Alexei Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005 (one bound for many rays).

use std::mem::size_of;
use std::ops::Range;

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::bundle_leaf::GroupTriangles;
use crate::cost_groups::Groups;
use crate::culling_space::{CulledRay, CullingSpace, Cut, Parameter, planes};
use crate::lanes::{Boxes, LANES, bits};
use crate::predicates::Distance;
use crate::probes::{Nearest, Probes};
use crate::runs::Node;
use crate::shaft::Shaft;
use crate::{Hits, Stats, Triangles};

/// The most rays of a window. Indices of a list must fit u16.
pub(crate) const WINDOW: usize = 1 << 13;
/// The fewest rays for which a thread is worth its while.
const FEWEST: usize = 1 << 10;
/// Octants of directions.
const OCTANTS: usize = 8;

/// Triangles, ready for rays.
#[derive(Debug)]
pub(crate) struct Objects<'a> {
    triangles: &'a Triangles<'a>,
    groups: Groups,
    space: CullingSpace,
    level: Level,
}

impl<'a> Objects<'a> {
    /// Divides triangles into groups. `None` where numbers are too large or too small for culling in f32.
    pub(crate) fn new(triangles: &'a Triangles<'a>, level: Level) -> Option<Self> {
        let space = CullingSpace::over(&triangles.position_bounds())?;
        Some(Self { triangles, groups: Groups::new(triangles, &space, level), space, level })
    }

    /// Finds the nearest, or any, hit of each ray. `None` if a ray begins too far away for culling in f32.
    pub(crate) fn intersect(&self, probes: Probes<'_>, any: bool, hits: &mut Hits) -> Option<Stats> {
        let query = Query { objects: self, probes, any };
        let threads = rayon::current_num_threads();
        let window = (probes.len() / (threads * 4)).clamp(FEWEST, WINDOW);
        let windows = hits.ids.par_chunks_mut(window).zip(hits.ts.par_chunks_mut(window)).enumerate();
        let of_window = |work: &mut Workspace, (index, (ids, ts)): (usize, (&mut [u32], &mut [f32]))| {
            // In range: there are fewer than 2³² rays.
            let first = (index * window) as u32;
            let stats = work.intersect(&query, first..first + ids.len() as u32)?;
            work.write(&query, first, ids, ts);
            Some(stats)
        };
        let stats = windows.map_init(Workspace::default, of_window);
        let stats = stats.try_reduce(Stats::default, |one, other| Some(one.plus(other)))?;
        let workspaces = threads.min(probes.len().div_ceil(window)) * self.workspace_bytes(window);
        Some(Stats { engine_bytes: (self.bytes() + workspaces) as u64, ..stats })
    }

    /// Finds any hit of the rays of one window, at most [`WINDOW`], and tells those that hit something.
    pub(crate) fn any_of_window(
        &self,
        work: &mut Workspace,
        probes: Probes<'_>,
        mut hit: impl FnMut(u32),
    ) -> Option<Stats> {
        let query = Query { objects: self, probes, any: true };
        // In range: a window is small.
        let stats = work.intersect(&query, 0..probes.len() as u32)?;
        let rays = work.rays.iter().zip(&work.found);
        rays.filter(|(_, found)| found.nearest.is_hit()).for_each(|(ray, _)| hit(ray.probe));
        Some(stats)
    }

    /// Bytes of the objects.
    pub(crate) fn bytes(&self) -> usize {
        self.groups.bytes()
    }

    /// Bytes that a thread needs for windows of so many rays.
    pub(crate) fn workspace_bytes(&self, rays: usize) -> usize {
        // Twice while they are sorted by octant.
        let sorting = 2 * (size_of::<CulledRay>() + size_of::<Found>());
        rays * (sorting + lists_for(&self.groups) * size_of::<u16>())
    }
}

/// The query that all windows share.
#[derive(Clone, Copy)]
struct Query<'a> {
    objects: &'a Objects<'a>,
    probes: Probes<'a>,
    any: bool,
}

/// Places of lists for each ray: at each level the list of each of eight boxes could hold all rays.
fn lists_for(groups: &Groups) -> usize {
    1 + LANES * groups.levels()
}

/// What a ray has found, and how its t is seen in the culling space.
#[derive(Debug, Clone, Copy)]
struct Found {
    nearest: Nearest,
    parameter: Parameter,
}

/// What a thread keeps of a window.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    rays: Vec<CulledRay>,
    /// Of each ray.
    found: Vec<Found>,
    /// Lists of rays, one behind the other.
    lists: Vec<u16>,
    stats: Stats,
}

impl Workspace {
    /// Finds the hits of a window. `None` if a ray begins too far away.
    fn intersect(&mut self, query: &Query<'_>, probes: Range<u32>) -> Option<Stats> {
        self.stats = Stats::default();
        let ends = self.cut(query, probes)?;
        self.lists.resize((self.rays.len() * lists_for(&query.objects.groups)).max(self.lists.len()), 0);
        let mut first = 0;
        for (octant, end) in ends.into_iter().enumerate() {
            if first < end {
                self.descend_octant(query, octant, first, end);
            }
            first = end;
        }
        Some(self.stats)
    }

    /// Cuts rays to the scene and sorts them by octant. Returns where each octant ends.
    fn cut(&mut self, query: &Query<'_>, probes: Range<u32>) -> Option<[usize; OCTANTS]> {
        let mut cut = Vec::with_capacity(probes.len());
        let mut counts = [0; OCTANTS];
        for probe in probes {
            let ray = query.probes.ray(probe);
            match query.objects.space.cut(&ray, probe) {
                Cut::Outside => {}
                Cut::Far => return None,
                Cut::Ray(culled, parameter) => {
                    counts[culled.octant()] += 1;
                    cut.push((culled, Found { nearest: Nearest::none(ray.t_max), parameter }));
                }
            }
        }
        let mut next = [0; OCTANTS];
        for octant in 1..OCTANTS {
            next[octant] = next[octant - 1] + counts[octant - 1];
        }
        let Some(&(ray, found)) = cut.first() else {
            self.rays.clear();
            return Some(next);
        };
        self.rays.resize(cut.len(), ray);
        self.found.resize(cut.len(), found);
        for (ray, found) in cut {
            let place = &mut next[ray.octant()];
            (self.rays[*place], self.found[*place]) = (ray, found);
            *place += 1;
        }
        Some(next)
    }

    /// All rays of an octant.
    fn descend_octant(&mut self, query: &Query<'_>, octant: usize, first: usize, end: usize) {
        let Self { rays, found, lists, stats } = self;
        let mut bundle = Bundle {
            query,
            octant,
            shaft: Shaft::around(&rays[first..end], octant),
            rays: &mut rays[first..end],
            found: &mut found[first..end],
            stats,
        };
        // In range: a window has at most 2¹³ rays.
        let (list, free) = lists.split_at_mut(end - first);
        (0..).zip(&mut *list).for_each(|(ray, place)| *place = ray);
        bundle.descend(query.objects.groups.root(), list, free);
    }

    /// Writes the hits of a window.
    fn write(&self, query: &Query<'_>, first: u32, ids: &mut [u32], ts: &mut [f32]) {
        for (ray, Found { nearest, .. }) in self.rays.iter().zip(&self.found) {
            if nearest.is_hit() {
                let place = (ray.probe - first) as usize;
                ids[place] = nearest.id;
                if !query.any {
                    let triangle = query.objects.triangles.triangle(nearest.id);
                    ts[place] = Distance::new(&ray.ray, &triangle).rounded();
                }
            }
        }
    }
}

/// Rays of one octant.
struct Bundle<'a> {
    query: &'a Query<'a>,
    octant: usize,
    shaft: Shaft,
    rays: &'a mut [CulledRay],
    found: &'a mut [Found],
    stats: &'a mut Stats,
}

impl Bundle<'_> {
    /// One step of the recursion: a list of rays, and a node that they may meet. Further lists go to where is free.
    fn descend(&mut self, node: Node, list: &[u16], free: &mut [u16]) {
        let Some(boxes) = self.query.objects.groups.boxes(node) else { return };
        self.stats.nodes += 1;
        let (lists, free) = free.split_at_mut(list.len() * LANES);
        let counts = dispatch!(self.query.objects.level, simd => self.distribute(simd, boxes, list, lists));
        let (near_first, kept) = self.shaft.near_first(boxes, &counts);
        for &lane in &near_first[..kept] {
            let child = node.child(lane);
            let list = &lists[lane * list.len()..][..counts[lane]];
            match child.leaf() {
                Some(group) => dispatch!(self.query.objects.level, simd => self.leaf(simd, group, list)),
                None => self.descend(child, list, free),
            }
        }
    }

    /// Asks the shaft, then each ray, which of eight boxes it may meet, and lists the rays of each box. Returns their numbers.
    #[inline(always)]
    fn distribute<S: Simd>(
        &mut self,
        simd: S,
        boxes: &Boxes,
        list: &[u16],
        lists: &mut [u16],
    ) -> [usize; LANES] {
        let mut counts = [0; LANES];
        let planes = planes(simd, boxes, self.octant);
        let of_shaft = self.shaft.meets(simd, &planes);
        self.stats.frustum_tests += LANES as u64;
        if of_shaft == 0 {
            return counts;
        }
        self.stats.box_tests += (list.len() * LANES) as u64;
        for &ray in list {
            // Mostly one or two.
            for lane in bits(self.rays[ray as usize].meets(&planes)) {
                lists[lane * list.len() + counts[lane]] = ray;
                counts[lane] += 1;
            }
        }
        counts
    }

    /// "DirectlyIntersect": a group of triangles against the rays of a list.
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, group: usize, list: &[u16]) {
        let Query { objects, probes, any } = *self.query;
        let Objects { triangles, groups, space, .. } = objects;
        let ids = groups.ids(group);
        if ids.is_empty() {
            return;
        }
        self.stats.triangles_set_up += ids.len() as u64;
        let set_up = GroupTriangles::new(simd, triangles, space, ids);
        for &ray in list {
            let ray = ray as usize;
            let culled = &mut self.rays[ray];
            let candidates = set_up.candidates(culled);
            self.stats.samples_tested += LANES as u64;
            for lane in bits(candidates & ((1 << ids.len()) - 1)) {
                let (probe, found) = ((culled.probe, &culled.ray), &mut self.found[ray]);
                self.stats.doubtful_samples += 1;
                if any && found.nearest.is_hit() {
                    break;
                }
                if probes.test(probe, ids[lane], triangles, &mut found.nearest, self.stats) {
                    let end = if any { -1.0 } else { found.parameter.upper(found.nearest.hi) };
                    culled.t_max = end;
                }
            }
        }
    }
}
