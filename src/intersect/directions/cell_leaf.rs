//! The leaf of a cell of parallel rays: some packets of receivers against triangles that may meet them.
//!
//! The rays of a cell get columns and rows of their own, so that f32 is fine enough: see [`crate::intersect::pencil::setup`]. Boxes of eight packets are
//! compared with a triangle's at once; triangles wait until there are eight to be set up together.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Ingo Wald et al., "Interactive Rendering with Coherent Ray
//! Tracing", 2001 (packets).

use fearless_simd::{prelude::*, u32x8};
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::intersect::grid::hierarchical_z::TILE_SIDE;
use crate::intersect::irregular::bounds::Bounds;
use crate::intersect::irregular::packets::Functions;
use crate::intersect::irregular::projection::Plane;
use crate::intersect::irregular::sightings::{ToTile, keys_around};
use crate::intersect::pencil::setup::{Setups, TileRays, exact_side, set_up};
use crate::objects::gather;
use crate::objects::gather::EightCorners;
use crate::options::Accuracy;
use crate::rays::film::Sampling;
use crate::rays::hemisphere::{Occlusion, RaySample};
use crate::rays::pencil::Origin;
use crate::simd::lanes::{LANES, Lanes, Narrow, NarrowMask, bits, narrow, widen};
use crate::stats::Stats;

/// The most packets of a cell.
pub(crate) const PACKETS: usize = LANES * LANES;
const POINTS: usize = PACKETS * LANES;
/// A film is at least this part of the coordinates wide.
const LEAST_WIDTH: f64 = 1.0 / (1 << 20) as f64;

/// What a direction's cells share.
#[derive(Clone, Copy)]
pub(crate) struct CellQuery<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    /// Their corners, in the order of the runs.
    pub(crate) corners: &'a [EightCorners],
    pub(crate) occlusion: &'a Occlusion<'a>,
    pub(crate) sample: RaySample,
    /// Its direction over a power of two, so that the greatest component lies in [1, 2).
    pub(crate) direction: DVec3,
    /// Of all triangles and receivers.
    pub(crate) bounds: Aabb,
    pub(crate) accuracy: Accuracy,
    /// The limit of the rays in units of that direction, rounded down and up.
    pub(crate) reach: [f32; 2],
}

/// A packet on its way into a cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CellPacket<'a> {
    /// First and last place on both axes of the plane, and the least t of what matters, relative to the scene's middle.
    pub(crate) sides: [f32; 4],
    pub(crate) near: f32,
    /// Coordinates, receivers and their triangles.
    pub(crate) at: [&'a [f32]; 3],
    pub(crate) ids: &'a [u32],
    pub(crate) owners: &'a [u32],
    /// Receivers whose rays are open, as bits.
    pub(crate) open: u8,
}

/// The packets of a cell, and triangles that wait.
#[derive(Debug)]
pub(crate) struct Cell {
    places: [[f32; POINTS]; 2],
    lo: [f32; POINTS],
    hi: [f32; POINTS],
    ids: [u32; POINTS],
    owners: [u32; POINTS],
    open: [u8; PACKETS],
    count: usize,
    bounds: Bounds<LANES>,
    waiting: usize,
    triangles: [u32; LANES],
    /// The packets that each may meet, as bits.
    met: [u64; LANES],
    setups: Setups,
    rays: TileRays,
}

impl Cell {
    /// No packets.
    pub(crate) fn new() -> Self {
        Self {
            places: [[0.0; POINTS]; 2],
            lo: [0.0; POINTS],
            hi: [0.0; POINTS],
            ids: [0; POINTS],
            owners: [0; POINTS],
            open: [0; PACKETS],
            count: 0,
            bounds: Bounds::EMPTY,
            waiting: 0,
            triangles: [0; LANES],
            met: [0; LANES],
            setups: Setups::EMPTY,
            rays: TileRays {
                origin: Origin::Infinity(DVec3::Z),
                span: [DVec3::ZERO; 3],
                sampling: Sampling::Scattered,
                on_lattice: false,
            },
        }
    }

