//! `umbel-bench primary`: what a pinhole camera sees, by all engines in turns.

use crate::Result;
use crate::cli::{Common, PrimaryArgs};
use crate::comparison;
use crate::picture::Picture;

/// Measures every scene at every size.
pub(crate) fn run(args: &PrimaryArgs, common: &Common) -> Result<()> {
    comparison::run("primary", &args.compared, common, &args.size, |view, size| {
        Picture::of_camera(&view.name, &view.scene, view.camera(size))
    })
}
