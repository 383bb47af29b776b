//! The rays of `umbel bake` on the command line: how many, how far, how they count, how they are chosen.

use clap::{Args, ValueEnum};
use glam::DVec3;
use umbel::bake::{BakeOptions, DepthMaps, Falloff, Polarity, Reach, SampleSet, Weighting};
use umbel::engine::Grouping;
use umbel::{Error, Scene};

use crate::options::camera::refuse_first;

/// Which rays there are, and how they count.
#[derive(Debug, Args)]
#[command(next_help_heading = "Rays")]
pub(crate) struct SamplingArgs {
    /// Rays of a receiver; about as many where sets are shared [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    rays: Option<u32>,

    /// How far occluders count: world units, or percent of the diagonal of the scene's box; 0 is unlimited
    #[arg(long, value_name = "D|P%", default_value = "0", value_parser = parse_distance, allow_hyphen_values = true)]
    max_distance: Distance,

    /// Up to where nothing occludes, likewise: layers that lie upon each other but for rounding ask for it. Slower; 0 is exact
    #[arg(long, value_name = "D|P%", default_value = "0", value_parser = parse_distance, allow_hyphen_values = true)]
    min_distance: Distance,

    /// linear: an occluder at t counts 1 - t/D, where D is --max-distance
    #[arg(long, value_enum, default_value = "none")]
    falloff: FalloffArg,

    /// How much a direction counts: the cosine of its angle to the normal, or all the same
    #[arg(long, value_enum, default_value = "cosine")]
    weighting: WeightingArg,

    /// What 1 means: nothing occludes (white is open), or all is occluded
    #[arg(long, value_enum, default_value = "openness")]
    polarity: PolarityArg,

    /// shared: the same directions for all, the fastest. interleaved: 16 sets in turn, a fine grain instead of bands.
    /// independent: each receiver its own [default: interleaved for texels, else and with --depth-maps shared]
    #[arg(long, value_enum)]
    set: Option<SetArg>,

    /// Look directions up in depth maps of N x N texels instead of tracing rays: faster, and wrong within half a texel of
    /// where shadows end. For any distance; with 256 a texture is about twice
    /// as fast, with about the error of 64 rays
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8192))]
    depth_maps: Option<u32>,

    /// How the engine groups rays. Never changes an output
    #[arg(long, value_enum, default_value = "auto")]
    group: GroupArg,

    /// Another number takes other directions
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

impl SamplingArgs {
    /// Refuses options that contradict each other.
    pub(crate) fn check(&self) -> Result<(), Error> {
        refuse_first(&[
            (
                self.falloff == FalloffArg::Linear && self.max_distance.is_zero(),
                "--falloff linear goes down to 0 at --max-distance: give one, such as 10%",
            ),
            (
                self.set == Some(SetArg::Independent) && self.group == GroupArg::Direction,
                "--set independent has no common directions for --group direction: take auto or origin",
            ),
            (
                self.has_maps() && self.set == Some(SetArg::Independent),
                "--depth-maps: a map is made for a direction that receivers share: take --set shared or interleaved",
            ),
            (
                self.has_maps() && !self.max_distance.is_zero(),
                "--depth-maps: a map knows only the outermost surface, not what lies within --max-distance: leave out one of \
                 them",
            ),
            (
                self.has_maps() && !self.min_distance.is_zero(),
                "--depth-maps: a map knows only the outermost surface, not what lies beyond --min-distance: leave out one of them",
            ),
            (
                self.group == GroupArg::Direction && !self.min_distance.is_zero(),
                "--min-distance: rays that leave something out go by origin: take --group auto",
            ),
            (
                self.has_maps() && self.group != GroupArg::Auto,
                "--depth-maps: maps take the place of rays, and --group has none to group: leave it out",
            ),
        ])
    }

    /// Whether the number of rays is given.
    pub(crate) fn has_rays(&self) -> bool {
        self.rays.is_some()
    }

