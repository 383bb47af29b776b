//! umbel: from positions and indices to ids and distances in one call, from scratch or with the order of the triangles kept
//! from the round before. As with the others, the memory of the answer is kept.

use umbel::{Frame, Options, Triangles};

use crate::Result;
use crate::answer::Answer;
use crate::engine::{Engine, Times, timed};
use crate::subject::Subject;

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

impl Engine for Umbel {
    fn name(&self) -> &str {
        self.name
    }

    fn prebuilt(&self) -> bool {
        self.name == KEEPING
    }

    fn run(&mut self, subject: &Subject, answer: &mut Answer) -> Result<Times> {
        let triangles = Triangles::new(&subject.positions, &subject.triangles)?;
        let (trace, stats) =
            timed(|| self.frame.closest_hit(&triangles, &subject.pencil, &Options::default()));
        stats?;
        answer.ids.copy_from_slice(self.frame.hits().ids());
        answer.ts.copy_from_slice(self.frame.hits().ts());
        Ok(Times { build: 0.0, trace })
    }
}