    /// Takes at most [`PACKETS`] packets in place of those before. Places count from `middle`.
    #[inline(always)]
    pub(crate) fn fill<'a, S: Simd>(
        &mut self,
        simd: S,
        query: &CellQuery<'_>,
        middle: DVec3,
        packets: impl Iterator<Item = CellPacket<'a>> + Clone,
    ) {
        (self.count, self.waiting, self.bounds) = (0, 0, Bounds::EMPTY);
        let mut around = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
        for packet in packets.clone() {
            let [u0, v0, u1, v1] = packet.sides;
            around = [around[0].min(u0), around[1].min(v0), around[2].max(u1), around[3].max(v1)];
        }
        let film = self.film_around(query, middle, around.map(f64::from));
        let infinite = Narrow::simd_from(simd, f32::INFINITY);
        for packet in packets {
            let (index, first) = (self.count, self.count * LANES);
            let eight = first..first + LANES;
            let ([x, y], key) = film.see(simd, packet.at);
            let (lo, hi) = keys_around(simd, key);
            let open = NarrowMask::from_bitmask(simd, u64::from(packet.open));
            x.store_slice(&mut self.places[0][eight.clone()]);
            y.store_slice(&mut self.places[1][eight.clone()]);
            open.select(lo, infinite).store_slice(&mut self.lo[eight.clone()]);
            open.select(hi, infinite).store_slice(&mut self.hi[eight.clone()]);
            self.ids[eight.clone()].copy_from_slice(packet.ids);
            self.owners[eight].copy_from_slice(packet.owners);
            self.open[index] = packet.open;
            self.bounds.set(index, packet.sides, packet.near);
            self.count += 1;
        }
    }

    /// Columns and rows over a rectangle of places, which count from where `middle` is seen.
    fn film_around(
        &mut self,
        query: &CellQuery<'_>,
        middle: DVec3,
        [u0, v0, u1, v1]: [f64; 4],
    ) -> ParallelFilm {
        let toward = -query.direction;
        let plane = Plane::of(Origin::Infinity(toward), toward);
        let [ahead, right, up] = plane.axes();
        let along = toward.dot(ahead);
        let slope = |axis: DVec3| -toward.dot(axis) / along;
        let place = |p: DVec3, axis: DVec3| p.dot(axis) + p.dot(ahead) * slope(axis);
        let size = query.bounds.reach(DVec3::ZERO).max_element();
        let step = |lo: f64, hi: f64| (hi - lo).max(size * LEAST_WIDTH) / f64::from(TILE_SIDE - 4);
        let (step_u, step_v) = (step(u0, u1), step(v0, v1));
        // Start points at the height of the middle; the first column and row lie outside.
        let height = middle.dot(ahead);
        let (u, v) = (place(middle, right) + u0 - step_u, place(middle, up) + v0 - step_v);
        let first = ahead * height + right * (u - height * slope(right)) + up * (v - height * slope(up));
        self.rays = TileRays {
            origin: Origin::Infinity(toward),
            span: [first, right * step_u, up * step_v],
            sampling: Sampling::Scattered,
            on_lattice: false,
        };
        let at = [[place(first, right), 1.0 / step_u], [place(first, up), 1.0 / step_v]];
        let turn = ahead.x + ahead.y + ahead.z;
        ParallelFilm {
            axes: [ahead, right, up].map(axis_of),
            slopes: [right, up].map(|axis| slope(axis) * turn),
            to_tile: ToTile { at, depth: [first.dot(ahead) * turn, -turn / along] },
        }
    }

    /// Tests a triangle, given what it covers and the greatest t of it, now or later.
    #[inline(always)]
    pub(crate) fn intersect<S: Simd>(
        &mut self,
        simd: S,
        query: &CellQuery<'_>,
        (id, sides, far): (u32, &[f32; 4], f32),
        stats: &mut Stats,
    ) {
        let mut met = 0;
        for group in 0..self.count.div_ceil(LANES) {
            met |= self.bounds.meeting(simd, group, sides, far) << (group * LANES);
        }
        if met == 0 {
            return;
        }
        let place = self.waiting % LANES;
        (self.triangles[place], self.met[place]) = (id, met);
        self.waiting += 1;
        if self.waiting == LANES {
            self.intersect_waiting(simd, query, stats);
        }
    }

    /// Tests the triangles that wait.
    #[inline(always)]
    pub(crate) fn intersect_waiting<S: Simd>(&mut self, simd: S, query: &CellQuery<'_>, stats: &mut Stats) {
        if self.waiting == 0 {
            return;
        }
        let ids = self.triangles;
        let corners = gather::corners(simd, query.triangles, &ids);
        let exact = |lane: usize| exact_side(self.rays.origin, &query.triangles.triangle(ids[lane % LANES]));
        let reach = query.bounds.reach(self.rays.base());
        set_up(simd, &self.rays, (corners, (1 << self.waiting) - 1), reach, exact, &mut self.setups);
        stats.triangles_set_up += self.waiting as u64;
        let kept = if query.occlusion.back_faces {
            self.setups.lanes
        } else {
            self.setups.lanes & !self.setups.negative
        };
        for lane in bits(kept) {
            let functions = Functions::new(simd, &self.setups, lane);
            for packet in bits(self.met[lane]) {
                self.test(simd, query, (ids[lane], &functions), packet % PACKETS, stats);
            }
        }
        self.waiting = 0;
    }

    /// Tests a packet with a triangle.
    #[inline(always)]
    fn test<S: Simd>(
        &mut self,
        simd: S,
        query: &CellQuery<'_>,
        (id, functions): (u32, &Functions<S>),
        packet: usize,
        stats: &mut Stats,
    ) {
        stats.samples_tested += LANES as u64;
        let eight = packet * LANES..packet * LANES + LANES;
        let [x, y] = [0, 1].map(|k| Narrow::from_slice(simd, &self.places[k][eight.clone()]));
        let (lo, hi) = (
            Narrow::from_slice(simd, &self.lo[eight.clone()]),
            Narrow::from_slice(simd, &self.hi[eight.clone()]),
        );
        let doubt = if query.accuracy == Accuracy::Exact { 1.0 } else { 0.0 };
        let least = functions.least_edge(x, y);
        let (lowest, highest) = functions.keys(x, y);
        // NaN, where keys are infinite, is in doubt.
        let beyond = lowest.simd_gt(hi + query.reach[1]);
        let kept = (least.simd_ge(-doubt) & highest.simd_ge(lo) & !beyond).to_bitmask();
        if kept == 0 {
            return;
        }
        let others = !u32x8::from_slice(simd, &self.owners[eight.clone()]).simd_eq(id);
        let within = lowest.simd_gt(hi) & highest.simd_lt(hi + query.reach[0]);
        let certain = least.simd_gt(doubt) & within & others;
        let mut closed = certain.to_bitmask() & kept;
        let doubtful = kept & !closed & others.to_bitmask();
        if doubtful != 0 {
            closed |= self.decide(query, id, (packet * LANES, doubtful), stats);
        }
        if closed != 0 {
            let infinite = Narrow::simd_from(simd, f32::INFINITY);
            let closed_lanes = NarrowMask::from_bitmask(simd, closed);
            closed_lanes.select(infinite, lo).store_slice(&mut self.lo[eight.clone()]);
            closed_lanes.select(infinite, hi).store_slice(&mut self.hi[eight]);
            // In range: eight bits.
            self.open[packet] &= !(closed as u8);
            if self.open[packet] == 0 {
                // Nothing meets it any more.
                self.bounds.set(
                    packet,
                    [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY],
                    f32::INFINITY,
                );
            }
        }
    }

    /// Decides some of eight rays from one on exactly; tells which are closed.
    #[inline(never)]
    fn decide(
        &self,
        query: &CellQuery<'_>,
        id: u32,
        (first, doubtful): (usize, u64),
        stats: &mut Stats,
    ) -> u64 {
        let corners = query.triangles.corners(TriangleId(id));
        let mut closed = 0;
        for lane in bits(doubtful).filter(|lane| self.lo[first + lane] < f32::INFINITY) {
            let receiver = self.ids[first + lane] as usize;
            // From one of its corners no triangle is hit. Common where receivers are vertices.
            if corners.contains(&query.occlusion.hemispheres[receiver].receiver.point) {
                continue;
            }
            stats.doubtful_samples += 1;
            let ray = query.occlusion.untested_ray(receiver, &query.sample);
            closed |= u64::from(ray.is_blocked_by(id, &query.triangles.triangle(id), stats)) << lane;
        }
        closed
    }

    /// The open rays of its packets.
    pub(crate) fn open(&self) -> &[u8] {
        &self.open[..self.count]
    }
}

