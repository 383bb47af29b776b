//! The command line: what can be typed, and what it means.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use umbel::engine::Grouping;

use crate::subjects::ambient::MaxDistance;
use crate::subjects::surface_points::ReceiverSet;

/// Runs umbel and other engines side by side.
#[derive(Debug, Parser)]
#[command(name = "umbel-bench", version, about, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,

    #[command(flatten)]
    pub(crate) common: Common,
}

/// Options of every command.
#[derive(Debug, Args)]
pub(crate) struct Common {
    /// Threads of every engine; 0 takes all processors
    #[arg(long, global = true, default_value_t = 0, value_name = "N")]
    pub(crate) threads: usize,

    /// Embree's shared library; without it Embree is left out
    #[arg(long, global = true, value_name = "FILE.so", env = "EMBREE_LIBRARY")]
    pub(crate) embree: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Time what a pinhole camera sees: ids and t of one ray per pixel
    Primary(PrimaryArgs),
    /// Time what a point light sees: ids and t on the six faces of a cube
    Cube(CubeArgs),
    /// Time exact shadows: which of the points that a pinhole camera sees does a point light not see
    Shadow(ShadowArgs),
    /// Time ambient occlusion: which rays from points on surfaces into the half space above are open
    Ambient(AmbientArgs),
    /// Time diffuse-bounce rays, which share nothing: ids and t of rays from what a pinhole camera sees
    Bounce(BounceArgs),
    /// Time and count the general path with each of its partitions, on diffuse-bounce rays
    Partitions(PartitionsArgs),
    /// Time how long openness takes that is right to within an error
    Error(ErrorArgs),
    /// Time surfaces that are diced while they are looked at, against the same triangles made beforehand
    Reyes(ReyesArgs),
    /// Measure the memory of finer and finer micropolygons, and the time of more and more hidden surfaces
    ReyesGrowth(ReyesGrowthArgs),
    /// Count the rays that escape from a closed sphere
    Leaks(LeaksArgs),
    /// Time umbel for hard subjects with more and more triangles
    Cliffs(CliffsArgs),
    /// Time umbel for scenes in which things coincide exactly, against the same scenes where nothing does
    Coincident(CoincidentArgs),
}

/// Options of the commands that compare engines.
#[derive(Debug, Args)]
pub(crate) struct ComparisonArgs {
    /// Names in scenes.json, files, or builtin:NAME. Default: all of scenes.json, or builtin:umbel
    pub(crate) scenes: Vec<String>,

    /// A folder with scenes.json, which names files, cameras and lights
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,

    /// Rounds that count; one more goes before them
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Engines by the beginnings of their names, such as embree,obvhs-cwbvh. umbel always runs. Default: all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) engines: Vec<String>,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,

    /// Draw the medians
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct PrimaryArgs {
    #[command(flatten)]
    pub(crate) compared: ComparisonArgs,

    /// Pixels; may be given more than once
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: Vec<(u32, u32)>,
}

#[derive(Debug, Args)]
pub(crate) struct CubeArgs {
    #[command(flatten)]
    pub(crate) compared: ComparisonArgs,

    /// Pixels along the side of a face; may be given more than once
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16384), default_value = "1024")]
    pub(crate) size: Vec<u32>,

    /// Where the light is. Default: as scenes.json says
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) light: Option<[f32; 3]>,
}

#[derive(Debug, Args)]
pub(crate) struct ShadowArgs {
    #[command(flatten)]
    pub(crate) compared: ComparisonArgs,

    /// Pixels of the camera; may be given more than once
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: Vec<(u32, u32)>,

    /// Where the light is. Default: as scenes.json says
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) light: Option<[f32; 3]>,
}

#[derive(Debug, Args)]
pub(crate) struct AmbientArgs {
    #[command(flatten)]
    pub(crate) compared: ComparisonArgs,

    /// texel:N, vertex or random:N; may be given more than once
    #[arg(long, value_name = "SET", default_value = "random:20000")]
    pub(crate) receivers: Vec<ReceiverSet>,

    /// Rays above each receiver's horizon, on average
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 16), default_value = "64")]
    pub(crate) rays: u32,

    /// How far occluders count: a length, or a share of the scene's diagonal such as 10%. Default: any distance
    #[arg(long, value_name = "D|P%")]
    pub(crate) max_distance: Option<MaxDistance>,
}

#[derive(Debug, Args)]
pub(crate) struct BounceArgs {
    #[command(flatten)]
    pub(crate) compared: ComparisonArgs,

    /// Rays; may be given more than once, for a plot of time against rays
    #[arg(long, value_name = "N", value_parser = parse_rays, default_value = "2000000")]
    pub(crate) rays: Vec<usize>,

    /// Shuffle the rays. Default: image order
    #[arg(long)]
    pub(crate) shuffled: bool,

    /// Other directions, and another shuffling
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

#[derive(Debug, Args)]
pub(crate) struct PartitionsArgs {
    /// Names in scenes.json, files, or builtin:NAME. Default: all of scenes.json, or builtin:umbel
    pub(crate) scenes: Vec<String>,

    /// A folder with scenes.json, which names files and cameras
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,

    /// Rays
    #[arg(long, value_name = "N", value_parser = parse_rays, default_value = "50000")]
    pub(crate) rays: usize,

    /// Other directions
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,

    /// Rounds that count; one more goes before them
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ErrorArgs {
    /// Names in scenes.json, files, or builtin:NAME. Default: all of scenes.json, or builtin:umbel
    pub(crate) scenes: Vec<String>,

    /// A folder with scenes.json, which names files
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,

    /// texel:N, vertex or random:N
    #[arg(long, value_name = "SET", default_value = "random:20000")]
    pub(crate) receivers: ReceiverSet,

    /// Rays above each receiver's horizon
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [4, 8, 16, 32, 64, 128, 256, 512, 1024])]
    pub(crate) rays: Vec<u32>,

