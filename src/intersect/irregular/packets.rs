//! The leaf of receivers: a triangle that was set up against the points of a tile, which may lie anywhere on it.
//!
//! Eight points that follow each other make a packet, eight packets a block: an implicit hierarchy over the points, as
//! [`crate::objects::runs`] is one over the triangles. Each keeps the rectangle that it covers, and the least of its
//! keys. Eight rectangles at a time are compared with the triangle's, so most of a tile is done with in a few
//! comparisons; the points of a packet that is left are tested together, through the same edge functions as pixels, at
//! their own columns and rows. Rounding those to f32 adds to the bounds, see [`crate::intersect::pencil::setup`].
//!
//! A triangle blocks a point where it covers it and lies nearer to the light: its depth key is greater than the
//! point's. Where f32 leaves doubt, the exact stage decides at once: that happens at edges, and wherever a surface is
//! as far as the point. A point that is in shadow is done: its key becomes +∞. So what lies behind all points that are
//! left is hidden from them.
//!
//! Blocks that a large triangle may meet are compared with its edges and its plane before their packets are (13 % fewer
//! instructions on sponza, 12 % on mines).
//!
//! Tried and dropped: points sorted into a grid of 32x32 cells instead of packets (19 % more instructions on sponza and
//! mines, 4 and 8 % fewer on koala and chess).
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005; Ingo Wald et al., "Interactive Rendering with
//! Coherent Ray Tracing", 2001 (packets).

use fearless_simd::{prelude::*, u32x8};

use crate::geometry::triangles::TriangleId;
use crate::intersect::irregular::bounds::Bounds;
use crate::intersect::irregular::face_points::{FacePoints, TILE_POINTS, ToTile};
use crate::intersect::pencil::leaf::{LeafDepth, Tile};
use crate::intersect::pencil::rect::Rect;
use crate::intersect::pencil::setup::Setups;
use crate::rays::receiver::{Receiver, blocks};
use crate::simd::lanes::{LANES, Narrow, bits, least_of};
use crate::stats::Stats;

/// The most packets of a tile, and blocks of those.
const PACKETS: usize = TILE_POINTS / LANES;
const BLOCKS: usize = PACKETS / LANES;

/// Bounds are brought up to date once this part of the points has been found in shadow since.
const REFRESH: usize = 8;

/// A triangle that may meet more blocks is compared with their rectangles first.
const FEW_BLOCKS: u32 = 6;
/// Edge functions are certain beyond ±1; the order of sums at a corner adds less than that again.
const CERTAIN_ON_RECT: f32 = 2.0;

/// The receivers of a tile.
#[derive(Debug)]
pub(crate) struct Packets<'a> {
    receivers: &'a [Receiver],
    /// Columns and rows.
    at: [[f32; TILE_POINTS]; 2],
    /// Bounds of the keys: +∞ for points in shadow, and where there is no point.
    lo: [f32; TILE_POINTS],
    hi: [f32; TILE_POINTS],
    /// The receiver of each point, and the triangle that it lies on.
    ids: [u32; TILE_POINTS],
    owners: [u32; TILE_POINTS],
    count: usize,
    packets: Bounds<BLOCKS>,
    blocks: Bounds<{ BLOCKS / LANES }>,
    /// The least of all keys.
    farthest: f32,
    /// Points that were found in shadow since the bounds were brought up to date.
    settled: usize,
}

impl<'a> Packets<'a> {
    /// No receivers.
    pub(crate) fn new() -> Self {
        Self {
            receivers: &[],
            at: [[0.0; TILE_POINTS]; 2],
            lo: [f32::INFINITY; TILE_POINTS],
            hi: [f32::INFINITY; TILE_POINTS],
            ids: [0; TILE_POINTS],
            owners: [0; TILE_POINTS],
            count: 0,
            packets: Bounds::EMPTY,
            blocks: Bounds::EMPTY,
            farthest: f32::INFINITY,
            settled: 0,
        }
    }

