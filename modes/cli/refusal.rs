//! What an error means for who has typed the command: its words, with the options by their names, and its exit code.

use umbel::engine;
use umbel::{Argument, Error};

/// What readers call their options, and the options of the command that set them.
const FLAGS: [(&str, &str); 5] = [
    (": LoadOptions::drop_non_finite", " with --drop-non-finite"),
    (": GltfOptions::drop_non_finite", " with --drop-non-finite"),
    (": ObjOptions::allow_outside", " with --allow-outside"),
    (": GltfOptions::allow_outside", " with --allow-outside"),
    (": max_memory", " with --max-memory"),
];

/// Letters that turn the direction of writing.
const TURNS: [char; 9] = [
    '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}', '\u{2066}', '\u{2067}', '\u{2068}',
    '\u{2069}',
];

/// What a reader says, with the options of the command in the place of its own.
pub(crate) fn with_flags(text: &str) -> String {
    FLAGS.iter().fold(text.to_owned(), |text, (field, flag)| text.replace(field, flag))
}

/// What the command says about an error.
pub(crate) fn message(error: &Error) -> String {
    printable(&match error {
        Error::Argument(argument) => of_argument(argument),
        Error::Input { .. } | Error::Limit(_) => with_flags(&error.to_string()),
        other => other.to_string(),
    })
}

/// A text without what would command a terminal, or turn the direction of writing: names in files may hold anything.
pub(crate) fn printable(text: &str) -> String {
    let is_plain = |letter: char| letter == '\n' || !(letter.is_control() || TURNS.contains(&letter));
    let shown = |letter: char| match is_plain(letter) {
        true => letter.to_string(),
        false => letter.escape_unicode().to_string(),
    };
    text.chars().map(shown).collect()
}

/// The same of a value out of its range.
fn of_argument(argument: &Argument) -> String {
    match argument {
        Argument::ImageSize => "--size must be at least 1x1".into(),
        Argument::ViewNotFinite => "--eye, --target and --up must be finite numbers".into(),
        Argument::EyeIsTarget => "--eye and --target are the same point; move one of them".into(),
        Argument::UpParallel => "--up is parallel to the view; choose another, such as --up 0,0,1".into(),
        Argument::FilmHeight { height } => {
            format!("--height must be a positive number of world units, not {height}")
        }
        Argument::FieldOfView { degrees, limit } => {
            format!("--fov must lie between 0 and {limit} degrees, not {degrees}")
        }
        Argument::Elevations { lower, upper } => format!(
            "fov={lower}..{upper}: a LiDAR's rings lie between two elevations in degrees, the lower first, each from -90 to 90"
        ),
        Argument::CubeSize => "--cube-size must be at least 1".into(),
        Argument::SunDirection => {
            "--sun needs a direction: the one toward the sun, such as --sun 1,2,1".into()
        }
        Argument::GroundUp => "--up must be finite and not zero".into(),
        Argument::GroundSize => "--ground-plane: the scene is too large for a ground around it".into(),
        Argument::OutsideOfMaps { .. } => {
            format!("--depth-maps: {argument}: leave out --depth-maps or that point")
        }
        Argument::NoMesh { name } => {
            format!("{name}: --subdivide and --displace are for meshes; leave them out")
        }
        Argument::NoTextureCoordinates { .. } => {
            format!("{argument}; use --displace noise:FREQUENCY,SEED, or a mesh with texture coordinates")
        }
        other => other.to_string(),
    }
}

/// 1 runtime failure, 2 usage, 3 bad input, 4 limit, 5 difference.
pub(crate) fn exit_code(error: &Error) -> u8 {
    match error {
        Error::Usage(_) | Error::Argument(_) => 2,
        Error::Input { .. } => 3,
        Error::Limit(_) => 4,
        Error::Difference(_) => 5,
        Error::Engine(error) => of_engine(error),
        // A file that cannot be written, and what is not known here.
        _ => 1,
    }
}

/// 3 for what is wrong with a scene, 2 for what is wrong with the rays or the machine that were asked for.
fn of_engine(error: &engine::Error) -> u8 {
    use engine::Error as E;
    match error {
        E::NonFinitePosition { .. }
        | E::IndexOutOfRange { .. }
        | E::TooManyTriangles { .. }
        | E::EmptyGroup { .. }
        | E::GroupsEnd { .. }
        | E::SurfacePoint { .. }
        | E::SurfacePoints { .. } => 3,
        E::TooManyRays { .. }
        | E::Origin { .. }
        | E::Direction { .. }
        | E::Interval { .. }
        | E::Film { .. }
        | E::ReceiverTriangle { .. }
        | E::Normal { .. }
        | E::NoCommonDirections
        | E::ScatteredDensity
        | E::ShadingRate { .. }
        | E::Spacing { .. }
        | E::Isa { .. }
        | E::FlushToZero
        | E::RoundingMode => 2,
        _ => 1,
    }
}
