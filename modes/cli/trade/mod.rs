//! `umbel trade`: measures what each setting of a verb costs and how wrong it is, on the user's scene and machine.
//!
//! Every setting first runs once to warm up, which also gives its answer; then all take turns for some rounds, so that what
//! disturbs the machine disturbs all alike. Errors are those against a reference made by the same program. A setting that may
//! change the time only is compared byte by byte with the default.

pub(crate) mod args;
pub(crate) mod page;
pub(crate) mod picture;
pub(crate) mod plot;
pub(crate) mod report;
pub(crate) mod settings;
pub(crate) mod subject;
pub(crate) mod words;

use std::ffi::{OsStr, OsString};

use clap::Parser as _;
use clap_lex::OsStrExt as _;
use umbel::bake::Bake;
use umbel::files::{check_output, write_atomically};
use umbel::measure::{Differences, pareto_front};
use umbel::{Error, Origin, Scene};

use crate::args::{Cli, Command};
use crate::bake::source::Source;
use crate::bake::{make_plan, occluders, set_name};
use crate::common::Common;
use crate::forecast::{HIT_BYTES, RECEIVER_BYTES, Rays, SURFACE_HIT_BYTES};
use crate::memory::Room;
use crate::report::Times;
use crate::reyes::args::ReyesArgs;
use crate::run::{load_scene, progress};
use crate::trade::args::{ModeArg, TradeArgs};
use crate::trade::picture::Canvas;
use crate::trade::report::{Findings, Measured, Rounded};
use crate::trade::settings::{Changes, REFERENCE_RATE, Setting, settings};
use crate::trade::subject::{Answer, BakeSubject, ShadowSubject, Subject};

/// Bytes of the numbers of a pixel of a picture: those of a setting, of the default and of the reference, a colour in f32, id and t.
const ITEM_BYTES: u64 = 3 * (12 + 8);
/// Bytes of a pixel while a setting's picture is made: hits, and what the general path takes, one of the settings.
const PASS_BYTES: u64 = 8 + 8 + 88;
/// What settings with threads of their own leave behind: about so many bytes of a pixel in lists of free memory, and stacks.
const POOL_BYTES: [u64; 2] = [48, 3 << 20];
/// Bytes of a pixel of a mask: counts, and the numbers of a setting, of the default and of the reference.
const MASK_BYTES: u64 = 4 + 3 * 4;
/// Bytes of the largest cube map that is measured: 6 faces of 2048 x 2048, 16 each.
const CUBE_BYTES: u64 = 6 * 2048 * 2048 * 16;

/// A setting that is measured.
struct Point {
    setting: Setting,
    /// What the user would type.
    command: String,
    cli: Cli,
    /// The threads that it asks for, where these are not those of all.
    pool: Option<rayon::ThreadPool>,
    milliseconds: Vec<f64>,
    /// Whether all runs gave the same bytes.
    repeats: bool,
    hash: Option<blake3::Hash>,
    errors: Differences,
    /// Against the default: pixels or receivers that differ in the triangle, in t, in a value.
    changed: Option<[usize; 3]>,
    picture: Option<Vec<u8>>,
}

