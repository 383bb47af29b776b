//! `umbel bake`: ambient occlusion of texels, vertices and points.
//!
//! Receivers are taken in pieces, so that memory stays bounded by what is asked for; how they are cut changes no output.

pub(crate) mod args;
pub(crate) mod dial;
pub(crate) mod files;
#[cfg_attr(not(feature = "gltf"), path = "no_gltf.rs")]
pub(crate) mod gltf;
pub(crate) mod into;
pub(crate) mod run;
pub(crate) mod sample;
pub(crate) mod sampling_args;
pub(crate) mod source;

use std::ffi::{OsStr, OsString};
use std::time::Instant;

use glam::DVec3;
use serde_json::{Map, Value, json};
use umbel::bake::{
    Bake, BakeOccluders, BakeOptions, Falloff, Occluders, Polarity, SampleSet, TracedRay, Weighting,
    check_uvs, rays_around, rounding_distance,
};
use umbel::files::{available_memory, check_output};
use umbel::formats::{SurfaceOptions, SurfaceScene, load_surfaces, names_surfaces};
use umbel::{Error, Scene, load};

use crate::bake::args::{BakeArgs, OccluderArgs};
use crate::bake::dial::{Dial, Done};
use crate::bake::files::Files;
use crate::bake::gltf::Patched;
use crate::bake::run::{Pieces, run};
use crate::bake::source::{Extent, Results, Source};
use crate::common::Common;
use crate::memory::{ROUND_BYTES, Room};
use crate::report::{Report, Times, timed};
use crate::run::{load_scene, print_run, say};

/// The most bytes that a piece takes where the user sets no limit.
const PIECE_BYTES: u64 = 1 << 30;

/// The least part of the charts' area that must have texels of its own. Where all charts lie on their mirrored other halves it
/// is just reached: such textures are common, and of use where both halves look alike.
const OWN_PART: f64 = 0.5;

/// Bytes that the engine takes for triangles: a copy in its own order.
fn engine_bytes(triangles: usize) -> u64 {
    triangles as u64 * 64
}

/// Memory that is needed, and how it is used.
pub(crate) struct Plan {
    /// Units at once.
    pub(crate) piece: usize,
    /// Receivers at once, at most.
    receivers: u64,
    /// Values in all.
    values: u64,
    /// All bytes together, the scene apart.
    forecast: u64,
}

/// `umbel bake`.
pub(crate) fn bake(args: &BakeArgs, common: &Common) -> Result<(), Error> {
    args.check()?;
    let (mut times, start) = (Times::default(), Instant::now());
    let (scene, patched) = match Patched::load(&args.scene, args.output.as_deref(), common, &mut times)? {
        Some((patched, scene)) => (scene, Some(patched)),
        None => (load_scene(&args.scene, common, &mut times)?, None),
    };
    let mut options = args.options(&scene);
    let mut bake = Bake::new(options)?;
    let occluders = timed(&mut times.load, || occluders(&scene, &args.occluders, common))?;
    let mut plan = make_plan(args, &bake, (&scene, &occluders), common)?;
    // Not after hours of work.
    args.outputs().chain(&common.report).try_for_each(|path| check_output(path))?;
    let triangles = occluders.geometry()?;
    let source = timed(&mut times.receivers, || Source::new(args, &scene))?;
    timed(&mut times.check, || check_texture(&source, args, common))?;
    let dial = Dial { options, source: &source, triangles: &triangles, piece: plan.piece, common, start };
    let (choice, done) = args.dial.goal().map(|goal| dial.choose(goal)).transpose()?.unzip();
    if let Some(choice) = &choice {
        options.rays = choice.setting;
        bake = Bake::new(options)?;
        plan = make_plan(args, &bake, (&scene, &occluders), common)?;
        choice.say(common);
    }
    let surfaces = timed(&mut times.load, || surfaces(&args.occluders, common))?;
    let around = rays_around(scene.bounds().union(source.points_bounds()), plan.values as usize);
    let dicing = args.occluders.made.dicing();
    let among = BakeOccluders { triangles: &triangles, surfaces: &surfaces, around, dicing };
    let rounding = (options.reach.min_distance == 0.0).then(|| rounding_distance(&scene.bounds()));
    let found = match done.flatten() {
        Some(Done { found, times: taken }) => {
            times.receivers += taken.receivers;
            times.engine = taken.engine;
            found
        }
        None => {
            let pieces = Pieces { piece: plan.piece, with_bent: options.bent, near: rounding };
            run(&bake, (&source, among), &pieces, common, &mut times)?
        }
    };
    say_near(&found, rounding, common);
    let mut hash = blake3::Hasher::new();
    let (stats, rays) = (found.stats, usize::try_from(found.rays).unwrap_or(usize::MAX));
    let mut more = report_fields(&options, &source, &found, &plan);
    more.extend(choice.map(|choice| ("dial".to_owned(), choice.json())));
    if common.verbose {
        let (receivers, rays) = (found.receivers, found.rays);
        anstream::eprintln!("{receivers} receivers, at most {} at once, {rays} rays", plan.receivers);
    }
    timed(&mut times.write, || {
        let files = Files { args, common, scene: &scene, source: &source, patched };
        files.write(found, options.polarity, &mut hash)
    })?;
    if common.verbose {
        print_run(&times, &stats);
    }
    let report = Report {
        command: "bake",
        scene: &scene,
        rays,
        options: common.options(),
        times: &times,
        stats,
        forecast: plan.forecast,
        hash: hash.finalize(),
    };
    common.report.as_deref().map_or(Ok(()), |path| report.write_with(path, more))
}