    /// Takes receivers as a light sees them, in place of those before.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        simd: S,
        (receivers, ids): (&'a [Receiver], &[u32]),
        seen: &FacePoints,
        to_tile: &ToTile,
    ) {
        (self.receivers, self.count, self.settled) = (receivers, seen.count, 0);
        (self.packets, self.blocks) = (Bounds::EMPTY, Bounds::EMPTY);
        for (packet, first) in (0..seen.count).step_by(LANES).enumerate() {
            let [x, y] = seen.places_on(simd, first, to_tile);
            let (lo, hi) = seen.keys_on(simd, first, to_tile);
            let eight = first..first + LANES;
            x.store_slice(&mut self.at[0][eight.clone()]);
            y.store_slice(&mut self.at[1][eight.clone()]);
            lo.store_slice(&mut self.lo[eight.clone()]);
            hi.store_slice(&mut self.hi[eight]);
            // What is repeated at the end lies in the packet.
            let sides = [least_of(x), least_of(y), -least_of(-x), -least_of(-y)];
            self.packets.set(packet, sides, least_of(lo));
            for index in first..seen.count.min(first + LANES) {
                let id = ids[usize::from(seen.places[index])];
                (self.ids[index], self.owners[index]) = (id, receivers[id as usize].triangle.0);
            }
        }
        let end = self.count.next_multiple_of(LANES).min(TILE_POINTS);
        self.lo[self.count..end].fill(f32::INFINITY);
        self.hi[self.count..end].fill(f32::INFINITY);
        self.sum_up(simd);
    }

    /// The bounds of blocks from those of packets.
    #[inline(always)]
    fn sum_up<S: Simd>(&mut self, simd: S) {
        self.farthest = f32::INFINITY;
        for block in 0..self.count.div_ceil(LANES * LANES) {
            let (sides, far) = self.packets.union(simd, block);
            self.blocks.set(block, sides, far);
            self.farthest = if far < self.farthest { far } else { self.farthest };
        }
    }

    /// The receivers in shadow.
    pub(crate) fn shadowed(&self) -> impl Iterator<Item = u32> {
        let settled = self.lo[..self.count].iter().zip(&self.ids).filter(|(lo, _)| **lo == f32::INFINITY);
        settled.map(|(_, &id)| id)
    }

    /// Tests eight points from one on with a triangle, and settles what it blocks for certain; tells which are in
    /// doubt.
    #[inline(always)]
    fn test_eight<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        (id, function): (u32, &Functions<S>),
        doubt: f32,
    ) -> u64 {
        let eight = first..first + LANES;
        let [x, y] = [0, 1].map(|k| Narrow::from_slice(simd, &self.at[k][eight.clone()]));
        let least = function.least_edge(x, y);
        let (lowest, highest) = function.keys(x, y);
        let near_lo = Narrow::from_slice(simd, &self.lo[eight.clone()]);
        let kept = (least.simd_ge(-doubt) & highest.simd_ge(near_lo)).to_bitmask();
        if kept == 0 {
            return 0;
        }
        let others = !u32x8::from_slice(simd, &self.owners[eight.clone()]).simd_eq(id);
        let near_hi = Narrow::from_slice(simd, &self.hi[eight.clone()]);
        let certain = least.simd_gt(doubt) & lowest.simd_gt(near_hi) & others;
        let infinite = Narrow::simd_from(simd, f32::INFINITY);
        certain.select(infinite, near_lo).store_slice(&mut self.lo[eight.clone()]);
        certain.select(infinite, near_hi).store_slice(&mut self.hi[eight]);
        let certain = certain.to_bitmask();
        self.settled += certain.count_ones() as usize;
        kept & !certain & others.to_bitmask()
    }
}

/// The functions of a triangle, in all lanes: c, x and y of its edges and its key, and the bounds of the key's c.
pub(crate) struct Functions<S: Simd> {
    edges: [[Narrow<S>; 3]; 3],
    slope: [Narrow<S>; 2],
    bounds: [Narrow<S>; 2],
}

impl<S: Simd> Functions<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, setups: &Setups, lane: usize) -> Self {
        let zero = Narrow::simd_from(simd, 0.0);
        let mut functions = Self { edges: [[zero; 3]; 3], slope: [zero; 2], bounds: [zero; 2] };
        // No closures over vectors: they would lose the instruction set.
        for (edge, parts) in functions.edges.iter_mut().zip(&setups.edges) {
            for (value, part) in edge.iter_mut().zip(parts) {
                *value = Narrow::simd_from(simd, part[lane % LANES]);
            }
        }
        for k in 0..2 {
            functions.slope[k] = Narrow::simd_from(simd, setups.slope[k + 1][lane % LANES]);
            functions.bounds[k] = Narrow::simd_from(simd, setups.bounds[k][lane % LANES]);
        }
        functions
    }

    /// The least edge function.
    #[inline(always)]
    pub(crate) fn least_edge(&self, x: Narrow<S>, y: Narrow<S>) -> Narrow<S> {
        let [one, two, three] = self.edges;
        let one = (one[0] + x * one[1]) + one[2] * y;
        let two = (two[0] + x * two[1]) + two[2] * y;
        let three = (three[0] + x * three[1]) + three[2] * y;
        one.min(two).min(three)
    }

    /// The rectangles of eight, as bits, that the triangle may reach and where it may be nearer than their rays' keys:
    /// an affine function is greatest at a corner.
    #[inline(always)]
    fn reaches<const N: usize>(&self, simd: S, bounds: &Bounds<N>, eight: usize) -> u64 {
        let ([x0, y0, x1, y1], far) = bounds.eight(simd, eight);
        let certain = Narrow::simd_from(simd, -CERTAIN_ON_RECT);
        let mut reached = u64::MAX;
        for [c, x, y] in self.edges {
            let greatest = c + (x0 * x).max(x1 * x) + (y0 * y).max(y1 * y);
            reached &= !greatest.simd_lt(certain).to_bitmask();
        }
        let [x, y] = self.slope;
        let nearest = (x0 * x).max(x1 * x) + (y0 * y).max(y1 * y) + self.bounds[1];
        reached & !nearest.simd_lt(far).to_bitmask() & 0xFF
    }

    /// Bounds of the key.
    #[inline(always)]
    pub(crate) fn keys(&self, x: Narrow<S>, y: Narrow<S>) -> (Narrow<S>, Narrow<S>) {
        let key = x * self.slope[0] + self.slope[1] * y;
        (key + self.bounds[0], key + self.bounds[1])
    }
}

