//! The last step of the leaf: a triangle that was set up against the rays of a tile, block by block (8x8 rays), row by
//! row.
//!
//! Triangles of at most eight columns go straight to the rows. For others a row of eight blocks is looked at together:
//! blocks on which an edge function is negative are dropped, so are those where the triangle lies behind all that they
//! have hit, and where all edge functions are positive they are not evaluated again. Where the bound of f32 leaves
//! doubt about a ray, the exact stage decides: it asks f64 first.
//!
//! The rows are f32: on fourteen real scenes 0.015 % of the samples are left in doubt, and eight rays fit one register
//! of AVX2. Rows of f64 took twice as many instructions for a frame (koala: 308 million with them and what else was new
//! since, now 131). Keys of f64 kept per ray were written with masked stores, 7 % of the time on sponza: hits refer to
//! records now.
//!
//! Tried and dropped: small triangles side by side, the lanes being triangles instead of rays. Their hits must be kept
//! one by one: 2 % fewer instructions for a million triangles, 2 % more on koala, whichever size counted as small.
//!
//! Based on: Juan Pineda, "A Parallel Algorithm for Polygon Rasterization", 1988 (edge functions); Ned Greene,
//! "Hierarchical Polygon Tiling with Coverage Masks", 1996.

use std::ops::Range;

use fearless_simd::prelude::*;

use crate::exact::filter::Sign;
use crate::exact::predicates::covers;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangles;
use crate::intersect::grid::depth::{Candidate, FewRecords, Record, TileDepth};
use crate::intersect::grid::hierarchical_z::BLOCK_SIDE;
use crate::intersect::grid::relations::Relation;
use crate::intersect::pencil::leaf::{FilmQuery, LeafDepth, Tile};
use crate::intersect::pencil::rect::{Rect, TILE_SIDE};
use crate::intersect::pencil::setup::Setups;
use crate::rays::hits::precedes;
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, Narrow, bits};
use crate::stats::Stats;

/// 0 to 7.
const COLUMNS: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
/// The middle columns of the blocks, and half of their width.
const MIDDLES: [f32; LANES] = [3.5, 11.5, 19.5, 27.5, 35.5, 43.5, 51.5, 59.5];
const HALF: f32 = 3.5;

/// Edge functions are certain beyond ±1. Their range over a block adds a few roundings of at most a fifth of that each.
const CERTAIN_ON_BLOCK: f32 = 2.0;

/// An affine function on eight columns: at row 0, and its step from row to row.
#[derive(Clone, Copy)]
struct Columns<S: Simd> {
    start: Narrow<S>,
    along_y: Narrow<S>,
}

impl<S: Simd> Columns<S> {
    /// c + xv_x + yv_y on columns x, from a lane of a setup.
    #[inline(always)]
    fn new(simd: S, x: Narrow<S>, [c, along_x, along_y]: &[[f32; LANES]; 3], lane: usize) -> Self {
        let lane = lane % LANES;
        let c = Narrow::simd_from(simd, c[lane]);
        let along_y = Narrow::simd_from(simd, along_y[lane]);
        Self { start: c + x * along_x[lane], along_y }
    }

    #[inline(always)]
    fn at(self, y: f32) -> Narrow<S> {
        self.start + self.along_y * y
    }
}

/// The functions of a triangle on eight columns: its edges, its key but for the c, and bounds of that.
struct OnColumns<S: Simd> {
    edges: [Columns<S>; 3],
    slope: Columns<S>,
    lowest: Narrow<S>,
    highest: Narrow<S>,
}

