//! `umbel bake` on the command line.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::Args;
use glam::DVec3;
use umbel::bake::{AtlasOptions, BakeOptions};
use umbel::files::GrayBits;
use umbel::formats::names_surfaces;
use umbel::{Error, Scene};

use crate::bake::into::{FORMATS, IntoArg};
use crate::bake::sampling_args::SamplingArgs;
use crate::options::camera::refuse_first;
use crate::options::dial::DialArgs;
use crate::options::parse::extension;
use crate::options::parse::parse_vector;
use crate::reyes::args::MadeArgs;

/// Texels of the margin where none are asked for: four for a texture that is halved twice.
pub(crate) const MARGIN: u32 = 16;

#[derive(Debug, Args)]
pub(crate) struct BakeArgs {
    /// A mesh (.obj, .gltf, .glb, .ply, .stl, .off, each also .gz or .zst; - reads stdin), builtin:umbel, builtin:umbel:TRIANGLES or builtin:cornell
    #[arg(default_value = "builtin:umbel")]
    pub(crate) scene: OsString,

    /// Texels as .png, .exr or .npy; vertices and points as .npy, or as .ply with positions, faces and gray; .glb and .gltf are the
    /// scene's own file with openness in it. NaN in arrays, and white in a PNG, is where nothing was baked
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Bent normals, the mean open directions in world axes, as an array (..., 3)
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) bent: Option<PathBuf>,

    /// Which texels were baked, 1 or 0, without the margin: .npy, .png or .exr
    #[arg(long, value_name = "FILE")]
    pub(crate) coverage: Option<PathBuf>,

    /// Where a .glb or .gltf has the openness of vertices: in the attribute _AO, or in COLOR_0, which all viewers show
    #[arg(long, value_enum, default_value = "ao")]
    pub(crate) into: IntoArg,

    /// Bits of a gray PNG, or of the texture in a .glb or .gltf [default: 8]
    #[arg(long, value_name = "8|16", value_parser = ["8", "16"])]
    bits: Option<String>,

    /// All rays above the surfaces, as an array (R, 8): origin, direction, t_max, and 1 for a hit or else 0
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) dump_rays: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) receivers: ReceiverArgs,

    #[command(flatten)]
    sampling: SamplingArgs,

    #[command(flatten)]
    pub(crate) occluders: OccluderArgs,

    #[command(flatten)]
    pub(crate) dial: DialArgs,
}

/// What is baked.
#[derive(Debug, Args)]
#[command(next_help_heading = "Receivers")]
pub(crate) struct ReceiverArgs {
    /// Bake a texture of N x N texels, by the texture coordinates of the scene: this is so by default, with 1024, but for .ply
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65535), conflicts_with_all = ["vertices", "points"])]
    texels: Option<u32>,

    /// Receivers per texel, spread over it [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    texel_samples: Option<u32>,

    /// Texels around each chart that take the nearest value, in images [default: 16]
    #[arg(long, value_name = "N")]
    pub(crate) margin: Option<u32>,

    /// Bake a texture even where less than half of the charts' area has texels of its own, because charts repeat, overlap
    /// or lie outside of the image. It is refused otherwise: most surfaces would show what belongs to others, or nothing
    #[arg(long)]
    pub(crate) allow_overlap: bool,

    /// Bake the vertices of the scene, in file order
    #[arg(long, conflicts_with = "points")]
    pub(crate) vertices: bool,

    /// Bake points: an array (N, 6) of f4 or f8, each row a position and a normal
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) points: Option<PathBuf>,

    /// The triangle that each point lies on, which never occludes it: an array (N) of integers, -1 for none
    #[arg(long, value_name = "FILE.npy")]
    pub(crate) point_ids: Option<PathBuf>,

    /// Move points by this much along their normals, for points that may lie beneath their surface
    #[arg(long, value_name = "D", default_value_t = 0.0, allow_hyphen_values = true)]
    pub(crate) bias: f64,
}

/// What occludes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Occluders")]
pub(crate) struct OccluderArgs {
    /// Triangles occlude only rays that meet their front, the side from which their corners run counter-clockwise
    #[arg(long, overrides_with = "two_sided")]
    ignore_back_faces: bool,

