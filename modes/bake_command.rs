//! `umbel bake`: ambient occlusion of vertices and points.
//!
//! Receivers are taken in pieces, so that memory stays bounded by what is asked for; how they are cut changes no output.

use std::path::Path;

use glam::DVec3;
use serde_json::{Map, Value, json};
use umbel::{
    Array, Bake, BakeOptions, BakeReceivers, Error, Falloff, Frame, LoadOptions, Occluders, Polarity,
    SampleSet, Scene, Stats, TracedRay, Triangles, VertexReceivers, Weighting, check_output, load,
    read_points, write_npy, write_ply_mesh,
};

use crate::bake_args::{BakeArgs, OccluderArgs};
use crate::cli::Common;
use crate::commands::{available_bytes, limit_memory, load_scene, print_run, progress};
use crate::picture::extension;
use crate::report::{Report, Times, timed};

/// Bytes of a vertex while owners and normals are found: two normals in f64, one in f32, an angle and an id.
const VERTEX_BYTES: u64 = 72;
/// Bytes of a point: its row in f64, its id, and the receiver.
const POINT_BYTES: u64 = 48 + 8 + 48;
/// Bytes of the smallest point in a file: six `f4`.
const ROW_BYTES: u64 = 24;
/// Bytes of a value, as it is kept and as it is hashed.
const VALUE_BYTES: u64 = 8;
/// The most bytes that a piece takes where the user sets no limit.
const PIECE_BYTES: u64 = 1 << 30;

/// What is baked.
enum Source<'a> {
    Vertices(VertexReceivers<'a>, usize),
    Points(BakeReceivers),
}

impl Source<'_> {
    /// How many values there are.
    fn len(&self) -> usize {
        match self {
            Self::Vertices(_, vertices) => *vertices,
            Self::Points(points) => points.len(),
        }
    }

    /// The receivers among some of them.
    fn piece(&self, first: usize, end: usize) -> BakeReceivers {
        match self {
            Self::Vertices(vertices, _) => vertices.range(first..end),
            Self::Points(points) => BakeReceivers {
                hemispheres: points.hemispheres[first..end].to_vec(),
                normals: points.normals[first..end].to_vec(),
                indices: points.indices[first..end].to_vec(),
            },
        }
    }
}

/// Memory that is needed, and how it is used.
struct Plan {
    /// Receivers at once.
    piece: usize,
    /// All bytes together, the scene apart.
    forecast: u64,
}

/// What has been found.
struct Results {
    /// One for each vertex or point, NaN where there is no receiver.
    values: Vec<f32>,
    bent: Vec<[f32; 3]>,
    traced: Vec<TracedRay>,
    receivers: usize,
    rays: u64,
    stats: Stats,
}

/// `umbel bake`.
pub(crate) fn bake(args: &BakeArgs, common: &Common) -> Result<(), Error> {
    args.check()?;
    let mut times = Times::default();
    let scene = load_scene(&args.scene, common, &mut times)?;
    let options = args.options(&scene);
    let bake = Bake::new(options)?;
    let occluders = timed(&mut times.load, || occluders(&scene, &args.occluders, common))?;
    let plan = plan(args, &bake, (&scene, &occluders), common)?;
    // Not after hours of work.
    args.outputs().chain(&common.report).try_for_each(|path| check_output(path))?;
    if common.verbose {
        anstream::eprintln!("about {} bytes, {} receivers at once", plan.forecast, plan.piece);
    }
    let triangles = occluders.geometry()?;
    let source = timed(&mut times.receivers, || source(args, &scene))?;
    let found = run(&bake, (&source, &triangles), plan.piece, common, &mut times)?;
    let mut hash = blake3::Hasher::new();
    timed(&mut times.write, || write(args, &scene, &source, (&found, options.polarity), &mut hash))?;
    if common.verbose {
        print_run(&times, &found.stats);
        anstream::eprintln!("{} receivers, {} rays", found.receivers, found.rays);
    }
    let report = Report {
        command: "bake",
        scene: &scene,
        rays: usize::try_from(found.rays).unwrap_or(usize::MAX),
        options: common.options(),
        times: &times,
        stats: found.stats,
        hash: hash.finalize(),
    };
    let more = report_fields(&options, &source, &found, &plan);
    common.report.as_deref().map_or(Ok(()), |path| report.write_with(path, more))
}

