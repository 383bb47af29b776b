//! `umbel-bench reyes`: a displaced sheet that is diced while it is looked at, against the same triangles made beforehand.
//!
//! The sheet is a square with waves of height, seen from above at an angle so that it fills the picture. `umbel-reyes` makes
//! micropolygons and samples them; all others get the triangles that a pencil's density asks for, off the picture too, as a
//! mesh that is there already. The time of making it is told, and counts for nobody.

use serde_json::json;
use umbel::glam::DVec3;
use umbel::{
    Aabb, Dicing, Domain, Film, GridFilm, OnDemand, Options, Origin, Pencil, SurfaceHits,
    closest_hit_on_demand, dice_all,
};

use crate::Result;
use crate::answer::Hits;
use crate::cli::{Common, ReyesArgs};
use crate::engine::{Engine, Times, Variant, timed};
use crate::engines::Engines;
use crate::picture::Picture;
use crate::subject::Model;
use crate::{machine, report, rounds, table};

/// The side of the sheet, the height of its waves, and waves along a side.
const SIDE: f64 = 10.0;
const HEIGHT: f64 = 0.05;
const WAVES: f64 = 40.0;

/// A displaced square.
#[derive(Debug, Clone, Copy)]
struct Sheet;

/// A wave from 0 to 1: parabolas.
#[inline(always)]
fn wave(x: f64) -> f64 {
    let part = x * WAVES - (x * WAVES).floor();
    4.0 * part * (1.0 - part)
}

impl OnDemand for Sheet {
    type Object = ();

    fn roots(&self) -> Vec<()> {
        vec![()]
    }

    fn bounds(&self, (): &(), domain: Domain) -> Aabb {
        let [[x0, x1], [z0, z1]] = [domain.u, domain.v].map(|side| side.map(|t| ((t - 0.5) * SIDE) as f32));
        Aabb { lo: [x0, 0.0, z0], hi: [x1, HEIGHT as f32, z1] }
    }

    fn expand(&self, (): &(), _: f64, _: &mut Vec<()>) -> bool {
        false
    }

    fn evaluate(&self, (): &(), parameters: &[[f64; 2]], points: &mut Vec<[f32; 3]>) {
        points.extend(parameters.iter().map(|&[u, v]| {
            let height = (wave(u) + wave(v)) * (0.5 * HEIGHT);
            [(u - 0.5) * SIDE, height, (v - 0.5) * SIDE].map(|x| x as f32)
        }));
    }

    fn id(&self, (): &()) -> u32 {
        0
    }
}

/// What looks at the sheet.
fn pencil((width, height): (u32, u32)) -> Result<Pencil> {
    let forward = DVec3::new(0.0, -1.0, -1.0);
    let half = 1.0 / f64::from(width);
    let (right, up) = (DVec3::X * half, DVec3::new(0.0, 0.5, -0.5).normalize() * half);
    let film = GridFilm::new(width, height, forward, right, up)?;
    Ok(Pencil::new(Origin::Point(DVec3::new(0.0, 4.0, 4.0)), vec![Film::Grid(film)])?)
}

/// umbel, with nothing but the rule.
#[derive(Debug)]
struct OnTheWay {
    dicing: Dicing,
    seen: SurfaceHits,
}

impl Variant for OnTheWay {
    fn name(&self) -> &str {
        "umbel-reyes"
    }
}

impl Engine<Picture> for OnTheWay {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let see = || closest_hit_on_demand(&Sheet, &picture.pencil, &self.dicing, &Options::default());
        let (trace, seen) = timed(see);
        (self.seen, _) = seen?;
        answer.ts.copy_from_slice(self.seen.ts());
        // The sheet is one surface; the others tell triangles.
        answer.ids.copy_from_slice(self.seen.ids());
        Ok(Times { build: 0.0, trace })
    }
}

/// Measures every shading rate.
pub(crate) fn run(args: &ReyesArgs, common: &Common) -> Result<()> {
    let wanted = |name: &str| args.engines.is_empty() || args.engines.iter().any(|start| name.starts_with(start));
    let engines = Engines::open(common, &wanted)?;
    let (machine, versions) = (machine::machine(), engines.versions());
    println!("{machine}\n{versions}");
    let mut subjects = Vec::new();
    for &shading_rate in &args.shading_rate {
        let dicing = Dicing { shading_rate };
        let pencil = pencil(args.size)?;
        let (_, stats) = closest_hit_on_demand(&Sheet, &pencil, &dicing, &Options::default())?;
        let (made, diced) = timed(|| dice_all(&Sheet, &pencil, &dicing));
        let diced = diced?;
        let model = Model {
            name: format!("sheet at {shading_rate} pixels"),
            positions: diced.positions().to_vec(),
            triangles: diced.indices().to_vec(),
            dropped: 0,
        };
        println!("{} micropolygons on the way; {} triangles made before in {made:.0} ms", stats.micropolygons, model.triangles.len());
        drop(diced);
        let picture = Picture::new(model, pencil)?;
        let mut prepared = engines.for_pictures(&picture, wanted)?;
        prepared.push(Box::new(OnTheWay { dicing, seen: SurfaceHits::default() }));
        let measured = rounds::measure(&mut prepared, &picture, args.repeat)?;
        let best = rounds::best(&measured);
        table::print(&picture, &measured, &best);
        subjects.push(report::subject(&picture, &measured, &best));
    }
    let head = json!({"schema": 1, "command": "reyes", "machine": machine, "versions": versions});
    args.json.as_deref().map_or(Ok(()), |path| report::write(path, head, "subjects", subjects))
}
