//! The camera on the command line.

use clap::{Args, ValueEnum};
use glam::DVec3;
use serde::Deserialize;
use umbel::builtin::{BuiltinView, builtin_view};
use umbel::engine::Aabb;
use umbel::{Camera, Error, Lens, Scene};

use crate::options::parse::{parse_size, parse_vector};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum LensArg {
    Pinhole,
    Ortho,
    Equirect,
    Fisheye,
    Cube,
}

impl LensArg {
    /// Whether straight lines may be bent in the picture.
    pub(crate) fn bends_lines(self) -> bool {
        matches!(self, Self::Equirect | Self::Fisheye)
    }
}

/// Where the rays come from. Without options the scene is framed from (1, 0.7, 1).
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// Position of the eye; of an ortho camera, the middle of the film
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,

    /// World units from the lower to the upper edge of an ortho picture
    #[arg(long, value_name = "UNITS", allow_hyphen_values = true)]
    pub(crate) height: Option<f64>,

    /// The lens
    #[arg(long = "camera", value_enum, default_value = "pinhole")]
    pub(crate) lens: LensArg,

    #[command(flatten)]
    pub(crate) view: ViewArgs,
}

/// Where a camera looks and how finely, wherever its eye is.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct ViewArgs {
    /// The point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) target: Option<DVec3>,

    /// The direction that is up in the picture (default +Y; -Z looking straight down, +Z straight up)
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) up: Option<DVec3>,

    /// Degrees: vertical for pinhole, over the inscribed circle for fisheye (default 45 and 180)
    #[arg(long, value_name = "DEGREES")]
    pub(crate) fov: Option<f64>,

    /// Pixels (default 1280x720)
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<(u32, u32)>,

    /// Pixels along one side of a cube face (default 1024)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32768))]
    pub(crate) cube_size: Option<u32>,
}

impl ViewArgs {
    /// Refuses options that a lens would ignore.
    pub(crate) fn refuse_useless(&self, lens: LensArg) -> Result<(), Error> {
        refuse_first(&[(
            self.cube_size.is_some() && lens != LensArg::Cube,
            "--cube-size goes with --camera cube; the others take --size",
        )])?;
        self.refuse_useless_beside_cube(lens)
    }

    /// The same where `--cube-size` may be that of a light.
    fn refuse_useless_beside_cube(&self, lens: LensArg) -> Result<(), Error> {
        let (angle, cube) = (matches!(lens, LensArg::Pinhole | LensArg::Fisheye), lens == LensArg::Cube);
        let useless = [
            (self.fov.is_some() && !angle, "--fov goes with --camera pinhole or fisheye"),
            (self.size.is_some() && cube, "--camera cube takes --cube-size, not --size"),
            (
                self.target.is_some() && cube,
                "--camera cube looks along the world's axes: it takes no --target",
            ),
            (self.up.is_some() && cube, "--camera cube looks along the world's axes: it takes no --up"),
        ];
        refuse_first(&useless)
    }
}

/// Refuses with the first sentence that applies.
pub(crate) fn refuse_first(useless: &[(bool, &str)]) -> Result<(), Error> {
    let first = useless.iter().find(|(applies, _)| *applies);
    first.map_or(Ok(()), |(_, why)| Err(Error::Usage((*why).into())))
}

impl CameraArgs {
    /// The camera for a scene.
    pub(crate) fn camera(&self, scene: &Scene) -> Result<Camera, Error> {
        self.view.refuse_useless(self.lens)?;
        self.framing(scene)
    }

    /// The camera for a scene, where `--cube-size` may be that of a light.
    pub(crate) fn camera_beside_cube(&self, scene: &Scene) -> Result<Camera, Error> {
        self.view.refuse_useless_beside_cube(self.lens)?;
        self.framing(scene)
    }

    /// The same for a box, with a curated view or none, where an ortho picture shows so many world units.
    pub(crate) fn framing_beside_cube(
        &self,
        bounds: &Aabb,
        view: Option<BuiltinView>,
        (film_height, offset): (Option<f64>, DVec3),
    ) -> Result<Camera, Error> {
        self.view.refuse_useless_beside_cube(self.lens)?;
        self.framing_of(bounds, view, (film_height, offset))
    }

    /// The camera with what was given, and what suits the scene for the rest.
    fn framing(&self, scene: &Scene) -> Result<Camera, Error> {
        if self.height.is_some() && self.lens != LensArg::Ortho {
            return Err(Error::Usage("--height goes with --camera ortho".into()));
        }
        let view = scene.name.strip_prefix("builtin:").and_then(builtin_view);
        self.framing_of(&scene.bounds(), view, (self.height, scene.offset))
    }

    /// The camera for a box, with a curated view or none, where an ortho picture shows so many world units. Eye and target
    /// are given in the file's frame, from which `offset` was taken.
    pub(crate) fn framing_of(
        &self,
        bounds: &Aabb,
        view: Option<BuiltinView>,
        (film_height, offset): (Option<f64>, DVec3),
    ) -> Result<Camera, Error> {
        let (width, height) = match self.lens {
            LensArg::Cube => (self.view.cube_size.unwrap_or(1024), self.view.cube_size.unwrap_or(1024)),
            _ => self.view.size.unwrap_or((1280, 720)),
        };
        let lens = match self.lens {
            LensArg::Pinhole => Lens::Pinhole { fov: self.view.fov.unwrap_or(45.0) },
            LensArg::Ortho => Lens::Ortho { height: film_height.unwrap_or(0.0) },
            LensArg::Equirect => Lens::Equirect,
            LensArg::Fisheye => Lens::Fisheye { fov: self.view.fov.unwrap_or(180.0) },
            LensArg::Cube => Lens::Cube,
        };
        let mut camera = Camera::framing(bounds, DVec3::new(1.0, 0.7, 1.0), lens, width, height);
        if let (Some(view), Lens::Pinhole { .. }, None, None) = (view, lens, self.eye, self.view.target) {
            camera.eye = DVec3::from_array(view.eye);
            camera.target = DVec3::from_array(view.target);
            camera.up = DVec3::from_array(view.up);
            camera.lens = Lens::Pinhole { fov: self.view.fov.unwrap_or(view.fov_degrees) };
        }
        camera.eye = self.eye.map_or(camera.eye, |eye| eye - offset);
        camera.target = self.view.target.map_or(camera.target, |target| target - offset);
        let is_framed = self.eye.is_none() && self.view.target.is_none();
        let default_up = if is_framed { camera.up } else { Camera::default_up(camera.target - camera.eye) };
        camera.up = self.view.up.unwrap_or(default_up);
        if let (Lens::Ortho { .. }, Some(height)) = (lens, film_height) {
            camera.lens = Lens::Ortho { height };
        }
        Ok(camera)
    }

    /// Whether the camera itself is a cube.
    pub(crate) fn is_cube(&self) -> bool {
        self.lens == LensArg::Cube
    }

    /// Whether anything but `--cube-size` was given, and but `--height` where that is a displacement's.
    pub(crate) fn is_given(&self, displaced: bool) -> bool {
        let ViewArgs { target, up, fov, size, .. } = &self.view;
        let vectors = [&self.eye, target, up].into_iter().any(Option::is_some);
        let numbers = fov.is_some() || (self.height.is_some() && !displaced) || size.is_some();
        vectors || numbers || self.lens != LensArg::Pinhole
    }
}