    /// Triangles occlude from both sides; this is so by default
    #[arg(long, overrides_with = "ignore_back_faces")]
    two_sided: bool,

    /// Put a large ground plane below everything
    #[arg(long)]
    pub(crate) ground_plane: bool,

    /// The direction that is up for the ground plane [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true, requires = "ground_plane")]
    pub(crate) up: Option<DVec3>,

    /// Another scene that occludes this one and is not baked, surfaces on demand included; may be given several times
    #[arg(long = "occluders", value_name = "SCENE")]
    pub(crate) scenes: Vec<OsString>,

    #[command(flatten)]
    pub(crate) made: MadeArgs,

    /// World units by which --displace moves the occluders where the map is 1
    #[arg(long, value_name = "UNITS", allow_hyphen_values = true, requires = "displace")]
    pub(crate) height: Option<f64>,
}

impl OccluderArgs {
    /// Refuses what cannot be meant, where a dial chooses the rays or not, and where depth maps take their place or not.
    fn check(&self, has_dial: bool, has_maps: bool) -> Result<(), Error> {
        refuse_first(&[
            (
                self.has_surfaces() && has_maps,
                "--depth-maps are made of triangles: leave out surfaces on demand, or give --rays",
            ),
            (
                self.made.is_given() && self.scenes.is_empty(),
                "--subdivide and --displace make surfaces of --occluders; what is baked stays as it is",
            ),
            (
                self.height.is_some_and(|height| !height.is_finite()),
                "--height must be a finite number of world units",
            ),
            (
                self.has_surfaces() && has_dial,
                "--max-error and --time-budget are for triangles: leave out surfaces on demand, or give --rays",
            ),
        ])
    }

    /// Whether a further scene is made of surfaces on demand.
    pub(crate) fn is_on_demand(&self, name: &OsStr) -> bool {
        self.made.is_given() || names_surfaces(name)
    }

    /// Whether any is.
    pub(crate) fn has_surfaces(&self) -> bool {
        self.scenes.iter().any(|name| self.is_on_demand(name))
    }
}

