//! The verbs of the command line: each reads a scene, runs the library, and writes what it was asked for.

use std::io::Write as _;

use glam::DVec3;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};
use umbel::{
    Aov, Bounces, Camera, Error, Frame, Lens, Look, Scene, Stats, VisibilityBuffer, available_memory, info,
    load, preview_with, verify, write_png_rgb8,
};

use crate::args::{Common, InfoArgs, RenderArgs, VerifyArgs};
use crate::bake::vertices_forecast;
use crate::picture::{Files, Picture, Sight};
use crate::report::{Report, Times, timed};

/// Bytes of a pixel: hits 8, and either points 28 with their positions and normals 24, or else a preview 12 and its sum 12,
/// bytes of the picture 3 and the widest derived image 12.
pub(crate) const PIXEL_BYTES: u64 = 60;

/// More bytes of a scattered ray: its direction and its pixel, and its place in their order.
pub(crate) const SCATTERED_BYTES: u64 = 36;

/// More bytes of a pixel for each light: the receiver 20, at most half of that again while receivers are joined, the answer 1.
pub(crate) const SHADOW_BYTES: u64 = 31;

/// Reads a scene and says what was noticed.
pub(crate) fn load_scene(name: &str, common: &Common, times: &mut Times) -> Result<Scene, Error> {
    let options = common.load_options();
    let scene = timed(&mut times.load, || load(name, options))?;
    print_warnings(&scene, common);
    Ok(scene)
}

/// Says what the reader of a scene has noticed.
pub(crate) fn print_warnings(scene: &Scene, common: &Common) {
    say(&scene.warnings, common);
}

/// Prints warnings, unless only errors are wanted.
pub(crate) fn say(warnings: &[String], common: &Common) {
    if !common.quiet {
        warnings.iter().for_each(|warning| anstream::eprintln!("warning: {warning}"));
    }
}

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
    check_memory_with(&scene, &camera, (lights.len() as u64, bounces), common)?;
    let sight = Sight::of_camera(&camera)?;
    let look = Look { samples: args.picture.samples, lights, bounces };
    see("render", &scene, sight, &Files { args: &args.picture, output, look }, common, times)
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
    let (linear, followed) = seen.unzip();
    progress.finish_and_clear();
    let picture = Picture { shape, seen: &(&buffer, scene) };
    timed(&mut times.write, || picture.write(files, linear, &mut hash))?;

    if common.verbose {
        print_run(&times, &stats);
    }
    let rays = buffer.hits.len();
    let report = Report { command, scene, rays, options, times: &times, stats, hash: hash.finalize() };
    let mut more = Map::new();
    if files.look.bounces.most > 0 {
        // The rays of each bounce, over all samples.
        more.insert("bounces".to_owned(), json!(followed.unwrap_or_default().rays));
    }
    common.report.as_deref().map_or(Ok(()), |path| report.write_with(path, more))
}

/// Stops before the start when a picture needs more than `--max-memory`, or else what the machine has left.
pub(crate) fn check_memory(scene: &Scene, camera: &Camera, common: &Common) -> Result<(), Error> {
    check_memory_with(scene, camera, (0, Bounces::default()), common)
}

/// The same, with so many lights, and with bounces.
fn check_memory_with(
    scene: &Scene,
    camera: &Camera,
    (lights, bounces): (u64, Bounces),
    common: &Common,
) -> Result<(), Error> {
    let pixels = u64::from(camera.width) * u64::from(camera.rows());
    let scattered = if camera.lens.bends_lines() { SCATTERED_BYTES } else { 0 };
    let remedy = match camera.lens {
        Lens::Cube => "--cube-size",
        Lens::Spinning { .. } => "--pattern",
        _ => "--size",
    };
    let bytes = pixels * (PIXEL_BYTES + scattered + lights * (SHADOW_BYTES + 1));
    let bytes = bytes + bounces.forecast(pixels, lights);
    limit_memory(bytes, scene, remedy, common)
}

/// Stops when so many bytes, with the engine's own for the triangles, are more than there may be.
pub(crate) fn limit_memory(bytes: u64, scene: &Scene, remedy: &str, common: &Common) -> Result<(), Error> {
    let forecast = bytes + scene.triangles.len() as u64 * 6;
    let (limit, name) = match common.max_memory {
        Some(limit) => (limit, "--max-memory"),
        None => (available_memory().unwrap_or(u64::MAX), "the memory that is left,"),
    };
    if forecast > limit {
        return Err(Error::Limit(format!(
            "about {forecast} bytes are needed, more than {name} {limit}; use a smaller {remedy}"
        )));
    }
    Ok(())
}

