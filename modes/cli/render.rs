//! `umbel render` and `umbel verify`: what a camera sees, and whether another way sees the same.

use glam::DVec3;
use serde_json::{Map, json};
use umbel::files::write_png_rgb8;
use umbel::render::{Look, preview_with, verify};
use umbel::{Aov, Camera, Error, Frame, Lens, Scene, Stats, VisibilityBuffer};

use crate::args::{RenderArgs, VerifyArgs};
use crate::common::{Common, PathArg};
use crate::forecast::{HIT_BYTES, PictureBytes, Rays, Shares};
use crate::memory::Room;
use crate::options::picture::PictureArgs;
use crate::picture::{Files, Picture, Sight};
use crate::report::{Report, Times, timed};
use crate::run::{load_scene, print, print_run, progress, say};

/// Bytes of a projected triangle, as it is filled to verify a picture: its corners, in a list of its own.
const POLYGON_BYTES: u64 = 144;

/// `umbel render`.
pub(crate) fn render(args: &RenderArgs, common: &Common) -> Result<(), Error> {
    let output = args.picture.checked_output()?;
    args.lights.lights(DVec3::ZERO)?;
    let bounces = args.bounces.bounces()?;
    let is_lit = !args.lights.is_none() || args.bounces.is_given();
    if is_lit && (output.is_none() || args.picture.is_point_cloud()) {
        let what = "lights, mirrors and glass go with the preview: add -o FILE.png, or leave them out";
        return Err(Error::Usage(what.into()));
    }
    let mut times = Times::default();
    let mut scene = load_scene(&args.scene, common, &mut times)?;
    say(args.bounces.change(&mut scene)?.as_slice(), common);
    let (camera, lights) = (args.camera.camera(&scene)?, args.lights.lights(scene.offset)?);
    let look = Look { samples: args.picture.samples, lights, bounces };
    let forecast = timed(&mut times.check, || check_memory(&scene, &camera, (&args.picture, &look), common))?;
    let sight = Sight::of_camera(&camera)?;
    see("render", &scene, sight, &Files { args: &args.picture, output, look, forecast }, common, times)
}

/// Finds what the rays of a sight hit, and writes the files that were asked for and nothing else.
pub(crate) fn see(
    command: &'static str,
    scene: &Scene,
    sight: Sight,
    files: &Files<'_>,
    common: &Common,
    mut times: Times,
) -> Result<(), Error> {
    // The engine: visibility of the pixel centres.
    let options = common.options();
    let triangles = scene.geometry()?;
    let mut frame = if common.keep_order { Frame::keeping_order() } else { Frame::new() };
    if files.args.aovs.iter().any(|(aov, _)| *aov == Aov::Work) {
        frame = frame.counting_pairs();
    }
    let mut stats = Stats::default();
    for _ in 0..common.repeat {
        let mut milliseconds = 0.0;
        stats = timed(&mut milliseconds, || frame.closest_hit(&triangles, &sight.shot.pencil, &options))?;
        times.engine.push(milliseconds);
    }
    let pixels = sight.pixels();
    let Sight { shot, shape, camera } = sight;
    let buffer = VisibilityBuffer::new(shot, pixels, frame);

    let mut hash = blake3::Hasher::new();
    let progress = progress(files.look.samples, "samples", common);
    let seen = match (&files.output, &camera) {
        (Some(_), Some(camera)) if !files.args.is_point_cloud() => Some(timed(&mut times.shade, || {
            preview_with(scene, camera, &buffer, &files.look, &options, |pass| {
                progress.set_position(u64::from(pass))
            })
        })?),
        _ => None,
    };
    let (linear, followed) = seen.map(|seen| times.take_preview(seen)).unzip();
    progress.finish_and_clear();
    let picture = Picture { shape, seen: &(&buffer, scene) };
    timed(&mut times.write, || picture.write(files, linear, &mut hash))?;

    if common.verbose {
        print_run(&times, &stats);
    }
    let rays = buffer.hits.len();
    let (hash, forecast) = (hash.finalize(), files.forecast);
    let report = Report { command, scene, rays, options, times: &times, stats, forecast, hash };
    let mut more = Map::new();
    if files.look.bounces.most > 0 {
        // The rays of each bounce, over all samples.
        more.insert("bounces".to_owned(), json!(followed.unwrap_or_default().rays));
    }
    common.report.as_deref().map_or(Ok(()), |path| report.write_with(path, more))
}

