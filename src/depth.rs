//! The nearest hit of each ray of a sub-pencil, while it is worked on, and the farthest of blocks of rays.
//!
//! Each ray keeps an interval that holds its depth key (greater is nearer), and an id. Where the interval of a candidate
//! overlaps it, the exact order decides. Blocks keep a lower bound of their rays' keys: what lies behind it is hidden from
//! all of them. A lower bound that is out of date is still one, so it is refreshed only now and then.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use std::mem::size_of;

use crate::approx::Sign;
use crate::bounds::U;
use crate::hits::NO_TRIANGLE;
use crate::lanes::{LANES, bits};
use crate::pencil::Origin;
use crate::predicates::{Distance, saturate};
use crate::ray::Ray;
use crate::triangles::Triangles;
use crate::window::Row;

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
    pub(crate) lo: Vec<f64>,
    pub(crate) hi: Vec<f64>,
    pub(crate) ids: Vec<u32>,
    /// Per block of [`BLOCK`] rays, a lower bound of their keys.
    far: Vec<f64>,
    /// Blocks whose bound is out of date.
    stale: u64,
    /// The least of `far`.
    farthest: f64,
}

impl DepthBuffer {
    /// A buffer for `rays` rays, none of which has hit anything.
    pub(crate) fn new(rays: usize) -> Self {
        let blocks = rays.div_ceil(BLOCK);
        Self {
            lo: vec![f64::NEG_INFINITY; rays],
            hi: vec![f64::NEG_INFINITY; rays],
            ids: vec![NO_TRIANGLE; rays],
            far: vec![f64::NEG_INFINITY; blocks],
            stale: (1_u64 << (blocks - 1) << 1).wrapping_sub(1),
            farthest: f64::NEG_INFINITY,
        }
    }

    /// Bytes of a buffer for some rays.
    pub(crate) fn bytes_for(rays: usize) -> usize {
        rays * (2 * size_of::<f64>() + size_of::<u32>()) + rays.div_ceil(BLOCK) * size_of::<f64>()
    }

    /// Marks rays that do not exist as hit by everything, so that they hide what they can.
    pub(crate) fn exclude(&mut self, ray: usize) {
        (self.lo[ray], self.hi[ray]) = (f64::INFINITY, f64::INFINITY);
    }

    /// Notes that the bound of a block is out of date.
    pub(crate) fn mark_stale(&mut self, block: usize) {
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

    /// Whether something whose keys are at most `key` is hidden from a block.
    pub(crate) fn hides_in_block(&self, block: usize, key: f64) -> bool {
        key < self.far[block]
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
        ambiguous: &mut u64,
    ) {
        let (lo, hi, id) = (self.lo[index], self.hi[index], self.ids[index]);
        let nearer = if id == NO_TRIANGLE || candidate.lo > hi {
            true
        } else if candidate.hi < lo {
            false
        } else if let Some(ray) = exact {
            precedes(&ray(), candidate.id, id, triangles, ambiguous)
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

    /// Writes ids and distances of consecutive rays. `ray` makes the ray with an index.
    pub(crate) fn write(
        &self,
        first: usize,
        (ids, ts): &mut Row<'_>,
        origin: Origin,
        triangles: &Triangles<'_>,
        ray: impl Fn(usize) -> Ray,
    ) {
        for (place, (id, t)) in ids.iter_mut().zip(ts.iter_mut()).enumerate() {
            let index = first + place;
            *id = self.ids[index];
            if *id == NO_TRIANGLE || self.lo[index] == f64::INFINITY {
                // Missed, or settled: nobody asks for the distance.
                continue;
            }
            *t = rounded_distance(self.lo[index], self.hi[index], origin)
                .unwrap_or_else(|| Distance::new(&ray(place), &triangles.triangle(*id)).rounded());
        }
    }
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

/// t of a key in [lo, hi], where that leaves no doubt about the nearest f32.
fn rounded_distance(lo: f64, hi: f64, origin: Origin) -> Option<f32> {
    let (least, greatest) = match origin {
        Origin::Point(_) if lo > 0.0 => (1.0 / hi, 1.0 / lo),
        Origin::Infinity(_) if hi < 0.0 => (-hi, -lo),
        _ => return None,
    };
    // A quotient: one rounding.
    let (least, greatest) = (saturate(least * (1.0 - 2.0 * U)), saturate(greatest * (1.0 + 2.0 * U)));
    (least == greatest).then_some(least)
}

/// Whether the first triangle comes before the second along the ray by (t, id), exactly.
pub(crate) fn precedes(
    ray: &Ray,
    first: u32,
    second: u32,
    triangles: &Triangles<'_>,
    ambiguous: &mut u64,
) -> bool {
    let (one, other) = (triangles.triangle(first), triangles.triangle(second));
    match Distance::new(ray, &one).compare(&Distance::new(ray, &other), ambiguous) {
        Sign::Negative => true,
        Sign::Zero => first < second,
        Sign::Positive => false,
    }
}
