//! The pencil of one direction: packets of receivers and triangles, divided together into the cells of a grid across it.
//!
//! Places, t and cells are those of [`crate::intersect::directions::binning`].
//!
//! 1. Packets go to all cells that they cover; a cell knows the least t of its rays.
//! 2. So do triangles, unless they lie behind all rays of a cell. Large ones come first: they end most rays.
//! 3. Each cell is a leaf, see [`crate::intersect::directions::cell_leaf`].
//!
//! Tried and dropped: the recursion of [`crate::intersect::pencil`] for each cluster of 2048 or 4096 receivers. It projects the triangles anew
//! for each cluster: 2 (koala) to 10 (chess) times as many instructions.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011; Gregory Johnson et al., "The Irregular Z-Buffer", 2005.

use std::mem::size_of;

use fearless_simd::prelude::*;
use glam::DVec3;

use crate::intersect::directions::binning::{Across, Grid, each_cell};
use crate::intersect::directions::cell_leaf::{Cell, CellQuery, PACKETS};
use crate::intersect::directions::packet_set::PacketSet;
use crate::objects::runs::{RUN, Runs};
use crate::simd::lanes::least_of;
use crate::simd::lanes::{LANES, Narrow, NarrowMask, bits};
use crate::stats::Stats;

/// Triangles that cover more cells than these two more in a row are large.
const LARGE: u16 = 1;

/// What a packet or a triangle covers: first and last place on both axes, and the least and the greatest t.
#[derive(Debug, Clone, Copy)]
struct Cover {
    sides: [f32; 4],
    ts: [f32; 2],
    /// First column and row, last column and row of the cells.
    cells: [u16; 4],
    /// The packet or the triangle.
    id: u32,
}

/// A cell: the ends of its packets and triangles in their lists.
#[derive(Debug, Clone, Copy)]
struct CellLists {
    packets: u32,
    triangles: u32,
    /// The least and the greatest t of its packets.
    ts: [f32; 2],
}

/// What a thread keeps from direction to direction.
#[derive(Debug)]
pub(crate) struct CellScratch {
    packets: Vec<Cover>,
    triangles: Vec<Cover>,
    cells: Vec<CellLists>,
    packet_lists: Vec<u32>,
    triangle_lists: Vec<u32>,
    leaf: Box<Cell>,
}

impl CellScratch {
    /// Nothing.
    pub(crate) fn new() -> Self {
        Self {
            packets: Vec::new(),
            triangles: Vec::new(),
            cells: Vec::new(),
            packet_lists: Vec::new(),
            triangle_lists: Vec::new(),
            leaf: Box::new(Cell::new()),
        }
    }

    /// Bytes of it.
    pub(crate) fn bytes(&self) -> usize {
        (self.packets.capacity() + self.triangles.capacity()) * size_of::<Cover>()
            + self.cells.capacity() * size_of::<CellLists>()
            + (self.packet_lists.capacity() + self.triangle_lists.capacity()) * size_of::<u32>()
            + size_of::<Cell>()
    }
}

