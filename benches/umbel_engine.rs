//! umbel: from positions and indices to the answer in one call, from scratch or with the order of the triangles kept
//! from the round before. As with the others, the memory of ids and distances is kept.

use umbel::{Frame, Options, Triangles};

use crate::Result;
use crate::answer::{Blocked, Hits};
use crate::engine::{Engine, Times, Variant, timed};
use crate::picture::Picture;
use crate::shadow::Shadow;

/// The name of the engine that keeps the order.
pub(crate) const KEEPING: &str = "umbel-keep-order";

/// umbel with its default options: exact, by pencils.
#[derive(Debug)]
pub(crate) struct Umbel {
    name: &'static str,
    frame: Frame,
}

impl Umbel {
    /// Everything from scratch.
    pub(crate) fn from_scratch() -> Self {
        Self { name: "umbel", frame: Frame::new() }
    }

    /// With the permutation of the round before, and nothing else.
    pub(crate) fn keeping_order() -> Self {
        Self { name: KEEPING, frame: Frame::keeping_order() }
    }
}

impl Variant for Umbel {
    fn name(&self) -> &str {
        self.name
    }

    fn prebuilt(&self) -> bool {
        self.name == KEEPING
    }
}

impl Engine<Picture> for Umbel {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let triangles = Triangles::new(&picture.model.positions, &picture.model.triangles)?;
        let (trace, stats) =
            timed(|| self.frame.closest_hit(&triangles, &picture.pencil, &Options::default()));
        stats?;
        answer.ids.copy_from_slice(self.frame.hits().ids());
        answer.ts.copy_from_slice(self.frame.hits().ts());
        Ok(Times { build: 0.0, trace })
    }
}

impl Engine<Shadow> for Umbel {
    fn run(&mut self, shadow: &Shadow, answer: &mut Blocked) -> Result<Times> {
        let triangles = Triangles::new(&shadow.model.positions, &shadow.model.triangles)?;
        let (trace, found) =
            timed(|| self.frame.shadowed(&triangles, shadow.light, &shadow.receivers, &Options::default()));
        let (shadowed, _) = found?;
        shadow.rays.put_in_order(&shadowed, answer);
        Ok(Times { build: 0.0, trace })
    }
}
