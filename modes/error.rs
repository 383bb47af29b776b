//! What can go wrong outside the engine.
//!
//! Errors carry what they found as values: which option of a command that was, and what its user may do, is the command's to say.

use std::path::PathBuf;

/// An error of the modes. Each says what is wrong, where, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Options that contradict each other or lie outside their range.
    #[error("{0}")]
    Usage(String),

    /// A value outside of its range.
    #[error(transparent)]
    Argument(#[from] Argument),

    /// A file that cannot be read as a scene.
    #[error("{}{}: {problem}\n  {remedy}", path.display(), line.map(|l| format!(":{l}")).unwrap_or_default())]
    Input {
        /// The file.
        path: PathBuf,
        /// The line of the file, counted from 1, where it is known.
        line: Option<u64>,
        /// What is wrong there.
        problem: String,
        /// What the user can do about it.
        remedy: String,
    },

    /// A file that cannot be written. Nothing was changed under its name.
    #[error("{}: cannot write: {problem}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said.
        problem: String,
    },

    /// The engine refused its input.
    #[error(transparent)]
    Engine(#[from] umbel_core::Error),

    /// A limit that the user set was hit.
    #[error("{0}")]
    Limit(String),

    /// `verify` or a comparison found a difference.
    #[error("{0}")]
    Difference(String),
}

/// A value that a camera, a light or a mode cannot take.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Argument {
    /// A picture without a pixel.
    #[error("a picture has at least 1x1 pixels")]
    ImageSize,

    /// An eye, a target or an up with a NaN or an infinite coordinate.
    #[error("eye, target and up must be finite numbers")]
    ViewNotFinite,

    /// A view without a direction.
    #[error("eye and target are the same point; move one of them")]
    EyeIsTarget,

    /// An up that says nothing about how the picture is turned.
    #[error("up is parallel to the view; choose another, such as (0, 0, 1)")]
    UpParallel,

    /// The height of an ortho camera's film.
    #[error("the height must be a positive number of world units, not {height}")]
    FilmHeight {
        /// World units, as given.
        height: f64,
    },

    /// A field of view out of the lens's range.
    #[error("the field of view must lie between 0 and {limit} degrees, not {degrees}")]
    FieldOfView {
        /// As given.
        degrees: f64,
        /// The greatest that the lens takes, or the least that it does not.
        limit: f64,
    },

    /// Elevations of a LiDAR's rings, in degrees.
    #[error(
        "elevations from {lower} to {upper}: a LiDAR's rings lie between two elevations in degrees, the lower first, each from -90 to 90"
    )]
    Elevations {
        /// The lower, as given.
        lower: f64,
        /// The upper, as given.
        upper: f64,
    },

    /// A cube map without a texel.
    #[error("a cube map has at least 1 texel along each side")]
    CubeSize,

    /// A sun without a direction.
    #[error("the direction toward the sun must be finite and not zero")]
    SunDirection,

    /// A ground without an upper side.
    #[error("the ground's up must be finite and not zero")]
    GroundUp,

    /// A ground that would leave the range of f32.
    #[error("the scene is too large for a ground around it")]
    GroundSize,

    /// A receiver that depth maps do not cover.
    #[error("receiver {receiver} at {}, {}, {} lies outside of the scene's box, which the depth maps cover", point[0], point[1], point[2])]
    OutsideOfMaps {
        /// Its index among the receivers.
        receiver: usize,
        /// Where it is.
        point: [f32; 3],
    },

    /// Something that is no mesh is to be subdivided or displaced.
    #[error("{name}: only meshes can be subdivided or displaced")]
    NoMesh {
        /// The name of the scene.
        name: String,
    },

    /// A height map for a mesh without texture coordinates.
    #[error("{name} has no texture coordinates by which a height map could be found")]
    NoTextureCoordinates {
        /// The name of the scene.
        name: String,
    },
}

/// The remedy for a line of text that cannot be read.
pub(crate) const CORRECT_LINE: &str = "Correct the line, or export the file again.";

/// What is wrong in a file whose path the caller knows.
#[derive(Debug)]
pub(crate) struct Problem {
    pub(crate) line: Option<u64>,
    pub(crate) what: String,
    pub(crate) remedy: &'static str,
}

impl Problem {
    /// The error that names the file as well.
    pub(crate) fn at(self, path: &std::path::Path) -> Error {
        let Self { line, what: problem, remedy } = self;
        Error::Input { path: path.to_owned(), line, problem, remedy: remedy.to_owned() }
    }
}