/// `umbel trade`.
pub(crate) fn trade(args: &TradeArgs, common: &Common) -> Result<(), Error> {
    args.check(common)?;
    args.outputs().try_for_each(|path| check_output(path))?;
    let base = parse(&words(args, common, &output_words(args)))?;
    if let Command::Reyes(verb) = &base.command {
        return trade_reyes(args, common, verb);
    }
    let scene = load_scene(args.scene(), common, &mut Times::default())?;
    match &base.command {
        Command::Shadow(verb) => {
            let camera = verb.camera.camera_beside_cube(&scene)?;
            let rays = Rays::of_camera(&camera);
            let bytes = rays.bytes() + rays.pixels * (MASK_BYTES + RECEIVER_BYTES) + CUBE_BYTES;
            Room::beside(&scene).limit(bytes, "--size", common)?;
            let subject = ShadowSubject::new(&scene, verb)?;
            let has_cubes = !subject.lights.iter().any(|light| matches!(light, Origin::Infinity(_)));
            let canvas = Canvas::of_camera(&subject.camera, true);
            measure(args, common, &scene, &Subject::Shadow(subject), (&canvas, (has_cubes, "")))
        }
        Command::Bake(verb) => {
            if verb.occluders.has_surfaces() {
                return Err(Error::Usage("trade bakes among triangles: leave out surfaces on demand".into()));
            }
            let occluders = occluders(&scene, &verb.occluders, common)?;
            let bake = Bake::new(verb.options(&scene))?;
            let piece = make_plan(verb, &bake, (&scene, &occluders), common)?.piece;
            let (source, triangles) = (Source::new(verb, &scene)?, occluders.geometry()?);
            let canvas = Canvas::of_source(&source, &scene)?;
            let subject = BakeSubject { scene: &scene, source, triangles, piece };
            measure(
                args,
                common,
                &scene,
                &Subject::Bake(subject),
                (&canvas, (verb.takes_maps(), set_name(verb.options(&scene).set))),
            )
        }
        Command::Render(verb) => {
            let camera = verb.camera.camera(&scene)?;
            let rays = Rays::of_camera(&camera);
            let pools = if common.threads == 0 { POOL_BYTES } else { [0; 2] };
            let bytes = rays.bytes() + rays.pixels * (ITEM_BYTES + PASS_BYTES + pools[0]) + pools[1];
            Room::beside(&scene).limit(bytes, "--size", common)?;
            let canvas = Canvas::of_camera(&camera, false);
            measure(args, common, &scene, &Subject::Render(&scene), (&canvas, (false, "")))
        }
        _ => Err(Error::Usage("trade measures render, shadow, bake or reyes".into())),
    }
}

/// `umbel trade --mode reyes`.
fn trade_reyes(args: &TradeArgs, common: &Common, verb: &ReyesArgs) -> Result<(), Error> {
    let surfaces = verb.load(common)?;
    let camera = verb.framing(&surfaces)?;
    let named = Scene { name: surfaces.name.clone(), offset: surfaces.offset, ..Scene::default() };
    let rays = Rays::of_camera(&camera);
    let hits = 2 * (SURFACE_HIT_BYTES - HIT_BYTES);
    let bytes = rays.pixels * (ITEM_BYTES + PASS_BYTES + hits);
    Room::beside(&named).limit(bytes, "--size", common)?;
    let canvas = Canvas::of_camera(&camera, false);
    measure(args, common, &named, &Subject::Reyes(&surfaces), (&canvas, (false, "")))
}

/// The output that every setting has, so that its command line can be run.
fn output_words(args: &TradeArgs) -> Vec<String> {
    let output = output_of(args);
    output.split_whitespace().map(str::to_owned).collect()
}

/// The same in one line.
fn output_of(args: &TradeArgs) -> &'static str {
    let asks_where =
        args.shared.iter().any(|word| word.starts_with("--texels") || word.starts_with("--points"));
    match args.mode {
        ModeArg::Render | ModeArg::Reyes => "-o picture.npy",
        ModeArg::Shadow => "--mask mask.npy",
        // What every scene has.
        ModeArg::Bake if !asks_where && !args.shared.iter().any(|word| word == "--vertices") => {
            "--vertices -o open.npy"
        }
        ModeArg::Bake => "-o open.npy",
    }
}

/// The words of a command line with some options of its own.
fn words(args: &TradeArgs, common: &Common, own: &[String]) -> Vec<OsString> {
    let first = [OsStr::new(args.mode.verb()), args.scene()].map(OsString::from);
    first
        .into_iter()
        .chain(common.words().into_iter().map(OsString::from))
        .chain(args.shared.iter().cloned())
        .chain(own.iter().map(OsString::from))
        .collect()
}

/// A command line as it is shown.
fn line(words: &[OsString]) -> String {
    format!("umbel {}", words.join(OsStr::new(" ")).display())
}

