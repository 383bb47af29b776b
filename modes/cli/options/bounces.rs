//! Mirrors and glass on the command line.

use clap::Args;
use umbel::render::Bounces;
use umbel::scene::Optics;
use umbel::{Error, Scene};

/// Bounces where nothing else is said.
const DEFAULT_BOUNCES: u32 = 4;
/// The refractive index of window glass.
const WINDOW_GLASS: f32 = 1.5;
/// The name that stands for all objects.
const ALL: &str = "all";
/// Names that an error tells at most.
const NAMES_TOLD: usize = 8;

/// What is followed behind the camera's rays.
#[derive(Debug, Args)]
#[command(next_help_heading = "Mirrors and glass")]
pub(crate) struct BounceArgs {
    /// Add what mirrors show, to the preview. The materials of the file say what a mirror is
    #[arg(long)]
    reflect: bool,

    /// Add what is seen through glass
    #[arg(long)]
    refract: bool,

    /// Make a mirror of an object or a material, or of all; may be given several times. Implies --reflect
    #[arg(long, value_name = "NAME")]
    mirror: Vec<String>,

    /// Make clear glass of an object or a material, or of all: closed surfaces, IOR 1.5 if left out. Implies --reflect and --refract
    #[arg(long, value_name = "NAME[=IOR]", value_parser = parse_glass)]
    glass: Vec<(String, f32)>,

    /// The most mirrors and surfaces of glass in a row [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: Option<u32>,
}

impl BounceArgs {
    /// Whether anything at all was asked for.
    pub(crate) fn is_given(&self) -> bool {
        self.asks() || self.bounces.is_some()
    }

    /// Whether there is anything to follow.
    fn asks(&self) -> bool {
        self.reflect || self.refract || !self.mirror.is_empty() || !self.glass.is_empty()
    }

    /// What is followed. Nothing has been read yet.
    pub(crate) fn bounces(&self) -> Result<Bounces, Error> {
        if self.bounces.is_some() && !self.asks() {
            let what = "--bounces goes with --reflect, --refract, --mirror NAME or --glass NAME";
            return Err(Error::Usage(what.into()));
        }
        let glass = !self.glass.is_empty();
        Ok(Bounces {
            reflect: self.reflect || glass || !self.mirror.is_empty(),
            refract: self.refract || glass,
            most: if self.asks() { self.bounces.unwrap_or(DEFAULT_BOUNCES) } else { 0 },
        })
    }

    /// Makes mirrors and glass of what is named. Returns what is odd about that.
    pub(crate) fn change(&self, scene: &mut Scene) -> Result<Option<String>, Error> {
        for name in &self.mirror {
            set_optics(scene, "--mirror", name, Optics::MIRROR)?;
        }
        for (name, ior) in &self.glass {
            set_optics(scene, "--glass", name, Optics::glass(*ior))?;
        }
        let optics = || scene.materials.iter().map(|material| material.optics);
        let idle = [
            (
                self.reflect && !optics().any(|optics| optics.reflects()),
                "mirrors anything: try --mirror NAME",
            ),
            (self.refract && !optics().any(|optics| optics.transmits()), "is glass: try --glass NAME"),
        ];
        let idle = idle.into_iter().find(|(idle, _)| *idle);
        Ok(idle.map(|(_, what)| format!("no material of the scene {what}")))
    }
}

/// Gives optics to what has this name.
fn set_optics(scene: &mut Scene, option: &str, name: &str, optics: Optics) -> Result<(), Error> {
    if scene.set_optics(name, optics) > 0 {
        return Ok(());
    }
    if name == ALL {
        let mut names: Vec<String> = scene.objects.iter().map(|object| object.name.clone()).collect();
        names.dedup();
        names.iter().for_each(|name| _ = scene.set_optics(name, optics));
        return Ok(());
    }
    let objects = scene.objects.iter().map(|object| object.name.as_str());
    let mut names: Vec<&str> = objects.chain(scene.materials.iter().map(|m| m.name.as_str())).collect();
    names.retain(|name| !name.is_empty());
    names.sort_unstable();
    names.dedup();
    let more = if names.len() > NAMES_TOLD { ", ..." } else { "" };
    names.truncate(NAMES_TOLD);
    let names = names.join(", ");
    let what =
        format!("{option} {name}: no object and no material has this name; there are {names}{more}, and all");
    Err(Error::Usage(what))
}

/// "NAME" or "NAME=IOR".
fn parse_glass(text: &str) -> Result<(String, f32), String> {
    let Some((name, ior)) = text.rsplit_once('=') else {
        return Ok((text.to_owned(), WINDOW_GLASS));
    };
    let ior = ior.trim().parse().ok().filter(|ior: &f32| (0.1..=10.0).contains(ior));
    let ior = ior.ok_or("the refractive index is a number from 0.1 to 10, such as --glass ball=1.5")?;
    Ok((name.to_owned(), ior))
}
