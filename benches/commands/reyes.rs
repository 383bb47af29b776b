//! `umbel-bench reyes`: surfaces that are diced while they are looked at, against the same triangles made beforehand.
//!
//! `reyes` has nothing but the rule. All others get the triangles that the pencil's density asks for, hidden ones and those
//! outside of the picture too, as a mesh that is there already. The time of making that mesh is told, and counts for nobody.
//! Ids are compared by surface: a triangle stands for the surface that it was made of.

use std::path::Path;
use std::rc::Rc;

use serde_json::{Value, json};
use umbel::engine::{Dicing, OnDemand, SurfaceHits, closest_hit_on_demand, dice_all};
use umbel::formats::{SurfaceOptions, SurfaceScene, load_surfaces, surface_view};
use umbel::glam::DVec3;
use umbel::surfaces::{Displacement, Noise, Relief};
use umbel::{Camera, Lens, Options, Pencil, Stats};

use crate::Result;
use crate::commands::cli::{Common, ReyesArgs};
use crate::engines::Engines;
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::engines::rounds;
use crate::engines::rounds::{Best, Measured};
use crate::machine;
use crate::report;
use crate::report::table;
use crate::subjects::Model;
use crate::subjects::answer::{Hits, MISS};
use crate::subjects::picture::Picture;
use crate::subjects::sheets::Sheets;
use crate::subjects::views::{Folder, View};

/// Scenes where none is named.
const SCENES: [&str; 3] = ["sheet", "builtin:teapot", "builtin:terrain"];
/// A cage is displaced by noise: cells along the diagonal of its box, and the height over it.
const CELLS: f64 = 12.0;
const HEIGHT: f64 = 0.04;

/// umbel, with nothing but the rule.
struct OnTheWay<'a, S> {
    surfaces: &'a S,
    dicing: Dicing,
    seen: SurfaceHits,
}

impl<S> Variant for OnTheWay<'_, S> {
    fn name(&self) -> &str {
        "reyes"
    }
}

impl<S: OnDemand> Engine<Picture> for OnTheWay<'_, S> {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let see = || self.seen.find(self.surfaces, &picture.pencil, &self.dicing, &Options::default());
        let (trace, found) = timed(see);
        found?;
        answer.ids.copy_from_slice(self.seen.ids());
        answer.ts.copy_from_slice(self.seen.ts());
        Ok(Times { build: 0.0, trace })
    }
}

/// Another engine, whose triangles are told as the surfaces that they were made of.
struct BySurface {
    engine: Box<dyn Engine<Picture>>,
    /// The surface of each triangle.
    surfaces: Rc<Vec<u32>>,
}

impl Variant for BySurface {
    fn name(&self) -> &str {
        self.engine.name()
    }

    fn prebuilt(&self) -> bool {
        self.engine.prebuilt()
    }
}

impl Engine<Picture> for BySurface {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let times = self.engine.run(picture, answer)?;
        for id in answer.ids.iter_mut().filter(|id| **id != MISS) {
            *id = self.surfaces[*id as usize];
        }
        Ok(times)
    }
}

/// Measures every scene at every shading rate.
pub(crate) fn run(args: &ReyesArgs, common: &Common) -> Result<()> {
    let engines = Engines::open(common, |name| args.wanted(name))?;
    let (machine, versions) = (machine::machine(), engines.versions());
    println!("{machine}\n{versions}");
    let folder = args.folder.as_deref().map(Folder::read).transpose()?;
    let scenes: Vec<String> = match args.scenes.is_empty() {
        true => SCENES.map(str::to_owned).to_vec(),
        false => args.scenes.clone(),
    };
    let mut subjects = Vec::new();
    for name in &scenes {
        if name == "sheet" {
            let sheets = Sheets::new(1, args.size);
            subjects.extend(measure(name, &sheets, &sheets.pencil(args.size)?, &engines, args)?);
        } else {
            let (scene, camera) = find(name, folder.as_ref(), args.size)?;
            subjects.extend(measure(&scene.name, &scene.surfaces, &camera.shot()?.pencil, &engines, args)?);
        }
    }
    let head = json!({"schema": 1, "command": "reyes", "machine": machine, "versions": versions});
    args.json.as_deref().map_or(Ok(()), |path| report::write(path, head, "subjects", subjects))
}

