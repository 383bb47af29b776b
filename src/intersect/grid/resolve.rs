//! Ids and distances of a tile's rays, at its end.
//!
//! A ray refers to a record, which gives its key in f64 as a function of column and row; the distance is 1/key, or −key
//! at infinity. Rays of a row that share a record are done together. Where the key's error leaves doubt about the
//! nearest f32, the exact stage rounds.
//!
//! Based on: Michael Deering et al., "The Triangle Processor and Normal Vector Shader", 1988 (deferred evaluation).

use fearless_simd::{dispatch, prelude::*, u32x8};

use crate::exact::distance::Distance;
use crate::exact::filter::Sign;
use crate::exact::predicates::facing;
use crate::geometry::ray::Ray;
use crate::intersect::grid::depth::{KEY_ERROR, Record, TileDepth};
use crate::intersect::grid::hierarchical_z::BLOCK_SIDE;
use crate::intersect::grid::tile_keys::{SIDE, eight};
use crate::intersect::pencil::leaf::{FilmQuery, Tile};
use crate::intersect::pencil::window::Window;
use crate::rays::hits::{NO_TRIANGLE, Row};
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, Lanes, Narrow, NarrowMask, bits, narrow};
use crate::stats::Stats;

/// The error of a key for 1/key and −key, with their roundings and that of the key to f32.
const T_ERROR: f64 = KEY_ERROR * 1.01;
/// Distances between these are neither subnormal nor saturated.
const PLAIN_T: [f32; 2] = [1e-30, 1e30];
/// The least magnitude of a settled key: less than any.
const SETTLED: f32 = -1.0;

/// 0 to 7.
const COLUMNS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Tile<'_, TileDepth> {
    /// Writes what the rays have hit.
    pub(crate) fn write(&mut self, window: &mut Window<Row<'_>>, stats: &mut Stats) {
        if self.work.depth.keys.ready {
            dispatch!(self.query.context.level, simd => self.write_lanes(simd, window, stats));
        } else {
            window.miss();
        }
    }

    #[inline(always)]
    fn write_lanes<S: Simd>(&mut self, simd: S, window: &mut Window<Row<'_>>, stats: &mut Stats) {
        let (query, rect) = (self.query, self.rect);
        let view = query.view;
        for (j, row) in (0..).zip(&mut window.rows) {
            let ray = |i| view.origin.ray(view.film.at(rect.x0 + i, rect.y0 + j));
            self.work.depth.write(simd, j, row, &query, ray, stats);
        }
    }
}

impl TileDepth {
    /// Writes ids and distances of row `y`. `ray` makes the ray of a column.
    #[inline(always)]
    fn write<S: Simd>(
        &mut self,
        simd: S,
        y: u32,
        (ids, ts): &mut Row<'_>,
        query: &FilmQuery<'_>,
        ray: impl Fn(u32) -> Ray,
        stats: &mut Stats,
    ) {
        let origin = query.view.origin;
        let ((id_eights, last_ids), (t_eights, last_ts)) = (ids.as_chunks_mut(), ts.as_chunks_mut());
        let covered = self.keys.covered[y as usize % SIDE];
        let mut x = 0;
        for (ids, ts) in id_eights.iter_mut().zip(t_eights) {
            let doubtful = self.resolve(simd, (x, y), covered >> x & 0xFF, origin, (ids, ts));
            if doubtful != 0 {
                self.decide(query, (x, y), (ts, doubtful), &ray, stats);
            }
            x += BLOCK_SIDE;
        }
        if !last_ids.is_empty() {
            let (mut ids, mut ts) = ([0; LANES], [0.0; LANES]);
            let covered = covered >> x & ((1 << last_ids.len()) - 1);
            let doubtful = self.resolve(simd, (x, y), covered, origin, (&mut ids, &mut ts));
            if doubtful != 0 {
                self.decide(query, (x, y), (&mut ts, doubtful), &ray, stats);
            }
            last_ids.copy_from_slice(&ids[..last_ids.len()]);
            last_ts.copy_from_slice(&ts[..last_ids.len()]);
        }
    }

    /// Rounds the distances of some of eight rays from column `x` of row `y` exactly. A triangle that faces the film has one distance
    /// for all rays: its record says so from then on, and leaves no more doubt.
    #[inline(never)]
    fn decide(
        &mut self,
        query: &FilmQuery<'_>,
        (x, y): (u32, u32),
        (ts, doubtful): (&mut [f32; LANES], u64),
        ray: impl Fn(u32) -> Ray,
        stats: &mut Stats,
    ) {
        for lane in bits(doubtful) {
            // In range: fewer than eight columns.
            let column = x + lane as u32;
            let number = self.nearest[y as usize % SIDE][column as usize % SIDE];
            let record = &mut self.records[number as usize];
            ts[lane] = record
                .constant(query.view.origin)
                .unwrap_or_else(|| round(record, query, &ray(column), stats));
        }
    }

