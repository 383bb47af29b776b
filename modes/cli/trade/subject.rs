//! What `umbel trade` runs: the work of one verb, again and again, on a scene that is read once.
//!
//! Times are those from the loaded scene to finished numbers. Reading and writing files, and finding the receivers that all
//! settings share, are left out.

use rayon::prelude::*;
use umbel::bake::{Bake, BakeOptions, SampleSet};
use umbel::formats::SurfaceScene;
use umbel::glam::DVec3;
use umbel::render::{preview_lit, surface_preview, surface_visibility};
use umbel::scene::Shot;
use umbel::shadow::{CubeMap, MaskCounts, Receivers, cube_map, receivers};
use umbel::{Camera, Error, Frame, Hits, Options, Origin, Scene, Triangles, VisibilityBuffer, closest_hit};

use crate::args::{Cli, Command, RenderArgs};
use crate::bake::run;
use crate::bake::source::{Source, Values};
use crate::common::Common;
use crate::options::dial::REFERENCE_SEED;
use crate::report::{Times, timed};
use crate::reyes::args::ReyesArgs;
use crate::shadow::args::ShadowArgs;

/// What a setting answers, and how long that took.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    /// Numbers of items: of pixels or of receivers.
    pub(crate) values: Vec<f32>,
    /// The triangles that pixels see, where that is asked.
    pub(crate) ids: Vec<u32>,
    /// Their t.
    pub(crate) ts: Vec<f32>,
    pub(crate) milliseconds: f64,
}

impl Answer {
    /// BLAKE3 of all numbers.
    pub(crate) fn hash(&self) -> blake3::Hash {
        let mut hash = blake3::Hasher::new();
        for id in &self.ids {
            hash.update(&id.to_le_bytes());
        }
        for value in self.ts.iter().chain(&self.values) {
            hash.update(&value.to_le_bytes());
        }
        hash.finalize()
    }
}