/// Surfaces and a camera: a rule, a `.bpt` file, or any mesh as a cage that is subdivided and displaced.
fn find(name: &str, folder: Option<&Folder>, size: (u32, u32)) -> Result<(SurfaceScene, Camera)> {
    let rule = name.strip_prefix("builtin:").filter(|rule| ["teapot", "terrain", "field"].contains(rule));
    let is_bpt = Path::new(name).extension().is_some_and(|extension| extension == "bpt");
    let (scene, mut camera) = if rule.is_some() || is_bpt {
        let scene = load_surfaces(name, SurfaceOptions::default())?;
        let (lens, from) = (Lens::Pinhole { fov: 45.0 }, DVec3::new(1.0, 0.7, 1.0));
        let mut camera = Camera::framing(&scene.bounds(), from, lens, size.0, size.1);
        if let Some(view) = rule.and_then(surface_view) {
            let [eye, target, up] = [view.eye, view.target, view.up].map(DVec3::from_array);
            camera = Camera { eye, target, up, lens: Lens::Pinhole { fov: view.fov_degrees }, ..camera };
        }
        (scene, camera)
    } else {
        let view = View::find(name, folder)?;
        let [x, y, z] = view.scene.bounds().extent();
        let diagonal = (x * x + y * y + z * z).sqrt();
        let relief = Relief::Noise(Noise::new(CELLS / diagonal, 1));
        let displacement = Displacement { relief, height: HEIGHT * diagonal };
        let options = SurfaceOptions { subdivide: true, displacement, ..SurfaceOptions::default() };
        (SurfaceScene::of_mesh(view.scene.clone(), options)?, view.camera(size))
    };
    // The other engines know no other eyes.
    camera.eye = camera.eye.as_vec3().as_dvec3();
    Ok((scene, camera))
}

/// Measures one scene at every shading rate.
fn measure<S: OnDemand>(
    name: &str,
    surfaces: &S,
    pencil: &Pencil,
    engines: &Engines,
    args: &ReyesArgs,
) -> Result<Vec<Value>> {
    let mut subjects = Vec::new();
    for &shading_rate in &args.shading_rate {
        let dicing = Dicing { shading_rate, ..Dicing::default() };
        let (_, stats) = closest_hit_on_demand(surfaces, pencil, &dicing, &Options::default())?;
        let (made, diced) = timed(|| dice_all(surfaces, pencil, &dicing));
        let diced = diced?;
        let by_surface = Rc::new(diced.surfaces().to_vec());
        let model = Model {
            name: format!("{name}, shading rate {shading_rate}"),
            positions: diced.positions().to_vec(),
            triangles: diced.indices().to_vec(),
            group_ends: vec![diced.indices().len() as u32],
            dropped: 0,
        };
        drop(diced);
        let picture = Picture::new(model, pencil.clone())?;
        let mut prepared: Vec<Box<dyn Engine<Picture> + '_>> =
            vec![Box::new(OnTheWay { surfaces, dicing, seen: SurfaceHits::default() })];
        let others = engines.for_pictures(&picture, |name| args.wanted(name))?;
        let by_surface = |engine| BySurface { engine, surfaces: Rc::clone(&by_surface) };
        prepared.extend(
            others.into_iter().map(|engine| Box::new(by_surface(engine)) as Box<dyn Engine<Picture>>),
        );
        let measured = rounds::measure(&mut prepared, &picture, args.repeat)?;
        let best = rounds::best(&measured);
        table::print_rows(&picture, &measured);
        let found = Found { stats, made, measured: &measured, best: &best };
        found.print();
        let mut subject = report::subject(&picture, &measured, &best);
        found.add_to(&mut subject);
        subjects.push(subject);
    }
    Ok(subjects)
}

/// What is told of a scene beside the table.
struct Found<'a> {
    stats: Stats,
    /// Milliseconds that it took to make all triangles.
    made: f64,
    measured: &'a [Measured],
    best: &'a [Best],
}

impl Found<'_> {
    /// The median of umbel with nothing but the rule.
    fn own(&self) -> f64 {
        self.measured.first().map_or(f64::NAN, |reyes| reyes.median(Times::total))
    }

    /// Million micropolygons per second and thread.
    fn speed(&self) -> f64 {
        self.stats.micropolygons as f64 / self.own() / 1e3 / rayon::current_num_threads() as f64
    }

    fn print(&self) {
        let Stats { micropolygons, surfaces_diced, .. } = self.stats;
        println!(
            "reyes: {micropolygons} micropolygons in {surfaces_diced} grids, {:.1} million a second and thread; the triangles of the others took {:.0} ms to make",
            self.speed(),
            self.made
        );
        for best in self.best.iter().filter(|best| best.family != "reyes") {
            if let Some((ms, name)) = &best.total {
                let (alone, all) = (ms / self.own(), (ms + self.made) / self.own());
                println!(
                    "best {}: {ms:.1} ms = {alone:.2} reyes ({name}); {all:.2} with making the triangles",
                    best.family
                );
            }
        }
    }

    fn add_to(&self, subject: &mut Value) {
        subject["made_ms"] = json!(self.made);
        subject["million_micropolygons_per_s_and_thread"] = json!(self.speed());
        subject["stats"] =
            self.stats.counters().into_iter().map(|(name, count)| (name.to_owned(), json!(count))).collect();
    }
}