    /// Ids and rounded distances of eight rays from column `x` of row `y`, of which some have hit something; the lanes
    /// where the nearest f32 is in doubt.
    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        (x, y): (u32, u32),
        covered: u64,
        origin: Origin,
        (ids, ts): (&mut [u32; LANES], &mut [f32; LANES]),
    ) -> u64 {
        if covered == 0 {
            (*ids, *ts) = ([NO_TRIANGLE; LANES], [f32::INFINITY; LANES]);
            return 0;
        }
        let (keys, least) = self.keys(simd, (x, y), covered, ids);
        let t = if matches!(origin, Origin::Point(_)) { Lanes::simd_from(simd, 1.0) / keys } else { -keys };
        // Rounding to f32 is monotonic, so equal ends leave no doubt. NaN is in doubt, and so are distances near to where
        // they saturate.
        let (lo, hi) = (narrow(t * (1.0 - T_ERROR)), narrow(t * (1.0 + T_ERROR)));
        let certain = lo.simd_eq(hi)
            & narrow(keys.abs()).simd_ge(least)
            & lo.simd_gt(PLAIN_T[0])
            & lo.simd_lt(PLAIN_T[1]);
        let hit = NarrowMask::from_bitmask(simd, covered);
        hit.select(lo, Narrow::simd_from(simd, f32::INFINITY)).store_slice(ts);
        covered & !certain.to_bitmask()
    }

    /// Ids and keys of some of eight rays, and the least magnitude of each that gives the distance.
    #[inline(always)]
    fn keys<S: Simd>(
        &self,
        simd: S,
        (x, y): (u32, u32),
        covered: u64,
        ids: &mut [u32; LANES],
    ) -> (Lanes<S>, Narrow<S>) {
        let numbers = eight(&self.nearest[y as usize % SIDE], x);
        let nearest = u32x8::from_slice(simd, numbers);
        let columns = Lanes::load_array(simd, COLUMNS) + f64::from(x);
        let mut all_keys = Lanes::simd_from(simd, f64::NAN);
        let mut all_least = Narrow::simd_from(simd, f32::INFINITY);
        let mut all_ids = u32x8::simd_from(simd, NO_TRIANGLE);
        let mut left = covered;
        // All rays with the record of the first one that is left: mostly one or two rounds.
        while left != 0 {
            let number = numbers[left.trailing_zeros() as usize % LANES];
            let Record { key: [c, along_x, along_y], least, id } = self.records[number as usize];
            let same = nearest.simd_eq(number);
            let keys = (columns * along_x + c) + along_y * f64::from(y);
            let (low, high) = same.widen();
            all_keys = simd.combine_mask64x4(low, high).select(keys, all_keys);
            all_least = same.select(Narrow::simd_from(simd, least), all_least);
            all_ids = same.select(u32x8::simd_from(simd, id), all_ids);
            left &= !same.to_bitmask();
        }
        all_ids.store_slice(ids);
        (all_keys, all_least)
    }
}

impl Record {
    /// The record of a triangle that has one distance for all rays. A key of 1/t or −t errs by two roundings of f64, an f32 has far more
    /// room around it.
    fn settle(&mut self, t: f32, origin: Origin) {
        let t = f64::from(t);
        self.key = [if matches!(origin, Origin::Point(_)) { 1.0 / t } else { -t }, 0.0, 0.0];
        self.least = SETTLED;
    }

    /// The distance of all rays, once it is settled.
    fn constant(&self, origin: Origin) -> Option<f32> {
        let key = self.key[0];
        (self.least == SETTLED)
            .then(|| if matches!(origin, Origin::Point(_)) { (1.0 / key) as f32 } else { -key as f32 })
    }
}

/// Rounds the distance of a ray to the triangle of a record exactly, and settles the record if that is the distance of all rays: d·N
/// (or p·N at infinity) is the same for all, if N·R = N·U = 0.
#[inline(never)]
fn round(record: &mut Record, query: &FilmQuery<'_>, ray: &Ray, stats: &mut Stats) -> f32 {
    let triangle = query.context.triangles.triangle(record.id);
    let t = Distance::new(ray, &triangle).rounded(stats);
    let [_, right, up] = query.view.film.span();
    if facing(right, &triangle) == Sign::Zero && facing(up, &triangle) == Sign::Zero {
        record.settle(t, query.view.origin);
    }
    t
}
