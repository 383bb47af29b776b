//! `umbel probe` on the command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{OsStringValueParser, TypedValueParser as _};
use clap::{Args, ValueEnum};
use glam::DVec3;
use umbel::{Camera, Error, Lens};

use crate::options::camera::{LensArg, ViewArgs, refuse_first};
use crate::options::parse::parse_vector;
use crate::options::picture::PictureArgs;

/// The sine of the angle to Z up to which up counts as along Z, for the view without a target. Where it lies is a matter of
/// taste: level directions are accurate from 2⁻²⁰ on.
const NEARLY_UP: f64 = 1e-3;

/// The elevations of a LiDAR's rings without `fov=`, in degrees.
const ELEVATIONS: [f64; 2] = [-15.0, 15.0];

#[derive(Debug, Args)]
#[command(mut_arg("size", |size| size.help("Pixels (default 1024x512; fisheye 1024x1024)")))]
#[command(mut_arg("target", |target| target.help("The point in the middle of the picture (default: level, towards -Z)")))]
#[command(mut_arg("up", |up| up.help("The direction that is up: the axis of a spinning LiDAR (default +Y)")))]
#[command(mut_arg("fov", |fov| fov.help("Degrees over the inscribed circle of a fisheye (default 180)")))]
pub(crate) struct ProbeArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    #[command(flatten)]
    pub(crate) picture: PictureArgs,

    /// Where all rays start
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true, help_heading = "Camera")]
    pub(crate) center: DVec3,

    /// A LiDAR instead of a lens: rings=N,columns=N[,fov=LOWER..UPPER], elevations in degrees (default -15..15); or directions in world axes, an array (N, 3) of f4 or f8 in FILE.npy
    #[arg(long, value_name = "PATTERN", value_parser = OsStringValueParser::new().try_map(parse_pattern), conflicts_with = "lens", help_heading = "Camera")]
    pub(crate) pattern: Option<PatternArg>,

    /// The lens
    #[arg(long = "camera", value_enum, default_value = "equirect", help_heading = "Camera")]
    lens: ProbeLens,

    #[command(flatten)]
    view: ViewArgs,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ProbeLens {
    Equirect,
    Fisheye,
    Cube,
}

/// The rays of a LiDAR.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PatternArg {
    /// Directions in a file.
    File(PathBuf),
    /// Rings between two elevations in degrees, each of so many columns.
    Rings { rings: u32, columns: u32, elevations: [f64; 2] },
}

impl ProbeArgs {
    /// The camera at the centre, unless its rays stand in a file.
    pub(crate) fn camera(&self) -> Result<Camera, Error> {
        let view = &self.view;
        let (lens, size) = if let Some(PatternArg::Rings { rings, columns, elevations }) = self.pattern {
            refuse_first(&[
                (view.fov.is_some(), "--fov goes with --camera fisheye; a pattern takes fov=LOWER..UPPER"),
                (view.size.is_some(), "a pattern takes rings= and columns=, not --size"),
                (view.cube_size.is_some(), "a pattern takes rings= and columns=, not --cube-size"),
            ])?;
            (Lens::Spinning { elevations }, (columns, rings))
        } else {
            self.lens_and_size()?
        };
        let (target, up) = self.orientation();
        refuse_first(&[(
            target == self.center,
            "--center and --target are the same point; move one of them",
        )])?;
        Ok(Camera { eye: self.center, target, up, lens, width: size.0, height: size.1 })
    }

    /// The file of directions, where they come from one.
    pub(crate) fn inputs(&self) -> Option<&PathBuf> {
        match &self.pattern {
            Some(PatternArg::File(path)) => Some(path),
            _ => None,
        }
    }

    /// The lens of `--camera`, and its pixels.
    fn lens_and_size(&self) -> Result<(Lens, (u32, u32)), Error> {
        let view = &self.view;
        Ok(match self.lens {
            ProbeLens::Equirect => {
                view.refuse_useless(LensArg::Equirect)?;
                (Lens::Equirect, view.size.unwrap_or((1024, 512)))
            }
            ProbeLens::Fisheye => {
                view.refuse_useless(LensArg::Fisheye)?;
                let fov = view.fov.unwrap_or(180.0);
                (Lens::Fisheye { fov }, view.size.unwrap_or((1024, 1024)))
            }
            ProbeLens::Cube => {
                view.refuse_useless(LensArg::Cube)?;
                let side = view.cube_size.unwrap_or(1024);
                (Lens::Cube, (side, side))
            }
        })
    }