    /// Estimates by the beginnings of their names, such as umbel,embree-random. Default: all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) estimates: Vec<String>,

    /// How far occluders count: a length, or a share of the scene's diagonal such as 10%. Default: any distance
    #[arg(long, value_name = "D|P%")]
    pub(crate) max_distance: Option<MaxDistance>,

    /// How umbel groups rays: origin, direction or auto. Changes times only
    #[arg(long, value_name = "BY", default_value = "auto", value_parser = parse_grouping)]
    pub(crate) group: Grouping,

    /// The error whose time is told: root mean square of openness, which is from 0 to 1
    #[arg(long, value_name = "RMSE", default_value_t = 0.02)]
    pub(crate) target: f64,

    /// Rays of the reference, above each receiver's horizon
    #[arg(long, value_name = "N", default_value_t = 16384, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) reference: u32,

    /// Rounds that count; one more goes before them. 0 measures errors and no times
    #[arg(long, default_value_t = 3, value_name = "N")]
    pub(crate) repeat: u32,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,

    /// Draw errors against rays
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ReyesArgs {
    /// sheet, builtin:teapot, builtin:terrain, .bpt files, or meshes, which are subdivided and displaced: files or names in scenes.json
    pub(crate) scenes: Vec<String>,

    /// A folder with scenes.json, which names files and cameras
    #[arg(long = "scenes", value_name = "DIR")]
    pub(crate) folder: Option<PathBuf>,

    /// Pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: (u32, u32),

    /// Edges of micropolygons in pixels; may be given more than once
    #[arg(long, value_name = "PIXELS", default_value = "0.5")]
    pub(crate) shading_rate: Vec<f64>,

    /// Rounds that count; one more goes before them
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Engines by the beginnings of their names, such as embree,obvhs-cwbvh. umbel always runs
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "embree-low,embree-medium-8,embree-medium-16"
    )]
    pub(crate) engines: Vec<String>,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

impl ReyesArgs {
    /// Whether an engine of this name is asked for.
    pub(crate) fn wanted(&self, name: &str) -> bool {
        self.engines.iter().any(|start| name.starts_with(start.as_str()))
    }
}

#[derive(Debug, Args)]
pub(crate) struct ReyesGrowthArgs {
    /// Pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: (u32, u32),

    /// Micropolygons after which a sheet is not diced more finely
    #[arg(long, value_name = "N", default_value_t = 5e8)]
    pub(crate) most: f64,

    /// Rounds that count; one more goes before them
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Draw memory against micropolygons
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) memory: Option<PathBuf>,

    /// Draw time against hidden surfaces
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) depth: Option<PathBuf>,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct LeaksArgs {
    /// Divisions of the icosahedron: each makes four triangles of one
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=8))]
    pub(crate) divisions: u32,

    /// Origins inside the sphere
    #[arg(long, default_value_t = 12, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) origins: u32,

    /// Write the counts
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CliffsArgs {
    /// Names of subjects. Default: all
    pub(crate) subjects: Vec<String>,

    /// The most triangles; they are doubled from 1024 on
    #[arg(long, default_value_t = 1 << 20, value_name = "N", value_parser = clap::value_parser!(u32).range(1024..=1 << 24))]
    pub(crate) largest: u32,

    /// Pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: (u32, u32),

    /// Runs that count; one more goes before them. Runs of more than a second are not repeated
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Seconds of a run after which a subject is not made larger
    #[arg(long, default_value_t = 10.0, value_name = "SECONDS")]
    pub(crate) limit: f64,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,

    /// Draw time against triangles
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CoincidentArgs {
    /// Parts of names of scenes, such as wall or open-rays. Default: all
    pub(crate) names: Vec<String>,

    /// Rounds, in each of which every place of a scene is asked for some milliseconds; the least time counts
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// Fail where a scene takes more than this times as long as the same scene apart
    #[arg(long, value_name = "RATIO")]
    pub(crate) limit: Option<f64>,

    /// Write everything that was measured
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,

    /// Draw the ratios
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
}

/// "WxH" as two positive numbers.
fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X']).map(|(w, h)| (w.trim().parse(), h.trim().parse()));
    match parts {
        Some((Ok(width), Ok(height))) if (1..=16384).contains(&width) && (1..=16384).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("expected WIDTHxHEIGHT in pixels, each 1 to 16384, such as 1920x1080".into()),
    }
}

/// A number of rays.
fn parse_rays(text: &str) -> Result<usize, String> {
    let rays = text.parse().ok().filter(|rays| (1..=1 << 26).contains(rays));
    rays.ok_or_else(|| "expected a number of rays from 1 to 67108864".into())
}

/// The name of a grouping.
fn parse_grouping(text: &str) -> Result<Grouping, String> {
    match text {
        "auto" => Ok(Grouping::Auto),
        "origin" => Ok(Grouping::Origin),
        "direction" => Ok(Grouping::Direction),
        _ => Err("expected origin, direction or auto".into()),
    }
}

/// "X,Y,Z" as a point.
fn parse_point(text: &str) -> Result<[f32; 3], String> {
    let numbers: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let point = numbers.and_then(|numbers| <[f32; 3]>::try_from(numbers).ok());
    let point = point.filter(|point| point.iter().all(|x| x.is_finite()));
    point.ok_or_else(|| "expected X,Y,Z such as 0,8,0.5".into())
}