/// One of so many receivers near another surface is worth a warning; the report has the number in any case.
const NEAR_SHARE: u64 = 1000;

/// Says how many receivers are dark where rounding has put something before them, or bright where behind.
fn say_near(found: &Results, rounding: Option<f64>, common: &Common) {
    // Single ones are seams of nearly flat folds.
    let is_worth_it = found.near * NEAR_SHARE > found.receivers as u64;
    let Some(distance) = rounding.filter(|_| is_worth_it) else { return };
    let what = format!(
        "receivers within rounding ({distance:.1e}) of another surface, which hides all from them: {} of {}; where such layers \
         belong together give --min-distance {:.0e}",
        found.near,
        found.receivers,
        4.0 * distance
    );
    say(&[what], common);
}

/// The scene with what else occludes it.
pub(crate) fn occluders<'a>(
    scene: &'a Scene,
    args: &OccluderArgs,
    common: &Common,
) -> Result<Occluders<'a>, Error> {
    let mut occluders = Occluders::new(scene);
    for name in args.scenes.iter().filter(|name| !args.is_on_demand(name)) {
        occluders.add(&load(name, common.load_options())?)?;
    }
    if args.ground_plane {
        occluders.add_ground(args.up.unwrap_or(DVec3::Y))?;
    }
    Ok(occluders)
}

/// The further scenes that are surfaces on demand.
fn surfaces(args: &OccluderArgs, common: &Common) -> Result<Vec<SurfaceScene>, Error> {
    let load = common.load_options();
    let read = |name: &OsString| {
        let made = if names_surfaces(name) {
            SurfaceOptions::default()
        } else {
            args.made.options(load, args.height)?
        };
        load_surfaces(name, made)
    };
    let found: Vec<SurfaceScene> =
        args.scenes.iter().filter(|name| args.is_on_demand(name)).map(read).collect::<Result<_, _>>()?;
    found.iter().for_each(|scene| say(&scene.warnings, common));
    Ok(found)
}

