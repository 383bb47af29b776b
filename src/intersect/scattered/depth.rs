//! The nearest hit of each scattered ray of a cluster, while it is worked on, and the farthest of blocks of rays. Those of
//! tiles are in [`crate::intersect::grid::depth`].
//!
//! Each ray keeps an interval that holds its depth key (greater is nearer), and an id. Where the interval of a candidate
//! overlaps it, the exact order decides. Blocks keep a lower bound of their rays' keys: what lies behind it is hidden from
//! all of them. A lower bound that is out of date is still one, so it is refreshed only now and then.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use fearless_simd::prelude::*;

use crate::exact::distance::{Distance, compare};
use crate::exact::filter::Sign;
use crate::geometry::aabb::U;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::Triangles;
use crate::intersect::grid::tiles::Row;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::pencil::Origin;
use crate::simd::lanes::{LANES, Lanes, Narrow, bits, narrow};
use crate::stats::Stats;

/// The most rays in a block. A sub-pencil has at most 64 blocks.
pub(crate) const BLOCK: usize = 64;

/// A hit that is to be compared with the nearest one: its key lies in [lo, hi].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) id: u32,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

/// What the rays of a sub-pencil have hit so far.
#[derive(Debug)]
pub(crate) struct DepthBuffer {
    /// Bounds of each ray's key: −∞ for none, +∞ where nothing more matters.
    lo: Vec<f64>,
    hi: Vec<f64>,
    ids: Vec<u32>,
    /// Per block of [`BLOCK`] rays, a lower bound of their keys.
    far: Vec<f64>,
    /// Blocks whose bound is out of date.
    stale: u64,
    /// The least of `far`.
    farthest: f64,
}

impl DepthBuffer {
    /// A buffer for `rays` rays (rounded up to a multiple of eight), none of which has hit anything.
    pub(crate) fn new(rays: usize) -> Self {
        let rays = rays.next_multiple_of(LANES);
        let blocks = rays.div_ceil(BLOCK);
        Self {
            lo: vec![f64::NEG_INFINITY; rays],
            hi: vec![f64::NEG_INFINITY; rays],
            ids: vec![NO_TRIANGLE; rays],
            far: vec![f64::NEG_INFINITY; blocks],
            stale: all_blocks(blocks),
            farthest: f64::NEG_INFINITY,
        }
    }

    /// Notes that the bound of a block is out of date.
    fn mark_stale(&mut self, block: usize) {
        self.stale |= 1 << block;
    }

    /// Brings the lower bounds up to date. O(rays of stale blocks).
    pub(crate) fn refresh(&mut self) {
        if self.stale == 0 {
            return;
        }
        for block in bits(std::mem::take(&mut self.stale)) {
            let end = (block * BLOCK + BLOCK).min(self.lo.len());
            self.far[block] = least(&self.lo[block * BLOCK..end]);
        }
        self.farthest = least(&self.far);
    }

    /// Whether something whose keys are at most `key` is hidden from all rays.
    pub(crate) fn hides(&self, key: f64) -> bool {
        key < self.farthest
    }

    /// Bounds of the keys of eight rays.
    #[inline(always)]
    pub(crate) fn keys<S: Simd>(&self, simd: S, first: usize) -> [Lanes<S>; 2] {
        let places = first..first + LANES;
        [Lanes::from_slice(simd, &self.lo[places.clone()]), Lanes::from_slice(simd, &self.hi[places])]
    }

    /// Whether the candidate is certainly farther than what the ray has hit.
    pub(crate) fn is_behind(&self, ray: usize, candidate: &Candidate) -> bool {
        candidate.hi < self.lo[ray]
    }

    /// Keeps the nearer of the candidate and what the ray has hit. `exact` makes the ray; `None` lets keys decide.
    pub(crate) fn offer(
        &mut self,
        index: usize,
        candidate: Candidate,
        triangles: &Triangles<'_>,
        exact: Option<&dyn Fn() -> Ray>,
        stats: &mut Stats,
    ) {
        let (lo, hi, id) = (self.lo[index], self.hi[index], self.ids[index]);
        let nearer = if id == NO_TRIANGLE || candidate.lo > hi {
            true
        } else if candidate.hi < lo {
            false
        } else if let Some(ray) = exact {
            precedes(&ray(), candidate.id, id, triangles, stats)
        } else {
            let (key, nearest) = (candidate.lo + candidate.hi, lo + hi);
            key > nearest || (key == nearest && candidate.id < id)
        };
        if nearer {
            (self.lo[index], self.hi[index], self.ids[index]) = (candidate.lo, candidate.hi, candidate.id);
            self.mark_stale(index / BLOCK);
        }
    }

