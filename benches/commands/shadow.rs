//! `umbel-bench shadow`: which of the points that a camera sees does a light not see? By all engines in turns.

use crate::Result;
use crate::commands::cli::{Common, ShadowArgs};
use crate::commands::comparison;
use crate::subjects::shadow::Shadow;

/// Measures every scene at every size.
pub(crate) fn run(args: &ShadowArgs, common: &Common) -> Result<()> {
    comparison::run("shadow", &args.compared, common, &args.size, |view, size| {
        Shadow::new(&view.name, &view.scene, view.camera(size), view.light(args.light)?)
    })
}
