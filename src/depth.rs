//! The nearest hit of each ray of a sub-pencil, while it is worked on, and the farthest of blocks of rays.
//!
//! Each ray keeps a depth key (greater is nearer) with a bound of its error, and an id. Where two keys lie within their
//! errors the exact order decides. Blocks keep a lower bound of their rays' keys: what lies behind it is hidden from all of
//! them. A lower bound that is out of date is still one, so it is refreshed only now and then.
//!
//! Based on: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical Z-Buffer Visibility", 1993; Jon Hasselgren, Magnus
//! Andersson, Tomas Akenine-Möller, "Masked Software Occlusion Culling", 2016 (lazy updates).

use std::mem::size_of;

use crate::approx::Sign;
use crate::bounds::U;
use crate::hits::NO_TRIANGLE;
use crate::pencil::Origin;
use crate::predicates::{Distance, saturate};
use crate::ray::Ray;
use crate::triangles::Triangles;
use crate::window::Row;

/// The most rays in a block.
pub(crate) const BLOCK: usize = 64;

/// The nearest hit of one ray so far.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    /// −∞ for none.
    key: f64,
    /// |true key − key|.
    error: f64,
    id: u32,
}

const NOTHING: Nearest = Nearest {
    key: f64::NEG_INFINITY,
    error: 0.0,
    id: NO_TRIANGLE,
};

/// A hit that is to be compared with the nearest one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) id: u32,
    pub(crate) key: f64,
    pub(crate) error: f64,
}

/// What the rays of a sub-pencil have hit so far.
#[derive(Debug)]
pub(crate) struct DepthBuffer {
    rays: Vec<Nearest>,
    /// Per block of [`BLOCK`] rays, a lower bound of their keys.
    far: Vec<f64>,
    /// Blocks whose bound is out of date.
    stale: Vec<bool>,
    /// The least of `far`.
    farthest: f64,
}

impl DepthBuffer {
    /// A buffer for `rays` rays, none of which has hit anything.
    pub(crate) fn new(rays: usize) -> Self {
        let blocks = rays.div_ceil(BLOCK);
        Self {
            rays: vec![NOTHING; rays],
            far: vec![f64::NEG_INFINITY; blocks],
            stale: vec![false; blocks],
            farthest: f64::NEG_INFINITY,
        }
    }

    /// Bytes kept.
    pub(crate) fn bytes(&self) -> usize {
        self.rays.capacity() * size_of::<Nearest>() + self.far.capacity() * (size_of::<f64>() + 1)
    }

    /// Marks rays that do not exist as hit by everything, so that they hide what they can.
    pub(crate) fn exclude(&mut self, ray: usize) {
        self.rays[ray].key = f64::INFINITY;
    }

    /// Notes that no lower bound is up to date.
    pub(crate) fn mark_all_stale(&mut self) {
        self.stale.fill(true);
    }

    /// Brings the lower bounds up to date. O(rays of stale blocks).
    pub(crate) fn refresh(&mut self) {
        for block in 0..self.far.len() {
            if self.stale[block] {
                self.stale[block] = false;
                let end = (block * BLOCK + BLOCK).min(self.rays.len());
                let keys = self.rays[block * BLOCK..end]
                    .iter()
                    .map(|ray| ray.key - ray.error);
                // One rounding of the difference, toward −∞ at worst.
                let least = keys.fold(
                    f64::INFINITY,
                    |least, key| if key < least { key } else { least },
                );
                self.far[block] = if least.is_finite() {
                    least - least.abs() * U
                } else {
                    least
                };
            }
        }
        self.farthest = self.far.iter().fold(
            f64::INFINITY,
            |least, &key| if key < least { key } else { least },
        );
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
        let nearest = &self.rays[ray];
        candidate.key + candidate.error < nearest.key - nearest.error
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
        let nearest = self.rays[index];
        // Both sums round once; errors are bounded with room for that.
        let reach =
            (candidate.error + nearest.error) * (1.0 + 4.0 * U) + candidate.key.abs() * (2.0 * U);
        let gap = candidate.key - nearest.key;
        let replace = if nearest.id == NO_TRIANGLE || gap > reach {
            true
        } else if gap < -reach {
            false
        } else if let Some(ray) = exact {
            precedes(&ray(), candidate.id, nearest.id, triangles, ambiguous)
        } else {
            gap > 0.0 || (gap == 0.0 && candidate.id < nearest.id)
        };
        if replace {
            self.rays[index] = Nearest {
                key: candidate.key,
                error: candidate.error,
                id: candidate.id,
            };
            self.stale[index / BLOCK] = true;
        }
    }

    /// Notes that a ray has hit something and that nothing more about it matters.
    pub(crate) fn settle(&mut self, index: usize, id: u32) {
        self.rays[index] = Nearest {
            key: f64::INFINITY,
            error: 0.0,
            id,
        };
        self.stale[index / BLOCK] = true;
    }

    /// Whether a ray needs no further test.
    pub(crate) fn is_settled(&self, index: usize) -> bool {
        self.rays[index].key == f64::INFINITY
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
        let rays = &self.rays[first..first + ids.len()];
        for (place, (nearest, (id, t))) in rays
            .iter()
            .zip(ids.iter_mut().zip(ts.iter_mut()))
            .enumerate()
        {
            if nearest.id == NO_TRIANGLE {
                continue;
            }
            *id = nearest.id;
            if nearest.key == f64::INFINITY {
                // Settled: nobody asks for the distance.
                continue;
            }
            *t = rounded_distance(nearest, origin).unwrap_or_else(|| {
                Distance::new(&ray(place), &triangles.triangle(nearest.id)).rounded()
            });
        }
    }
}

/// t of a key, where its error leaves no doubt about the nearest f32.
fn rounded_distance(nearest: &Nearest, origin: Origin) -> Option<f32> {
    let (lo, hi) = (nearest.key - nearest.error, nearest.key + nearest.error);
    let (least, greatest) = match origin {
        Origin::Point(_) if lo > 0.0 => (1.0 / hi, 1.0 / lo),
        Origin::Infinity(_) if hi < 0.0 => (-hi, -lo),
        _ => return None,
    };
    // A difference and a quotient: two roundings.
    let (least, greatest) = (
        saturate(least * (1.0 - 4.0 * U)),
        saturate(greatest * (1.0 + 4.0 * U)),
    );
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
