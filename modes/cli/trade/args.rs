//! `umbel trade` on the command line.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use umbel::Error;

use crate::common::Common;
use crate::options::camera::refuse_first;
use crate::options::parse::extension;

#[derive(Debug, Args)]
pub(crate) struct TradeArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell; for reyes also a .bpt
    /// file, builtin:teapot, builtin:terrain or builtin:field [default: builtin:umbel, and builtin:teapot]
    pub(crate) scene: Option<OsString>,

    /// The verb whose settings are measured
    #[arg(long, value_enum, default_value = "render")]
    pub(crate) mode: ModeArg,

    /// The page to read: one HTML file that needs neither network nor script
    #[arg(short, long, value_name = "FILE.html", default_value = "trade.html")]
    pub(crate) output: PathBuf,

    /// The table as comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) csv: Option<PathBuf>,

    /// Everything that the page says, as JSON
    #[arg(long, value_name = "FILE.json")]
    pub(crate) json: Option<PathBuf>,

    /// The plot of error against time, as SVG
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,

    /// How often each setting is timed, after one run to warm up; settings take turns
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) rounds: u32,

    /// Samples per pixel (render, reyes) or rays per receiver (bake) of the reference that errors are measured against
    /// [default: 256, 64, and 1024]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) reference: Option<u32>,

    /// Options of the verb that all its settings share, such as -- --size 640x360 or -- --vertices --max-distance 10%
    #[arg(last = true, value_name = "OPTIONS")]
    pub(crate) shared: Vec<OsString>,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ModeArg {
    Render,
    Shadow,
    Bake,
    Reyes,
}

impl ModeArg {
    /// The verb.
    pub(crate) fn verb(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Shadow => "shadow",
            Self::Bake => "bake",
            Self::Reyes => "reyes",
        }
    }
}

impl TradeArgs {
    /// Refuses options that contradict each other or would be ignored. Nothing has been read yet.
    pub(crate) fn check(&self, common: &Common) -> Result<(), Error> {
        refuse_first(&[
            (
                self.mode == ModeArg::Shadow && self.reference.is_some(),
                "--reference: the exact mask is the reference of shadows, and has no number of samples",
            ),
            (
                matches!(self.mode, ModeArg::Render | ModeArg::Reyes)
                    && self.reference.is_some_and(|samples| samples > 4096),
                "--reference: a pixel takes at most 4096 samples",
            ),
            (common.repeat > 1, "--repeat: trade has --rounds, in which all settings take turns"),
            (common.report.is_some(), "--report: trade has --json, which holds all that is measured"),
        ])?;
        let csv = self.csv.iter().map(|path| (path, "--csv", "csv"));
        let json = self.json.iter().map(|path| (path, "--json", "json"));
        let plot = self.plot.iter().map(|path| (path, "--plot", "svg"));
        for (path, option, format) in csv.chain(json).chain(plot).chain([(&self.output, "-o", "html")]) {
            if extension(path) != format {
                return Err(Error::Usage(format!("{}: {option} takes .{format}", path.display())));
            }
        }
        Ok(())
    }

    /// The files that are asked for.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.csv, &self.json, &self.plot].into_iter().flatten().chain([&self.output])
    }

    /// Samples or rays of the reference.
    pub(crate) fn reference(&self) -> u32 {
        self.reference.unwrap_or(match self.mode {
            ModeArg::Bake => 1024,
            ModeArg::Reyes => 64,
            ModeArg::Render | ModeArg::Shadow => 256,
        })
    }

    /// The scene that was asked for, or the default.
    pub(crate) fn scene(&self) -> &OsStr {
        let default = if self.mode == ModeArg::Reyes { "builtin:teapot" } else { "builtin:umbel" };
        self.scene.as_deref().unwrap_or(OsStr::new(default))
    }
}