/// The meaning of a command line of this program, checked.
fn parse(words: &[OsString]) -> Result<Cli, Error> {
    let program = std::iter::once(OsString::from("umbel"));
    let quiet = std::iter::once(OsString::from("--quiet"));
    let refused = |error: clap::Error| {
        let line = line(words);
        Error::Usage(format!("one of the settings, {line}, is not accepted: {error}"))
    };
    let cli = Cli::try_parse_from(program.chain(words.iter().cloned()).chain(quiet)).map_err(refused)?;
    match &cli.command {
        Command::Shadow(verb) => verb.check()?,
        Command::Bake(verb) => verb.check()?,
        Command::Render(verb) => _ = verb.picture.checked_output()?,
        Command::Reyes(verb) => {
            verb.check()?;
            verb.picture.checked_output()?;
        }
        _ => {}
    }
    Ok(cli)
}

/// Measures all settings and writes the page.
fn measure(
    args: &TradeArgs,
    common: &Common,
    scene: &Scene,
    subject: &Subject<'_>,
    (canvas, varied): (&Canvas, (bool, &str)),
) -> Result<(), Error> {
    let own = output_words(args);
    let more = |option: &str| [own.clone(), vec![option.to_owned(), args.reference().to_string()]].concat();
    let reference = match args.mode {
        ModeArg::Render => words(args, common, &more("--samples")),
        ModeArg::Shadow => words(args, common, &own),
        ModeArg::Bake => words(args, common, &more("--rays")),
        ModeArg::Reyes => {
            let rate = ["--shading-rate", REFERENCE_RATE].map(str::to_owned);
            words(args, common, &[more("--samples"), rate.to_vec()].concat())
        }
    };
    let fixed = |word: &String| {
        common.words().contains(word) || args.shared.iter().any(|shared| shared == word.as_str())
    };
    // What the user fixes is not varied.
    let is_free = |setting: &Setting| {
        let options = setting.words.iter().filter(|word| word.starts_with("--") && !own.contains(word));
        !options.into_iter().any(fixed)
    };
    let varied: Vec<Setting> =
        settings(args.mode, varied, output_of(args)).into_iter().filter(is_free).collect();
    let Some(default) = varied.iter().position(|setting| setting.is_default) else {
        let what = "--samples of render and reyes, --shading-rate of reyes and --rays of bake are varied by trade itself: leave them out behind --";
        return Err(Error::Usage(what.into()));
    };
    let mut points =
        varied.into_iter().map(|setting| Point::new(setting, args, common)).collect::<Result<Vec<_>, _>>()?;
    let steps = (points.len() as u64 * u64::from(args.rounds + 1)) as u32 + 1;
    let (bar, mut done) = (progress(steps, "runs", common), 0);
    let mut step = || {
        done += 1;
        bar.set_position(done);
    };
    let reference = subject.reference(&parse(&reference)?)?;
    step();
    let of_default = points[default].run(subject)?;
    for point in &mut points {
        let answer = point.run(subject)?;
        point.compare(&answer, (&reference, &of_default), subject.channels(), canvas);
        step();
    }
    for _ in 0..args.rounds {
        for point in &mut points {
            let answer = point.run(subject)?;
            point.milliseconds.push(answer.milliseconds);
            point.repeats &= point.hash == Some(answer.hash());
            step();
        }
    }
    bar.finish_and_clear();
    write(args, findings(args, scene, points, default))
}

impl Point {
    fn new(setting: Setting, args: &TradeArgs, common: &Common) -> Result<Self, Error> {
        let words = words(args, common, &setting.words);
        let cli = parse(&words)?;
        let own_threads = setting.words.iter().any(|word| word == "--threads");
        let pool = || rayon::ThreadPoolBuilder::new().num_threads(cli.common.threads).build();
        let failed = |error| Error::Limit(format!("--threads {}: {error}", cli.common.threads));
        let pool = own_threads.then(pool).transpose().map_err(failed)?;
        Ok(Self {
            command: line(&words),
            setting,
            cli,
            pool,
            milliseconds: Vec::new(),
            repeats: true,
            hash: None,
            errors: Differences::default(),
            changed: None,
            picture: None,
        })
    }

