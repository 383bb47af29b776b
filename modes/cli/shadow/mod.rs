//! `umbel shadow`: the maps that lights see, exact masks of pictures, and how far the two are apart.

pub(crate) mod args;
pub(crate) mod dial;
pub(crate) mod files;
pub(crate) mod report;
pub(crate) mod scene;

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value};
use umbel::engine::{Dicing, closest_hit_on_demand};
use umbel::files::available_memory;
use umbel::glam::DVec3;
use umbel::render::{Look, surface_visibility};
use umbel::scene::Shot;
use umbel::shadow::{
    Casters, MaskCounts, Receivers, compare_maps, cube_map, cube_pencil, distances, in_pieces, receivers,
    sun_pencil, surface_distances,
};
use umbel::{Camera, Error, Frame, Lens, NO_TRIANGLE, Origin, Pencil, Stats, Triangles};

use crate::common::Common;
use crate::file_names::FileNames;
use crate::forecast::{CORNERS_BYTES, HIT_BYTES, RECEIVER_BYTES, Rays, SURFACE_HIT_BYTES, Shares, Tally};
use crate::memory::Room;
use crate::options::dial::Goal;
use crate::options::parse::extension;
use crate::report::{Report, Times, timed};
use crate::run::{print, print_run, progress};
use crate::shadow::args::ShadowArgs;
use crate::shadow::dial::Dial;
use crate::shadow::files::{Content, Names, Writer};
use crate::shadow::report::{comparison, is_sun, light_json, map_json};
use crate::shadow::scene::ShadowScene;

/// Bytes of a texel of a map, and of a pixel of a mask.
const DISTANCE_BYTES: u64 = 4;

/// Bytes of a texel while a map is computed: the hit, its distance, and the map.
const MAP_TEXEL_BYTES: u64 = HIT_BYTES + 2 * DISTANCE_BYTES;

/// Bytes of a number in a PNG file before it is compressed: its code, and the colour, gray or in a cross.
const CODE_BYTES: u64 = 1 + 5;

/// Bytes of a pixel's samples that see a surface, and of those that a light reaches.
const COUNT_BYTES: u64 = 2;

/// Bytes of a receiver that is compared: its answers, and its bias once more.
const COMPARED_BYTES: u64 = 16 + 8;

/// Bytes of an id.
const ID_BYTES: u64 = 4;

/// One run of the verb.
struct Run<'a> {
    args: &'a ShadowArgs,
    common: &'a Common,
    scene: &'a ShadowScene,
    /// The triangles that are seen.
    visible: Triangles<'a>,
    casters: Casters<'a>,
    lights: Vec<Origin>,
    times: Times,
    stats: Stats,
    /// Texels of maps, and surfaces that are seen, once for each light.
    rays: usize,
    /// Those of them that were receivers.
    asked: usize,
    hash: blake3::Hasher,
    /// What the report has beyond that of other verbs.
    more: Map<String, Value>,
    /// Texels along one side of the lights' maps.
    map_size: u32,
    /// What the camera sees, pass by pass.
    sight: Frame,
    /// The bytes of the process that were foreseen.
    forecast: u64,
}

/// What a camera sees through one pass.
struct Seen {
    shot: Shot,
    ids: Vec<u32>,
    /// Those of each light.
    receivers: Vec<Receivers>,
}

impl Seen {
    /// How many rays see a surface.
    fn surfaces(&self) -> usize {
        self.ids.iter().filter(|&&id| id != NO_TRIANGLE).count()
    }
}