impl BakeArgs {
    /// Refuses options that contradict each other. Nothing has been read yet.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.sampling.check()?;
        self.dial.refuse_beside("--rays", self.sampling.has_rays())?;
        self.occluders.check(self.dial.goal().is_some(), self.sampling.has_maps())?;
        let (receivers, target) = (&self.receivers, self.target());
        let texels = matches!(target, Target::Texels(_));
        let output = self.output.as_deref().map(extension).unwrap_or_default();
        let is_gltf = FORMATS.contains(&output.as_str());
        refuse_first(&[
            (
                self.outputs().next().is_none(),
                "nothing to do: give -o FILE.png or FILE.ply, --bent FILE.npy, --coverage FILE or --dump-rays FILE.npy",
            ),
            (
                self.sampling.has_maps() && self.dial.goal().is_some(),
                "--max-error and --time-budget choose the number of exact rays: leave out --depth-maps, whose error no number \
                 of rays makes smaller",
            ),
            (
                self.sampling.has_maps() && self.occluders.ignore_back_faces,
                "--depth-maps: a map knows only the outermost surface, whichever side it shows: leave out --ignore-back-faces",
            ),
            (receivers.points.is_none() && receivers.point_ids.is_some(), "--point-ids goes with --points"),
            (
                receivers.points.is_none() && receivers.bias != 0.0,
                "--bias goes with --points; surfaces need none",
            ),
            (!texels && receivers.texel_samples.is_some(), "--texel-samples goes with --texels"),
            (!texels && receivers.margin.is_some(), "--margin goes with --texels"),
            (!texels && self.coverage.is_some(), "--coverage goes with --texels"),
            (!texels && receivers.allow_overlap, "--allow-overlap goes with --texels"),
            (
                !(texels && (output == "png" || is_gltf)) && self.bits.is_some(),
                "--bits goes with --texels and -o FILE.png, .glb or .gltf",
            ),
            (
                self.into != IntoArg::Ao && !(is_gltf && matches!(target, Target::Vertices)),
                "--into goes with --vertices and -o FILE.glb or .gltf",
            ),
            (is_gltf && !self.sampling.is_openness(), "--polarity: glTF has openness, and nothing else"),
            (!receivers.bias.is_finite(), "--bias must be a finite number"),
        ])?;
        self.check_files()
    }

    /// Refuses outputs of a wrong format, and two of one name.
    fn check_files(&self) -> Result<(), Error> {
        let target = self.target();
        let arrays = [("--bent", &self.bent), ("--dump-rays", &self.dump_rays)];
        for (option, path) in arrays.into_iter().filter_map(|(option, path)| Some((option, path.as_ref()?))) {
            if extension(path) != "npy" {
                return Err(Error::Usage(format!("{}: {option} takes .npy", path.display())));
            }
        }
        let images: &[&str] = &["png", "exr", "npy"];
        let of_output = match target {
            Target::Texels(_) => [images, FORMATS].concat(),
            Target::Vertices => [&["npy", "ply"], FORMATS].concat(),
            Target::Points(_) => vec!["npy", "ply"],
        };
        let named = [("-o", &self.output, &of_output[..]), ("--coverage", &self.coverage, images)];
        for (option, path, formats) in named {
            if let Some(path) = path
                && !formats.contains(&extension(path).as_str())
            {
                let (shown, formats) = (path.display(), formats.join(", ."));
                let what = target.name();
                return Err(Error::Usage(format!("{shown}: {option} takes one of .{formats} for {what}")));
            }
        }
        Ok(())
    }

    /// Whether depth maps could take the place of rays, whatever the number of rays.
    pub(crate) fn takes_maps(&self) -> bool {
        self.sampling.takes_maps() && !self.occluders.ignore_back_faces
    }

    /// What is baked, and how: distances are measured in the scene.
    pub(crate) fn options(&self, scene: &Scene) -> BakeOptions {
        BakeOptions {
            back_faces: !self.occluders.ignore_back_faces,
            bent: self.bent.is_some(),
            traced: self.dump_rays.is_some(),
            columns: match self.target() {
                Target::Texels(AtlasOptions { size, .. }) => Some(size),
                _ => None,
            },
            ..self.sampling.options(scene, matches!(self.target(), Target::Texels(_)))
        }
    }

    /// What is baked: texels, unless something else is named, or the output is a mesh.
    pub(crate) fn target(&self) -> Target<'_> {
        let ReceiverArgs { texels, texel_samples, vertices, points, .. } = &self.receivers;
        let is_mesh = self.output.as_deref().is_some_and(|path| extension(path) == "ply");
        match points {
            Some(path) => Target::Points(path),
            None if *vertices || is_mesh && texels.is_none() => Target::Vertices,
            None => {
                let AtlasOptions { size, samples } = AtlasOptions::default();
                Target::Texels(AtlasOptions {
                    size: texels.unwrap_or(size),
                    samples: texel_samples.unwrap_or(samples),
                })
            }
        }
    }

    /// The levels of a PNG.
    pub(crate) fn bits(&self) -> GrayBits {
        if self.bits.as_deref() == Some("16") { GrayBits::Sixteen } else { GrayBits::Eight }
    }

    /// The files that are read beside scenes.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        let of_points = [&self.receivers.points, &self.receivers.point_ids].into_iter().flatten();
        of_points.chain(self.occluders.made.inputs())
    }

    /// The files that are asked for.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = &PathBuf> {
        [&self.coverage, &self.output, &self.bent, &self.dump_rays].into_iter().flatten()
    }
}

/// What is baked.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Target<'a> {
    Texels(AtlasOptions),
    Vertices,
    Points(&'a Path),
}

impl Target<'_> {
    /// What it is called.
    fn name(self) -> &'static str {
        match self {
            Self::Texels(_) => "texels",
            Self::Vertices => "vertices",
            Self::Points(_) => "points",
        }
    }

    /// What to make smaller where memory is short.
    pub(crate) fn remedy(self) -> &'static str {
        match self {
            Self::Texels(_) => "--texels",
            Self::Vertices => "scene",
            Self::Points(_) => "--points",
        }
    }
}
