//! What the engine gives back: one (id, t) per ray, in the order of the rays.

use crate::exact::distance::compare;
use crate::exact::filter::Sign;
use crate::geometry::ray::Ray;
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::stats::Stats;

/// The id that stands for "no triangle", in arrays and files.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// The nearest triangle of one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The triangle.
    pub id: TriangleId,
    /// The distance in units of the ray's direction: the exact value rounded to the nearest f32, at least 2⁻¹⁴⁹ and
    /// at most [`f32::MAX`].
    pub t: f32,
}

/// The hits of a set of rays, in the order of the rays.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hits {
    pub(crate) ids: Vec<u32>,
    pub(crate) ts: Vec<f32>,
}

/// The hits of one row of a film: ids and distances.
pub(crate) type Row<'a> = (&'a mut [u32], &'a mut [f32]);

impl Hits {
    /// As many misses as there are rays.
    pub(crate) fn missed(rays: usize) -> Self {
        Self { ids: vec![NO_TRIANGLE; rays], ts: vec![f32::INFINITY; rays] }
    }

    /// Room for some rays that are all going to be written. New memory is made of zeros that nobody has touched yet.
    pub(crate) fn make_room(&mut self, rays: usize) {
        if self.ids.len() != rays {
            *self = Self { ids: vec![0; rays], ts: vec![0.0; rays] };
        }
    }

    /// All of them as one row.
    pub(crate) fn as_row(&mut self) -> Row<'_> {
        (&mut self.ids, &mut self.ts)
    }

    /// The number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there was no ray.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// What a ray hits, or `None`.
    ///
    /// # Panics
    /// When there is no such ray.
    #[must_use]
    pub fn get(&self, ray: usize) -> Option<Hit> {
        let id = self.ids[ray];
        (id != NO_TRIANGLE).then(|| Hit { id: TriangleId(id), t: self.ts[ray] })
    }

    /// The ids of all rays as an array for files: [`NO_TRIANGLE`] is a miss.
    #[must_use]
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// The distances of all rays as an array for files: +∞ is a miss.
    #[must_use]
    pub fn ts(&self) -> &[f32] {
        &self.ts
    }
}

impl FromIterator<Option<Hit>> for Hits {
    /// Hits of rays that were found in parts.
    fn from_iter<I: IntoIterator<Item = Option<Hit>>>(hits: I) -> Self {
        let pair = |hit: Option<Hit>| hit.map_or((NO_TRIANGLE, f32::INFINITY), |hit| (hit.id.0, hit.t));
        let (ids, ts) = hits.into_iter().map(pair).unzip();
        Self { ids, ts }
    }
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