/// `umbel shadow`.
pub(crate) fn shadow(args: &ShadowArgs, common: &Common) -> Result<(), Error> {
    args.check()?;
    let start = Instant::now();
    let mut times = Times { engine: vec![0.0; common.repeat as usize], ..Times::default() };
    let scene = ShadowScene::load(args, common, &mut times)?;
    let lights = args.lights.shadow_lights(&scene.mesh)?;
    let camera = scene.camera(args)?;
    // A view that sees nothing is refused before anything is written.
    Camera { width: 1, height: 1, ..camera }.shot()?;
    let maps = args.output.as_ref().map(|path| {
        let formats: &[&str] =
            if is_sun(lights[0]) { &["npy", "exr", "png"] } else { &["npy", "exr", "ktx2", "png"] };
        Names::new("-o", path, lights.len(), formats)
    });
    let masks = args.mask.as_ref().map(|path| Names::new("--mask", path, lights.len(), &["npy", "png"]));
    let (maps, masks) = (maps.transpose()?, masks.transpose()?);
    let each = maps.iter().chain(&masks).flat_map(Names::paths);
    FileNames::default().writing(each).writing(&common.report).refuse_collisions()?;
    let (occluders, surfaces) = (scene.occluders()?, scene.casters());
    let forecast = timed(&mut times.check, || check_memory(args, &scene, &camera, &lights, common))?;
    let triangles = occluders.geometry()?;
    let dicing = args.surfaces.made.dicing();
    let casters = Casters { triangles: &triangles, surfaces: &surfaces, dicing };
    let visible = scene.mesh.geometry()?;
    let (stats, hash) = (Stats::default(), blake3::Hasher::new());
    let more = Map::from_iter([(
        "lights".to_owned(),
        lights.iter().map(|&light| light_json(light, scene.mesh.offset)).collect(),
    )]);
    let (scene, map_size) = (&scene, args.map_size());
    let mut run = Run {
        args,
        common,
        scene,
        visible,
        casters,
        lights,
        times,
        stats,
        rays: 0,
        asked: 0,
        hash,
        more,
        map_size,
        sight: Frame::keeping_order(),
        forecast,
    };
    args.dial.goal().map_or(Ok(()), |goal| run.choose(goal, &camera, start))?;
    maps.map_or(Ok(()), |names| run.write_maps(&names))?;
    masks.map_or(Ok(()), |names| run.write_masks(&names, &camera))?;
    if let Some(sizes) = &args.compare {
        run.compare(&sizes.0, &camera)?;
    }
    run.report()
}