/// Closes those rays of packets along one sample that something occludes.
#[inline(always)]
pub(crate) fn close_rays_along<S: Simd>(
    simd: S,
    query: &CellQuery<'_>,
    (runs, set, slot): (&Runs, &PacketSet, usize),
    scratch: &mut CellScratch,
) -> Stats {
    let mut stats = Stats::default();
    let across = Across::new(query.direction, &query.bounds);
    let Some((sides, least)) = cover_packets(simd, &across, (set, slot), scratch) else {
        return stats;
    };
    let grid = Grid::over(sides, scratch.packets.len(), query.triangles.len());
    list_packets(&grid, scratch);
    cover_triangles(simd, &across, query, runs, (&grid, sides, least), scratch);
    // Here t counts along the axis; the slack of the reach pays for rounding the product.
    let along = query.direction.abs().max_element() as f32;
    list_triangles(&grid, query.reach[1] * along, scratch);
    stats.nodes += scratch.cells.len() as u64;
    stats.blocks += scratch.triangle_lists.len() as u64;
    let middle = DVec3::from_array(across.middle.map(f64::from));
    let CellScratch { packets, triangles, cells, packet_lists, triangle_lists, leaf } = scratch;
    let (mut first_packet, mut first_triangle) = (0, 0);
    for cell in cells.iter() {
        let (end, last) = (cell.packets as usize, cell.triangles as usize);
        let covering = &triangle_lists[first_triangle..last];
        for places in packet_lists[first_packet..end].chunks(PACKETS) {
            if covering.is_empty() {
                break;
            }
            let packet = |&place: &u32| {
                let Cover { sides, ts, id, .. } = packets[place as usize];
                set.cell_packet(id as usize, slot, (sides, ts[0]))
            };
            leaf.fill(simd, query, middle, places.iter().map(packet));
            for &place in covering {
                let Cover { sides, ts, id, .. } = &triangles[place as usize];
                leaf.intersect(simd, query, (*id, sides, ts[1]), &mut stats);
            }
            leaf.intersect_waiting(simd, query, &mut stats);
            for (&place, &open) in places.iter().zip(leaf.open()) {
                set.close(packets[place as usize].id as usize, slot, open);
            }
        }
        (first_packet, first_triangle) = (end, last);
    }
    stats
}

/// What packets with open rays cover; and all of them together, with their least t.
#[inline(always)]
fn cover_packets<S: Simd>(
    simd: S,
    across: &Across,
    (set, slot): (&PacketSet, usize),
    scratch: &mut CellScratch,
) -> Option<([f32; 4], f32)> {
    scratch.packets.clear();
    let infinite = Narrow::simd_from(simd, f32::INFINITY);
    let mut all = [f32::INFINITY, f32::INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY];
    let mut least = f32::INFINITY;
    for packet in 0..set.packets() {
        let open = set.open(packet, slot);
        if open == 0 {
            continue;
        }
        let at = set.points(packet);
        let points = [
            Narrow::from_slice(simd, at[0]),
            Narrow::from_slice(simd, at[1]),
            Narrow::from_slice(simd, at[2]),
        ];
        let [u, v, t] = across.see(points);
        let open = NarrowMask::from_bitmask(simd, u64::from(open));
        let lo = |x: Narrow<S>| least_of(open.select(x, infinite));
        let slack = across.slack;
        let sides = [lo(u) - slack, lo(v) - slack, slack - lo(-u), slack - lo(-v)];
        let near = lo(t) - slack;
        let ts = [near, slack - lo(-t)];
        all = [all[0].min(sides[0]), all[1].min(sides[1]), all[2].max(sides[2]), all[3].max(sides[3])];
        least = least.min(near);
        // In range: there are fewer than 2³² receivers.
        scratch.packets.push(Cover { sides, ts, cells: [0; 4], id: packet as u32 });
    }
    (!scratch.packets.is_empty()).then_some((all, least))
}

/// The packets of each cell.
fn list_packets(grid: &Grid, scratch: &mut CellScratch) {
    let CellScratch { packets, cells, packet_lists, .. } = scratch;
    let none = CellLists { packets: 0, triangles: 0, ts: [f32::INFINITY, f32::NEG_INFINITY] };
    cells.clear();
    cells.resize(grid.cells[0] * grid.cells[1], none);
    for Cover { sides, ts, cells: covered, .. } in packets.iter_mut() {
        *covered = grid.covered(sides);
        each_cell(grid, *covered, |cell| {
            let cell = &mut cells[cell];
            cell.packets += 1;
            cell.ts = [cell.ts[0].min(ts[0]), cell.ts[1].max(ts[1])];
        });
    }
    let mut next = 0;
    for cell in cells.iter_mut() {
        next += std::mem::replace(&mut cell.packets, next);
    }
    packet_lists.clear();
    packet_lists.resize(next as usize, 0);
    for (place, Cover { cells: covered, .. }) in (0..).zip(packets.iter()) {
        each_cell(grid, *covered, |cell| {
            let next = &mut cells[cell].packets;
            packet_lists[*next as usize] = place;
            *next += 1;
        });
    }
}

