//! `umbel reyes`: what a camera sees of surfaces that are made on demand.

pub(crate) mod args;

use glam::DVec3;
use umbel::formats::{SurfaceScene, load_surfaces, surface_view};
use umbel::render::{Look, surface_preview, surface_visibility};
use umbel::{Camera, Error, Scene};

use crate::common::Common;
use crate::memory::{CORNERS_BYTES, SURFACE_PIXEL_BYTES};
use crate::memory::{PIXEL_BYTES, SHADOW_BYTES, limit_memory};
use crate::picture::{Files, Picture, Sight};
use crate::report::{Report, Times, timed};
use crate::reyes::args::ReyesArgs;
use crate::run::{print_run, progress, say};

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
    let pixels = u64::from(camera.width) * u64::from(camera.rows());
    let lit = look.lights.len() as u64 * (SHADOW_BYTES + 1)
        + if look.lights.is_empty() { 0 } else { CORNERS_BYTES };
    limit_memory(pixels * (PIXEL_BYTES + SURFACE_PIXEL_BYTES + lit), &named, "--size", common)?;

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
    let files = Files { args: &args.picture, output, look: Look::default() };
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
        hash: hash.finalize(),
    };
    common.report.as_deref().map_or(Ok(()), |path| report.write(path))
}