    /// Notes that a ray has hit something and that nothing more about it matters.
    pub(crate) fn settle(&mut self, index: usize, id: u32) {
        (self.lo[index], self.hi[index], self.ids[index]) = (f64::INFINITY, f64::INFINITY, id);
        self.mark_stale(index / BLOCK);
    }

    /// Writes ids and distances of at most eight rays, the first of them at a multiple of eight. `ray` makes the ray with an
    /// index.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &self,
        simd: S,
        first: usize,
        (ids, ts): &mut Row<'_>,
        origin: Origin,
        triangles: &Triangles<'_>,
        ray: impl Fn(usize) -> Ray,
        stats: &mut Stats,
    ) {
        let count = ids.len();
        let [lo, hi] = self.keys(simd, first);
        let (rounded, doubtful) = rounded_distances(simd, lo, hi, origin);
        ids.copy_from_slice(&self.ids[first..first + count]);
        ts.copy_from_slice(&rounded.to_array()[..count]);
        for lane in bits(doubtful & ((1 << count) - 1)) {
            ts[lane] = Distance::new(&ray(lane), &triangles.triangle(ids[lane])).rounded(stats);
        }
    }
}

/// One bit per block, for 1 to 64 blocks.
fn all_blocks(blocks: usize) -> u64 {
    u64::MAX >> (64 - blocks)
}

/// The least of some numbers that are not NaN. Eight at a time, which the compiler turns into vectors.
fn least(keys: &[f64]) -> f64 {
    let (eights, rest) = keys.as_chunks::<LANES>();
    let mut least = [f64::INFINITY; LANES];
    for eight in eights {
        for (least, &key) in least.iter_mut().zip(eight) {
            *least = if key < *least { key } else { *least };
        }
    }
    least.iter().chain(rest).fold(f64::INFINITY, |least, &key| if key < least { key } else { least })
}

/// t of keys in [lo, hi], rounded (+∞ where nothing was hit, and where nobody asks), and the lanes, as bits, where the
/// nearest f32 is in doubt.
#[inline(always)]
fn rounded_distances<S: Simd>(simd: S, lo: Lanes<S>, hi: Lanes<S>, origin: Origin) -> (Narrow<S>, u64) {
    let zero = Lanes::simd_from(simd, 0.0);
    let (least, greatest, valid) = match origin {
        Origin::Point(_) => ((zero + 1.0) / hi, (zero + 1.0) / lo, lo.simd_gt(zero)),
        Origin::Infinity(_) => (-hi, -lo, hi.simd_lt(zero)),
    };
    // Misses have keys of −∞, settled rays of +∞.
    let nothing = hi.simd_eq(zero + f64::NEG_INFINITY) | lo.simd_eq(zero + f64::INFINITY);
    // A quotient: one rounding. Rounding to f32 is monotonic, so equal ends leave no doubt.
    let (smallest, largest) = (f64::from(f32::from_bits(1)), f64::from(f32::MAX));
    let least = (least * (1.0 - 2.0 * U)).max(smallest).min(largest);
    let greatest = (greatest * (1.0 + 2.0 * U)).max(smallest).min(largest);
    let least = nothing.select(zero + f64::INFINITY, least);
    let (least, greatest) = (narrow(least), narrow(greatest));
    let certain = (least.simd_eq(greatest).to_bitmask() & valid.to_bitmask()) | nothing.to_bitmask();
    (least, !certain & 0xFF)
}

/// Whether the first triangle comes before the second along the ray by (t, id), exactly.
pub(crate) fn precedes(
    ray: &Ray,
    first: u32,
    second: u32,
    triangles: &Triangles<'_>,
    stats: &mut Stats,
) -> bool {
    let (one, other) = (triangles.triangle(first), triangles.triangle(second));
    match compare(ray, &one, &other, stats) {
        Sign::Negative => true,
        Sign::Zero => first < second,
        Sign::Positive => false,
    }
}
