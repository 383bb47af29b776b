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

/// From where a scene is framed. Right and front are those of who looks at it with `--up` up: with Y up the front is where +Z
/// points from, with Z up where −Y does, as drawings have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum NamedView {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
    /// From the right, above and in front, by equal parts
    Iso,
}

impl NamedView {
    /// The direction toward the eye, by its parts to the right, up and to the front.
    fn parts(self) -> DVec3 {
        match self {
            Self::Front => DVec3::Z,
            Self::Back => DVec3::NEG_Z,
            Self::Left => DVec3::NEG_X,
            Self::Right => DVec3::X,
            Self::Top => DVec3::Y,
            Self::Bottom => DVec3::NEG_Y,
            Self::Iso => DVec3::ONE,
        }
    }
}

/// Where the rays come from. Without options the scene is framed from the right, above and in front: parts 1, 0.7 and 1.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera")]
pub(crate) struct CameraArgs {
    /// Position of the eye; of an ortho camera, the middle of the film
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector, allow_hyphen_values = true)]
    pub(crate) eye: Option<DVec3>,

    /// Frame the scene from a side
    #[arg(long = "view", value_enum, conflicts_with_all = ["eye", "target", "azimuth", "elevation"])]
    pub(crate) named_view: Option<NamedView>,

    /// Frame the scene from an angle: degrees from the front toward the right (default 45)
    #[arg(long, value_name = "DEGREES", conflicts_with_all = ["eye", "target"], allow_hyphen_values = true)]
    pub(crate) azimuth: Option<f64>,

    /// Frame the scene from a height: degrees above the horizon, -90 to 90 (default 26)
    #[arg(long, value_name = "DEGREES", conflicts_with_all = ["eye", "target"], allow_hyphen_values = true)]
    pub(crate) elevation: Option<f64>,

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
        let direction = self.framing_direction()?;
        let mut camera = match self.view.up {
            Some(up) => Camera::framing_with_up(bounds, direction, up, lens, width, height),
            None => Camera::framing(bounds, direction, lens, width, height),
        };
        let is_placed = self.eye.is_some() || self.view.target.is_some() || self.frames_from_a_side();
        if let (Some(view), Lens::Pinhole { .. }, false) = (view, lens, is_placed) {
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

    /// Whether the scene is framed from where the user said.
    fn frames_from_a_side(&self) -> bool {
        self.named_view.is_some() || self.azimuth.is_some() || self.elevation.is_some()
    }

    /// The direction toward the eye from which the scene is framed.
    fn framing_direction(&self) -> Result<DVec3, Error> {
        let parts = match (self.named_view, self.azimuth, self.elevation) {
            (Some(view), ..) => view.parts(),
            (None, None, None) => DVec3::new(1.0, 0.7, 1.0),
            (None, azimuth, elevation) => {
                let (azimuth, elevation) = (azimuth.unwrap_or(45.0), elevation.unwrap_or(DEFAULT_ELEVATION));
                if !azimuth.is_finite() || !(-90.0..=90.0).contains(&elevation) {
                    return Err(Error::Usage(
                        "--azimuth is a finite number of degrees, --elevation one from -90 to 90".into(),
                    ));
                }
                toward(azimuth, elevation)
            }
        };
        let up = self.view.up.and_then(DVec3::try_normalize).unwrap_or(DVec3::Y);
        // Where up is along X there is no right that is X.
        let right = if up.cross(DVec3::X).length() > 1e-6 { DVec3::X } else { DVec3::Y };
        let right = (right - up * right.dot(up)).normalize_or_zero();
        Ok(right * parts.x + up * parts.y + right.cross(up) * parts.z)
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
        vectors || numbers || self.lens != LensArg::Pinhole || self.frames_from_a_side()
    }
}

/// The elevation of the default view in degrees: atan(0.7/√2), rounded.
const DEFAULT_ELEVATION: f64 = 26.0;

/// A direction by degrees from the front toward the right, and above the horizon. The quarters are exact, so that a view from the side sees
/// what is parallel to it edge-on.
fn toward(azimuth: f64, elevation: f64) -> DVec3 {
    let turn = |degrees: f64| match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => (libm::sin(other.to_radians()), libm::cos(other.to_radians())),
    };
    let ((x, z), (y, flat)) = (turn(azimuth), turn(elevation));
    DVec3::new(x * flat, y, z * flat)
}