impl Run<'_> {
    /// Has the dial choose the size of the lights' maps.
    fn choose(&mut self, goal: Goal, camera: &Camera, start: Instant) -> Result<(), Error> {
        let seen = self.seen(camera, 0, 1)?;
        // The picture is there already.
        let left = Room::beside(&self.scene.mesh).left(self.common);
        let left = left.or_else(available_memory).unwrap_or(u64::MAX);
        let texel = 6 * (MAP_TEXEL_BYTES + DISTANCE_BYTES * (self.lights.len() as u64 - 1));
        let dial = Dial {
            triangles: self.casters.triangles,
            options: self.common.options(),
            lights: &self.lights,
            receivers: &seen.receivers,
            surfaces: seen.surfaces(),
            // In range: it is a root. A reserve for what else there is.
            most: (left as f64 * 0.8 / texel as f64).sqrt() as u32,
            start,
        };
        let choice = dial.choose(goal)?;
        choice.say(self.common);
        self.map_size = choice.setting;
        self.more.insert("dial".into(), choice.json());
        Ok(())
    }

    /// Computes the light's maps and writes them.
    fn write_maps(&mut self, names: &Names) -> Result<(), Error> {
        let size = self.map_size;
        let bounds = self.scene.bounds();
        let pencil = |light: &Origin| match *light {
            Origin::Point(point) => cube_pencil(point, size),
            Origin::Infinity(direction) => sun_pencil(&bounds, -direction, size),
        };
        let pencils: Vec<Pencil> = self.lights.iter().map(pencil).collect::<Result<_, _>>()?;
        let content = if is_sun(self.lights[0]) { Content::Square(size) } else { Content::Cube(size) };
        self.more.insert("map".into(), map_json(size, &pencils));
        let options = self.common.options();
        let mut writer = Writer::new(names, content, self.lights.len(), &mut self.hash);
        let mut frame = Frame::keeping_order();
        for (repeat, milliseconds) in self.times.engine.iter_mut().enumerate() {
            if !self.common.keep_order {
                frame = Frame::keeping_order();
            }
            let is_last = repeat + 1 == self.common.repeat as usize;
            for pencil in &pencils {
                let casters = &self.casters;
                // Surfaces are diced for a map as a whole.
                let pieces =
                    if casters.surfaces.is_empty() { in_pieces(pencil)? } else { vec![pencil.clone()] };
                for pencil in &pieces {
                    let mut stats =
                        timed(milliseconds, || frame.closest_hit(casters.triangles, pencil, &options))?;
                    let mut seen = Vec::new();
                    for &surfaces in casters.surfaces {
                        let see = || closest_hit_on_demand(surfaces, pencil, &casters.dicing, &options);
                        let (hits, more) = timed(milliseconds, see)?;
                        (stats, _) = (stats.then(more), seen.push(hits));
                    }
                    if !is_last {
                        continue;
                    }
                    self.stats = self.stats.then(stats);
                    self.rays += pencil.len();
                    let values = timed(&mut self.times.shade, || {
                        let nearest = distances(casters.triangles, pencil, frame.hits());
                        seen.iter()
                            .fold(nearest, |nearest, hits| nearer(nearest, &surface_distances(pencil, hits)))
                    });
                    timed(&mut self.times.write, || writer.put(&values));
                }
                if is_last {
                    timed(&mut self.times.write, || writer.end())?;
                }
            }
        }
        timed(&mut self.times.write, || writer.finish())
    }

    /// What the camera sees through pass `pass` of `passes`, and the receivers of each light in it.
    fn seen(&mut self, camera: &Camera, pass: u32, passes: u32) -> Result<Seen, Error> {
        let shot = camera.subpixel_shot(pass, passes)?;
        let options = self.common.options();
        if let Some(surface) = &self.scene.surface {
            let dicing = Dicing { keep_corners: true, ..self.casters.dicing };
            let query = || surface_visibility(surface, shot, camera.pixels(), &dicing, &options);
            let (buffer, _) = timed(&mut self.times.camera, query)?;
            let receivers = timed(&mut self.times.receivers, || buffer.receivers(&self.lights))?;
            return Ok(Seen { ids: buffer.hits.ids().to_vec(), shot: buffer.shot, receivers });
        }
        let query = || self.sight.closest_hit(&self.visible, &shot.pencil, &options);
        timed(&mut self.times.camera, query)?;
        let hits = self.sight.hits();
        let leave = || receivers(&self.visible, &shot.pencil, hits, &self.lights);
        let receivers = timed(&mut self.times.receivers, leave)?;
        Ok(Seen { shot, ids: hits.ids().to_vec(), receivers })
    }

    /// Which receivers of each light are in shadow. `repeat` is that of the times.
    fn shadowed(&mut self, seen: &Seen, frame: &mut Frame, repeat: usize) -> Result<Vec<Vec<bool>>, Error> {
        let options = self.common.options();
        let mut all = Vec::new();
        for (&light, Receivers { points, .. }) in self.lights.iter().zip(&seen.receivers) {
            let view = &seen.shot.pencil;
            let query = || self.casters.shadowed(view, (light, points), frame, &options);
            let (shadowed, stats) = timed(&mut self.times.engine[repeat], query)?;
            if repeat + 1 == self.common.repeat as usize {
                self.stats = self.stats.then(stats);
                self.rays += seen.surfaces();
                self.asked += points.len();
            }
            all.push(shadowed);
        }
        Ok(all)
    }

    /// Computes the masks and writes them.
    fn write_masks(&mut self, names: &Names, camera: &Camera) -> Result<(), Error> {
        let samples = self.args.samples;
        let mut counts = MaskCounts::new(camera, self.lights.len());
        let mut frame = Frame::keeping_order();
        let progress = progress(samples, "samples", self.common);
        for pass in 0..samples {
            let seen = self.seen(camera, pass, samples)?;
            let mut shadowed = Vec::new();
            for repeat in 0..self.common.repeat as usize {
                if !self.common.keep_order {
                    frame = Frame::keeping_order();
                }
                shadowed = self.shadowed(&seen, &mut frame, repeat)?;
            }
            counts.add_seen(&seen.shot, &seen.ids);
            for (light, (receivers, shadowed)) in seen.receivers.iter().zip(&shadowed).enumerate() {
                counts.add_lit(&seen.shot, light, receivers, shadowed);
            }
            progress.set_position(u64::from(pass) + 1);
        }
        progress.finish_and_clear();
        let content = match camera.lens {
            Lens::Cube => Content::CubeMask(camera.width),
            _ => Content::Mask(camera.width, camera.height),
        };
        let mut writer = Writer::new(names, content, self.lights.len(), &mut self.hash);
        for light in 0..self.lights.len() {
            let mask = timed(&mut self.times.shade, || counts.mask(light));
            timed(&mut self.times.write, || {
                writer.put(&mask);
                drop(mask);
                writer.end()
            })?;
        }
        timed(&mut self.times.write, || writer.finish())
    }

    /// Prints where cube maps differ from exact shadows.
    fn compare(&mut self, sizes: &[u32], camera: &Camera) -> Result<(), Error> {
        let seen = self.seen(camera, 0, 1)?;
        let surfaces = seen.surfaces();
        let (mut frame, options) = (Frame::keeping_order(), self.common.options());
        let shadowed = self.shadowed(&seen, &mut frame, self.common.repeat as usize - 1)?;
        let (mut rows, mut text) = (Vec::new(), String::new());
        for (index, (&light, shadowed)) in self.lights.iter().zip(&shadowed).enumerate() {
            let Origin::Point(point) = light else { continue };
            let place = point + self.scene.mesh.offset;
            let reached = shadowed.iter().filter(|&&shadowed| !shadowed).count();
            text += &format!(
                "light {index} at {place}: {surfaces} receivers, {reached} lit\n{:>10} {:>19} {:>19} {:>12} {:>12}\n",
                "cube size", "acne", "leaks", "median bias", "largest bias"
            );
            for &size in sizes {
                let (map, _) = cube_map(self.casters.triangles, point, size, &mut frame, &options)?;
                let points = &seen.receivers[index].points;
                let found = compare_maps(self.casters.triangles, &map, points, shadowed);
                let (line, mut row) = comparison(size, surfaces, &found);
                row["light"] = index.into();
                text += &line;
                rows.push(row);
            }
        }
        self.more.insert("compare".into(), rows.into());
        print(&text)
    }

    /// Says what was asked for: times and counters, and the report.
    fn report(mut self) -> Result<(), Error> {
        if self.common.verbose {
            print_run(&self.times, &self.stats);
        }
        self.more.insert("asked".into(), self.asked.into());
        let report = Report {
            command: "shadow",
            scene: &self.scene.mesh,
            rays: self.rays,
            options: self.common.options(),
            times: &self.times,
            stats: self.stats,
            forecast: self.forecast,
            hash: self.hash.finalize(),
        };
        self.common.report.as_deref().map_or(Ok(()), |path| report.write_with(path, self.more))
    }
}