impl<S: Simd> OnColumns<S> {
    /// On the columns from `x` on. No closures over vectors: they would lose the instruction set and be called, not
    /// inlined.
    #[inline(always)]
    fn new(simd: S, setups: &Setups, lane: usize, x: u32) -> Self {
        let columns = Narrow::load_array(simd, COLUMNS) + x as f32;
        let [one, two, three] = &setups.edges;
        let [lowest, highest] = &setups.bounds;
        Self {
            edges: [
                Columns::new(simd, columns, one, lane),
                Columns::new(simd, columns, two, lane),
                Columns::new(simd, columns, three, lane),
            ],
            slope: Columns::new(simd, columns, &setups.slope, lane),
            lowest: Narrow::simd_from(simd, lowest[lane % LANES]),
            highest: Narrow::simd_from(simd, highest[lane % LANES]),
        }
    }

    /// The least edge function on a row.
    #[inline(always)]
    fn least_edge(&self, y: f32) -> Narrow<S> {
        let [one, two, three] = self.edges;
        one.at(y).min(two.at(y)).min(three.at(y))
    }
}

/// A triangle on its way through the blocks of a tile.
#[derive(Clone, Copy)]
struct Primitive {
    id: u32,
    /// Its lane in the setups.
    lane: usize,
    /// The record that its hits refer to.
    record: u32,
    /// An upper bound of its keys.
    greatest: f32,
}

impl LeafDepth for TileDepth {
    #[inline(always)]
    fn hides(&self, key: f64) -> bool {
        self.keys.blocks.hides(key)
    }

    /// All of the rays are one part.
    #[inline(always)]
    fn meets<S: Simd>(&self, simd: S, rect: Rect, key: f32) -> u64 {
        u64::from(!self.keys.blocks.hides_in_rect(simd, rect, key))
    }

    #[inline(always)]
    fn drops_copy(&mut self, triangles: &Triangles<'_>, id: u32) -> bool {
        self.twins.hide(triangles, id)
    }

    #[inline(always)]
    fn refresh<S: Simd>(&mut self, simd: S) {
        self.keys.refresh_blocks(simd);
    }

    #[inline(always)]
    fn rasterize<S: Simd>(
        tile: &mut Tile<'_, Self>,
        simd: S,
        (id, lane): (u32, usize),
        (rect, _): (Rect, u64),
        greatest: f32,
        stats: &mut Stats,
    ) {
        if !tile.work.depth.keys.ready {
            tile.work.depth.make_ready();
        }
        tile.work.depth.relations.begin();
        let record = tile.work.depth.next_record();
        let primitive = Primitive { id, lane, record, greatest };
        let hit = if rect.width() <= BLOCK_SIDE {
            // One row of lanes is enough, wherever it begins.
            let x = rect.x0.min(TILE_SIDE - BLOCK_SIDE);
            tile.intersect_rows::<S, false, false>(
                simd,
                primitive,
                ((x, rect.y0..rect.y1), &FewRecords::NONE),
                stats,
            )
        } else {
            tile.intersect_blocks(simd, primitive, rect, stats)
        };
        if hit {
            let depth = &mut tile.work.depth;
            let [c, x, y, error] = tile.work.setups.key.each_ref().map(|part| part[lane % LANES]);
            depth.record(Record::new(id, [c, x, y], error));
            depth.keys.blocks.mark_stale(rect.y0..rect.y1);
        }
    }
}

