//! How much detail rays can tell apart, anywhere in space: what a surface on demand knows of those who ask.
//!
//! Neighbouring rays are so far apart where they come to a box: the distance between the box and their origins times
//! the angle between them, or their distance at the start if that is more. An eye is a box of origins without size,
//! from which rays start at no distance; parallel rays have no angle. Shorter waves than two of these distances show as
//! noise or not at all (Nyquist), so a surface need not make them: see [`Detail::share`].
//!
//! All of it is made of + − × ÷ √ and comparisons that are monotone in each coordinate, roundings included: the spacing
//! of a box is not above that of any box within.
//!
//! Based on: Alan Norton, Alyn Rockwood and Philip Skolmoski, "Clamping: A Method of Antialiasing Textured Surfaces by
//! Bandwidth Limiting in Object Space", 1982.

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::geometry::aabb::widen;
use crate::reyes::dice::dicing::Dicing;
use crate::simd::lanes::{LANES, Lanes, Points};

/// Rays that start all over a box and leave to all sides: how far apart they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    /// The box that they start in.
    pub bounds: Aabb,
    /// World units between neighbours at their start: positive.
    pub spacing: f64,
    /// The angle between neighbours, in radians: farther away they are as far apart as this times the distance from the
    /// box.
    pub angle: f64,
}

/// What rays can tell apart, and with which instructions points are found.
#[derive(Debug, Clone, Copy)]
pub struct Detail {
    /// The box of the origins of rays.
    origins: [DVec3; 2],
    /// The least angle between neighbouring rays, in radians.
    angle: f64,
    /// The least distance between neighbours at their start.
    spacing: f64,
    level: Level,
}

impl Around {
    /// Whether pixels have a size.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let is_size = self.spacing > 0.0 && self.spacing.is_finite();
        if is_size && self.angle >= 0.0 && self.angle.is_finite() && !self.bounds.is_empty() {
            Ok(())
        } else {
            Err(Error::Spacing { spacing: self.spacing, angle: self.angle })
        }
    }
}

impl Detail {
    /// All the detail that there is: rays that are nowhere apart, and the best instructions of the machine.
    #[must_use]
    pub fn all() -> Self {
        Self::from_point(DVec3::ZERO, 0.0, Level::new())
    }

    /// Of rays from an eye with so many radians between them.
    pub(crate) fn from_point(eye: DVec3, angle: f64, level: Level) -> Self {
        Self { origins: [eye; 2], angle, spacing: 0.0, level }
    }

    /// Of parallel rays so far apart.
    pub(crate) fn from_infinity(spacing: f64, level: Level) -> Self {
        Self { origins: [DVec3::ZERO; 2], angle: 0.0, spacing, level }
    }

    /// Of rays from all over a box.
    pub(crate) fn around(around: &Around, level: Level) -> Self {
        let origins = [widen(around.bounds.lo), widen(around.bounds.hi)];
        Self { origins, angle: around.angle, spacing: around.spacing, level }
    }

    /// The same where micropolygons are larger than a pixel: they cannot show what is smaller than they are.
    pub(crate) fn of_micropolygons(self, dicing: &Dicing) -> Self {
        let pixels = if dicing.shading_rate > 1.0 { dicing.shading_rate } else { 1.0 };
        Self { angle: self.angle * pixels, spacing: self.spacing * pixels, ..self }
    }

    /// The instructions by which points may be found, the same bits with any: a level of `fearless_simd`.
    #[must_use]
    pub fn level(&self) -> Level {
        self.level
    }

    /// The distance between neighbouring rays where they come to points of a box: the least, and the greatest, in world
    /// units.
    #[must_use]
    pub fn spacing(&self, [lo, hi]: [DVec3; 2]) -> [f64; 2] {
        let farthest = |k: usize| {
            let ends = [(hi[k] - self.origins[0][k]).abs(), (lo[k] - self.origins[1][k]).abs()];
            if ends[0] > ends[1] { ends[0] } else { ends[1] }
        };
        let farthest = length(DVec3::new(farthest(0), farthest(1), farthest(2)));
        [gap([lo, hi], self.origins), farthest].map(|distance| self.at(distance))
    }

    /// The least spacing of each of eight boxes, given by their least and their greatest x, y and z: as
    /// [`Detail::spacing`] tells it.
    #[must_use]
    pub fn spacings(&self, boxes: [&[[f64; LANES]; 3]; 2]) -> [f64; LANES] {
        dispatch!(self.level, simd => self.spacings_lanes(simd, boxes))
    }

    #[inline(always)]
    fn spacings_lanes<S: Simd>(&self, simd: S, boxes: [&[[f64; LANES]; 3]; 2]) -> [f64; LANES] {
        let [lo, hi] = boxes.map(|[x, y, z]| Points {
            x: Lanes::load_array(simd, *x),
            y: Lanes::load_array(simd, *y),
            z: Lanes::load_array(simd, *z),
        });
        self.least(simd, [lo, hi]).to_array()
    }

    /// The least spacing of each of eight boxes.
    #[inline(always)]
    pub(crate) fn least<S: Simd>(&self, simd: S, [lo, hi]: [Points<S>; 2]) -> Lanes<S> {
        let [first, last] = self.origins;
        let mut square = Lanes::simd_from(simd, 0.0);
        for (lo, hi, first, last) in
            [(lo.x, hi.x, first.x, last.x), (lo.y, hi.y, first.y, last.y), (lo.z, hi.z, first.z, last.z)]
        {
            let gap = (lo - last).max(first - hi).max(0.0);
            square += gap * gap;
        }
        (square.sqrt() * self.angle).max(self.spacing)
    }

    /// The spacing at a distance.
    fn at(&self, distance: f64) -> f64 {
        let wide = distance * self.angle;
        if wide > self.spacing { wide } else { self.spacing }
    }

    /// How far apart rays are where they come to a box, at least.
    pub(crate) fn least_spacing(&self, bounds: &Aabb) -> f64 {
        let (lo, hi) = bounds.corners();
        self.at(gap([lo, hi], self.origins))
    }

    /// How much of waves of some length is to be shown where rays are so far apart: all that are longer than four of
    /// these distances, none that are shorter than two, and between a part that grows steadily, so that nothing pops
    /// up.
    #[must_use]
    pub fn share(wavelength: f64, spacing: f64) -> f64 {
        (wavelength / (2.0 * spacing) - 1.0).clamp(0.0, 1.0)
    }
}

/// The distance between two boxes.
pub(crate) fn gap([lo, hi]: [DVec3; 2], [other_lo, other_hi]: [DVec3; 2]) -> f64 {
    let gap = |k: usize| {
        let (below, above) = (lo[k] - other_hi[k], other_lo[k] - hi[k]);
        let gap = if below > above { below } else { above };
        if gap > 0.0 { gap } else { 0.0 }
    };
    length(DVec3::new(gap(0), gap(1), gap(2)))
}

/// |a|, summed in order.
fn length(a: DVec3) -> f64 {
    (a.x * a.x + a.y * a.y + a.z * a.z).sqrt()
}
