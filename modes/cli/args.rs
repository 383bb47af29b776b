//! The command line: what can be typed, and what it means.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use umbel::{Accuracy, Isa, LoadOptions, Options, Partition, Path};

use crate::bake::args::BakeArgs;
use crate::options::bounces::BounceArgs;
use crate::options::camera::CameraArgs;
use crate::options::parse::parse_bytes;
use crate::options::picture::PictureArgs;
use crate::probe::args::ProbeArgs;
use crate::reyes::args::ReyesArgs;
use crate::shadow::args::{LightArgs, ShadowArgs};
use crate::trade::args::TradeArgs;

const EXIT_CODES: &str = "Exit codes: 0 ok, 1 runtime failure, 2 usage, 3 bad input, 4 limit hit, \
5 a comparison found a difference, 130 interrupted.";

/// Exact visibility on the CPU: no GPU, no GL, nothing to build.
#[derive(Debug, Parser)]
#[command(name = "umbel", version, about, after_help = EXIT_CODES, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,

    #[command(flatten)]
    pub(crate) common: Common,
}

/// Options of every verb.
#[derive(Debug, Args)]
#[command(next_help_heading = "Common options")]
pub(crate) struct Common {
    /// Worker threads; 0 takes all processors. Never changes an output
    #[arg(long, global = true, default_value_t = 0, value_name = "N", env = "UMBEL_THREADS")]
    pub(crate) threads: usize,

    /// exact: every decision as in exact arithmetic. fast: rounded decisions
    #[arg(long, global = true, value_enum, default_value = "exact")]
    pub(crate) accuracy: AccuracyArg,

    /// pencil: one bound stands for many rays. general: every ray by itself. Both give the same output
    #[arg(long, global = true, value_enum, default_value = "pencil")]
    pub(crate) path: PathArg,

    /// How --path general divides triangles: at the middle of the longest side, as the file gives them, by space, or by cost
    /// from a sample of the rays. Never changes an output; only time, and the memory of spatial
    #[arg(long, global = true, value_enum, default_value = "middle")]
    pub(crate) partition: PartitionArg,

    /// Instructions of the kernels. Never changes an output; what the machine lacks is refused
    #[arg(long, global = true, value_enum, default_value = "auto")]
    pub(crate) isa: IsaArg,

    /// Write counts, times and a hash of the outputs as JSON
    #[arg(long, global = true, value_name = "FILE.json")]
    pub(crate) report: Option<PathBuf>,

    /// Run the engine N times on the loaded scene, for timing
    #[arg(long, global = true, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// With --repeat: start from the triangle order that the run before has found, and from nothing else
    #[arg(long, global = true)]
    pub(crate) keep_order: bool,

    /// Stop before starting when more memory than this would be needed, such as 500M or 8G
    #[arg(long, global = true, value_name = "BYTES", value_parser = parse_bytes)]
    pub(crate) max_memory: Option<u64>,

    /// Leave out triangles with NaN or infinite positions, with a warning, instead of refusing the scene
    #[arg(long, global = true)]
    pub(crate) drop_non_finite: bool,

    /// Open what the scene's file names in other folders than its own, too: buffers and material libraries
    #[arg(long, global = true)]
    pub(crate) allow_outside: bool,

    /// Say nothing but errors
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,

    /// Print times and counters on stderr
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,

    #[command(flatten)]
    pub(crate) color: colorchoice_clap::Color,
}

impl Common {
    /// Those options that a run of another verb on the same scene has to have as well.
    pub(crate) fn words(&self) -> Vec<String> {
        let threads = (self.threads > 0).then(|| ["--threads".to_owned(), self.threads.to_string()]);
        let dropped = self.drop_non_finite.then(|| "--drop-non-finite".to_owned());
        let outside = self.allow_outside.then(|| "--allow-outside".to_owned());
        threads.into_iter().flatten().chain(dropped).chain(outside).collect()
    }

    /// How scenes are read.
    pub(crate) fn load_options(&self) -> LoadOptions {
        LoadOptions {
            drop_non_finite: self.drop_non_finite,
            allow_outside: self.allow_outside,
            max_memory: self.max_memory,
        }
    }

    /// The engine's options.
    pub(crate) fn options(&self) -> Options {
        Options {
            path: match self.path {
                PathArg::Pencil => Path::Pencil,
                PathArg::General => Path::General,
            },
            partition: match self.partition {
                PartitionArg::Middle => Partition::Middle,
                PartitionArg::Given => Partition::Given,
                PartitionArg::Spatial => Partition::Spatial,
                PartitionArg::Sampled => Partition::Sampled,
            },
            accuracy: match self.accuracy {
                AccuracyArg::Exact => Accuracy::Exact,
                AccuracyArg::Fast => Accuracy::Fast,
            },
            isa: match self.isa {
                IsaArg::Auto => Isa::Auto,
                IsaArg::Sse2 => Isa::Sse2,
                IsaArg::Sse42 => Isa::Sse42,
                IsaArg::Avx2 => Isa::Avx2,
                IsaArg::Avx512 => Isa::Avx512,
                IsaArg::Neon => Isa::Neon,
            },
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum IsaArg {
    Auto,
    Sse2,
    #[value(name = "sse4.2")]
    Sse42,
    Avx2,
    Avx512,
    Neon,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum AccuracyArg {
    Exact,
    Fast,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PathArg {
    Pencil,
    General,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PartitionArg {
    Middle,
    Given,
    Spatial,
    Sampled,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render what a camera sees: a shaded preview, ids, depth, normals, positions
    Render(RenderArgs),
    /// Look all around from one place: environment maps, and the ranges that a LiDAR measures
    Probe(ProbeArgs),
    /// List the triangles that any of some views sees
    Visible(VisibleArgs),
    /// Exact shadows per pixel, and maps of the distances that lights see
    Shadow(ShadowArgs),
    /// Bake ambient occlusion: into a texture, at vertices, or at points
    Bake(BakeArgs),
    /// Render displaced, subdivided and procedural surfaces, made on demand where the rays are
    Reyes(Box<ReyesArgs>),
    /// Measure what each setting costs and how wrong it is, on your own scene: a page with plots and tables
    Trade(TradeArgs),
    /// Check pencils against the general path and against tiny-skia, on your own scene
    Verify(VerifyArgs),
    /// Print counts, bounds, and degenerate and non-finite elements
    Info(InfoArgs),
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// An OBJ or glTF file (.obj, .gltf, .glb), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) picture: PictureArgs,

    /// Lights of the preview, with exact shadows
    #[command(flatten)]
    pub(crate) lights: LightArgs,

    #[command(flatten)]
    pub(crate) bounces: BounceArgs,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct VisibleArgs {
    /// An OBJ or glTF file (.obj, .gltf, .glb), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// NPY: the ids as an array. TXT: one a line. Without it they are printed
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Print visible and all triangles of each object, and their share, instead of ids
    #[arg(long)]
    pub(crate) objects: bool,

    /// Views in a file: [{"eye": [x,y,z], "target": [x,y,z], "fov": 60, "size": [640,480]}, ...] or a table of such by name; also up, camera, height and cube_size
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["eye", "target", "up", "fov", "height", "size", "cube_size", "lens"])]
    pub(crate) views: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// An OBJ or glTF file (.obj, .gltf, .glb), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// Write a picture of the differences: red real, yellow within tolerance
    #[arg(long, value_name = "FILE.png")]
    pub(crate) difference: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// An OBJ or glTF file (.obj, .gltf, .glb), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