/// A bar over passes: on stderr, on a terminal, and only when there is more than one.
pub(crate) fn progress(passes: u32, what: &str, common: &Common) -> ProgressBar {
    if common.quiet || passes <= 1 {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(u64::from(passes));
    match ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left")) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// Prints times and counters on stderr.
pub(crate) fn print_run(times: &Times, stats: &Stats) {
    let engine: Vec<String> = times.engine.iter().map(|ms| format!("{ms:.2}")).collect();
    anstream::eprintln!(
        "load {:.1} ms, engine {} ms, shade {:.1} ms, write {:.1} ms",
        times.load,
        engine.join(" "),
        times.shade,
        times.write
    );
    for (name, count) in stats.counters() {
        anstream::eprintln!("{name:20} {count}");
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
    check_memory(&scene, &camera, common)?;
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
fn mark_colour(mark: &umbel::Mark) -> [u8; 3] {
    match mark {
        umbel::Mark::Miss => [24, 24, 28],
        umbel::Mark::Hit => [70, 74, 82],
        umbel::Mark::Tolerated => [240, 200, 40],
        umbel::Mark::Difference => [235, 30, 30],
    }
}

/// `umbel info`.
pub(crate) fn info_scene(args: &InfoArgs, common: &Common) -> Result<(), Error> {
    let scene = load_scene(&args.scene, common, &mut Times::default())?;
    let found = info(&scene);
    let [lo, hi] = [found.bounds.lo, found.bounds.hi].map(|corner| in_frame_of_file(corner, &scene));
    let counts = [
        ("triangles", found.triangles),
        ("vertices", found.vertices),
        ("unused_vertices", found.unused_vertices),
        ("objects", found.objects),
        ("materials", found.materials),
        ("with_normals", found.with_normals),
        ("with_uvs", found.with_uvs),
        ("degenerate", found.degenerate),
        ("duplicates", found.duplicates),
        ("non_finite", found.non_finite),
    ];
    let picture = 1280 * 720 * PIXEL_BYTES + 6 * found.triangles as u64;
    let memory = [("render", picture), ("bake_vertices", vertices_forecast(&scene)?)];
    if args.json {
        let mut value = json!({ "schema": 1, "name": scene.name, "warnings": scene.warnings });
        for (name, count) in counts {
            value[name] = json!(count);
        }
        value["memory"] = Map::from_iter(memory.map(|(name, bytes)| (name.to_owned(), json!(bytes)))).into();
        value["offset"] = json!(scene.offset.to_array());
        value["bounds"] = if found.bounds.is_empty() { json!(null) } else { json!({ "lo": lo, "hi": hi }) };
        return print(&format!("{value:#}\n"));
    }
    let mut text = format!("{}\n", scene.name);
    for (name, count) in counts {
        text += &format!("  {:16} {count}\n", name.replace('_', " "));
    }
    if !found.bounds.is_empty() {
        let shown = |corner: &[Value; 3]| format!("[{}, {}, {}]", corner[0], corner[1], corner[2]);
        text += &format!("  bounds           {} to {}\n", shown(&lo), shown(&hi));
    }
    if scene.offset != DVec3::ZERO {
        text += &format!("  offset           {:?}\n", scene.offset.to_array());
    }
    let forecast =
        memory.map(|(name, bytes)| format!("{} {:.1} MB", name.replace('_', " --"), bytes as f64 / 1e6));
    text += &format!("  memory           {}, beside the scene\n", forecast.join(", "));
    print(&text)
}

/// A place in the frame of the scene's file. Near the origin the number is that in f32, with its digits.
fn in_frame_of_file(place: [f32; 3], scene: &Scene) -> [Value; 3] {
    let offset = scene.offset.to_array();
    [0, 1, 2].map(|k| match offset[k] == 0.0 {
        true => json!(place[k]),
        false => json!(offset[k] + f64::from(place[k])),
    })
}

/// Writes data to stdout. A reader that has gone away is no failure.
pub(crate) fn print(text: &str) -> Result<(), Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::Write { path: "stdout".into(), problem: error.to_string() })
        }
        _ => Ok(()),
    }
}