impl Tile<'_, TileDepth> {
    /// Tests one triangle block by block; tells whether any ray hit it.
    #[inline(always)]
    fn intersect_blocks<S: Simd>(
        &mut self,
        simd: S,
        primitive: Primitive,
        rect: Rect,
        stats: &mut Stats,
    ) -> bool {
        let mut hit = false;
        let blocks = (2_u64 << ((rect.x1 - 1) / BLOCK_SIDE)) - (1 << (rect.x0 / BLOCK_SIDE));
        for by in rect.y0 / BLOCK_SIDE..=(rect.y1 - 1) / BLOCK_SIDE {
            let (met, inside) = self.classify(simd, (primitive.lane, primitive.greatest), by, blocks);
            let rows = rect.y0.max(by * BLOCK_SIDE)..rect.y1.min((by + 1) * BLOCK_SIDE);
            for bx in bits(met) {
                // In range: eight blocks.
                let part = (bx as u32 * BLOCK_SIDE, rows.clone());
                let known = if self.work.depth.relations.are_found() {
                    self.behind_on_block(primitive, &part, stats)
                } else {
                    None
                };
                let none = &FewRecords::NONE;
                hit |= match (inside >> bx & 1 == 1, &known) {
                    (_, Some(behind)) if behind.is_empty() => false,
                    (true, None) => {
                        self.intersect_rows::<S, true, false>(simd, primitive, (part, none), stats)
                    }
                    (false, None) => {
                        self.intersect_rows::<S, false, false>(simd, primitive, (part, none), stats)
                    }
                    (true, Some(behind)) => {
                        self.intersect_rows::<S, true, true>(simd, primitive, (part, behind), stats)
                    }
                    (false, Some(behind)) => {
                        self.intersect_rows::<S, false, true>(simd, primitive, (part, behind), stats)
                    }
                };
            }
        }
        hit
    }

    /// Of some blocks of a row of blocks: those that a triangle may meet, given its lane and an upper bound of its
    /// keys, and those on which all rays are inside.
    #[inline(always)]
    fn classify<S: Simd>(&self, simd: S, (lane, greatest): (usize, f32), by: u32, blocks: u64) -> (u64, u64) {
        let lane = lane % LANES;
        let setups = &self.work.setups;
        let x = Narrow::load_array(simd, MIDDLES);
        let y = (by * BLOCK_SIDE) as f32 + HALF;
        let certain = Narrow::simd_from(simd, CERTAIN_ON_BLOCK);
        let (mut met, mut inside) = (blocks, blocks);
        for parts in &setups.edges {
            let middle = Columns::new(simd, x, parts, lane).at(y);
            let range = (parts[1][lane].abs() + parts[2][lane].abs()) * HALF;
            met &= !(middle + range).simd_lt(-certain).to_bitmask();
            inside &= (middle - range).simd_gt(certain).to_bitmask();
        }
        let [_, along_x, along_y] = &setups.slope;
        let range = (along_x[lane].abs() + along_y[lane].abs()) * HALF;
        let nearest = Columns::new(simd, x, &setups.slope, lane).at(y) + (range + setups.bounds[1][lane]);
        met &= !nearest.min(greatest).simd_lt(self.work.depth.keys.blocks.far(simd, by)).to_bitmask();
        (met, inside & met)
    }

    /// Tests one triangle against eight columns of some rows of rays, all of them `INSIDE` its edges or not; tells whether
    /// any of them hit it. Where it is `KNOWN`, all rays have hit something, and the triangle lies before the records that are `behind` it
    /// and after all others.
    #[inline(always)]
    fn intersect_rows<S: Simd, const INSIDE: bool, const KNOWN: bool>(
        &mut self,
        simd: S,
        primitive: Primitive,
        ((x, rows), behind): ((u32, Range<u32>), &FewRecords),
        stats: &mut Stats,
    ) -> bool {
        let FilmQuery { context, view, any, .. } = self.query;
        let zero = Narrow::simd_from(simd, 0.0);
        let doubt = context.doubt();
        let triangle = OnColumns::new(simd, &self.work.setups, primitive.lane, x);
        stats.blocks += 1;
        stats.samples_tested += u64::from(rows.end - rows.start) * LANES as u64;
        let mut hit = false;
        for j in rows {
            let y = j as f32;
            // Not behind what the ray has hit, and not outside for certain.
            let key = triangle.slope.at(y);
            let (hi, near_lo) = (key + triangle.highest, self.work.depth.keys.lo(simd, x, j));
            let least = if INSIDE { zero } else { triangle.least_edge(y) };
            let mut kept =
                if KNOWN { self.work.depth.having(simd, (x, j), behind) } else { hi.simd_ge(near_lo) };
            let first = kept;
            if !INSIDE {
                kept &= least.simd_ge(-doubt);
            }
            let mut kept = kept.to_bitmask();
            if kept == 0 {
                continue;
            }
            // Before what the ray has hit, and inside, for certain.
            let (lo, near_hi) = (key + triangle.lowest, self.work.depth.keys.hi(simd, x, j));
            let mut sure = if KNOWN { first } else { lo.simd_gt(near_hi) };
            if !INSIDE {
                sure &= least.simd_gt(doubt);
            }
            if matches!(view.origin, Origin::Infinity(_)) {
                // Rays start at their start points.
                kept &= lo.simd_le(zero).to_bitmask();
                sure &= hi.simd_lt(zero);
            }
            // What is certain is kept as it is; the rest goes to the exact stage.
            let certain = sure.to_bitmask();
            if certain != 0 {
                let [lo, hi] = if any { [zero + f32::INFINITY; 2] } else { [lo, hi] };
                let bounds = [[lo, near_lo], [hi, near_hi]];
                self.work.depth.keep(simd, (x, j), sure, bounds, primitive.record);
                hit = true;
            }
            if kept != certain {
                let bounds = [lo.to_array(), hi.to_array()];
                let mut inside = if INSIDE { !0 } else { least.simd_gt(doubt).to_bitmask() };
                if matches!(self.query.view.origin, Origin::Infinity(_)) {
                    inside &= hi.simd_lt(zero).to_bitmask();
                }
                hit |= self.decide_all(primitive, bounds, (x, j), [kept & !certain, inside], stats);
            }
        }
        hit
    }

    /// Decides some of eight rays from column `x` of row `j` exactly; those that are `inside` hit the triangle for certain, and only the
    /// order is in doubt. Tells whether the triangle is the nearest of any of them.
    #[inline(never)]
    fn decide_all(
        &mut self,
        primitive: Primitive,
        [lo, hi]: [[f32; LANES]; 2],
        (x, j): (u32, u32),
        [mut lanes, inside]: [u64; 2],
        stats: &mut Stats,
    ) -> bool {
        let mut hit = false;
        let candidate = |lane: usize| Candidate { lo: lo[lane], hi: hi[lane], record: primitive.record };
        let mut ordered = if self.query.context.is_exact() { lanes & inside } else { 0 };
        // All rays with the record of the first one that is left.
        while ordered != 0 {
            let (same, number) = self.work.depth.with_first((x, j), ordered);
            ordered &= !same;
            let [decided, nearer] = self.precedes_record(primitive, number, ((x, j), same), stats);
            stats.doubtful_samples += u64::from(decided.count_ones());
            lanes &= !decided;
            if nearer != 0 {
                self.work.depth.put_some((x, j), nearer, [&lo, &hi], primitive.record);
                hit = true;
            }
        }
        bits(lanes)
            .fold(hit, |hit, lane| self.decide(primitive, candidate(lane), (x + lane as u32, j), stats) | hit)
    }

    /// Of some of eight rays from column `x` of row `j` that have hit the triangle of a record: those where it is known which of the two
    /// comes first, and of these those where it is the triangle at hand.
    fn precedes_record(
        &mut self,
        Primitive { id, lane, .. }: Primitive,
        number: u32,
        ((x, j), rays): ((u32, u32), u64),
        stats: &mut Stats,
    ) -> [u64; 2] {
        let Some(&Record { id: other, .. }) = self.work.depth.records.get(number as usize) else {
            return [0; 2];
        };
        match self.relation((id, lane), (number, rays.count_ones()), stats) {
            Relation::Nearer => [rays; 2],
            Relation::Equal => [rays, if id < other { rays } else { 0 }],
            Relation::Farther => [rays, 0],
            Relation::Along(order) => {
                // In range: eight columns.
                let sign = |lane: usize| self.order_at(order, [x + lane as u32, j]);
                bits(rays).fold([0; 2], |[decided, nearer], lane| match sign(lane) {
                    Some(Sign::Positive) => [decided | 1 << lane, nearer | 1 << lane],
                    Some(_) => [decided | 1 << lane, nearer],
                    None => [decided, nearer],
                })
            }
            Relation::Asked(_) => [0; 2],
        }
    }

    /// Of the records that the rays of some rows of a block have, those that lie behind a triangle; the others lie before it. `None` where that
    /// is not known of all.
    #[inline(never)]
    fn behind_on_block(
        &mut self,
        primitive: Primitive,
        (x, rows): &(u32, Range<u32>),
        stats: &mut Stats,
    ) -> Option<FewRecords> {
        let records = self.work.depth.block_records(*x, rows.clone())?;
        let corners = [[*x, rows.start], [*x + BLOCK_SIDE - 1, rows.end - 1]];
        records.split(|number| self.precedes_on(primitive, number, corners, stats))
    }

    /// Whether a triangle comes before that of a record along all rays from one corner of a rectangle to the other, or after it, if that
    /// is known. What is affine has the sign of its corners.
    fn precedes_on(
        &mut self,
        Primitive { id, lane, .. }: Primitive,
        number: u32,
        [[x0, y0], [x1, y1]]: [[u32; 2]; 2],
        stats: &mut Stats,
    ) -> Option<bool> {
        let other = self.work.depth.records.get(number as usize)?.id;
        match self.relation((id, lane), (number, 0), stats) {
            Relation::Nearer => Some(true),
            Relation::Equal => Some(id < other),
            Relation::Farther => Some(false),
            Relation::Along(order) => {
                let sign = self.order_at(order, [x0, y0])?;
                let same = |at| self.order_at(order, at) == Some(sign);
                [[x1, y0], [x0, y1], [x1, y1]].into_iter().all(same).then_some(sign == Sign::Positive)
            }
            Relation::Asked(_) => None,
        }
    }

    /// Decides one ray exactly: coverage, then the order. Tells whether it hit the triangle.
    fn decide(
        &mut self,
        Primitive { id, lane, .. }: Primitive,
        candidate: Candidate,
        (i, j): (u32, u32),
        stats: &mut Stats,
    ) -> bool {
        let FilmQuery { context, view, any, .. } = self.query;
        let (triangles, exact) = (context.triangles, context.is_exact());
        if i >= self.rect.width() || j >= self.rect.height() {
            return false;
        }
        stats.doubtful_samples += 1;
        let at = view.film.at(self.rect.x0 + i, self.rect.y0 + j);
        let ray = || -> Ray { view.origin.ray(at) };
        if exact {
            let (triangle, ties) = (triangles.triangle(id), stats.edge_ties);
            let covers = covers(&ray(), &triangle, view.origin.ties(), stats);
            if stats.edge_ties > ties {
                self.meet_edge();
            }
            if !covers {
                return false;
            }
        }
        if any {
            let settled = Candidate { lo: f32::INFINITY, hi: f32::INFINITY, ..candidate };
            self.work.depth.put(i, j, settled);
            return true;
        }
        let nearer = match self.work.depth.nearest(i, j) {
            None => true,
            Some((nearest, _)) if candidate.lo > nearest.hi => true,
            Some((nearest, _)) if candidate.hi < nearest.lo => false,
            Some((_, other)) if exact => precedes(&ray(), id, other, triangles, stats),
            Some((nearest, other)) => {
                let [c, x, y, _] = self.work.setups.key.each_ref().map(|part| part[lane]);
                let key = c + x * f64::from(i) + y * f64::from(j);
                let nearest = self.work.depth.key(nearest.record, i, j);
                key > nearest || (key == nearest && id < other)
            }
        };
        if nearer {
            self.work.depth.put(i, j, candidate);
        }
        nearer
    }
}
