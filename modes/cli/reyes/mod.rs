//! `umbel reyes`: what a camera sees of surfaces that are made on demand.

pub(crate) mod args;

use glam::DVec3;
use umbel::formats::{SurfaceScene, load_surfaces, surface_view};
use umbel::render::{Bounces, Look, SurfaceLook, surface_preview, surface_visibility};
use umbel::{Camera, Error, Scene};

use crate::common::Common;
use crate::forecast::{CORNERS_BYTES, PictureBytes, Rays, SURFACE_HIT_BYTES, Shares};
use crate::memory::Room;
use crate::picture::{Files, Picture, Sight};
use crate::report::{Report, Times, timed};
use crate::reyes::args::ReyesArgs;
use crate::run::{print_run, progress, say};

/// Bytes of the micropolygons that a thread works on.
const THREAD_BYTES: u64 = 1 << 18;

impl ReyesArgs {
    /// Reads the scene, and says what was noticed.
    pub(crate) fn load(&self, common: &Common) -> Result<SurfaceScene, Error> {
        let load = common.load_options();
        let scene = load_surfaces(&self.scene, self.surfaces.made.options(load, self.camera.height)?)?;
        say(&scene.warnings, common);
        Ok(scene)
    }

    /// The camera that was asked for; of a built-in scene its curated view, of others one that frames them.
    pub(crate) fn framing(&self, scene: &SurfaceScene) -> Result<Camera, Error> {
        let view = self.scene.to_str().and_then(|name| name.strip_prefix("builtin:")).and_then(surface_view);
        self.camera.framing_of(&scene.bounds(), view, (self.surfaces.film_height(&self.camera), scene.offset))
    }
}

/// `umbel reyes`.
pub(crate) fn reyes(args: &ReyesArgs, common: &Common) -> Result<(), Error> {
    args.check()?;
    let output = args.picture.checked_output()?;
    // Wrong options are refused before anything is read.
    args.look(DVec3::ZERO)?;
    let mut times = Times::default();
    let scene = timed(&mut times.load, || args.load(common))?;
    let look = args.look(scene.offset)?;
    let camera = args.framing(&scene)?;
    let named = Scene { name: scene.name.clone(), offset: scene.offset, ..Scene::default() };
    let forecast = timed(&mut times.check, || check_memory(args, (&scene, &named), &camera, &look, common))?;

    // The engine: visibility of the pixel centres.
    let (dicing, options) = (args.dicing(), common.options());
    let Sight { shot, shape, .. } = Sight::of_camera(&camera)?;
    let (mut milliseconds, pixels) = (0.0, camera.pixels());
    let (mut buffer, mut stats) =
        timed(&mut milliseconds, || surface_visibility(&scene, shot, pixels, &dicing, &options))?;
    times.engine.push(milliseconds);
    for _ in 1..common.repeat {
        milliseconds = 0.0;
        stats = timed(&mut milliseconds, || buffer.see(&scene, &dicing, &options))?;
        times.engine.push(milliseconds);
    }

    let mut hash = blake3::Hasher::new();
    let samples = look.samples;
    let bar = progress(samples, "samples", common);
    let seen = match &output {
        Some(_) if !args.picture.is_point_cloud() => Some(timed(&mut times.shade, || {
            surface_preview(&scene, &camera, &buffer, &look, (&dicing, &options), |pass| {
                bar.set_position(u64::from(pass));
            })
        })?),
        _ => None,
    };
    let linear = seen.map(|seen| times.take_preview(seen).0);
    bar.finish_and_clear();
    let files = Files { args: &args.picture, output, look: Look::default(), forecast };
    timed(&mut times.write, || Picture { shape, seen: &buffer }.write(&files, linear, &mut hash))?;

    if common.verbose {
        print_run(&times, &stats);
    }
    let rays = buffer.hits.len();
    let report = Report {
        command: "reyes",
        scene: &named,
        rays,
        options,
        times: &times,
        stats,
        forecast,
        hash: hash.finalize(),
    };
    common.report.as_deref().map_or(Ok(()), |path| report.write(path))
}

/// Stops before the start when a picture needs too much. Gives the bytes of the process.
fn check_memory(
    args: &ReyesArgs,
    (scene, named): (&SurfaceScene, &Scene),
    camera: &Camera,
    look: &SurfaceLook,
    common: &Common,
) -> Result<u64, Error> {
    let room = Room::beside(named);
    let corners = if look.lights.is_empty() { 0 } else { CORNERS_BYTES };
    let rays = Rays { hit_bytes: SURFACE_HIT_BYTES + corners, ..Rays::of_camera(camera) };
    let shares = match args.picture.is_point_cloud() || !look.lights.is_empty() {
        true => Shares::of_surfaces(scene, camera, &look.lights, (&args.dicing(), &common.options()))?,
        false => Shares::whole(0),
    };
    let engine = rayon::current_num_threads() as u64 * THREAD_BYTES;
    let bytes =
        PictureBytes { args: &args.picture, rays, shares, bounces: Bounces::default(), triangles: 0, engine }
            .most();
    room.limit(bytes, "--size", common)
}