/// The scene with what else occludes it.
fn occluders<'a>(scene: &'a Scene, args: &OccluderArgs, common: &Common) -> Result<Occluders<'a>, Error> {
    let mut occluders = Occluders::new(scene);
    for name in &args.scenes {
        occluders.add(&load(name, LoadOptions { drop_non_finite: common.drop_non_finite })?)?;
    }
    if args.ground_plane {
        occluders.add_ground(args.up.unwrap_or(DVec3::Y))?;
    }
    Ok(occluders)
}

/// Decides how many receivers are taken at once, or stops before the start where memory is too short for any number.
fn plan(
    args: &BakeArgs,
    bake: &Bake,
    (scene, occluders): (&Scene, &Occluders<'_>),
    common: &Common,
) -> Result<Plan, Error> {
    let (count, source_bytes, remedy) = match &args.receivers.points {
        // A file that cannot be looked at is refused when it is read.
        Some(path) => {
            let rows = std::fs::metadata(path).map_or(0, |found| found.len()) / ROW_BYTES;
            (rows, rows * POINT_BYTES, "--points")
        }
        None => (scene.positions.len() as u64, vertices_bytes(scene), "scene"),
    };
    let bent = if args.bent.is_some() { 24 } else { 0 };
    let traced =
        if args.dump_rays.is_some() { bake.directions() * 2 * size_of::<TracedRay>() as u64 } else { 0 };
    let fixed = source_bytes + count * (VALUE_BYTES + bent + traced) + occluders.copied_bytes();
    let limit = common.max_memory.or_else(available_bytes).unwrap_or(u64::MAX);
    let left = limit.saturating_sub(fixed + 6 * scene.triangles.len() as u64);
    let left = if common.max_memory.is_some() { left } else { left.min(PIECE_BYTES) };
    let piece = bake.piece(left).min(usize::try_from(count).unwrap_or(usize::MAX)).max(1);
    let forecast = fixed + piece as u64 * bake.receiver_bytes();
    limit_memory(forecast, scene, remedy, common)?;
    Ok(Plan { piece, forecast })
}

/// Bytes that the vertices of a scene take as receivers.
fn vertices_bytes(scene: &Scene) -> u64 {
    scene.positions.len() as u64 * VERTEX_BYTES
}

/// About how many bytes `umbel bake --vertices` needs with the options that it has by default, the scene apart.
pub(crate) fn vertices_forecast(scene: &Scene) -> Result<u64, Error> {
    let bake = Bake::new(BakeOptions::default())?;
    let count = scene.positions.len();
    let piece = bake.piece(PIECE_BYTES).min(count) as u64 * bake.receiver_bytes();
    Ok(vertices_bytes(scene) + count as u64 * VALUE_BYTES + piece + 6 * scene.triangles.len() as u64)
}

/// Reads or makes the receivers.
fn source<'a>(args: &BakeArgs, scene: &'a Scene) -> Result<Source<'a>, Error> {
    let receivers = &args.receivers;
    let Some(path) = &receivers.points else {
        return Ok(Source::Vertices(scene.vertex_receivers()?, scene.positions.len()));
    };
    let triangles = scene.geometry()?;
    Ok(Source::Points(read_points(path, receivers.point_ids.as_deref(), &triangles, receivers.bias)?))
}

/// Bakes piece by piece, as often as the options say.
fn run(
    bake: &Bake,
    (source, triangles): (&Source<'_>, &Triangles<'_>),
    piece: usize,
    common: &Common,
    times: &mut Times,
) -> Result<Results, Error> {
    let options = common.options();
    let count = source.len();
    let progress = progress(u32::try_from(count).unwrap_or(u32::MAX), "receivers", common);
    let (mut frame, mut found) = (Frame::keeping_order(), Results::new(0));
    for _ in 0..common.repeat {
        if !common.keep_order {
            frame = Frame::keeping_order();
        }
        found = Results::new(count);
        let (mut milliseconds, mut receivers_milliseconds) = (0.0, 0.0);
        for first in (0..count).step_by(piece) {
            let end = count.min(first + piece);
            let receivers = timed(&mut receivers_milliseconds, || source.piece(first, end));
            let baked = timed(&mut milliseconds, || bake.run(triangles, &receivers, &mut frame, &options))?;
            found.take(&receivers, baked);
            progress.set_position(end as u64);
        }
        if times.engine.is_empty() {
            times.receivers += receivers_milliseconds;
        }
        times.engine.push(milliseconds);
    }
    progress.finish_and_clear();
    Ok(found)
}

