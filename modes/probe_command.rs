//! `umbel probe`: what is seen from one place, all around or along a LiDAR's rays. From the rays on it is `umbel render`.

use std::path::Path;

use umbel::{Error, Scene, read_pattern};

use crate::cli::Common;
use crate::commands::{SCATTERED_BYTES, check_memory, limit_memory, load_scene, see};
use crate::picture::{Files, Sight};
use crate::probe_args::{PatternArg, ProbeArgs};
use crate::report::Times;

/// Bytes of the smallest direction in a file: three `f4`.
const DIRECTION_BYTES: u64 = 12;

/// `umbel probe`.
pub(crate) fn probe(args: &ProbeArgs, common: &Common) -> Result<(), Error> {
    let mut times = Times::default();
    if let Some(PatternArg::File(path)) = &args.pattern {
        args.refuse_useless_with_file()?;
        args.picture.checked_output()?;
        let scene = load_scene(&args.scene, common, &mut times)?;
        check_pattern_memory(path, &scene, common)?;
        let pattern = read_pattern(path, args.center)?;
        let sight = Sight { shot: pattern.shot, shape: pattern.shape, camera: None };
        return see("probe", &scene, sight, &Files { args: &args.picture, output: None }, common, times);
    }
    let output = args.picture.checked_output()?;
    let camera = args.camera()?;
    let scene = load_scene(&args.scene, common, &mut times)?;
    check_memory(&scene, &camera, common)?;
    let sight = Sight::of_camera(&camera)?;
    see("probe", &scene, sight, &Files { args: &args.picture, output }, common, times)
}

/// Stops before a file of directions is read that would need too much.
fn check_pattern_memory(path: &Path, scene: &Scene, common: &Common) -> Result<(), Error> {
    // A file that cannot be looked at is refused when it is read.
    let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
    // The numbers of the file 24, hits 8, the widest array 12.
    limit_memory(bytes / DIRECTION_BYTES * (SCATTERED_BYTES + 44), scene, "--pattern", common)
}