/// Decides how many receivers are taken at once, or stops before the start where memory is too short for any number.
pub(crate) fn make_plan(
    args: &BakeArgs,
    bake: &Bake,
    (scene, occluders): (&Scene, &Occluders<'_>),
    common: &Common,
) -> Result<Plan, Error> {
    let room = Room::beside(scene);
    let extent = Extent::new(args, scene)?;
    let surfaces = if args.occluders.has_surfaces() { ROUND_BYTES } else { 0 };
    // About half of all directions point above a horizon.
    let rays = if args.dump_rays.is_some() { bake.directions().div_ceil(2) } else { 0 };
    let traced = extent.receivers(extent.units) * rays * size_of::<TracedRay>() as u64;
    let fixed =
        surfaces + extent.bytes + traced + engine_bytes(occluders.geometry()?.len()) + bake.map_bytes();
    let left = room.left(common).or_else(available_memory).unwrap_or(u64::MAX).saturating_sub(fixed);
    let left = if common.max_memory.is_some() { left } else { left.min(PIECE_BYTES) };
    let piece = extent.piece(bake, left);
    // Rays are copied once before they join those of other pieces; those of interleaved sets are sorted, with some of them aside.
    let numbered = size_of::<TracedRay>() as u64 + 8;
    let is_sorted = args.options(scene).set == SampleSet::Interleaved;
    let copied = if is_sorted { numbered + numbered / 4 } else { numbered };
    let each = bake.receiver_bytes() + extent.receiver + rays * copied;
    let added = fixed + extent.receivers(piece) * each;
    let forecast = room.limit(added, args.target().remedy(), common)?;
    let receivers = piece * extent.per_unit;
    // In range: it is at most the number of units.
    Ok(Plan { piece: piece as usize, receivers, values: extent.values, forecast })
}

/// About how many bytes `umbel bake --vertices` adds with the options that it has by default.
pub(crate) fn vertices_forecast(scene: &Scene) -> Result<u64, Error> {
    let (bake, extent) = (Bake::new(BakeOptions::default())?, Extent::of_vertices(scene));
    let piece = extent.piece(&bake, PIECE_BYTES) * bake.receiver_bytes();
    Ok(extent.bytes + piece + engine_bytes(scene.triangles.len()))
}

/// Says what is odd about texture coordinates, and refuses those of which most have no texels of their own.
fn check_texture(source: &Source<'_>, args: &BakeArgs, common: &Common) -> Result<(), Error> {
    let Source::Texels(atlas, _) = source else { return Ok(()) };
    let (is_allowed, area) = (args.receivers.allow_overlap, atlas.charts_area());
    // So much area has too few texels, however it lies.
    if !is_allowed && area * OWN_PART > 1.0 {
        return Err(useless_texture(&args.scene, area, 1.0 / area));
    }
    if is_allowed && common.quiet {
        return Ok(());
    }
    let found = check_uvs(atlas);
    say(&found.warnings(), common);
    let own = found.own_part();
    if !is_allowed && own < OWN_PART { Err(useless_texture(&args.scene, area, own)) } else { Ok(()) }
}

/// Why a texture is refused, and what to do instead.
fn useless_texture(scene: &OsStr, area: f64, own: f64) -> Error {
    Error::Input {
        path: scene.into(),
        line: None,
        problem: format!(
            "at most {:.1} % of the charts would have texels of its own in this texture: they have {area:.2} times \
             the area of the image, and repeat, overlap or lie outside",
            own * 100.0
        ),
        remedy: "Bake per vertex with --vertices, unwrap the mesh without overlap, or give --allow-overlap to bake it all \
                 the same."
            .into(),
    }
}

/// What a set is called.
pub(crate) fn set_name(set: SampleSet) -> &'static str {
    match set {
        SampleSet::Shared => "shared",
        SampleSet::Interleaved => "interleaved",
        SampleSet::Independent => "independent",
    }
}

/// What the report has beyond that of other verbs.
fn report_fields(
    options: &BakeOptions,
    source: &Source<'_>,
    found: &Results,
    plan: &Plan,
) -> Map<String, Value> {
    let bake = json!({
        "of": source.name(),
        "values": plan.values,
        "receivers": found.receivers,
        "receivers_near_surfaces": found.near,
        "rays_per_receiver": options.rays,
        "set": set_name(options.set),
        "weighting": if options.weighting == Weighting::Cosine { "cosine" } else { "uniform" },
        "max_distance": options.reach.max_distance,
        "min_distance": options.reach.min_distance,
        "falloff": if options.reach.falloff == Falloff::Linear { "linear" } else { "none" },
        "polarity": if options.polarity == Polarity::Openness { "openness" } else { "occlusion" },
        "depth_maps": options.depth_maps.map(|maps| maps.size),
        "seed": options.seed,
        "receivers_at_once": plan.receivers,
        "forecast_bytes": plan.forecast,
    });
    Map::from_iter([("bake".to_owned(), bake)])
}