    /// Whether depth maps take the place of rays.
    pub(crate) fn has_maps(&self) -> bool {
        self.depth_maps.is_some()
    }

    /// Whether depth maps could.
    pub(crate) fn takes_maps(&self) -> bool {
        self.max_distance.is_zero()
            && self.min_distance.is_zero()
            && self.set != Some(SetArg::Independent)
            && self.group == GroupArg::Auto
    }

    /// Whether 1 is open.
    pub(crate) fn is_openness(&self) -> bool {
        self.polarity == PolarityArg::Openness
    }

    /// The sets of directions. Texels lie beside each other, so that what 16 sets have in common shows where a texture is seen from
    /// afar; of depth maps there are 16 times as many then.
    fn set(&self, of_texels: bool) -> SampleSet {
        match self.set {
            Some(SetArg::Shared) => SampleSet::Shared,
            Some(SetArg::Interleaved) => SampleSet::Interleaved,
            Some(SetArg::Independent) => SampleSet::Independent,
            None if of_texels && !self.has_maps() => SampleSet::Interleaved,
            None => SampleSet::Shared,
        }
    }

    /// What these options say: distances are measured in the scene. The rest is as it is by default.
    pub(crate) fn options(&self, scene: &Scene, of_texels: bool) -> BakeOptions {
        BakeOptions {
            rays: self.rays.unwrap_or(BakeOptions::default().rays),
            set: self.set(of_texels),
            weighting: match self.weighting {
                WeightingArg::Cosine => Weighting::Cosine,
                WeightingArg::Uniform => Weighting::Uniform,
            },
            reach: Reach {
                max_distance: self.max_distance.in_scene(scene),
                falloff: match self.falloff {
                    FalloffArg::None => Falloff::None,
                    FalloffArg::Linear => Falloff::Linear,
                },
                min_distance: self.min_distance.in_scene(scene),
            },
            back_faces: true,
            polarity: match self.polarity {
                PolarityArg::Openness => Polarity::Openness,
                PolarityArg::Occlusion => Polarity::Occlusion,
            },
            bent: false,
            traced: false,
            seed: self.seed,
            grouping: match self.group {
                GroupArg::Auto => Grouping::Auto,
                GroupArg::Origin => Grouping::Origin,
                GroupArg::Direction => Grouping::Direction,
            },
            columns: None,
            depth_maps: self.depth_maps.map(|size| DepthMaps { size, bounds: scene.bounds() }),
        }
    }
}

/// A distance on the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Distance {
    /// In world units.
    World(f64),
    /// In percent of the diagonal of the scene's box.
    Percent(f64),
}

impl Distance {
    fn is_zero(self) -> bool {
        matches!(self, Self::World(0.0) | Self::Percent(0.0))
    }

    /// In world units; 0 is unlimited.
    fn in_scene(self, scene: &Scene) -> f64 {
        match self {
            Self::World(distance) => distance,
            Self::Percent(percent) => {
                let bounds = scene.bounds();
                if bounds.is_empty() {
                    return 0.0;
                }
                let [lo, hi] = [bounds.lo, bounds.hi].map(|p| DVec3::from_array(p.map(f64::from)));
                (hi - lo).length() * percent / 100.0
            }
        }
    }
}

/// "D" or "P%", each finite and not negative.
fn parse_distance(text: &str) -> Result<Distance, String> {
    let (number, distance): (&str, fn(f64) -> Distance) = match text.strip_suffix('%') {
        Some(percent) => (percent, Distance::Percent),
        None => (text, Distance::World),
    };
    let number = number.trim().parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.map(distance).ok_or_else(|| "expected a distance such as 1.5, or 10% of the scene's box".into())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetArg {
    Shared,
    Interleaved,
    Independent,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FalloffArg {
    None,
    Linear,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WeightingArg {
    Cosine,
    Uniform,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PolarityArg {
    Openness,
    Occlusion,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum GroupArg {
    Auto,
    Origin,
    Direction,
}
