//! `umbel reyes` on the command line.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser as _};
use glam::DVec3;
use umbel::engine::Dicing;
use umbel::formats::SurfaceOptions;
use umbel::render::SurfaceLook;
use umbel::surfaces::{Displacement, HeightMap, Noise, Relief};
use umbel::{Aov, Error, LoadOptions};

use crate::options::camera::{CameraArgs, LensArg};
use crate::options::lights::LightArgs;
use crate::options::picture::PictureArgs;

#[derive(Debug, Args)]
pub(crate) struct ReyesArgs {
    /// A mesh (.obj, .gltf, .glb), Bezier patches (.bpt), builtin:teapot, builtin:terrain, builtin:field, or a built-in mesh
    #[arg(default_value = "builtin:teapot")]
    pub(crate) scene: OsString,

    #[command(flatten)]
    pub(crate) picture: PictureArgs,

    /// Jitter the sub-pixel positions of the samples instead of taking the same ones in every run
    #[arg(long)]
    pub(crate) jitter: bool,

    /// Where jitter starts from [default: 0]
    #[arg(long, value_name = "N", requires = "jitter")]
    pub(crate) seed: Option<u64>,

    #[command(flatten)]
    pub(crate) surfaces: SurfaceArgs,

    /// Lights of the preview, with exact shadows
    #[command(flatten)]
    pub(crate) lights: LightArgs,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,
}

/// What is made of a mesh, and how finely; and an ortho film beside that.
#[derive(Debug, Args)]
#[command(next_help_heading = "Surfaces")]
pub(crate) struct SurfaceArgs {
    #[command(flatten)]
    pub(crate) made: MadeArgs,

    /// World units from the lower to the upper edge of an ortho picture, where --height is that of a displacement
    #[arg(long, value_name = "UNITS")]
    film_height: Option<f64>,
}

/// What is made of a mesh, and how finely.
#[derive(Debug, Args)]
#[command(next_help_heading = "Surfaces")]
pub(crate) struct MadeArgs {
    /// Displace a mesh along its normals, by --height world units where the map is 1: MAP.png or .exr by texture coordinates, white is 1, or noise:FREQUENCY[,SEED[,OCTAVES]] with cells of 1/FREQUENCY units
    #[arg(long, value_name = "MAP.png|MAP.exr|noise:F,SEED", value_parser = OsStringValueParser::new().try_map(parse_relief), requires = "height")]
    displace: Option<ReliefArg>,

    /// Take the mesh for the cage of a Catmull-Clark surface
    #[arg(long)]
    pub(crate) subdivide: bool,

    /// The edge of a micropolygon in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = Dicing::default().shading_rate)]
    shading_rate: f64,
}

/// Where heights come from.
#[derive(Debug, Clone)]
enum ReliefArg {
    Map(PathBuf),
    Noise(Noise),
}

/// "MAP.png" or "noise:FREQUENCY[,SEED[,OCTAVES]]".
fn parse_relief(text: OsString) -> Result<ReliefArg, String> {
    let Some(noise) = text.to_str().and_then(|text| text.strip_prefix("noise:")) else {
        return Ok(ReliefArg::Map(PathBuf::from(text)));
    };
    let wrong = || {
        "expected noise:FREQUENCY[,SEED[,OCTAVES]] such as noise:4,7,6: a positive number, a whole number, and 1 to 24 octaves".to_owned()
    };
    let mut parts = noise.split(',').map(str::trim);
    let frequency =
        parts.next().and_then(|part| part.parse().ok()).filter(|f: &f64| *f > 0.0 && f.is_finite());
    let mut noise = Noise::new(frequency.ok_or_else(wrong)?, 0);
    if let Some(seed) = parts.next() {
        noise.seed = seed.parse().map_err(|_| wrong())?;
    }
    if let Some(octaves) = parts.next() {
        let octaves = octaves.parse().ok().filter(|n| (1..=24).contains(n));
        noise.octaves = octaves.ok_or_else(wrong)?;
    }
    if parts.next().is_some() { Err(wrong()) } else { Ok(ReliefArg::Noise(noise)) }
}

