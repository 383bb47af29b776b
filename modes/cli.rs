//! The command line: what can be typed, and what it means.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use umbel::{Accuracy, Aov, Camera, Error, Isa, Lens, Options, Path, Scene, builtin_view};

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
    /// The engine's options.
    pub(crate) fn options(&self) -> Options {
        Options {
            path: match self.path {
                PathArg::Pencil => Path::Pencil,
                PathArg::General => Path::General,
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

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render what a camera sees: a shaded preview, ids, depth, normals, positions
    Render(RenderArgs),
    /// Check pencils against the general path and against tiny-skia, on your own scene
    Verify(VerifyArgs),
    /// Print counts, bounds, and degenerate and non-finite elements
    Info(InfoArgs),
}

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// An OBJ file, builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// PNG: shaded preview. EXR: preview and every AOV asked for. NPY: linear preview. Default umbel.png
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// id, depth, distance, normal, position, bary, object or work (a heat map): NAME=FILE.npy, or NAME alone to add it to the EXR
    #[arg(long = "aov", value_name = "NAME[=FILE.npy]", value_parser = parse_aov)]
    pub(crate) aovs: Vec<(Aov, Option<PathBuf>)>,

    /// Samples per pixel of the preview; AOVs are those of the pixel centre
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// An OBJ file, builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
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
    /// An OBJ file, builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: String,

    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LensArg {
    Pinhole,
    Ortho,
    Equirect,
    Fisheye,
    Cube,
}

/// Where the rays come from. Without options the scene is framed from (1, 0.7, 1).
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// Position of the eye; of an ortho camera, the middle of the film
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    eye: Option<DVec3>,

    /// The point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    target: Option<DVec3>,

    /// The direction that is up in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    up: Option<DVec3>,

    /// Degrees: vertical for pinhole, over the inscribed circle for fisheye (default 45 and 180)
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f64>,

    /// World units from the lower to the upper edge of an ortho picture
    #[arg(long, value_name = "UNITS")]
    height: Option<f64>,

    /// Pixels (default 1280x720)
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,

    /// Pixels along one side of a cube face (default 1024)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32768))]
    cube_size: Option<u32>,

    /// The lens
    #[arg(long = "camera", value_enum, default_value = "pinhole")]
    lens: LensArg,
}

impl CameraArgs {
    /// The camera for a scene.
    pub(crate) fn camera(&self, scene: &Scene) -> Result<Camera, Error> {
        let (width, height) = match self.lens {
            LensArg::Cube => (self.cube_size.unwrap_or(1024), self.cube_size.unwrap_or(1024)),
            _ => self.size.unwrap_or((1280, 720)),
        };
        let lens = match self.lens {
            LensArg::Pinhole => Lens::Pinhole { fov: self.fov.unwrap_or(45.0) },
            LensArg::Ortho => Lens::Ortho { height: self.height.unwrap_or(0.0) },
            LensArg::Equirect => Lens::Equirect,
            LensArg::Fisheye => Lens::Fisheye { fov: self.fov.unwrap_or(180.0) },
            LensArg::Cube => Lens::Cube,
        };
        self.refuse_useless()?;
        let mut camera = Camera::framing(&scene.bounds(), DVec3::new(1.0, 0.7, 1.0), lens, width, height);
        let view = scene.name.strip_prefix("builtin:").and_then(builtin_view);
        if let (Some(view), Lens::Pinhole { .. }, None, None) = (view, lens, self.eye, self.target) {
            camera.eye = DVec3::from_array(view.eye);
            camera.target = DVec3::from_array(view.target);
            camera.up = DVec3::from_array(view.up);
            camera.lens = Lens::Pinhole { fov: self.fov.unwrap_or(view.fov_degrees) };
        }
        camera.eye = self.eye.unwrap_or(camera.eye);
        camera.target = self.target.unwrap_or(camera.target);
        camera.up = self.up.unwrap_or(camera.up);
        if let (Lens::Ortho { .. }, Some(height)) = (lens, self.height) {
            camera.lens = Lens::Ortho { height };
        }
        Ok(camera)
    }

    /// Refuses options that the lens would ignore.
    fn refuse_useless(&self) -> Result<(), Error> {
        let (lens, cube) = (self.lens, self.lens == LensArg::Cube);
        let angle = matches!(lens, LensArg::Pinhole | LensArg::Fisheye);
        let useless = [
            (self.fov.is_some() && !angle, "--fov goes with --camera pinhole or fisheye"),
            (self.height.is_some() && lens != LensArg::Ortho, "--height goes with --camera ortho"),
            (
                self.cube_size.is_some() && !cube,
                "--cube-size goes with --camera cube; the others take --size",
            ),
            (self.size.is_some() && cube, "--camera cube takes --cube-size, not --size"),
            (
                self.target.is_some() && cube,
                "--camera cube looks along the world's axes: it takes no --target",
            ),
            (self.up.is_some() && cube, "--camera cube looks along the world's axes: it takes no --up"),
        ];
        if let Some((_, why)) = useless.iter().find(|(useless, _)| *useless) {
            return Err(Error::Usage((*why).into()));
        }
        Ok(())
    }
}

/// "x,y,z" as three finite numbers.
fn parse_vector(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("expected three finite numbers such as 1,0.5,-2".into()),
    }
}

/// "WxH" as two positive numbers.
fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X']).map(|(w, h)| (w.trim().parse(), h.trim().parse()));
    match parts {
        Some((Ok(width), Ok(height))) if (1..=65536).contains(&width) && (1..=65536).contains(&height) => {
            Ok((width, height))
        }
        _ => Err("expected WIDTHxHEIGHT in pixels, each 1 to 65536, such as 1920x1080".into()),
    }
}

/// A number of bytes with an optional k, M, G or T.
fn parse_bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit: u64 = match text[digits.len()..].to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kb" => 1 << 10,
        "m" | "mb" => 1 << 20,
        "g" | "gb" => 1 << 30,
        "t" | "tb" => 1 << 40,
        _ => return Err("expected a number of bytes such as 500M or 8G".into()),
    };
    let number: f64 =
        digits.parse().map_err(|_| "expected a number of bytes such as 500M or 8G".to_owned())?;
    if number >= 0.0 && number.is_finite() {
        Ok((number * unit as f64) as u64)
    } else {
        Err("expected a size".into())
    }
}

/// "NAME" or "NAME=FILE.npy".
fn parse_aov(text: &str) -> Result<(Aov, Option<PathBuf>), String> {
    let (name, file) = match text.split_once('=') {
        Some((name, file)) => (name, Some(file)),
        None => (text, None),
    };
    let aov = match name {
        "id" => Aov::Id,
        "depth" => Aov::Depth,
        "distance" => Aov::Distance,
        "normal" => Aov::Normal,
        "position" => Aov::Position,
        "bary" => Aov::Bary,
        "object" => Aov::Object,
        "work" => Aov::Work,
        _ => {
            return Err(format!(
                "{name} is none of id, depth, distance, normal, position, bary, object, work"
            ));
        }
    };
    match file {
        Some(file) if !file.to_ascii_lowercase().ends_with(".npy") => {
            Err(format!("{file}: an AOV is written as .npy"))
        }
        file => Ok((aov, file.map(PathBuf::from))),
    }
}
