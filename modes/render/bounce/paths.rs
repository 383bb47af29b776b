//! Paths of light: a camera's ray, the share of its light that still arrives where the path is, and the ray that goes on from there.
//!
//! Based on: Roy Hall and Donald Greenberg, "A Testbed for Realistic Image Synthesis", 1983 (paths end by their share).

use umbel_core::Ray;

use crate::render::bounce::spawn::Spawned;

/// Paths with less than this share of a pixel's light are not followed: half a step of an 8-bit picture from its darkest end.
const LEAST_SHARE: f32 = 1.0 / 2048.0;

/// Bytes of a path that waits: its ray, its place and its share.
pub(crate) const PATH_BYTES: u64 = 64 + 16;

/// A path's place and share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The camera's ray.
    pub(crate) ray: u32,
    pub(crate) share: [f32; 3],
}

/// Paths that are traced together.
#[derive(Debug, Default)]
pub(crate) struct Wave {
    pub(crate) rays: Vec<Ray>,
    pub(crate) places: Vec<Place>,
}

impl Wave {
    pub(crate) fn push(&mut self, ray: Ray, place: Place) {
        self.rays.push(ray);
        self.places.push(place);
    }
}

/// A path that was spawned, and the planar mirror that sends it.
pub(crate) type Sent = (Ray, Place, Option<usize>);

/// The paths of what was spawned, but those of no account.
pub(crate) fn sent_on(
    spawned: &Spawned,
    place: Place,
    mirror: Option<usize>,
) -> impl Iterator<Item = Sent> + use<> {
    let parts = [spawned.reflected.zip(Some(mirror)), spawned.refracted.zip(Some(None))];
    parts.into_iter().flatten().filter_map(move |((ray, part), mirror)| {
        let share = [0, 1, 2].map(|k| place.share[k] * part[k]);
        share.iter().any(|&share| share >= LEAST_SHARE).then_some((ray, Place { share, ..place }, mirror))
    })
}
