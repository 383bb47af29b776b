//! Ambient occlusion: which of the rays that leave a surface into the half space above it are open.
//!
//! From the point p of a receiver leave rays (p, d), t_min < t < t_max. A direction that does not point strictly above the
//! surface, decided exactly as the sign of d·N, is occluded untested. Any other is occluded iff a triangle covers the
//! ray with the ties of parallel rays, at some t in range; the receiver's own triangle never does. No epsilon: see
//! [`Triangles::leave`].
//!
//! The same rays can be grouped by direction, as parallel beams, or receiver by receiver; the answer is decided ray by ray and
//! does not depend on that.
//!
//! Based on: Sergey Zhukov, Andrei Iones, Grigorij Kronin, "An Ambient Light Illumination Model", 1998; Alexander
//! Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001 (directions shared by many receivers).
//!
//! [`Triangles::leave`]: crate::geometry::triangles::Triangles::leave

use glam::DVec3;

use crate::error::Error;
use crate::exact::distance::{Distance, within_interval};
use crate::exact::expansion::Expansion;
use crate::exact::filter::{Cross, Sign};
use crate::exact::predicates::{covers, facing};
use crate::geometry::aabb::widen;
use crate::geometry::ray::{Ray, Ties, check_origin, in_range};
use crate::geometry::triangles::{Triangle, Triangles};
use crate::objects::offset::Side;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::receiver::Receiver;
use crate::stats::Stats;

/// What counts as above a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Above {
    /// One side of the triangle that the receiver lies on.
    Side(Side),
    /// Where this vector points to: finite, of any length. Above zero there is nothing.
    Normal([f32; 3]),
}

/// A receiver with the half space that its rays leave into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hemisphere {
    /// Where rays start.
    pub receiver: Receiver,
    /// Which directions count.
    pub above: Above,
}

/// A direction, and from where to where something along it matters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RaySample {
    /// Of any length, in the range of [`Ray::direction`].
    pub direction: DVec3,
    /// What is nearer does not count. Exclusive, in units of the direction's length: in the range of [`Ray::t_min`]. Above 0 rays go in
    /// bundles, receiver after receiver, whatever [`Grouping`] says.
    pub t_min: f32,
    /// What is farther does not count. Exclusive, likewise, in the range of [`Ray::t_max`].
    pub t_max: f32,
}

impl RaySample {
    /// A direction without a limit.
    #[must_use]
    pub fn unlimited(direction: DVec3) -> Self {
        Self { direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    /// The ray from a point.
    fn from(&self, point: DVec3) -> Ray {
        let (t_min, t_max) = (f64::from(self.t_min), f64::from(self.t_max));
        Ray { t_min, t_max, ..Ray::new(point, self.direction) }
    }
}

/// The samples of receivers.
#[derive(Clone, Copy)]
pub enum RaySamples<'a> {
    /// All receivers have the same.
    Shared(&'a [RaySample]),
    /// Each receiver has its own.
    Own {
        /// How many.
        count: usize,
        /// The sample of a receiver by its index, and that of the ray.
        of: &'a (dyn Fn(usize, usize) -> RaySample + Sync),
    },
}

impl RaySamples<'_> {
    /// Samples per receiver.
    pub(crate) fn count(&self) -> usize {
        match self {
            Self::Shared(samples) => samples.len(),
            Self::Own { count, .. } => *count,
        }
    }

    /// The sample of a receiver for a ray.
    pub(crate) fn of(&self, receiver: usize, ray: usize) -> RaySample {
        match self {
            Self::Shared(samples) => samples[ray],
            Self::Own { of, .. } => of(receiver, ray),
        }
    }
}

/// How rays are put together into pencils. It changes time only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Grouping {
    /// What is estimated to take less time.
    #[default]
    Auto,
    /// Receiver after receiver, in bundles of arbitrary rays: all that rays of their own can do.
    Origin,
    /// The rays of neighbouring receivers along one direction, as beams. Needs samples that receivers share.
    Direction,
}

