//! `umbel-bench ambient`: which rays leave points on surfaces into the half space above without meeting anything? By all
//! engines in turns.

use crate::Result;
use crate::commands::cli::{AmbientArgs, Common};
use crate::commands::comparison;
use crate::subjects::ambient::Ambient;

/// Measures every scene with every set of receivers.
pub(crate) fn run(args: &AmbientArgs, common: &Common) -> Result<()> {
    comparison::run("ambient", &args.compared, common, &args.receivers, |view, receivers| {
        Ambient::new(&view.name, &view.scene, receivers, args.rays as usize, args.max_distance)
    })
}
