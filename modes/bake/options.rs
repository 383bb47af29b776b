//! What is baked, and how.

use umbel_core::Grouping;

use crate::bake::depth_maps::DepthMaps;
use crate::bake::sample_sets::{Falloff, Reach, SampleSet, Weighting};
use crate::error::Error;

/// The most rays of a receiver.
const MOST_RAYS: u32 = 65_536;

/// What a value means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarity {
    /// 1 = nothing occludes: white is open.
    #[default]
    Openness,
    /// 1 = all is occluded.
    Occlusion,
}

impl Polarity {
    /// The value of an openness.
    pub(crate) fn value(self, openness: f64) -> f32 {
        (if self == Self::Openness { openness } else { 1.0 - openness }) as f32
    }
}

/// What is baked, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BakeOptions {
    /// Rays of a receiver, 1 to 65,536: as many where it has its own, else about as many.
    pub rays: u32,
    /// How directions are shared.
    pub set: SampleSet,
    /// How much each direction counts.
    pub weighting: Weighting,
    /// How far occluders count.
    pub reach: Reach,
    /// Whether triangles occlude that rays meet from behind.
    pub back_faces: bool,
    /// What a value means.
    pub polarity: Polarity,
    /// Whether bent normals are wanted.
    pub bent: bool,
    /// Whether the rays themselves are wanted.
    pub traced: bool,
    /// Turns the sets of directions, and seeds those of single receivers.
    pub seed: u64,
    /// How the engine groups rays. Changes time only.
    pub grouping: Grouping,
    /// For texels, whose numbers run row by row, how many there are in a row.
    pub columns: Option<u32>,
    /// Depth maps in place of rays, faster and less exact; for directions that are shared, of any length, and both sides of triangles.
    pub depth_maps: Option<DepthMaps>,
}

impl Default for BakeOptions {
    /// 64 cosine-weighted rays of unlimited length, shared by all.
    fn default() -> Self {
        Self {
            rays: 64,
            set: SampleSet::Shared,
            weighting: Weighting::Cosine,
            reach: Reach::default(),
            back_faces: true,
            polarity: Polarity::Openness,
            bent: false,
            traced: false,
            seed: 0,
            grouping: Grouping::Auto,
            columns: None,
            depth_maps: None,
        }
    }
}

impl BakeOptions {
    /// Refuses what is out of range or contradicts itself.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Self { rays, reach, .. } = *self;
        let refused = |what: String| Err(Error::Usage(what));
        if !(1..=MOST_RAYS).contains(&rays) {
            return refused(format!("{rays} rays: a receiver takes 1 to {MOST_RAYS}"));
        }
        if !(reach.max_distance.is_finite() && reach.max_distance >= 0.0) {
            return refused(format!("the distance {} must be finite, 0 or more", reach.max_distance));
        }
        let is_below = reach.max_distance == 0.0 || reach.min_distance < reach.max_distance;
        if !(reach.min_distance.is_finite() && reach.min_distance >= 0.0 && is_below) {
            return refused(format!(
                "the least distance {} must be finite, 0 or more, and below the greatest",
                reach.min_distance
            ));
        }
        if reach.max_distance == 0.0 && reach.falloff == Falloff::Linear {
            return refused("a linear falloff needs a distance: give the greatest one".into());
        }
        if self.set == SampleSet::Independent && self.grouping == Grouping::Direction {
            return refused(
                "independent directions are not common: they can be grouped by origin only".into(),
            );
        }
        self.depth_maps.map_or(Ok(()), |maps| self.check_maps(maps))
    }

    /// Refuses what depth maps cannot do.
    fn check_maps(&self, DepthMaps { size, .. }: DepthMaps) -> Result<(), Error> {
        let most = DepthMaps::MOST;
        let refused = |what: String| Err(Error::Usage(what));
        if !(1..=most).contains(&size) {
            return refused(format!("depth maps of {size} texels a side: they have 1 to {most}"));
        }
        if self.set == SampleSet::Independent {
            return refused(
                "depth maps are made for directions that receivers share: independent ones have none".into(),
            );
        }
        if self.reach.max_distance > 0.0 || self.reach.min_distance > 0.0 {
            return refused(
                "depth maps know only the outermost surface, and nothing of a least or a greatest distance"
                    .into(),
            );
        }
        if !self.back_faces {
            return refused("depth maps see both sides of triangles: back faces count".into());
        }
        if self.grouping != Grouping::Auto {
            return refused("depth maps take the place of rays: there is nothing to group".into());
        }
        Ok(())
    }
}