impl Results {
    /// Nothing yet.
    fn new(count: usize) -> Self {
        Self {
            values: vec![f32::NAN; count],
            bent: Vec::new(),
            traced: Vec::new(),
            receivers: 0,
            rays: 0,
            stats: Stats::default(),
        }
    }

    /// Puts the values of a piece in their places.
    fn take(&mut self, receivers: &BakeReceivers, baked: umbel::Baked) {
        let places = || receivers.indices.iter().map(|&index| index as usize);
        places().zip(&baked.values).for_each(|(place, &value)| self.values[place] = value);
        if !baked.bent.is_empty() {
            self.bent.resize(self.values.len(), [f32::NAN; 3]);
            places().zip(&baked.bent).for_each(|(place, &bent)| self.bent[place] = bent);
        }
        self.traced.extend(baked.traced);
        self.receivers += receivers.len();
        self.rays += baked.rays;
        self.stats = self.stats.then(baked.stats);
    }
}

/// Writes the files that were asked for, and hashes their numbers.
fn write(
    args: &BakeArgs,
    scene: &Scene,
    source: &Source<'_>,
    (found, polarity): (&Results, Polarity),
    hash: &mut blake3::Hasher,
) -> Result<(), Error> {
    let mut hashed = |values: &[f32]| {
        values.iter().for_each(|value| _ = hash.update(&value.to_le_bytes()));
    };
    if let Some(path) = &args.output {
        hashed(&found.values);
        match extension(path).as_str() {
            "npy" => write_npy(path, &[found.values.len()], Array::F32(&found.values))?,
            _ => write_mesh(path, scene, source, (&found.values, polarity))?,
        }
    }
    if let Some(path) = &args.bent {
        // Without any receiver nothing has been found.
        let mut bent = found.bent.clone();
        bent.resize(found.values.len(), [f32::NAN; 3]);
        hashed(bent.as_flattened());
        write_npy(path, &[bent.len(), 3], Array::F32(bent.as_flattened()))?;
    }
    if let Some(path) = &args.dump_rays {
        let numbers = found.traced.as_flattened();
        hashed(numbers);
        write_npy(path, &[found.traced.len(), 8], Array::F32(numbers))?;
    }
    Ok(())
}

/// Writes values on the scene itself, or on points without faces.
fn write_mesh(
    path: &Path,
    scene: &Scene,
    source: &Source<'_>,
    (values, polarity): (&[f32], Polarity),
) -> Result<(), Error> {
    let name = if polarity == Polarity::Openness { "openness" } else { "occlusion" };
    match source {
        Source::Vertices(..) => write_ply_mesh(path, scene, name, values),
        Source::Points(points) => {
            let positions = points.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point).collect();
            write_ply_mesh(path, &Scene { positions, ..Scene::default() }, name, values)
        }
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
        "of": if matches!(source, Source::Vertices(..)) { "vertices" } else { "points" },
        "values": found.values.len(),
        "receivers": found.receivers,
        "rays_per_receiver": options.rays,
        "set": match options.set {
            SampleSet::Shared => "shared",
            SampleSet::Interleaved => "interleaved",
            SampleSet::Independent => "independent",
        },
        "weighting": if options.weighting == Weighting::Cosine { "cosine" } else { "uniform" },
        "max_distance": options.reach.max_distance,
        "falloff": if options.reach.falloff == Falloff::Linear { "linear" } else { "none" },
        "polarity": if options.polarity == Polarity::Openness { "openness" } else { "occlusion" },
        "seed": options.seed,
        "receivers_at_once": plan.piece,
        "forecast_bytes": plan.forecast,
    });
    Map::from_iter([("bake".to_owned(), bake)])
}