/// The lesser of two distances, texel by texel.
fn nearer(mut nearest: Vec<f32>, others: &[f32]) -> Vec<f32> {
    for (nearest, &other) in nearest.iter_mut().zip(others) {
        *nearest = if other < *nearest { other } else { *nearest };
    }
    nearest
}

/// Stops before the start when too much memory would be needed. Gives the bytes of the process.
fn check_memory(
    args: &ShadowArgs,
    scene: &ShadowScene,
    camera: &Camera,
    lights: &[Origin],
    common: &Common,
) -> Result<u64, Error> {
    let (mesh, room) = (&scene.mesh, Room::beside(&scene.mesh));
    let is_picture = args.mask.is_some() || args.compare.is_some() || args.dial.goal().is_some();
    let look = Look { lights: lights.to_vec(), ..Look::default() };
    let shares = match is_picture && !args.is_of_surface() {
        true => Shares::of(mesh, camera, &look, &common.options())?,
        false => Shares::whole(lights.len()),
    };
    let corners = if args.is_of_surface() { SURFACE_HIT_BYTES - HIT_BYTES + CORNERS_BYTES } else { 0 };
    let rays = Rays::of_camera(camera);
    let rays = Rays { hit_bytes: rays.hit_bytes + corners, ..rays };
    let triangles = scene.triangles();
    // The dial chooses no size that is too large.
    let is_size_known = args.output.is_some() && args.dial.goal().is_none();
    let maps = if is_size_known { map_bytes(args, lights, scene.casters().len() as u64)? } else { 0 };
    let mut tally = Tally::default();
    if is_picture {
        tally.keep(rays.engine(triangles, common.path));
        masks(args, (&rays, &shares), &mut tally);
    }
    let compared = args.compare.iter().flat_map(|sizes| &sizes.0).max();
    let [asked, _] = shares.receivers(rays.rays);
    if let Some(&size) = compared {
        // The receivers, and what is found for each, are there as well.
        let found = asked + asked / RECEIVER_BYTES * COMPARED_BYTES + rays.rays * ID_BYTES;
        tally.pass(square(size) * 6 * MAP_TEXEL_BYTES + found);
    }
    let remedy = match (maps >= tally.most, is_sun(lights[0])) {
        (false, _) => "--size",
        (true, true) => "--map-size",
        (true, false) => "--cube-size",
    };
    room.limit(maps.max(tally.most), remedy, common)
}

