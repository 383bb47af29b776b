//! Scenes in which things coincide exactly, each with the same scene where nothing does.
//!
//! Three places of a scene are compared. *Coincident*: walls on round numbers, faces in one plane, rays through vertices. *Apart*: the
//! mesh is turned by a small angle whose sine is irrational while the rays stay, or what lies in one place is moved a little apart; the
//! same work but for coincidences. *Nearly*: mesh and rays are turned together by an irrational angle, so that all that
//! coincided is off by roundings.

pub(crate) mod ask;
mod lights;
mod modes;
mod openness;
mod rays;
mod scenes;
mod surfaces;
mod views;

use umbel::Stats;
use umbel::glam::{DMat3, DVec3};

use crate::Result;

/// How mesh and rays lie to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Coincident,
    Nearly,
    Apart,
}

/// One query, from scratch but for memory; it may be asked again and again.
pub(crate) type Query = Box<dyn FnMut() -> Result<Stats>>;

/// One kind of coincidence.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coincidence {
    /// The entry point, a blank, and the scene.
    pub(crate) name: &'static str,
    pub(crate) query: fn(Place) -> Result<Query>,
}

impl Place {
    pub(crate) const ALL: [Self; 3] = [Self::Coincident, Self::Nearly, Self::Apart];

    /// How the mesh is turned.
    fn of_mesh(self) -> DMat3 {
        match self {
            Self::Coincident => DMat3::IDENTITY,
            Self::Nearly => turn(0.7),
            Self::Apart => turn(0.011),
        }
    }

    /// How rays, receivers and lights are turned.
    fn of_rays(self) -> DMat3 {
        if self == Self::Nearly { turn(0.7) } else { DMat3::IDENTITY }
    }

    /// How mesh and rays are turned where it is the parts of the mesh that coincide.
    fn of_both(self) -> DMat3 {
        self.of_rays()
    }

    /// How far receivers and lights are off what they else coincide with, where the mesh stays.
    fn aside(self) -> DVec3 {
        if self == Self::Apart { DVec3::new(0.0137, 0.0071, 0.0191) } else { DVec3::ZERO }
    }

    /// The distance between parts that else coincide.
    fn gap(self, apart: f64) -> f64 {
        if self == Self::Apart { apart } else { 0.0 }
    }
}

/// A turn about an axis with irrational coordinates.
fn turn(angle: f64) -> DMat3 {
    DMat3::from_axis_angle(DVec3::new(1.0, 2.0_f64.sqrt(), 3.0_f64.sqrt()).normalize(), angle)
}

/// All of them.
pub(crate) fn all() -> impl Iterator<Item = Coincidence> {
    let parts: [&[Coincidence]; 6] = [
        &views::COINCIDENCES,
        &lights::COINCIDENCES,
        &rays::COINCIDENCES,
        &openness::COINCIDENCES,
        &surfaces::COINCIDENCES,
        &modes::COINCIDENCES,
    ];
    parts.into_iter().flatten().copied()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn every_scene_is_answered_at_every_place_and_has_a_name_of_its_own() -> Result<()> {
        let mut names = HashSet::new();
        for coincidence in all() {
            assert!(names.insert(coincidence.name), "{} stands twice", coincidence.name);
            for place in Place::ALL {
                (coincidence.query)(place)?()?;
            }
        }
        assert!(names.len() >= 30);
        Ok(())
    }
}
