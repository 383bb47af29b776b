//! The command line: what can be typed, and what it means.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;

use crate::bake::args::BakeArgs;
use crate::common::Common;
use crate::file_names::FileNames;
use crate::machine;
use crate::options::bounces::BounceArgs;
use crate::options::camera::CameraArgs;
use crate::options::lights::LightArgs;
use crate::options::picture::PictureArgs;
use crate::probe::args::ProbeArgs;
use crate::reyes::args::ReyesArgs;
use crate::shadow::args::ShadowArgs;
use crate::trade::args::TradeArgs;

const EXIT_CODES: &str = "Exit codes: 0 ok, 1 runtime failure, 2 usage, 3 bad input, 4 limit hit, \
5 a comparison found a difference, 130 interrupted.";

const EXAMPLES: &str = "\
Examples:
  umbel model.obj                                    a picture, umbel.png
  umbel render room.glb --view front --size 800x600 -o room.png
  umbel render scan.ply.gz --aov depth=depth.npy --aov id=id.npy
  curl -s https://example.org/part.stl | umbel - -o - > part.png
  umbel shadow model.obj --sun 1,2,1 --mask mask.png
  umbel bake model.glb --vertices -o baked.glb
  umbel info model.obj --json

Exit codes: 0 ok, 1 runtime failure, 2 usage, 3 bad input, 4 limit hit, \
5 a comparison found a difference, 130 interrupted.";

/// Exact visibility on the CPU: no GPU, no GL, nothing to build.
#[derive(Debug, Parser)]
#[command(
    name = "umbel",
    version,
    long_version = machine::long_version(),
    about,
    after_help = EXIT_CODES,
    after_long_help = EXAMPLES,
    arg_required_else_help = true
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,

    #[command(flatten)]
    pub(crate) common: Common,
}

/// The words of a command line, with the verb where it is left out: `umbel model.obj` renders.
pub(crate) fn with_verb(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut words: Vec<OsString> = words.collect();
    let Some(first) = words.get(1) else { return words };
    let text = first.to_string_lossy();
    let is_verb = Cli::command().get_subcommands().any(|verb| verb.get_name() == text) || text == "help";
    let is_option = text.starts_with('-') && text != "-";
    let names_scene = text == "-" || text.starts_with("builtin:") || Path::new(first).extension().is_some();
    if !is_verb && !is_option && names_scene {
        words.insert(1, "render".into());
    }
    words
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
    /// Print a script that completes umbel's options in a shell
    Completions {
        /// The shell that shall read it
        shell: Shell,
    },
    /// Write manual pages: one for umbel and one for each verb
    Man {
        /// The folder for them, which is made if it is not there
        folder: PathBuf,
    },
}

impl Command {
    /// The files that the command line names.
    pub(crate) fn files(&self) -> FileNames {
        let of_scene = |scene| FileNames::of_scenes([scene]);
        match self {
            Self::Render(args) => of_scene(&args.scene).writing(&args.picture.outputs()),
            Self::Probe(args) => {
                of_scene(&args.scene).reading(args.inputs()).writing(&args.picture.outputs())
            }
            Self::Visible(args) => of_scene(&args.scene).reading(&args.views).writing(&args.output),
            Self::Shadow(args) => {
                let names = FileNames::of_scenes([&args.scene].into_iter().chain(&args.occluders));
                names.reading(args.surfaces.made.inputs()).writing(args.outputs())
            }
            Self::Bake(args) => {
                let names = FileNames::of_scenes([&args.scene].into_iter().chain(&args.occluders.scenes));
                names.reading(args.inputs()).writing(args.outputs())
            }
            Self::Reyes(args) => {
                of_scene(&args.scene).reading(args.surfaces.made.inputs()).writing(&args.picture.outputs())
            }
            Self::Trade(args) => FileNames::of_scenes(&args.scene).writing(args.outputs()),
            Self::Verify(args) => of_scene(&args.scene).writing(&args.difference),
            Self::Info(args) => of_scene(&args.scene),
            Self::Completions { .. } | Self::Man { .. } => FileNames::default(),
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

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
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    /// NPY: the ids as an array. TXT: one a line. Without it they are printed
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Print visible and all triangles of each object, and their share, instead of ids
    #[arg(long)]
    pub(crate) objects: bool,

    /// Views in a file: [{"eye": [x,y,z], "target": [x,y,z], "fov": 60, "size": [640,480]}, ...] or a table of such by name; also up, camera, height and cube_size
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["named_view", "azimuth", "elevation", "eye", "target", "up", "fov", "height", "size", "cube_size", "lens"])]
    pub(crate) views: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    /// Write a picture of the differences: red real, yellow within tolerance
    #[arg(long, value_name = "FILE.png")]
    pub(crate) difference: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