fn square(size: u32) -> u64 {
    u64::from(size) * u64::from(size)
}

/// What the maps of lights take, one after the other.
fn map_bytes(args: &ShadowArgs, lights: &[Origin], surfaces: u64) -> Result<u64, Error> {
    let faces = if is_sun(lights[0]) { 1 } else { 6 };
    let (texels, lights) = (faces * square(args.map_size()), lights.len() as u64);
    let output = args.output.as_deref().unwrap_or(Path::new(""));
    // Surfaces are diced for a map as a whole.
    let cube = (faces == 6 && surfaces == 0).then(|| cube_pencil(DVec3::ZERO, args.map_size()));
    // A cube of too many rays is refused for its size.
    let asked = match cube {
        Some(Ok(cube)) => in_pieces(&cube)?.first().map_or(0, |piece| piece.len() as u64),
        _ => texels,
    };
    let mut tally = Tally::default();
    // One array holds the maps of all lights.
    let together = if extension(output) == "npy" { lights } else { 1 };
    tally.keep(asked * HIT_BYTES + (together - 1) * texels * DISTANCE_BYTES);
    tally.pass(asked * (surfaces * SURFACE_HIT_BYTES + DISTANCE_BYTES * (1 + surfaces.min(1))));
    tally.keep(texels * DISTANCE_BYTES);
    tally.pass(asked * DISTANCE_BYTES);
    if extension(output) == "png" {
        tally.pass(texels * CODE_BYTES);
    }
    Ok(tally.most)
}

/// What the masks of a picture take: what is seen, its receivers, and counts of samples.
fn masks(args: &ShadowArgs, (rays, shares): (&Rays, &Shares), tally: &mut Tally) {
    let lights = shares.lit.len() as u64;
    let [receivers, ordered] = shares.receivers(rays.rays);
    tally.keep(rays.bytes());
    if args.mask.is_some() {
        let counted = shares.hit + shares.lit.iter().sum::<f64>();
        tally.keep((counted * (rays.pixels * COUNT_BYTES) as f64) as u64);
    }
    // The ids are copied, and each receiver has an answer.
    let ids = rays.rays * ID_BYTES;
    tally.keep(ids + receivers + receivers / RECEIVER_BYTES);
    tally.pass(ordered);
    tally.free(ids + receivers + receivers / RECEIVER_BYTES);
    let is_npy = args.mask.as_deref().is_some_and(|path| extension(path) == "npy");
    // The mask of a light joins those of the others.
    let numbers = if is_npy { lights + 1 } else { 2 };
    tally.pass(
        rays.pixels * (numbers * DISTANCE_BYTES).max(DISTANCE_BYTES + if is_npy { 0 } else { CODE_BYTES }),
    );
}
