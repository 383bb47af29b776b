//! Ids and distances of a tile's rays, at its end.
//!
//! A ray refers to a record, which gives its key in f64 as a function of column and row; the distance is 1/key, or −key
//! at infinity. Rays of a row that share a record are done together. Where the key's error leaves doubt about the
//! nearest f32, the exact stage rounds.
//!
//! Based on: Michael Deering et al., "The Triangle Processor and Normal Vector Shader", 1988 (deferred evaluation).

use fearless_simd::{dispatch, prelude::*, u32x8};

use crate::exact::predicates::Distance;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangles;
use crate::intersect::context::Context;
use crate::intersect::grid::depth::{KEY_ERROR, Record, TileDepth};
use crate::intersect::grid::hierarchical_z::BLOCK_SIDE;
use crate::intersect::grid::tile_keys::{SIDE, eight};
use crate::intersect::grid::tiles::Window;
use crate::intersect::pencil::leaf::{FilmQuery, Tile};
use crate::intersect::pencil::viewport::Viewport;
use crate::rays::hits::{NO_TRIANGLE, Row};
use crate::rays::origin::Origin;
use crate::simd::lanes::{LANES, Lanes, Narrow, NarrowMask, bits, narrow};

/// The error of a key for 1/key and −key, with their roundings and that of the key to f32.
const T_ERROR: f64 = KEY_ERROR * 1.01;
/// Distances between these are neither subnormal nor saturated.
const PLAIN_T: [f32; 2] = [1e-30, 1e30];

/// 0 to 7.
const COLUMNS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Tile<'_, TileDepth> {
    /// Writes what the rays have hit.
    pub(crate) fn write(&self, window: &mut Window<'_>) {
        if self.work.depth.keys.ready {
            dispatch!(self.query.context.level, simd => self.write_lanes(simd, window));
        } else {
            window.miss();
        }
    }

    #[inline(always)]
    fn write_lanes<S: Simd>(&self, simd: S, window: &mut Window<'_>) {
        let FilmQuery { context: Context { triangles, .. }, view: Viewport { origin, film, .. }, .. } =
            self.query;
        for (j, row) in (0..).zip(&mut window.rows) {
            let ray = |i| origin.ray(film.at(self.rect.x0 + i, self.rect.y0 + j));
            self.work.depth.write(simd, j, row, (*origin, triangles), ray);
        }
    }
}

impl TileDepth {
    /// Writes ids and distances of row `y`. `ray` makes the ray of a column.
    #[inline(always)]
    fn write<S: Simd>(
        &self,
        simd: S,
        y: u32,
        (ids, ts): &mut Row<'_>,
        (origin, triangles): (Origin, &Triangles<'_>),
        ray: impl Fn(u32) -> Ray,
    ) {
        let ((id_eights, last_ids), (t_eights, last_ts)) = (ids.as_chunks_mut(), ts.as_chunks_mut());
        let covered = self.keys.covered[y as usize % SIDE];
        let decide = |x: u32, (ids, ts): (&[u32; LANES], &mut [f32; LANES]), doubtful: u64| {
            for lane in bits(doubtful) {
                // In range: fewer than eight columns.
                ts[lane] = Distance::new(&ray(x + lane as u32), &triangles.triangle(ids[lane])).rounded();
            }
        };
        let mut x = 0;
        for (ids, ts) in id_eights.iter_mut().zip(t_eights) {
            let doubtful = self.resolve(simd, (x, y), covered >> x & 0xFF, origin, (ids, ts));
            decide(x, (ids, ts), doubtful);
            x += BLOCK_SIDE;
        }
        if !last_ids.is_empty() {
            let (mut ids, mut ts) = ([0; LANES], [0.0; LANES]);
            let covered = covered >> x & ((1 << last_ids.len()) - 1);
            let doubtful = self.resolve(simd, (x, y), covered, origin, (&mut ids, &mut ts));
            decide(x, (&ids, &mut ts), doubtful);
            last_ids.copy_from_slice(&ids[..last_ids.len()]);
            last_ts.copy_from_slice(&ts[..last_ids.len()]);
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