/// The number of an axis.
pub(crate) fn axis_of(axis: DVec3) -> usize {
    if axis.x != 0.0 {
        0
    } else if axis.y != 0.0 {
        1
    } else {
        2
    }
}

/// How parallel rays see points on a film: (p_i + p_k·slope − offset)·factor for each axis i across, and
/// (p_k − offset)·factor for the key.
#[derive(Debug, Clone, Copy)]
struct ParallelFilm {
    /// k, and the two axes across.
    axes: [usize; 3],
    slopes: [f64; 2],
    to_tile: ToTile,
}

impl ParallelFilm {
    /// Columns, rows and keys of eight points, given coordinate by coordinate.
    #[inline(always)]
    fn see<S: Simd>(&self, simd: S, points: [&[f32]; 3]) -> ([Narrow<S>; 2], Lanes<S>) {
        let [k, i, j] = self.axes;
        let depth = widen(Narrow::from_slice(simd, points[k]));
        let mut places = [Narrow::simd_from(simd, 0.0); 2];
        for (axis, across) in [i, j].into_iter().enumerate() {
            let at = widen(Narrow::from_slice(simd, points[across]));
            let [offset, factor] = self.to_tile.at[axis];
            places[axis] = narrow((at + depth * self.slopes[axis] - offset) * factor);
        }
        let [offset, factor] = self.to_tile.depth;
        (places, (depth - offset) * factor)
    }
}