    /// The target and the direction that is up. Without a target the view is level: −Z without its part along up, or +X
    /// where up is along Z.
    fn orientation(&self) -> (DVec3, DVec3) {
        if let Some(target) = self.view.target {
            return (target, self.view.up.unwrap_or(Camera::default_up(target - self.center)));
        }
        let up = self.view.up.unwrap_or(DVec3::Y);
        let axis = (up / up.abs().max_element()).normalize_or_zero();
        let level = |towards: DVec3| towards - axis * towards.dot(axis);
        let ahead = level(DVec3::NEG_Z);
        let forward = if ahead.length() > NEARLY_UP { ahead } else { level(DVec3::X) };
        // As far away as the centre is from the origin: nearer, the sum would lose the direction.
        (self.center + forward * self.center.abs().max_element().max(1.0), up)
    }

    /// Refuses options that directions in a file would ignore. They give points and arrays, and no picture.
    pub(crate) fn refuse_useless_with_file(&self) -> Result<(), Error> {
        let (view, picture) = (&self.view, &self.picture);
        refuse_first(&[
            (
                !picture.is_point_cloud() && (picture.output.is_some() || picture.aovs.is_empty()),
                "--pattern FILE.npy gives no picture: take -o FILE.ply for the points, or arrays such as \
                 --aov distance=F.npy --aov id=F.npy --aov position=F.npy",
            ),
            (
                picture.aovs.iter().any(|(_, file)| file.is_none()),
                "--pattern FILE.npy gives no EXR that could hold --aov NAME: write --aov NAME=FILE.npy",
            ),
            (picture.samples > 1, "--samples is for pictures; --pattern FILE.npy gives none"),
            (view.target.is_some(), "the directions of --pattern FILE.npy are the world's: no --target"),
            (view.up.is_some(), "the directions of --pattern FILE.npy are the world's: no --up"),
            (view.fov.is_some(), "--pattern FILE.npy takes no --fov"),
            (view.size.is_some(), "--pattern FILE.npy takes no --size"),
            (view.cube_size.is_some(), "--pattern FILE.npy takes no --cube-size"),
        ])
    }
}

/// "FILE.npy", or "rings=N,columns=N" with an optional ",fov=LOWER..UPPER".
fn parse_pattern(text: OsString) -> Result<PatternArg, String> {
    if text.to_ascii_lowercase().as_encoded_bytes().ends_with(b".npy") {
        return Ok(PatternArg::File(PathBuf::from(text)));
    }
    let text = text.to_string_lossy();
    let expected = || "expected rings=N,columns=N[,fov=LOWER..UPPER], or FILE.npy".to_owned();
    let (mut rings, mut columns, mut elevations) = (None, None, None);
    for part in text.split(',') {
        let (name, value) = part.split_once('=').ok_or_else(expected)?;
        let twice = match name.trim() {
            "rings" => rings.replace(parse_count(name, value)?).is_some(),
            "columns" => columns.replace(parse_count(name, value)?).is_some(),
            "fov" => elevations.replace(parse_elevations(value)?).is_some(),
            _ => return Err(expected()),
        };
        if twice {
            return Err(format!("{name}= is given twice"));
        }
    }
    let (Some(rings), Some(columns)) = (rings, columns) else {
        return Err(expected());
    };
    Ok(PatternArg::Rings { rings, columns, elevations: elevations.unwrap_or(ELEVATIONS) })
}

/// A positive number.
fn parse_count(name: &str, text: &str) -> Result<u32, String> {
    let number = text.trim().parse().ok().filter(|number| (1..=65536).contains(number));
    number.ok_or_else(|| format!("{name}={text}: expected a number from 1 to 65536"))
}

/// "LOWER..UPPER" as two elevations in degrees. Whether they are in order is seen with the rays.
fn parse_elevations(text: &str) -> Result<[f64; 2], String> {
    let limits = text.split_once("..").map(|(lower, upper)| (lower.trim().parse(), upper.trim().parse()));
    match limits {
        Some((Ok(lower), Ok(upper))) => Ok([lower, upper]),
        _ => Err(format!("fov={text}: expected elevations in degrees such as -25..15")),
    }
}
