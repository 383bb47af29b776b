//! umbel: from positions and indices to ids and distances in one call. It allocates its answer within its time; the others
//! keep theirs.

use umbel::{Options, Triangles, closest_hit};

use crate::Result;
use crate::answer::Answer;
use crate::engine::{Engine, Times, timed};
use crate::subject::Subject;

/// umbel with its default options: exact, by pencils.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Umbel;

impl Engine for Umbel {
    fn name(&self) -> &str {
        "umbel"
    }

    fn run(&mut self, subject: &Subject, answer: &mut Answer) -> Result<Times> {
        let (trace, hits) = timed(|| {
            let triangles = Triangles::new(&subject.positions, &subject.triangles)?;
            closest_hit(&triangles, &subject.pencil, &Options::default())
        });
        let (hits, _) = hits?;
        answer.ids.copy_from_slice(hits.ids());
        answer.ts.copy_from_slice(hits.ts());
        Ok(Times { build: 0.0, trace })
    }
}