/// What is asked: which rays of which receivers are open.
#[derive(Clone, Copy)]
pub struct Occlusion<'a> {
    /// The receivers, in any order.
    pub hemispheres: &'a [Hemisphere],
    /// Their rays.
    pub samples: RaySamples<'a>,
    /// Whether triangles occlude that rays meet from behind, d·N > 0.
    pub back_faces: bool,
    /// How rays are grouped.
    pub grouping: Grouping,
}

impl Occlusion<'_> {
    /// Refuses what the exact stage cannot take.
    pub(crate) fn check(&self, triangles: &Triangles<'_>) -> Result<(), Error> {
        for (index, hemisphere) in self.hemispheres.iter().enumerate() {
            let Receiver { point, triangle } = hemisphere.receiver;
            check_origin(widen(point))?;
            let is_known = (triangle.0 as usize) < triangles.len();
            let is_named = match hemisphere.above {
                Above::Side(_) => is_known,
                Above::Normal(normal) => {
                    if !normal.iter().all(|x| x.is_finite()) {
                        return Err(Error::Normal { receiver: index, normal });
                    }
                    is_known || triangle.0 == NO_TRIANGLE
                }
            };
            if !is_named {
                return Err(Error::ReceiverTriangle { receiver: index, triangle: triangle.0 });
            }
        }
        match self.samples {
            RaySamples::Shared(samples) => {
                samples.iter().try_for_each(|sample| sample.from(DVec3::ZERO).check())
            }
            // They are checked as they are made.
            RaySamples::Own { .. } if self.grouping != Grouping::Direction => Ok(()),
            RaySamples::Own { .. } => Err(Error::NoCommonDirections),
        }
    }

    /// Tells the rays of a receiver that point above its surface, with their numbers.
    pub(crate) fn rays_above(
        &self,
        triangles: &Triangles<'_>,
        receiver: usize,
        mut tell: impl FnMut(usize, AmbientRay),
    ) -> Result<(), Error> {
        let horizon = Horizon::of(triangles, &self.hemispheres[receiver]);
        for ray in 0..self.samples.count() {
            let sample = self.samples.of(receiver, ray);
            if matches!(self.samples, RaySamples::Own { .. }) {
                sample.from(DVec3::ZERO).check()?;
            }
            if horizon.is_exceeded_by(sample.direction) {
                tell(ray, self.untested_ray(receiver, &sample));
            }
        }
        Ok(())
    }

    /// A ray, whether it points above the surface or not.
    pub(crate) fn untested_ray(&self, receiver: usize, sample: &RaySample) -> AmbientRay {
        let Receiver { point, triangle } = self.hemispheres[receiver].receiver;
        AmbientRay { ray: sample.from(widen(point)), owner: triangle.0, back_faces: self.back_faces }
    }
}

impl Hemisphere {
    /// Whether a direction points strictly above the surface, exactly. One that is zero or not finite does not; lengths are those of
    /// [`Triangles::side_toward`].
    #[must_use]
    pub fn is_above(&self, triangles: &Triangles<'_>, direction: DVec3) -> bool {
        match self.above {
            Above::Side(side) => triangles.side_toward(self.receiver.triangle, direction) == Some(side),
            Above::Normal(normal) => {
                let Some(direction) = in_range(direction) else { return false };
                let products = widen(normal) * direction;
                let sum = products.x + products.y + products.z;
                // Three products and two sums round once each.
                let error = (products.x.abs() + products.y.abs() + products.z.abs()) * (4.0 * f64::EPSILON);
                if sum.abs() > error {
                    return sum > 0.0;
                }
                let exact = (0..3)
                    .fold(Expansion::of(0.0), |sum, k| sum.plus_product(direction[k], f64::from(normal[k])));
                exact.sign() == Sign::Positive
            }
        }
    }
}

/// What the directions of one receiver are compared with: the normal of its triangle, found once.
struct Horizon<'a> {
    triangles: &'a Triangles<'a>,
    hemisphere: &'a Hemisphere,
    /// N, and the sign of d·N above the surface.
    side: Option<(Cross, Sign)>,
}

