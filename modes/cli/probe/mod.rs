//! `umbel probe`: what is seen from one place, all around or along a LiDAR's rays. From the rays on it is `umbel render`.

pub(crate) mod args;

use std::io::Read as _;
use std::path::Path;

use umbel::formats::{Pattern, read_pattern};
use umbel::render::{Bounces, Look};
use umbel::{Camera, Error, Scene};

use crate::common::Common;
use crate::forecast::{HIT_BYTES, PictureBytes, Rays, SCATTERED_BYTES, Shares};
use crate::memory::Room;
use crate::picture::{Files, Sight};
use crate::probe::args::{PatternArg, ProbeArgs};
use crate::render::{check_memory, see};
use crate::report::Times;
use crate::run::load_scene;

/// Bytes of the smallest direction in a file: three `f4`.
const DIRECTION_BYTES: u64 = 12;

/// Bytes of the head of a file of directions, which tells the type of its numbers.
const HEAD: usize = 128;

/// `umbel probe`.
pub(crate) fn probe(args: &ProbeArgs, common: &Common) -> Result<(), Error> {
    if let Some(PatternArg::File(_)) = &args.pattern {
        args.refuse_useless_with_file()?;
    }
    let output = args.picture.checked_output()?;
    let mut times = Times::default();
    let scene = load_scene(&args.scene, common, &mut times)?;
    let look = Look { samples: args.picture.samples, ..Look::default() };
    let (sight, forecast) = sight(args, &scene, &look, common)?;
    let files = Files { args: &args.picture, output, look, forecast };
    see("probe", &scene, sight, &files, common, times)
}

/// The rays: those of a file, or of a lens; and the bytes of the process.
fn sight(args: &ProbeArgs, scene: &Scene, look: &Look, common: &Common) -> Result<(Sight, u64), Error> {
    if let Some(PatternArg::File(path)) = &args.pattern {
        let forecast = check_pattern_memory(path, args, scene, common)?;
        let Pattern { shot, shape } = read_pattern(path, args.center - scene.offset)?;
        return Ok((Sight { shot, shape, camera: None }, forecast));
    }
    let camera = args.camera()?;
    let camera = Camera { eye: camera.eye - scene.offset, target: camera.target - scene.offset, ..camera };
    let forecast = check_memory(scene, &camera, (&args.picture, look), common)?;
    Ok((Sight::of_camera(&camera)?, forecast))
}

/// Stops before a file of directions is read that would need too much.
fn check_pattern_memory(path: &Path, args: &ProbeArgs, scene: &Scene, common: &Common) -> Result<u64, Error> {
    // A file that cannot be looked at is refused when it is read.
    let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
    let wide = if is_f64(path) { 2 } else { 1 };
    let count = bytes / (DIRECTION_BYTES * wide);
    let rays = Rays { pixels: count, rays: count, ray_bytes: SCATTERED_BYTES - 4, hit_bytes: HIT_BYTES };
    let triangles = scene.triangles.len() as u64;
    let engine = rays.engine(triangles, common.path);
    let (shares, bounces) = (Shares::whole(0), Bounces::default());
    let picture = PictureBytes { args: &args.picture, rays, shares, bounces, triangles, engine }.most();
    // Directions are there twice while they are read, beside the file's bytes.
    Room::beside(scene).limit(picture.max(count * 48 + bytes), "--pattern", common)
}

/// Whether a NumPy file says that its numbers have eight bytes.
fn is_f64(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(HEAD as u64).read_to_end(&mut head));
    read.is_ok() && head.windows(3).any(|text| text == b"<f8")
}
