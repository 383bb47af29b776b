//! `umbel-bench cube`: what a point light sees on the six faces of a cube, by all engines in turns.

use crate::Result;
use crate::commands::cli::{Common, CubeArgs};
use crate::commands::comparison;
use crate::subjects::picture::Picture;

/// Measures every scene at every size.
pub(crate) fn run(args: &CubeArgs, common: &Common) -> Result<()> {
    comparison::run("cube", &args.compared, common, &args.size, |view, size| {
        Picture::of_cube(&view.name, &view.scene, view.light(args.light)?, size)
    })
}