impl<'a> Horizon<'a> {
    fn of(triangles: &'a Triangles<'a>, hemisphere: &'a Hemisphere) -> Self {
        let side = match hemisphere.above {
            Above::Side(side) => {
                let Triangle { a, b, c } = triangles.triangle(hemisphere.receiver.triangle.0);
                let sign = if side == Side::Front { Sign::Positive } else { Sign::Negative };
                Some((Cross::of(b - a, c - a), sign))
            }
            Above::Normal(_) => None,
        };
        Self { triangles, hemisphere, side }
    }

    /// Whether a direction points strictly above the surface, exactly.
    fn is_exceeded_by(&self, direction: DVec3) -> bool {
        let filtered = self.side.and_then(|(normal, above)| Some(normal.dot(direction).sign()? == above));
        filtered.unwrap_or_else(|| self.hemisphere.is_above(self.triangles, direction))
    }
}

/// A ray that leaves a receiver.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AmbientRay {
    pub(crate) ray: Ray,
    /// The triangle that it leaves.
    pub(crate) owner: u32,
    pub(crate) back_faces: bool,
}

impl AmbientRay {
    /// Whether a triangle occludes it, exactly.
    pub(crate) fn is_blocked_by(&self, id: u32, triangle: &Triangle, stats: &mut Stats) -> bool {
        self.owner != id
            && !triangle.has_corner(self.ray.origin)
            && covers(&self.ray, triangle, Ties::Origin, stats)
            && (self.back_faces || facing(self.ray.direction, triangle) == Sign::Negative)
            && within_interval(&self.ray, &Distance::new(&self.ray, triangle), stats)
    }
}

/// Which rays are open: one bit for each ray of each receiver.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OpenRays {
    rays: usize,
    words: Vec<u32>,
}

impl OpenRays {
    /// From the words of all receivers, laid out as [`OpenRays::words`] has them, for rays that were decided elsewhere.
    ///
    /// # Panics
    /// When the words are not those of whole receivers.
    #[must_use]
    pub fn new(rays: usize, words: Vec<u32>) -> Self {
        assert!(words.len().is_multiple_of(Self::words_for(rays).max(1)), "{} words", words.len());
        Self { rays, words }
    }

    /// Words of 32 rays that each receiver has.
    pub(crate) fn words_for(rays: usize) -> usize {
        rays.div_ceil(u32::BITS as usize)
    }

    /// Rays per receiver.
    #[must_use]
    pub fn rays(&self) -> usize {
        self.rays
    }

    /// The rays of a receiver, 32 to a word: ray k is open iff bit k % 32 of word k / 32 is set. Bits beyond the last
    /// ray are not set.
    ///
    /// # Panics
    /// When there is no such receiver.
    #[must_use]
    pub fn words(&self, receiver: usize) -> &[u32] {
        let count = Self::words_for(self.rays);
        &self.words[receiver * count..][..count]
    }

    /// Closes the rays that are not open among others of the same receivers.
    pub fn retain(&mut self, others: &Self) {
        self.words.iter_mut().zip(&others.words).for_each(|(word, other)| *word &= other);
    }

    /// Says whether a ray of a receiver is open, where that was decided elsewhere.
    ///
    /// # Panics
    /// When there is no such receiver or ray.
    pub fn set(&mut self, receiver: usize, ray: usize, is_open: bool) {
        assert!(ray < self.rays, "ray {ray} of {}", self.rays);
        let word = &mut self.words[receiver * Self::words_for(self.rays) + ray / 32];
        *word = *word & !(1 << (ray % 32)) | u32::from(is_open) << (ray % 32);
    }

    /// Whether a ray of a receiver is open.
    ///
    /// # Panics
    /// When there is no such receiver or ray.
    #[must_use]
    pub fn is_open(&self, receiver: usize, ray: usize) -> bool {
        self.words(receiver)[ray / 32] >> (ray % 32) & 1 == 1
    }
}
