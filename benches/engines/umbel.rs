//! umbel: from positions and indices to the answer in one call, from scratch or with the order of the triangles kept
//! from the round before. As with the others, the memory of ids and distances is kept.

use umbel::engine::{Grouping, Occlusion, RaySamples};
use umbel::{Frame, Options, Triangles};

use crate::Result;
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::subjects::ambient::Ambient;
use crate::subjects::answer::{Blocked, Hits, OpenBits};
use crate::subjects::bounce::Bounce;
use crate::subjects::picture::Picture;
use crate::subjects::shadow::Shadow;

/// The name of the engine that keeps the order.
pub(crate) const KEEPING: &str = "umbel-keep-order";

/// umbel with its default options: exact, by pencils.
#[derive(Debug)]
pub(crate) struct Umbel {
    name: &'static str,
    frame: Frame,
    /// Of ambient rays.
    grouping: Grouping,
}

impl Umbel {
    /// Everything from scratch.
    pub(crate) fn from_scratch() -> Self {
        Self { name: "umbel", frame: Frame::new(), grouping: Grouping::Auto }
    }

    /// With the permutation of the round before, and nothing else.
    pub(crate) fn keeping_order() -> Self {
        Self { name: KEEPING, frame: Frame::keeping_order(), grouping: Grouping::Auto }
    }

    /// From scratch, with the grouping of ambient rays decided here.
    pub(crate) fn grouped() -> [Self; 2] {
        [("umbel-by-direction", Grouping::Direction), ("umbel-by-origin", Grouping::Origin)]
            .map(|(name, grouping)| Self { name, grouping, ..Self::from_scratch() })
    }

    /// Copies what the frame has found.
    fn copy_hits(&self, answer: &mut Hits) {
        answer.ids.copy_from_slice(self.frame.hits().ids());
        answer.ts.copy_from_slice(self.frame.hits().ts());
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
        self.copy_hits(answer);
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

impl Engine<Bounce> for Umbel {
    fn run(&mut self, bounce: &Bounce, answer: &mut Hits) -> Result<Times> {
        let triangles = Triangles::new(&bounce.model.positions, &bounce.model.triangles)?;
        let rays = &bounce.exact[..];
        let (trace, stats) = timed(|| self.frame.closest_hit(&triangles, rays, &Options::default()));
        stats?;
        self.copy_hits(answer);
        Ok(Times { build: 0.0, trace })
    }
}

impl Engine<Ambient> for Umbel {
    fn run(&mut self, ambient: &Ambient, answer: &mut OpenBits) -> Result<Times> {
        let triangles = Triangles::new(&ambient.model.positions, &ambient.model.triangles)?;
        let occlusion = Occlusion {
            hemispheres: &ambient.hemispheres,
            samples: RaySamples::Shared(&ambient.samples),
            back_faces: true,
            grouping: self.grouping,
        };
        let (trace, found) = timed(|| self.frame.open_rays(&triangles, &occlusion, &Options::default()));
        let (open, _) = found?;
        ambient.rays.put_in_order(&open, answer);
        Ok(Times { build: 0.0, trace })
    }
}