impl ReyesArgs {
    /// Refuses what cannot be meant.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let of_triangles = |aov: &Aov| matches!(aov, Aov::Bary | Aov::Object);
        if self.picture.aovs.iter().any(|(aov, _)| of_triangles(aov)) {
            return Err(Error::Usage(
                "bary and object are of triangles; reyes has id, depth, distance, normal, position, uv and work".into(),
            ));
        }
        if self.camera.lens.bends_lines() {
            return Err(Error::Usage(
                "surfaces are diced for rays on a grid: use --camera pinhole, ortho or cube".into(),
            ));
        }
        self.camera.view.refuse_useless(self.camera.lens)?;
        self.surfaces.check(&self.camera)
    }

    /// How finely surfaces are diced, and what hits keep.
    pub(crate) fn dicing(&self) -> Dicing {
        Dicing { keep_corners: !self.lights.is_none(), ..self.surfaces.made.dicing() }
    }

    /// How the preview is made.
    pub(crate) fn look(&self, offset: DVec3) -> Result<SurfaceLook, Error> {
        let jitter = self.jitter.then(|| self.seed.unwrap_or(0));
        Ok(SurfaceLook { samples: self.picture.samples, jitter, lights: self.lights.lights(offset)? })
    }
}

impl SurfaceArgs {
    /// Refuses heights that nothing has.
    pub(crate) fn check(&self, camera: &CameraArgs) -> Result<(), Error> {
        let (displaced, ortho) = (self.made.is_displaced(), camera.lens == LensArg::Ortho);
        if camera.height.is_some() && !displaced && !ortho {
            return Err(Error::Usage("--height goes with --displace or --camera ortho".into()));
        }
        if self.film_height.is_some() && !ortho {
            return Err(Error::Usage("--film-height goes with --camera ortho".into()));
        }
        if camera.height.is_some_and(|height| !height.is_finite()) {
            return Err(Error::Usage("--height must be a finite number of world units".into()));
        }
        if self.film_height.is_some() && !displaced {
            return Err(Error::Usage("--film-height goes with --displace; without it use --height".into()));
        }
        Ok(())
    }

    /// World units over an ortho picture.
    pub(crate) fn film_height(&self, camera: &CameraArgs) -> Option<f64> {
        if self.made.is_displaced() { self.film_height } else { camera.height }
    }
}

impl MadeArgs {
    /// The file of heights, where they come from one.
    pub(crate) fn inputs(&self) -> Option<&PathBuf> {
        match &self.displace {
            Some(ReliefArg::Map(path)) => Some(path),
            _ => None,
        }
    }

    /// Whether heights are those of a displacement.
    pub(crate) fn is_displaced(&self) -> bool {
        self.displace.is_some()
    }

    /// Whether a mesh is made into a surface on demand.
    pub(crate) fn is_given(&self) -> bool {
        self.subdivide || self.displace.is_some()
    }

    /// What is made of a mesh; reads its map. `height` is that of the displacement.
    pub(crate) fn options(&self, load: LoadOptions, height: Option<f64>) -> Result<SurfaceOptions, Error> {
        let displacement = match (&self.displace, height) {
            (Some(ReliefArg::Map(path)), Some(height)) => Displacement {
                relief: Relief::Map(HeightMap::read_within(Path::new(path), load.max_memory)?),
                height,
            },
            (Some(ReliefArg::Noise(noise)), Some(height)) => {
                Displacement { relief: Relief::Noise(*noise), height }
            }
            _ => Displacement::NONE,
        };
        Ok(SurfaceOptions { load, subdivide: self.subdivide, displacement })
    }

    /// How finely surfaces are diced.
    pub(crate) fn dicing(&self) -> Dicing {
        Dicing { shading_rate: self.shading_rate, ..Dicing::default() }
    }
}