/// What triangles cover that may meet packets within a rectangle beyond some t.
#[inline(always)]
fn cover_triangles<S: Simd>(
    simd: S,
    across: &Across,
    query: &CellQuery<'_>,
    runs: &Runs,
    (grid, [u0, v0, u1, v1], least): (&Grid, [f32; 4], f32),
    scratch: &mut CellScratch,
) {
    scratch.triangles.clear();
    for (group, corners) in query.corners.iter().enumerate() {
        let first = group * LANES;
        let here = LANES.min(query.triangles.len() - first);
        let [a, b, c] = corners;
        let (a, b, c) = (seen(simd, across, a), seen(simd, across, b), seen(simd, across, c));
        let [lo_u, lo_v, lo_t] =
            [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1]), a[2].min(b[2]).min(c[2])];
        let [hi_u, hi_v, hi_t] =
            [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1]), a[2].max(b[2]).max(c[2])];
        let (lo_u, lo_v, lo_t) = (lo_u - across.slack, lo_v - across.slack, lo_t - across.slack);
        let (hi_u, hi_v, hi_t) = (hi_u + across.slack, hi_v + across.slack, hi_t + across.slack);
        let kept =
            lo_u.simd_le(u1) & hi_u.simd_ge(u0) & lo_v.simd_le(v1) & hi_v.simd_ge(v0) & hi_t.simd_ge(least);
        let kept = kept.to_bitmask() & ((1 << here) - 1);
        if kept == 0 {
            continue;
        }
        let parts = [
            lo_u.to_array(),
            lo_v.to_array(),
            hi_u.to_array(),
            hi_v.to_array(),
            lo_t.to_array(),
            hi_t.to_array(),
        ];
        let cells = [
            grid.cells_at(simd, lo_u, 0),
            grid.cells_at(simd, lo_v, 1),
            grid.cells_at(simd, hi_u, 0),
            grid.cells_at(simd, hi_v, 1),
        ];
        for lane in bits(kept) {
            let [u0, v0, u1, v1, near, far] = parts.map(|part| part[lane % LANES]);
            let sides = [u0, v0, u1, v1];
            // In range: fewer than 2¹⁶ cells.
            let (cells, id) =
                (cells.map(|cells| cells[lane % LANES] as u16), runs.id(first / RUN, first % RUN + lane));
            scratch.triangles.push(Cover { sides, ts: [near, far], cells, id });
        }
    }
}

/// Places and t of points.
#[inline(always)]
fn seen<S: Simd>(simd: S, across: &Across, [x, y, z]: &[[f32; LANES]; 3]) -> [Narrow<S>; 3] {
    across.see([
        Narrow::load_array_ref(simd, x),
        Narrow::load_array_ref(simd, y),
        Narrow::load_array_ref(simd, z),
    ])
}

/// The triangles of each cell, large ones first.
fn list_triangles(grid: &Grid, t_max: f32, scratch: &mut CellScratch) {
    let CellScratch { triangles, cells, triangle_lists, .. } = scratch;
    let matters = |cell: &CellLists, ts: &[f32; 2]| ts[1] >= cell.ts[0] && ts[0] <= cell.ts[1] + t_max;
    for Cover { ts, cells: covered, .. } in triangles.iter() {
        each_cell(grid, *covered, |cell| {
            let cell = &mut cells[cell];
            cell.triangles += u32::from(matters(cell, ts));
        });
    }
    let mut next = 0;
    for cell in cells.iter_mut() {
        next += std::mem::replace(&mut cell.triangles, next);
    }
    triangle_lists.clear();
    triangle_lists.resize(next as usize, 0);
    for large in [true, false] {
        for (place, &Cover { ts, cells: covered, .. }) in (0..).zip(triangles.iter()) {
            let [x0, y0, x1, y1] = covered;
            if (x1 - x0 > LARGE || y1 - y0 > LARGE) != large {
                continue;
            }
            each_cell(grid, covered, |cell| {
                let cell = &mut cells[cell];
                if matters(cell, &ts) {
                    triangle_lists[cell.triangles as usize] = place;
                    cell.triangles += 1;
                }
            });
        }
    }
}
