//! The files of a picture on the command line: what is written, where to, and what cannot be meant.

use std::collections::HashSet;
use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser as _};
use clap_lex::OsStrExt as _;
use umbel::{Aov, Error};

use crate::options::parse::extension;

/// The picture where nothing at all was asked for.
const UNNAMED: &str = "umbel.png";

/// The standard output: of a picture a PNG, of an AOV an NPY.
const STDOUT: &str = "-";

/// What is made of the rays.
#[derive(Debug, Args)]
pub(crate) struct PictureArgs {
    /// PNG: shaded preview. EXR: preview and every AOV asked for. NPY: linear preview. PLY: the points that are seen. -: a PNG on stdout. Default umbel.png
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// id, depth, distance, normal, position, bary, uv, object, work or doubts (heat maps): NAME=FILE.npy, or NAME alone to add it to the EXR
    #[arg(long = "aov", value_name = "NAME[=FILE.npy]", value_parser = OsStringValueParser::new().try_map(parse_aov))]
    pub(crate) aovs: Vec<(Aov, Option<PathBuf>)>,

    /// Samples per pixel of the preview; AOVs are those of the pixel centre
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,
}

impl PictureArgs {
    /// Whether `-o` is a point cloud, for which nothing is shaded.
    pub(crate) fn is_point_cloud(&self) -> bool {
        self.output.as_deref().is_some_and(|output| extension(output) == "ply")
    }

    /// Where the picture goes: `-o`, or umbel.png where nothing at all was asked for.
    pub(crate) fn checked_output(&self) -> Result<Option<PathBuf>, Error> {
        self.refuse_twice()?;
        let Some(output) = &self.output else {
            self.refuse_nameless()?;
            return Ok(self.aovs.is_empty().then(|| PathBuf::from(UNNAMED)));
        };
        let format = extension(output);
        if !["png", "exr", "npy", "ply", STDOUT].contains(&format.as_str()) {
            return Err(Error::Usage(format!("{}: -o takes .png, .exr, .npy or .ply", output.display())));
        }
        if format != "exr" && self.aovs.iter().any(|(_, file)| file.is_none()) {
            return Err(Error::Usage(
                "--aov NAME without a file adds it to an EXR: use -o FILE.exr, or --aov NAME=FILE.npy".into(),
            ));
        }
        if self.samples > 1 && self.is_point_cloud() {
            return Err(Error::Usage(
                "--samples is for pictures; a .ply has the points of the pixel centres".into(),
            ));
        }
        Ok(Some(output.clone()))
    }

    /// Refuses channels where there is no EXR to hold them.
    fn refuse_nameless(&self) -> Result<(), Error> {
        let nameless = self.aovs.iter().find(|(_, file)| file.is_none());
        nameless.map_or(Ok(()), |(aov, _)| {
            let name = name(*aov);
            Err(Error::Usage(format!(
                "--aov {name} without a file needs -o FILE.exr; or write --aov {name}=FILE.npy"
            )))
        })
    }

    /// The files that are asked for: umbel.png where none is.
    pub(crate) fn outputs(&self) -> Vec<PathBuf> {
        let picture = self.output.clone().or_else(|| self.aovs.is_empty().then(|| PathBuf::from(UNNAMED)));
        self.aovs.iter().filter_map(|(_, file)| file.clone()).chain(picture).collect()
    }

    /// Refuses one channel given twice.
    fn refuse_twice(&self) -> Result<(), Error> {
        let mut channels = HashSet::new();
        let twice = self.aovs.iter().find(|(aov, file)| file.is_none() && !channels.insert(*aov));
        twice.map_or(Ok(()), |(aov, _)| Err(Error::Usage(format!("--aov {} is given twice", name(*aov)))))
    }
}

/// The name of an AOV on the command line.
fn name(aov: Aov) -> String {
    format!("{aov:?}").to_ascii_lowercase()
}

/// "NAME" or "NAME=FILE.npy".
fn parse_aov(text: OsString) -> Result<(Aov, Option<PathBuf>), String> {
    let (name, file) = match text.split_once("=") {
        Some((name, file)) => (name, Some(file)),
        None => (text.as_os_str(), None),
    };
    let name = name.to_string_lossy();
    let aov = match &*name {
        "id" => Aov::Id,
        "depth" => Aov::Depth,
        "distance" => Aov::Distance,
        "normal" => Aov::Normal,
        "position" => Aov::Position,
        "bary" => Aov::Bary,
        "uv" => Aov::Uv,
        "object" => Aov::Object,
        "work" => Aov::Work,
        "doubts" => Aov::Doubts,
        _ => {
            return Err(format!(
                "{name} is none of id, depth, distance, normal, position, bary, uv, object, work, doubts"
            ));
        }
    };
    match file {
        Some(file) if file != STDOUT && !file.to_ascii_lowercase().as_encoded_bytes().ends_with(b".npy") => {
            Err(format!("{}: an AOV is written as .npy", file.display()))
        }
        file => Ok((aov, file.map(PathBuf::from))),
    }
}