/// Stops before the start when a picture needs more than `--max-memory`, or else what the machine has left. Gives the bytes of
/// the process.
pub(crate) fn check_memory(
    scene: &Scene,
    camera: &Camera,
    (args, look): (&PictureArgs, &Look),
    common: &Common,
) -> Result<u64, Error> {
    let (room, rays) = (Room::beside(scene), Rays::of_camera(camera));
    // Where points do not count, how many there are does not matter.
    let shares = match args.is_point_cloud() || !look.lights.is_empty() || look.bounces.most > 0 {
        true => Shares::of(scene, camera, look, &common.options())?,
        false => Shares::whole(0),
    };
    let triangles = scene.triangles.len() as u64;
    let engine = rays.engine(triangles, common.path);
    let bytes = PictureBytes { args, rays, shares, bounces: look.bounces, triangles, engine }.most();
    room.limit(bytes, remedy(camera), common)
}

/// The option that makes a picture smaller.
fn remedy(camera: &Camera) -> &'static str {
    match camera.lens {
        Lens::Cube => "--cube-size",
        Lens::Spinning { .. } => "--pattern",
        _ => "--size",
    }
}

/// `umbel verify`.
pub(crate) fn verify_scene(args: &VerifyArgs, common: &Common) -> Result<(), Error> {
    let mut times = Times::default();
    let scene = load_scene(&args.scene, common, &mut times)?;
    let camera = args.camera.camera(&scene)?;
    if args.difference.is_some() && camera.lens.bends_lines() {
        let what = "--difference needs a lens with straight lines: pinhole, ortho or cube";
        return Err(Error::Usage(what.into()));
    }
    // Both paths are kept; the general one takes most.
    let rays = Rays::of_camera(&camera);
    let triangles = scene.triangles.len() as u64;
    let rastered = if camera.lens.bends_lines() { 0 } else { triangles * POLYGON_BYTES };
    let searched = rays.engine(triangles, PathArg::General).max(rastered);
    let bytes = rays.bytes() + rays.rays * HIT_BYTES + searched;
    Room::beside(&scene).limit(bytes, remedy(&camera), common)?;
    let found = verify(&scene, &camera, &common.options())?;
    let mut text = format!(
        "{}: {} triangles, {} rays, {} hits\n  pencil = general path: {} differences in id or t\n",
        scene.name,
        scene.triangles.len(),
        found.rays,
        found.hits,
        found.path_differences,
    );
    if found.pixels > 0 {
        text += &format!(
            "  tiny-skia: {} pixels, {} differ within its tolerance near edges, {} at equal depth, {} really differ\n",
            found.pixels, found.near_edges, found.same_depth, found.raster_differences
        );
    } else {
        text += "  tiny-skia: not compared, this lens bends straight lines\n";
    }
    print(&text)?;
    if let Some(path) = &args.difference {
        let bytes: Vec<u8> = found.marks.iter().flat_map(mark_colour).collect();
        write_png_rgb8(path, camera.width, camera.rows(), &bytes)?;
    }
    if found.is_clean() {
        return Ok(());
    }
    Err(Error::Difference(format!(
        "{} rays differ between the paths, {} pixels from tiny-skia",
        found.path_differences, found.raster_differences
    )))
}

/// The colour of a mark in a difference picture.
fn mark_colour(mark: &umbel::render::Mark) -> [u8; 3] {
    match mark {
        umbel::render::Mark::Miss => [24, 24, 28],
        umbel::render::Mark::Hit => [70, 74, 82],
        umbel::render::Mark::Tolerated => [240, 200, 40],
        umbel::render::Mark::Difference => [235, 30, 30],
    }
}
