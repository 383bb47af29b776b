//! `umbel-bench primary`: what a pinhole camera sees, by all engines in turns.

use crate::Result;
use crate::commands::cli::{Common, PrimaryArgs};
use crate::commands::comparison;
use crate::subjects::picture::Picture;

/// Measures every scene at every size.
pub(crate) fn run(args: &PrimaryArgs, common: &Common) -> Result<()> {
    comparison::run("primary", &args.compared, common, &args.size, |view, size| {
        Picture::of_camera(&view.name, &view.scene, view.camera(size))
    })
}
