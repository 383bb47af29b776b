//! `umbel visible`: which triangles any of some views sees, and how many of each object.

use std::path::Path;

use umbel::files::{Array, write_atomically, write_npy};
use umbel::render::{Visible, visible};
use umbel::{Camera, Error, Scene, Stats};

use crate::args::VisibleArgs;
use crate::common::Common;
use crate::forecast::Rays;
use crate::memory::Room;
use crate::options::parse::extension;
use crate::options::views::Views;
use crate::refusal::printable;
use crate::report::{Report, Times, timed};
use crate::run::{load_scene, print, print_run, progress};

/// `umbel visible`.
pub(crate) fn visible_triangles(args: &VisibleArgs, common: &Common) -> Result<(), Error> {
    if let Some(output) = &args.output
        && !["npy", "txt"].contains(&extension(output).as_str())
    {
        return Err(Error::Usage(format!("{}: -o takes .npy or .txt", output.display())));
    }
    let mut times = Times::default();
    let scene = load_scene(&args.scene, common, &mut times)?;
    let views = args.views.as_deref().map(|path| Views::read(path, &scene)).transpose()?;
    let one;
    let cameras = match &views {
        Some(views) => views.cameras.as_slice(),
        None => {
            one = [args.camera.camera(&scene)?];
            &one
        }
    };
    let forecast = check_memory(&scene, cameras, common)?;

    let (seen, stats) = find(&scene, cameras, views.as_ref(), common, &mut times)?;
    timed(&mut times.write, || write(args, &scene, &seen))?;

    if common.verbose {
        print_run(&times, &stats);
    }
    let bytes: Vec<u8> = seen.ids.iter().flat_map(|id| id.to_le_bytes()).collect();
    let hash = blake3::hash(&bytes);
    let (rays, options) = (seen.rays, common.options());
    let times = &times;
    let report = Report { command: "visible", scene: &scene, rays, options, times, stats, forecast, hash };
    common.report.as_deref().map_or(Ok(()), |path| report.write(path))
}

/// The engine, as often as asked for.
fn find(
    scene: &Scene,
    cameras: &[Camera],
    views: Option<&Views<'_>>,
    common: &Common,
    times: &mut Times,
) -> Result<(Visible, Stats), Error> {
    let mut found = (Visible::default(), Stats::default());
    for _ in 0..common.repeat {
        let (mut milliseconds, mut done) = (0.0, 0);
        let bar = progress(u32::try_from(cameras.len()).unwrap_or(u32::MAX), "views", common);
        let seen = timed(&mut milliseconds, || {
            visible(scene, cameras, &common.options(), |views| {
                done = views;
                bar.set_position(views as u64);
            })
        });
        bar.finish_and_clear();
        found = seen.map_err(|error| match views {
            Some(views) => views.explain(done, error),
            None => error,
        })?;
        times.engine.push(milliseconds);
    }
    Ok(found)
}

/// Stops before the start when the largest view needs too much. Gives the bytes of the process.
fn check_memory(scene: &Scene, cameras: &[Camera], common: &Common) -> Result<u64, Error> {
    let triangles = scene.triangles.len() as u64;
    let bytes = |camera: &Camera| {
        let rays = Rays::of_camera(camera);
        rays.bytes() + rays.engine(triangles, common.path)
    };
    // A mark for each triangle, and its id.
    let marks = triangles * 5;
    let most = cameras.iter().map(bytes).max().unwrap_or(0) + marks;
    Room::beside(scene).limit(most, "size of the views", common)
}

/// Writes the ids to `-o`; prints the objects where they are asked for, and else the ids that no file gets.
fn write(args: &VisibleArgs, scene: &Scene, seen: &Visible) -> Result<(), Error> {
    if let Some(output) = &args.output {
        write_ids(output, &seen.ids)?;
    }
    if args.objects {
        print(&table(scene, seen))
    } else if args.output.is_none() {
        print(&lines(&seen.ids))
    } else {
        Ok(())
    }
}

/// Writes the ids as an array or as text.
fn write_ids(output: &Path, ids: &[u32]) -> Result<(), Error> {
    if extension(output) == "npy" {
        return write_npy(output, &[ids.len()], Array::U32(ids));
    }
    write_atomically(output, |file| file.write_all(lines(ids).as_bytes()))
}

/// One id a line.
fn lines(ids: &[u32]) -> String {
    ids.iter().map(|id| format!("{id}\n")).collect()
}

/// One object a line, and the whole scene in the last.
fn table(scene: &Scene, seen: &Visible) -> String {
    let row = |visible: usize, triangles: usize, name: &str| {
        let share = if triangles > 0 { visible as f64 / triangles as f64 } else { 0.0 };
        format!("{visible:>10} {triangles:>10} {share:>7.4}  {name}\n")
    };
    let mut text = format!("{:>10} {:>10} {:>7}  object\n", "visible", "triangles", "share");
    for (object, visible) in scene.objects.iter().zip(seen.per_object(scene)) {
        text += &row(visible, object.triangles.len(), &printable(&object.name));
    }
    text + &row(seen.ids.len(), scene.triangles.len(), "total")
}