/// The work of a verb.
pub(crate) enum Subject<'a> {
    Render(&'a Scene),
    Shadow(ShadowSubject<'a>),
    Bake(BakeSubject<'a>),
    Reyes(&'a SurfaceScene),
}

impl Subject<'_> {
    /// Does what a command line says.
    pub(crate) fn run(&self, cli: &Cli) -> Result<Answer, Error> {
        match (self, &cli.command) {
            (Self::Render(scene), Command::Render(args)) => render(scene, args, &cli.common),
            (Self::Shadow(subject), Command::Shadow(args)) => subject.run(args, &cli.common.options()),
            (Self::Bake(subject), Command::Bake(args)) => {
                subject.run(args.options(subject.scene), &cli.common)
            }
            (Self::Reyes(scene), Command::Reyes(args)) => reyes(scene, args, &cli.common),
            _ => Err(Error::Usage("trade runs one verb at a time".into())),
        }
    }

    /// What errors are measured against: many samples or rays, decided exactly; for shadows the exact mask.
    pub(crate) fn reference(&self, cli: &Cli) -> Result<Answer, Error> {
        match (self, &cli.command) {
            (Self::Bake(subject), Command::Bake(args)) => {
                let options = args.options(subject.scene);
                // Directions unrelated to those that are measured.
                let seed = options.seed ^ REFERENCE_SEED;
                subject.run(
                    BakeOptions { set: SampleSet::Shared, seed, depth_maps: None, ..options },
                    &cli.common,
                )
            }
            _ => self.run(cli),
        }
    }

    /// Numbers of an item.
    pub(crate) fn channels(&self) -> usize {
        if matches!(self, Self::Render(_) | Self::Reyes(_)) { 3 } else { 1 }
    }
}

/// Pixels: ids, t, and the linear preview.
fn render(scene: &Scene, args: &RenderArgs, common: &Common) -> Result<Answer, Error> {
    let (camera, lights) = (args.camera.camera(scene)?, args.lights.lights(scene.offset)?);
    let (shot, triangles) = (camera.shot()?, scene.geometry()?);
    let (options, samples) = (common.options(), args.picture.samples);
    let pixels = camera.width as usize * camera.rows() as usize;
    let mut milliseconds = 0.0;
    let (buffer, values) = timed(&mut milliseconds, || -> Result<_, Error> {
        let mut frame = Frame::new();
        frame.closest_hit(&triangles, &shot.pencil, &options)?;
        let buffer = VisibilityBuffer::new(shot, pixels, frame);
        let values = preview_lit(scene, &camera, &buffer, samples, &lights, &options, |_| ())?;
        Ok((buffer, values))
    })?;
    Ok(Answer { values, ids: buffer.ids(), ts: buffer.ts(), milliseconds })
}

/// Pixels of surfaces on demand: ids, t, and the linear preview.
fn reyes(scene: &SurfaceScene, args: &ReyesArgs, common: &Common) -> Result<Answer, Error> {
    let camera = args.framing(scene)?;
    let shot = camera.shot()?;
    let (options, dicing, look) = (common.options(), args.dicing(), args.look(scene.offset)?);
    let mut milliseconds = 0.0;
    let (buffer, values) = timed(&mut milliseconds, || -> Result<_, Error> {
        let (buffer, _) = surface_visibility(scene, shot, camera.pixels(), &dicing, &options)?;
        let seen = surface_preview(scene, &camera, &buffer, &look, (&dicing, &options), |_| ())?;
        Ok((buffer, seen.linear))
    })?;
    let (ids, ts) = (buffer.hits.ids().to_vec(), buffer.hits.ts().to_vec());
    Ok(Answer { values, ids, ts, milliseconds })
}

/// What a camera sees, for shadows on it.
pub(crate) struct ShadowSubject<'a> {
    pub(crate) camera: Camera,
    pub(crate) lights: Vec<Origin>,
    triangles: Triangles<'a>,
    shot: Shot,
    hits: Hits,
    receivers: Vec<Receivers>,
}

impl<'a> ShadowSubject<'a> {
    pub(crate) fn new(scene: &'a Scene, args: &ShadowArgs) -> Result<Self, Error> {
        if args.is_of_surface() || !args.occluders.is_empty() {
            return Err(Error::Usage(
                "trade measures the shadows of a mesh: leave out --subdivide, --displace and --occluders"
                    .into(),
            ));
        }
        let (camera, lights) = (args.camera.camera_beside_cube(scene)?, args.lights.shadow_lights(scene)?);
        let (triangles, shot) = (scene.geometry()?, camera.shot()?);
        let (hits, _) = closest_hit(&triangles, &shot.pencil, &Options::default())?;
        let receivers = receivers(&triangles, &shot.pencil, &hits, &lights)?;
        Ok(Self { camera, lights, triangles, shot, hits, receivers })
    }

    /// The mask of each light: exact, or looked up in a cube map where the light's map is asked for.
    fn run(&self, args: &ShadowArgs, options: &Options) -> Result<Answer, Error> {
        let mut counts = MaskCounts::new(&self.camera, self.lights.len());
        counts.add_seen(&self.shot, self.hits.ids());
        let mut milliseconds = 0.0;
        let mut frame = Frame::keeping_order();
        for (index, (&light, receivers)) in self.lights.iter().zip(&self.receivers).enumerate() {
            let shadowed = timed(&mut milliseconds, || match light {
                Origin::Point(point) if args.output.is_some() => {
                    let size = args.map_size();
                    let (map, _) = cube_map(&self.triangles, point, size, &mut frame, options)?;
                    Ok(self.looked_up(&map, receivers))
                }
                _ => Ok::<_, Error>(frame.shadowed(&self.triangles, light, &receivers.points, options)?.0),
            })?;
            counts.add_lit(&self.shot, index, receivers, &shadowed);
        }
        let values = (0..self.lights.len()).flat_map(|light| counts.mask(light)).collect();
        Ok(Answer { values, milliseconds, ..Answer::default() })
    }
}

impl ShadowSubject<'_> {
    /// Which receivers a cube map calls shadowed.
    fn looked_up(&self, map: &CubeMap, receivers: &Receivers) -> Vec<bool> {
        let is_shadowed = |receiver: &umbel::engine::Receiver| {
            let point = DVec3::from_array(receiver.point.map(f64::from));
            !map.is_lit(point, self.triangles.normal(receiver.triangle))
        };
        receivers.points.par_iter().map(is_shadowed).collect()
    }
}

/// Receivers, made anew for each run as `bake` makes them, and what occludes them.
pub(crate) struct BakeSubject<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) source: Source<'a>,
    pub(crate) triangles: Triangles<'a>,
    /// Units at once.
    pub(crate) piece: usize,
}

impl BakeSubject<'_> {
    /// The values in their places, NaN where there is no receiver.
    fn run(&self, options: BakeOptions, common: &Common) -> Result<Answer, Error> {
        let (bake, mut times) = (Bake::new(options)?, Times::default());
        let pieces = run::Pieces { piece: self.piece, with_bent: false, near: None };
        let found = run::run(&bake, (&self.source, &self.triangles), &pieces, common, &mut times)?;
        let values = match found.values {
            Values::List(values, _) => values,
            Values::Image(image, _) => image.values().as_flattened().to_vec(),
        };
        Ok(Answer { values, milliseconds: times.engine[0], ..Answer::default() })
    }
}
