//! Shadows on the command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;
use umbel::Error;
use umbel::formats::names_surfaces;

use crate::options::camera::CameraArgs;
use crate::options::dial::DialArgs;
use crate::options::lights::LightArgs;
use crate::reyes::args::SurfaceArgs;

/// The resolutions that `--compare` measures where none are named.
const COMPARED_SIZES: [u32; 4] = [256, 512, 1024, 2048];

#[derive(Debug, Args)]
pub(crate) struct ShadowArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell; or surfaces on demand, as `umbel reyes` has them
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    /// The map of distances that the light sees: a cube as .npy, .exr, .ktx2 or .png (to look at), a sun's square map as
    /// .npy, .exr or .png. Several lights need {light} in the name, or .npy
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Exact shadows in the camera's picture: 1 lit, 0 shadowed, .npy or .png. Without a surface NaN, or white
    #[arg(long, value_name = "FILE")]
    pub(crate) mask: Option<PathBuf>,

    /// Samples per pixel of the mask
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,

    /// Count where cube maps of these sizes differ from the exact mask; without sizes 256,512,1024,2048
    #[arg(long, value_name = "N,N,...", num_args = 0..=1, require_equals = true, default_missing_value = "",
        value_parser = parse_sizes)]
    pub(crate) compare: Option<Sizes>,

    /// Texels along one side of a sun's map [default: 1024]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32768))]
    map_size: Option<u32>,

    #[command(flatten)]
    pub(crate) lights: LightArgs,

    /// Another scene that casts shadows and is not seen in the mask, surfaces on demand included; may be given several times
    #[arg(long, value_name = "SCENE")]
    pub(crate) occluders: Vec<OsString>,

    #[command(flatten)]
    pub(crate) surfaces: SurfaceArgs,

    #[command(flatten)]
    pub(crate) camera: CameraArgs,

    #[command(flatten)]
    pub(crate) dial: DialArgs,
}

/// Sizes of cube maps.
#[derive(Debug, Clone)]
pub(crate) struct Sizes(pub(crate) Vec<u32>);

impl ShadowArgs {
    /// Refuses options that contradict each other or would be ignored. Nothing has been read yet.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let (points, suns) = (!self.lights.points.is_empty(), !self.lights.suns.is_empty());
        let has_dial = self.dial.goal().is_some();
        self.dial
            .refuse_beside("--cube-size", self.camera.view.cube_size.is_some() && !self.camera.is_cube())?;
        let picture = self.mask.is_some() || self.compare.is_some() || has_dial;
        let refused = [
            (
                has_dial && suns,
                "--max-error and --time-budget choose the cube of a --light, whose shadows are looked up and compared; nothing \
                 looks shadows up in a sun's map: give --map-size, or take --mask, which is exact and needs no map",
            ),
            (
                has_dial && self.output.is_none(),
                "--max-error and --time-budget choose the size of a light's cube: they go with --light and -o",
            ),
            (
                self.output.is_none() && !picture,
                "nothing to do: give -o FILE for the light's map, --mask FILE for shadows in a picture, or --compare",
            ),
            (
                points && suns && self.output.is_some(),
                "--light and --sun make maps of different shapes: run them one after the other, or leave -o out",
            ),
            (
                suns && self.compare.is_some(),
                "--compare measures the cube maps of point lights: give --light, not --sun",
            ),
            (
                self.camera.is_given(self.surfaces.made.is_displaced()) && !picture,
                "the camera's options go with --mask or --compare; -o is what the light sees",
            ),
            (self.samples > 1 && self.mask.is_none(), "--samples goes with --mask"),
            (
                self.map_size.is_some() && !(suns && self.output.is_some()),
                "--map-size goes with --sun and -o; the cube of a --light takes --cube-size",
            ),
            (
                self.camera.view.cube_size.is_some()
                    && !self.camera.is_cube()
                    && (suns || self.output.is_none()),
                "--cube-size goes with --light and -o; a sun's map takes --map-size, a picture --size, \
                 --compare its own sizes, such as --compare=256,1024",
            ),
        ];
        let on_demand = self.is_of_surface() || self.occluders.iter().any(names_surfaces);
        self.surfaces.check(&self.camera)?;
        let refused = refused.into_iter().chain([
            (
                on_demand && (self.compare.is_some() || has_dial),
                "--compare, --max-error and --time-budget are for triangles: surfaces on demand have another shape in each map",
            ),
            (
                on_demand && self.camera.lens.bends_lines(),
                "surfaces are diced for rays on a grid: use --camera pinhole, ortho or cube",
            ),
        ]);
        let first = refused.into_iter().find(|(refused, _)| *refused);
        first.map_or(Ok(()), |(_, why)| Err(Error::Usage(why.into())))
    }

    /// The files that are asked for, as they are named: `{light}` stands for several.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.output.iter().chain(&self.mask)
    }

    /// Whether a surface on demand is seen, no triangles.
    pub(crate) fn is_of_surface(&self) -> bool {
        self.surfaces.made.is_given() || names_surfaces(&self.scene)
    }

    /// Texels along one side of the light's map.
    pub(crate) fn map_size(&self) -> u32 {
        let size = if self.lights.suns.is_empty() { self.camera.view.cube_size } else { self.map_size };
        size.unwrap_or(1024)
    }
}

/// "N,N,..." as sizes of cube maps; nothing stands for the usual ones.
fn parse_sizes(text: &str) -> Result<Sizes, String> {
    if text.is_empty() {
        return Ok(Sizes(COMPARED_SIZES.to_vec()));
    }
    let size = |part: &str| part.trim().parse().ok().filter(|size| (1..=32768).contains(size));
    let sizes: Option<Vec<u32>> = text.split(',').map(size).collect();
    sizes.map(Sizes).ok_or_else(|| "expected sizes from 1 to 32768 such as 256,1024".into())
}
