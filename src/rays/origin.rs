//! The common origin of the rays of a pencil, homogeneous: a point (w = 1) or a direction (w = 0).

use glam::DVec3;

use crate::geometry::ray::{Ray, Ties};

/// The common origin of a pencil.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Origin {
    /// w = 1: all rays start here. Films hold directions.
    Point(DVec3),
    /// w = 0: all rays have this direction. Films hold start points.
    Infinity(DVec3),
}

impl Origin {
    /// How edge functions of zero get their sign.
    pub(crate) fn ties(self) -> Ties {
        match self {
            Self::Point(_) => Ties::Direction,
            Self::Infinity(_) => Ties::Origin,
        }
    }

    /// The ray through a sample of a film.
    pub(crate) fn ray(self, sample: DVec3) -> Ray {
        match self {
            Self::Point(origin) => Ray::new(origin, sample),
            Self::Infinity(direction) => Ray::new(sample, direction),
        }
    }
}
