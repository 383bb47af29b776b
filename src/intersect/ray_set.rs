//! What is tested against triangles where rays share no origin: rays, segments, rays that leave receivers. With each
//! goes the nearest hit so far.
//!
//! A hit is kept as bounds of its t. Two hits whose bounds do not overlap need no exact comparison.

use glam::DVec3;
use prefetch_index::prefetch_index;

use crate::exact::distance::{Distance, within_interval};
use crate::exact::predicates::covers;
use crate::geometry::ray::{Ray, Ties};
use crate::geometry::triangles::Triangles;
use crate::rays::hemisphere::AmbientRay;
use crate::rays::hits::{NO_TRIANGLE, precedes};
use crate::rays::origin::Origin;
use crate::rays::pencil::Rays;
use crate::rays::receiver::{Receiver, blocks, culling_ray};
use crate::rays::segment::Segment;
use crate::simd::lanes::LANES;
use crate::stats::Stats;

/// What is tested against the triangles.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RaySet<'a> {
    /// Rays.
    Rays(Rays<'a>),
    /// Rays of one origin, through samples that lie anywhere on a film.
    Samples(Origin, &'a [DVec3]),
    /// Segments: any triangle that blocks one will do.
    Segments(&'a [Segment]),
    /// A light and what it may not see.
    Shadows(Origin, &'a [Receiver]),
    /// Rays that leave receivers: any triangle that blocks one will do.
    Ambient(&'a [AmbientRay]),
}

/// What is asked: which triangle each ray meets first, or whether it meets any.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Question<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) set: RaySet<'a>,
    /// Whether any hit will do.
    pub(crate) any: bool,
}

/// The nearest hit of a ray so far: t lies in [lo, hi]. Without a hit, hi is the end of the ray.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) id: u32,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

impl Nearest {
    /// Nothing was hit before the end of the ray.
    pub(crate) fn none(t_max: f64) -> Self {
        Self { id: NO_TRIANGLE, lo: t_max, hi: t_max }
    }

    /// Whether something was hit.
    pub(crate) fn is_hit(&self) -> bool {
        self.id != NO_TRIANGLE
    }
}

/// What is known of a pair that certainly is a hit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    /// Bounds of t.
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    /// Whether d·N > 0.
    pub(crate) from_behind: bool,
}

/// Any ray.
pub(crate) const A_RAY: Ray =
    Ray { origin: DVec3::ZERO, direction: DVec3::X, t_min: 0.0, t_max: f64::INFINITY };

impl RaySet<'_> {
    /// The number of rays.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Rays(rays) => rays.len(),
            Self::Samples(_, samples) => samples.len(),
            Self::Segments(segments) => segments.len(),
            Self::Shadows(_, receivers) => receivers.len(),
            Self::Ambient(rays) => rays.len(),
        }
    }

    /// The ray with a number: that of a segment or a shadow is good for culling only.
    #[inline]
    pub(crate) fn ray(&self, index: u32) -> Ray {
        match self {
            Self::Rays(rays) => rays.ray(index),
            Self::Samples(origin, samples) => origin.ray(samples[index as usize]),
            Self::Segments(segments) => segments[index as usize].as_ray(),
            Self::Shadows(light, receivers) => culling_ray(*light, &receivers[index as usize]),
            Self::Ambient(rays) => rays[index as usize].ray,
        }
    }

    /// The rays of eight numbers: where they are, or made in `space`.
    #[inline(always)]
    pub(crate) fn eight<'b>(
        &'b self,
        numbers: [u32; LANES],
        space: &'b mut [Ray; LANES],
    ) -> [&'b Ray; LANES] {
        // A ray is a line of the cache that is read and no more, unless it is copied first.
        match self {
            Self::Rays(Rays::General(rays)) => numbers.map(|number| &rays[number as usize]),
            Self::Ambient(rays) => numbers.map(|number| &rays[number as usize].ray),
            _ => {
                for (ray, number) in space.iter_mut().zip(numbers) {
                    *ray = self.ray(number);
                }
                space.each_ref()
            }
        }
    }

    /// Has the ray with a number read into the cache, where it is read and not made.
    #[inline]
    pub(crate) fn prefetch(&self, number: u32) {
        // It need not begin with a line of the cache; the one that follows begins where it ends.
        match self {
            Self::Rays(Rays::General(rays)) => {
                prefetch_index(rays, number as usize);
                prefetch_index(rays, number as usize + 1);
            }
            Self::Ambient(rays) => prefetch_index(rays, number as usize),
            _ => {}
        }
    }

    /// How edge functions of zero get their sign.
    pub(crate) fn ties(&self) -> Ties {
        match self {
            Self::Rays(rays) => rays.ties(),
            Self::Samples(origin, _) => origin.ties(),
            Self::Segments(_) => Ties::Direction,
            Self::Shadows(light, _) => light.ties(),
            Self::Ambient(_) => Ties::Origin,
        }
    }

    /// Whether the rays are what is tested, and not for culling only.
    pub(crate) fn are_rays(&self) -> bool {
        matches!(self, Self::Rays(_) | Self::Samples(..) | Self::Ambient(_))
    }

    /// Tests a ray, given with its number, against a triangle of which something is known. Otherwise like
    /// [`Self::test`].
    #[inline]
    pub(crate) fn test_known(
        &self,
        (number, ray): (u32, &Ray),
        (id, verdict): (u32, Option<Known>),
        triangles: &Triangles<'_>,
        nearest: &mut Nearest,
        stats: &mut Stats,
    ) -> bool {
        if let Some(Known { lo, hi, from_behind }) = verdict {
            match self {
                Self::Rays(_) | Self::Samples(..) if lo > nearest.hi => return false,
                Self::Rays(_) | Self::Samples(..) if !nearest.is_hit() || hi < nearest.lo => {
                    *nearest = Nearest { id, lo, hi };
                    return true;
                }
                Self::Ambient(rays) => {
                    let ray = &rays[number as usize];
                    let blocked = ray.owner != id && (ray.back_faces || !from_behind);
                    nearest.id = if blocked { id } else { nearest.id };
                    return blocked;
                }
                // It is as near as the nearest, as far as is known.
                Self::Rays(_) | Self::Samples(..) => {
                    let nearer = precedes(ray, id, nearest.id, triangles, stats);
                    if nearer {
                        *nearest = Nearest { id, lo, hi: if hi < nearest.hi { hi } else { nearest.hi } };
                    }
                    return nearer;
                }
                _ => {}
            }
        }
        self.test((number, ray), id, triangles, nearest, stats)
    }

    /// Tests a ray, given with its number, against a triangle, exactly, and keeps it if it is nearer; of rays alone it
    /// is asked what is nearer. Returns whether it was kept.
    #[inline]
    pub(crate) fn test(
        &self,
        (number, ray): (u32, &Ray),
        id: u32,
        triangles: &Triangles<'_>,
        nearest: &mut Nearest,
        stats: &mut Stats,
    ) -> bool {
        let blocked = match self {
            Self::Rays(rays) => return test_ray((ray, rays.ties()), id, triangles, nearest, stats),
            Self::Samples(origin, _) => return test_ray((ray, origin.ties()), id, triangles, nearest, stats),
            Self::Segments(segments) => {
                segments[number as usize].is_blocked_by(id, &triangles.triangle(id), stats)
            }
            Self::Shadows(light, receivers) => {
                let receiver = &receivers[number as usize];
                blocks(*light, receiver, (id, &triangles.triangle(id)), stats)
            }
            Self::Ambient(rays) => {
                let ray = &rays[number as usize];
                ray.is_blocked_by(id, &triangles.triangle(id), stats)
            }
        };
        if blocked {
            nearest.id = id;
        }
        blocked
    }
}

/// Tests one ray against one triangle and keeps what is nearer. Most triangles that are asked for lie around the ray's
/// line, so the distance decides more often than coverage, and is asked for first.
#[inline]
fn test_ray(
    (ray, ties): (&Ray, Ties),
    id: u32,
    triangles: &Triangles<'_>,
    nearest: &mut Nearest,
    stats: &mut Stats,
) -> bool {
    let triangle = triangles.triangle(id);
    let Some(distance) = Distance::ahead(ray, &triangle) else { return false };
    let (least, greatest) = distance.bounds();
    if least > nearest.hi || !covers(ray, &triangle, ties, stats) || !within_interval(ray, &distance, stats) {
        return false;
    }
    let nearer =
        !nearest.is_hit() || greatest < nearest.lo || precedes(ray, id, nearest.id, triangles, stats);
    if nearer {
        let hi = if greatest < nearest.hi { greatest } else { nearest.hi };
        *nearest = Nearest { id, lo: least, hi };
    }
    nearer
}
