//! `umbel shadow`: the maps that lights see, exact masks of pictures, and how far the two are apart.

pub(crate) mod args;
pub(crate) mod dial;
pub(crate) mod files;
pub(crate) mod report;
pub(crate) mod scene;

use std::time::Instant;

use serde_json::{Map, Value};
use umbel::engine::{Dicing, closest_hit_on_demand};
use umbel::files::available_memory;
use umbel::render::surface_visibility;
use umbel::scene::Shot;
use umbel::shadow::{
    Casters, MaskCounts, Receivers, compare_maps, cube_map, cube_pencil, distances, in_pieces, receivers,
    sun_pencil, surface_distances,
};
use umbel::{Camera, Error, Frame, Lens, NO_TRIANGLE, Origin, Pencil, Scene, Stats, Triangles};

use crate::common::Common;
use crate::file_names::FileNames;
use crate::memory::{CORNERS_BYTES, SURFACE_PIXEL_BYTES};
use crate::memory::{MAP_TEXEL_BYTES, MASK_PIXEL_BYTES};
use crate::memory::{SCATTERED_BYTES, SHADOW_BYTES, limit_memory};
use crate::options::dial::Goal;
use crate::report::{Report, Times, timed};
use crate::run::{print, print_run, progress};
use crate::shadow::args::ShadowArgs;
use crate::shadow::dial::Dial;
use crate::shadow::files::{Content, Names, Writer};
use crate::shadow::report::{comparison, is_sun, light_json, map_json};
use crate::shadow::scene::ShadowScene;

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
    check_memory(args, &scene.mesh, &camera, &lights, common)?;

    let (occluders, surfaces) = (scene.occluders()?, scene.casters());
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
        let limit = self.common.max_memory.or_else(available_memory).unwrap_or(u64::MAX);
        let texel = 6 * (MAP_TEXEL_BYTES + 4 * self.lights.len() as u64);
        let left =
            limit.saturating_sub(u64::from(camera.width) * u64::from(camera.rows()) * MASK_PIXEL_BYTES);
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
        let mut writer = Writer::new(names, content, &mut self.hash);
        let mut frame = Frame::keeping_order();
        for (repeat, milliseconds) in self.times.engine.iter_mut().enumerate() {
            if !self.common.keep_order {
                frame = Frame::keeping_order();
            }
            let is_last = repeat + 1 == self.common.repeat as usize;
            for pencil in &pencils {
                let casters = &self.casters;
                let mut values = Vec::with_capacity(if is_last { pencil.len() } else { 0 });
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
                    values.append(&mut timed(&mut self.times.shade, || {
                        let nearest = distances(casters.triangles, pencil, frame.hits());
                        seen.iter()
                            .fold(nearest, |nearest, hits| nearer(nearest, &surface_distances(pencil, hits)))
                    }));
                }
                if is_last {
                    timed(&mut self.times.write, || writer.put(values))?;
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
        let mut writer = Writer::new(names, content, &mut self.hash);
        for light in 0..self.lights.len() {
            let mask = timed(&mut self.times.shade, || counts.mask(light));
            timed(&mut self.times.write, || writer.put(mask))?;
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

/// Stops before the start when too much memory would be needed.
fn check_memory(
    args: &ShadowArgs,
    scene: &Scene,
    camera: &Camera,
    lights: &[Origin],
    common: &Common,
) -> Result<(), Error> {
    let square = |size: u32| u64::from(size) * u64::from(size);
    let count = lights.len() as u64;
    let faces = if is_sun(lights[0]) { 1 } else { 6 };
    // The dial chooses no size that is too large.
    let is_size_known = args.output.is_some() && args.dial.goal().is_none();
    let maps =
        if is_size_known { square(args.map_size()) * faces * (MAP_TEXEL_BYTES + 4 * count) } else { 0 };
    let picture = args.mask.is_some() || args.compare.is_some() || args.dial.goal().is_some();
    let scattered = if camera.lens.bends_lines() { SCATTERED_BYTES } else { 0 };
    let surface = if args.is_of_surface() { SURFACE_PIXEL_BYTES + CORNERS_BYTES } else { 0 };
    let pixel = MASK_PIXEL_BYTES + (SHADOW_BYTES + 6) * count + scattered + surface;
    let pixels = u64::from(camera.width) * u64::from(camera.rows());
    let masks = if picture { pixels * pixel } else { 0 };
    let compared =
        args.compare.iter().flat_map(|sizes| &sizes.0).map(|&size| square(size) * 6 * MAP_TEXEL_BYTES);
    let largest = maps.max(masks + compared.max().unwrap_or(0));
    let remedy = match (maps >= masks, is_sun(lights[0])) {
        (false, _) => "--size",
        (true, true) => "--map-size",
        (true, false) => "--cube-size",
    };
    limit_memory(largest, scene, remedy, common)
}
