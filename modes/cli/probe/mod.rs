//! `umbel probe`: what is seen from one place, all around or along a LiDAR's rays. From the rays on it is `umbel render`.

pub(crate) mod args;

use std::path::Path;

use umbel::formats::{Pattern, read_pattern};
use umbel::render::Look;
use umbel::{Camera, Error, Scene};

use crate::common::Common;
use crate::memory::{PIXEL_BYTES, SCATTERED_BYTES, limit_memory};
use crate::picture::{Files, Sight};
use crate::probe::args::{PatternArg, ProbeArgs};
use crate::render::{check_memory, see};
use crate::report::Times;
use crate::run::load_scene;

/// Bytes of the smallest direction in a file: three `f4`.
const DIRECTION_BYTES: u64 = 12;

/// `umbel probe`.
pub(crate) fn probe(args: &ProbeArgs, common: &Common) -> Result<(), Error> {
    if let Some(PatternArg::File(_)) = &args.pattern {
        args.refuse_useless_with_file()?;
    }
    let output = args.picture.checked_output()?;
    let mut times = Times::default();
    let scene = load_scene(&args.scene, common, &mut times)?;
    let sight = sight(args, &scene, common)?;
    let look = Look { samples: args.picture.samples, ..Look::default() };
    let files = Files { args: &args.picture, output, look };
    see("probe", &scene, sight, &files, common, times)
}

/// The rays: those of a file, or of a lens.
fn sight(args: &ProbeArgs, scene: &Scene, common: &Common) -> Result<Sight, Error> {
    if let Some(PatternArg::File(path)) = &args.pattern {
        check_pattern_memory(path, scene, common)?;
        let Pattern { shot, shape } = read_pattern(path, args.center - scene.offset)?;
        return Ok(Sight { shot, shape, camera: None });
    }
    let camera = args.camera()?;
    let camera = Camera { eye: camera.eye - scene.offset, target: camera.target - scene.offset, ..camera };
    check_memory(scene, &camera, common)?;
    Sight::of_camera(&camera)
}

/// Stops before a file of directions is read that would need too much.
fn check_pattern_memory(path: &Path, scene: &Scene, common: &Common) -> Result<(), Error> {
    // A file that cannot be looked at is refused when it is read.
    let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
    limit_memory(bytes / DIRECTION_BYTES * (PIXEL_BYTES + SCATTERED_BYTES), scene, "--pattern", common)
}
