//! The last occluders of each direction: what closed many rays of a parcel is tried first on the next one.
//!
//! Based on: Greg Ward, "The RADIANCE Lighting Simulation and Rendering System", 1994 (the last occluder of a light is
//! tested first).

use crate::intersect::beam::closing::Occluder;
use crate::intersect::beam::objects::{Objects, Run};
use crate::objects::runs::RUN;

/// The run number of occluders that were remembered already.
const REMEMBERED: u32 = u32::MAX;

/// For each direction up to sixteen triangles.
#[derive(Debug)]
pub(crate) struct LastOccluders {
    pub(crate) places: Vec<Run>,
    /// What was found along the direction at hand.
    pub(crate) found: Vec<Occluder>,
}

impl LastOccluders {
    /// None yet.
    pub(crate) fn new(directions: usize) -> Self {
        Self { places: vec![Run::EMPTY; directions], found: Vec::new() }
    }

    /// Bytes for so many directions.
    pub(crate) fn bytes_for(directions: usize) -> usize {
        directions * size_of::<Run>()
    }

    /// Keeps of a direction what closed most rays, if that is anything new.
    pub(crate) fn update(&mut self, slot: usize, objects: &Objects) {
        let Self { places, found } = self;
        if found.iter().all(|occluder| occluder.run == REMEMBERED) {
            return;
        }
        if found.len() > RUN {
            found.select_nth_unstable_by(RUN - 1, |one, other| other.closed.cmp(&one.closed));
            found.truncate(RUN);
        }
        let before = places[slot].clone();
        places[slot].present = 0;
        for (place, occluder) in found.iter().enumerate() {
            let run = if occluder.run == REMEMBERED { &before } else { &objects.runs[occluder.run as usize] };
            places[slot].copy_from(place, run, occluder.lane as usize);
        }
    }
}
