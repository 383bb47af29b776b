//! `umbel bake` on the command line.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use glam::DVec3;
use umbel::{BakeOptions, Error, Falloff, Grouping, Polarity, Reach, SampleSet, Scene, Weighting};

use crate::camera_args::refuse_first;
use crate::parse::parse_vector;
use crate::picture::extension;

#[derive(Debug, Args)]
pub(crate) struct BakeArgs {
    /// An OBJ file, builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// One number for each vertex or point: .npy, or .ply with positions, faces and gray. Unused vertices are NaN
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Bent normals, the mean open directions in world axes, as an array (..., 3)
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) bent: Option<PathBuf>,

    /// All rays above the surfaces, as an array (R, 8): origin, direction, t_max, and 1 for a hit or else 0
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) dump_rays: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) receivers: ReceiverArgs,

    #[command(flatten)]
    sampling: SamplingArgs,

    #[command(flatten)]
    pub(crate) occluders: OccluderArgs,
}

/// What is baked.
#[derive(Debug, Args)]
#[command(next_help_heading = "Receivers")]
pub(crate) struct ReceiverArgs {
    /// Bake the vertices of the scene, in file order
    #[arg(long, conflicts_with = "points")]
    pub(crate) vertices: bool,

    /// Bake points: an array (N, 6) of f4 or f8, each row a position and a normal
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) points: Option<PathBuf>,

    /// The triangle that each point lies on, which never occludes it: an array (N) of integers, -1 for none
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) point_ids: Option<PathBuf>,

    /// Move points by this much along their normals, for points that may lie beneath their surface
    #[arg(long, value_name = "D", default_value_t = 0.0, allow_hyphen_values = true)]
    pub(crate) bias: f64,
}

/// Which rays there are, and how they count.
#[derive(Debug, Args)]
#[command(next_help_heading = "Rays")]
struct SamplingArgs {
    /// Rays of a receiver; about as many where sets are shared
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=65536))]
    rays: u32,

    /// How far occluders count: world units, or percent of the diagonal of the scene's box; 0 is unlimited
    #[arg(long, value_name = "D|P%", default_value = "0", value_parser = parse_distance, allow_hyphen_values = true)]
    max_distance: Distance,

    /// linear: an occluder at t counts 1 - t/D, where D is --max-distance
    #[arg(long, value_enum, default_value = "none")]
    falloff: FalloffArg,

    /// How much a direction counts: the cosine of its angle to the normal, or all the same
    #[arg(long, value_enum, default_value = "cosine")]
    weighting: WeightingArg,

    /// What 1 means: nothing occludes (white is open), or all is occluded
    #[arg(long, value_enum, default_value = "openness")]
    polarity: PolarityArg,

    /// shared: the same directions for all, the least error. interleaved: 16 sets in turn, noise instead of bands.
    /// independent: each receiver its own
    #[arg(long, value_enum, default_value = "shared")]
    set: SetArg,

    /// How the engine groups rays. Never changes an output
    #[arg(long, value_enum, default_value = "auto")]
    group: GroupArg,

    /// Another number takes other directions
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// What occludes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Occluders")]
pub(crate) struct OccluderArgs {
    /// Triangles occlude only rays that meet their front, the side from which their corners run counter-clockwise
    #[arg(long, overrides_with = "two_sided")]
    ignore_back_faces: bool,

    /// Triangles occlude from both sides; this is so by default
    #[arg(long, overrides_with = "ignore_back_faces")]
    two_sided: bool,

    /// Put a large ground plane below everything
    #[arg(long)]
    pub(crate) ground_plane: bool,

    /// The direction that is up for the ground plane [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true, requires = "ground_plane")]
    pub(crate) up: Option<DVec3>,

    /// Another scene that occludes this one and is not baked; may be given several times
    #[arg(long = "occluders", value_name = "SCENE")]
    pub(crate) scenes: Vec<String>,
}

impl BakeArgs {
    /// Refuses options that contradict each other. Nothing has been read yet.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let nothing = self.outputs().next().is_none();
        let receivers = &self.receivers;
        refuse_first(&[
            (
                !receivers.vertices && receivers.points.is_none(),
                "what shall be baked? give --vertices, or --points FILE.npy",
            ),
            (
                nothing,
                "nothing to do: give -o FILE.npy or FILE.ply, --bent FILE.npy, or --dump-rays FILE.npy",
            ),
            (receivers.vertices && receivers.point_ids.is_some(), "--point-ids goes with --points"),
            (receivers.vertices && receivers.bias != 0.0, "--bias goes with --points; vertices need none"),
            (!receivers.bias.is_finite(), "--bias must be a finite number"),
            (
                self.sampling.falloff == FalloffArg::Linear && self.sampling.max_distance.is_unlimited(),
                "--falloff linear goes down to 0 at --max-distance: give one, such as 10%",
            ),
            (
                self.sampling.set == SetArg::Independent && self.sampling.group == GroupArg::Direction,
                "--set independent has no common directions for --group direction: take auto or origin",
            ),
        ])?;
        let arrays = [("--bent", &self.bent), ("--dump-rays", &self.dump_rays)];
        for (option, path) in arrays.into_iter().filter_map(|(option, path)| Some((option, path.as_ref()?))) {
            if extension(path) != "npy" {
                return Err(Error::Usage(format!("{}: {option} takes .npy", path.display())));
            }
        }
        if let Some(path) = &self.output
            && !["npy", "ply"].contains(&extension(path).as_str())
        {
            let shown = path.display();
            return Err(Error::Usage(format!("{shown}: -o takes one of .npy, .ply for vertices and points")));
        }
        let files: Vec<_> = self.outputs().collect();
        let twice = (1..files.len()).find(|&k| files[..k].contains(&files[k]));
        twice.map_or(Ok(()), |k| {
            Err(Error::Usage(format!("{}: two outputs have this name", files[k].display())))
        })
    }

    /// The files that are asked for.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.output, &self.bent, &self.dump_rays].into_iter().flatten()
    }

    /// What is baked, and how: distances are measured in the scene.
    pub(crate) fn options(&self, scene: &Scene) -> BakeOptions {
        let sampling = &self.sampling;
        BakeOptions {
            rays: sampling.rays,
            set: match sampling.set {
                SetArg::Shared => SampleSet::Shared,
                SetArg::Interleaved => SampleSet::Interleaved,
                SetArg::Independent => SampleSet::Independent,
            },
            weighting: match sampling.weighting {
                WeightingArg::Cosine => Weighting::Cosine,
                WeightingArg::Uniform => Weighting::Uniform,
            },
            reach: Reach {
                max_distance: sampling.max_distance.in_scene(scene),
                falloff: match sampling.falloff {
                    FalloffArg::None => Falloff::None,
                    FalloffArg::Linear => Falloff::Linear,
                },
            },
            back_faces: !self.occluders.ignore_back_faces,
            polarity: match sampling.polarity {
                PolarityArg::Openness => Polarity::Openness,
                PolarityArg::Occlusion => Polarity::Occlusion,
            },
            bent: self.bent.is_some(),
            traced: self.dump_rays.is_some(),
            seed: sampling.seed,
            grouping: match sampling.group {
                GroupArg::Auto => Grouping::Auto,
                GroupArg::Origin => Grouping::Origin,
                GroupArg::Direction => Grouping::Direction,
            },
            columns: None,
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
    fn is_unlimited(self) -> bool {
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