impl LeafDepth for Packets<'_> {
    #[inline(always)]
    fn hides(&self, key: f64) -> bool {
        key < f64::from(self.farthest)
    }

    #[inline(always)]
    fn meets<S: Simd>(&self, simd: S, rect: Rect, key: f32) -> u64 {
        let rect = inclusive(rect);
        let mut met = 0;
        for eight in 0..BLOCKS / LANES {
            met |= self.blocks.meeting(simd, eight, &rect, key) << (eight * LANES);
        }
        met
    }

    #[inline(always)]
    fn refresh<S: Simd>(&mut self, simd: S) {
        if self.settled * REFRESH < self.count || self.settled == 0 {
            return;
        }
        self.settled = 0;
        for (packet, first) in (0..self.count).step_by(LANES).enumerate() {
            let lo = Narrow::from_slice(simd, &self.lo[first..first + LANES]);
            self.packets.far[packet / LANES][packet % LANES] = least_of(lo);
        }
        self.sum_up(simd);
    }

    #[inline(always)]
    fn rasterize<S: Simd>(
        tile: &mut Tile<'_, Self>,
        simd: S,
        (id, lane): (u32, usize),
        (rect, all): (Rect, u64),
        greatest: f32,
        stats: &mut Stats,
    ) {
        let doubt = tile.query.context.doubt();
        let functions = Functions::new(simd, &tile.work.setups, lane);
        let rect = inclusive(rect);
        let mut blocks = all;
        if blocks.count_ones() > FEW_BLOCKS {
            for eight in (0..BLOCKS / LANES).filter(|eight| all >> (eight * LANES) & 0xFF != 0) {
                let reached = functions.reaches(simd, &tile.work.depth.blocks, eight);
                blocks &= !(0xFF << (eight * LANES)) | reached << (eight * LANES);
            }
        }
        for block in bits(blocks) {
            stats.blocks += 1;
            for packet in bits(tile.work.depth.packets.meeting(simd, block % BLOCKS, &rect, greatest)) {
                stats.samples_tested += LANES as u64;
                let first = (block * LANES + packet) * LANES;
                let doubtful = tile.work.depth.test_eight(simd, first, (id, &functions), doubt);
                if doubtful != 0 {
                    tile.decide(first, doubtful, id, stats);
                }
            }
        }
    }
}

/// The first and the last column and row of a rectangle.
#[inline(always)]
fn inclusive(Rect { x0, y0, x1, y1 }: Rect) -> [f32; 4] {
    // Exact: at most 64.
    [x0 as f32, y0 as f32, (x1 - 1) as f32, (y1 - 1) as f32]
}

impl Tile<'_, Packets<'_>> {
    /// Decides some of eight points from one on exactly.
    #[inline(never)]
    fn decide(&mut self, first: usize, doubtful: u64, id: u32, stats: &mut Stats) {
        let packets = &mut self.work.depth;
        let corners = self.query.context.triangles.corners(TriangleId(id));
        for index in bits(doubtful).map(|lane| first + lane) {
            if packets.lo[index] == f32::INFINITY {
                continue;
            }
            let receiver = &packets.receivers[packets.ids[index] as usize];
            // No triangle keeps light from its corners. Common where receivers are vertices.
            if corners.contains(&receiver.point) {
                continue;
            }
            stats.doubtful_samples += 1;
            let triangle = self.query.context.triangles.triangle(id);
            if blocks(self.query.view.origin, receiver, (id, &triangle), stats) {
                (packets.lo[index], packets.hi[index]) = (f32::INFINITY, f32::INFINITY);
                packets.settled += 1;
            }
        }
    }
}