    fn run(&self, subject: &Subject<'_>) -> Result<Answer, Error> {
        match &self.pool {
            Some(pool) => pool.install(|| subject.run(&self.cli)),
            None => subject.run(&self.cli),
        }
    }

    /// Keeps how an answer differs from the reference, and from the default where that is asked.
    fn compare(&mut self, answer: &Answer, of: (&Answer, &Answer), channels: usize, canvas: &Canvas) {
        let (reference, default) = of;
        self.hash = Some(answer.hash());
        self.repeats = self.setting.changes.allows(answer, default);
        self.errors = Differences::between(&answer.values, &reference.values, channels);
        if self.setting.is_fast {
            let count = |pairs: &mut dyn Iterator<Item = bool>| pairs.filter(|&differs| differs).count();
            self.changed = Some([
                count(&mut answer.ids.iter().zip(&default.ids).map(|(a, b)| a != b)),
                count(&mut answer.ts.iter().zip(&default.ts).map(|(a, b)| a.to_bits() != b.to_bits())),
                Differences::between(&answer.values, &default.values, channels).differing,
            ]);
        }
        if self.setting.changes == Changes::Answer {
            self.picture = canvas.difference(&answer.values, &reference.values, channels);
        }
    }

    /// What is known about it, rounded as it is shown.
    fn measured(self, default_median: f64) -> Measured {
        let mut times = self.milliseconds;
        times.sort_unstable_by(f64::total_cmp);
        let median = report::median(&times);
        Measured {
            series: self.setting.series,
            label: self.setting.label,
            command: self.command,
            changes: self.setting.changes,
            is_default: self.setting.is_default,
            is_on_front: false,
            ms: median.rounded(),
            ms_least: times.first().copied().unwrap_or(0.0).rounded(),
            ms_most: times.last().copied().unwrap_or(0.0).rounded(),
            ratio: (median / default_median).rounded(),
            rmse: self.errors.rmse.rounded(),
            greatest: self.errors.greatest.rounded(),
            differing: self.errors.differing,
            differing_percent: (100.0 * self.errors.share()).rounded(),
            changed: self.changed,
            same_bytes: self.repeats,
            picture: self.picture,
        }
    }
}

/// All that was found, with the front.
fn findings(args: &TradeArgs, scene: &Scene, points: Vec<Point>, default: usize) -> Findings {
    let mut times = points[default].milliseconds.clone();
    times.sort_unstable_by(f64::total_cmp);
    let median = report::median(&times);
    let items = points[default].errors.items;
    let mut points: Vec<Measured> = points.into_iter().map(|point| point.measured(median)).collect();
    let answers: Vec<usize> = (0..points.len()).filter(|&k| points[k].changes == Changes::Answer).collect();
    let places: Vec<[f64; 2]> = answers.iter().map(|&k| [points[k].ms, points[k].rmse]).collect();
    for (k, is_on_front) in answers.into_iter().zip(pareto_front(&places)) {
        points[k].is_on_front = is_on_front;
    }
    Findings {
        mode: args.mode,
        scene: scene.name.clone(),
        triangles: scene.triangles.len(),
        vertices: scene.positions.len(),
        items,
        rounds: args.rounds,
        reference: (args.mode != ModeArg::Shadow).then(|| args.reference()),
        points,
    }
}

/// Writes what was asked for, and fails where bytes differ that may not.
fn write(args: &TradeArgs, found: Findings) -> Result<(), Error> {
    let text =
        |path: &std::path::Path, text: String| write_atomically(path, |file| file.write_all(text.as_bytes()));
    args.csv.as_ref().map_or(Ok(()), |path| text(path, report::csv(&found)))?;
    args.json.as_ref().map_or(Ok(()), |path| text(path, format!("{:#}\n", report::json(&found))))?;
    args.plot.as_ref().map_or(Ok(()), |path| text(path, plot::front(&found, true).into_string()))?;
    text(&args.output, page::page(&found).into_string())?;
    let checked = found.points.iter().map(|point| (point.command.as_str(), point.same_bytes));
    report::verdict(checked, &args.output)
}
