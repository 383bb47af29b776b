//! The files that take openness beside what they hold already, and where in them it goes.

use clap::ValueEnum;

/// The formats that can take openness: none in a build without glTF.
pub(crate) const FORMATS: &[&str] = if cfg!(feature = "gltf") { &["glb", "gltf"] } else { &[] };

/// Where a glTF file has openness at vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum IntoArg {
    Ao,
    Color0,
}
