//! Shadows of receivers: clusters of them in the light's pencil, against the general path and against exact arithmetic.
//!
//! Lights are points and directions; receivers lie on triangles as [`Triangles::leave`] makes them, exactly on vertices, and
//! anywhere. Pictures of whole scenes are compared point by point, on several instruction sets and numbers of threads.
//!
//! The longer run takes that many times as many scenes:
//!
//! ```text
//! UMBEL_RECEIVERS_TIMES=50 cargo test --release -p umbel --test engine -- receivers:: --nocapture
//! ```
//!
//! [`Triangles::leave`]: umbel::Triangles::leave
//!
//! Based on: section 5 of the design, "Shadows".

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators::{self, KINDS, Kind, Mesh, widen};
use common::oracle::{self, OracleRay};
use common::random::Random;
use common::sides;
use umbel::builtin::builtin_view;
use umbel::engine::Accuracy;
use umbel::engine::Isa;
use umbel::engine::Receiver;
use umbel::engine::Side;
use umbel::engine::shadowed;
use umbel::glam::DVec3;
use umbel::{
    Camera, Frame, Lens, NO_TRIANGLE, Options, Origin, Path, Scene, TriangleId, Triangles, builtin,
    visibility,
};

/// How many times as much as usual.
fn times() -> usize {
    std::env::var("UMBEL_RECEIVERS_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

fn options(path: Path) -> Options {
    Options { path, ..Options::default() }
}

/// The answer of both paths, which must be one.
fn ask(triangles: &Triangles<'_>, light: Origin, receivers: &[Receiver]) -> Vec<bool> {
    let [pencil, general] = [Path::Pencil, Path::General]
        .map(|path| shadowed(triangles, light, receivers, &options(path)).expect("in range").0);
    if let Some(at) = pencil.iter().zip(&general).position(|(one, other)| one != other) {
        panic!("{:?} from {light:?}: pencil {}, general {}", receivers[at], pencil[at], general[at]);
    }
    pencil
}

/// In exact arithmetic.
fn expected(mesh: &Mesh, light: Origin, receiver: &Receiver) -> bool {
    let own = Some(receiver.triangle.0).filter(|&id| id != NO_TRIANGLE);
    let point = widen(receiver.point);
    match light {
        Origin::Point(light) => {
            let triangles = (0..mesh.triangles.len()).map(|id| mesh.corners(id));
            sides::segment_blocked(triangles, own, [light, point])
        }
        Origin::Infinity(direction) => {
            let ray = OracleRay {
                origin: point.to_array(),
                direction: (-direction).to_array(),
                t_min: 0.0,
                t_max: f64::INFINITY,
                ties: oracle::Ties::Origin,
            };
            let others = (0..mesh.triangles.len()).filter(|&id| own != Some(id as u32));
            let others: Vec<[u32; 3]> = others.map(|id| mesh.triangles[id]).collect();
            oracle::any(&mesh.positions, &others, &ray)
        }
    }
}

/// A point on a triangle, on a feature, or anywhere.
fn receiver(random: &mut Random, kind: Kind, mesh: &Mesh) -> Receiver {
    let id = TriangleId(random.below(mesh.triangles.len()) as u32);
    let point = match random.below(4) {
        0 | 1 => {
            let [a, b] = [random.signed(), random.signed()];
            let [a, b] = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
            mesh.geometry().leave(id, [a, b, 1.0 - a - b], random.pick(&[Side::Front, Side::Back]))
        }
        2 => generators::feature(random, mesh).to_array().map(|x| x as f32),
        _ => generators::eye(random, kind, mesh).to_array().map(|x| x as f32),
    };
    Receiver { point, triangle: random.pick(&[id, TriangleId(NO_TRIANGLE)]) }
}

/// A light anywhere, exactly on a feature, or at infinity.
fn light(random: &mut Random, kind: Kind, mesh: &Mesh) -> Origin {
    let eye = generators::eye(random, kind, mesh);
    match random.below(3) {
        0 => Origin::Point(eye),
        1 => Origin::Point(generators::on_grid(generators::feature(random, mesh))),
        _ => Origin::Infinity(generators::direction(random, kind, mesh, eye)),
    }
}

fn run(kind: Kind, scenes: usize, most: usize) {
    let mut random = Random(kind as u64 + 77);
    let (mut total, mut count) = (0, 0);
    for _ in 0..scenes * times() {
        let mesh = generators::scene(&mut random, kind, most);
        let receivers: Vec<Receiver> = (0..40).map(|_| receiver(&mut random, kind, &mesh)).collect();
        let light = light(&mut random, kind, &mesh);
        let answers = ask(&mesh.geometry(), light, &receivers);
        for (receiver, &answer) in receivers.iter().zip(&answers) {
            assert_eq!(answer, expected(&mesh, light, receiver), "{receiver:?} from {light:?}\n{mesh:?}");
        }
        total += answers.len();
        count += answers.into_iter().filter(|&blocked| blocked).count();
    }
    println!("{kind:?}: {total} receivers, {count} in shadow, no mismatch");
    assert!(count * 100 > total, "{kind:?}: {count} of {total}");
}

#[test]
fn small_scenes_of_all_kinds() {
    for kind in KINDS {
        run(kind, if kind == Kind::Mixed { 40 } else { 200 }, 20);
    }
}

#[test]
fn larger_scenes_of_all_kinds() {
    for kind in KINDS {
        run(kind, if kind == Kind::Mixed { 2 } else { 10 }, 500);
    }
}

/// What a camera sees of a built-in scene, as receivers on the side of the eye, tile by tile.
fn seen(scene: &Scene, name: &str, width: u32, height: u32) -> Vec<Receiver> {
    let view = builtin_view(name).expect("a built-in scene");
    let [eye, target, up] = [view.eye, view.target, view.up].map(DVec3::from_array);
    let camera = Camera { eye, target, up, lens: Lens::Pinhole { fov: view.fov_degrees }, width, height };
    let (buffer, _) = visibility(scene, &camera, &Options::default()).expect("a valid view");
    let triangles = scene.geometry().expect("a valid scene");
    let receiver = |pixel: usize| {
        let (hit, ray) = (buffer.hits.get(pixel)?, buffer.shot.pencil.ray(pixel));
        let side = triangles.side_toward(hit.id, -ray.direction)?;
        let point = triangles.leave(hit.id, triangles.barycentrics(hit.id, &ray), side);
        Some(Receiver { point, triangle: hit.id })
    };
    (0..buffer.hits.len()).filter_map(receiver).collect()
}

/// Lights inside, far outside, at a vertex, on a surface, and at infinity.
fn lights(scene: &Scene) -> Vec<Origin> {
    let bounds = scene.bounds();
    let (lo, hi) = (widen(bounds.lo), widen(bounds.hi));
    let within = |x: f64, y: f64, z: f64| {
        let p = lo + (hi - lo) * DVec3::new(x, y, z);
        widen(p.to_array().map(|x| x as f32))
    };
    let [a, b, c] = scene.geometry().expect("a valid scene").corners(TriangleId(7)).map(widen);
    let centre = (a + b + c) / 3.0;
    let points = [
        within(0.5, 0.9, 0.5),
        within(0.3, 1.5, 0.6),
        within(-2e3, 3e3, 500.0),
        a,
        widen(centre.to_array().map(|x| x as f32)),
    ];
    let directions = [DVec3::NEG_Y, DVec3::new(0.3, -1.0, 0.2), DVec3::new(-1e-3, 0.0, 1e-3)];
    points.map(Origin::Point).into_iter().chain(directions.map(Origin::Infinity)).collect()
}

#[test]
fn pictures_of_whole_scenes() {
    for name in ["umbel:3000", "cornell"] {
        let scene = builtin(name).expect("a built-in scene");
        let triangles = scene.geometry().expect("a valid scene");
        let receivers = seen(&scene, name, 160, 120);
        assert!(receivers.len() > 4000, "{name}: {}", receivers.len());
        for light in lights(&scene) {
            let answers = ask(&triangles, light, &receivers);
            let count = answers.iter().filter(|&&blocked| blocked).count();
            println!("{name} {light:?}: {count} of {} in shadow", answers.len());
            // An order without sense, one thread, and other instructions give the same answer.
            let mut random = Random(5);
            let mut shuffled: Vec<usize> = (0..receivers.len()).collect();
            (1..shuffled.len()).for_each(|k| shuffled.swap(k, random.below(k + 1)));
            let moved: Vec<Receiver> = shuffled.iter().map(|&k| receivers[k]).collect();
            let (other, _) = shadowed(&triangles, light, &moved, &Options::default()).expect("in range");
            assert!(shuffled.iter().map(|&k| answers[k]).eq(other), "{name} {light:?}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
            let narrow = Options { isa: Isa::Sse2, ..Options::default() };
            let (other, stats) =
                pool.install(|| shadowed(&triangles, light, &receivers, &narrow)).expect("in range");
            assert_eq!(answers, other, "{name} {light:?}");
            let contract = 6 * triangles.len() + 24 * receivers.len() + (256 << 10);
            assert!(stats.engine_bytes <= contract as u64, "{name} {light:?}: {}", stats.engine_bytes);
        }
    }
}

/// Rounded decisions differ from exact ones at few points: mostly beneath triangles that are nearly seen edge-on.
#[test]
fn fast_is_nearly_exact() {
    let scene = builtin("umbel:3000").expect("a built-in scene");
    let triangles = scene.geometry().expect("a valid scene");
    let receivers = seen(&scene, "umbel:3000", 160, 120);
    let mut frame = Frame::keeping_order();
    for light in lights(&scene) {
        let mut ask = |accuracy| {
            let options = Options { accuracy, ..Options::default() };
            frame.shadowed(&triangles, light, &receivers, &options).expect("in range").0
        };
        let (exact, fast) = (ask(Accuracy::Exact), ask(Accuracy::Fast));
        let differing = exact.iter().zip(&fast).filter(|(one, other)| one != other).count();
        assert!(differing * 50 < exact.len(), "{light:?}: {differing} of {}", exact.len());
    }
}

#[test]
fn what_is_out_of_range_is_refused() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangles = Triangles::new(&positions, &[[0, 1, 2]]).expect("valid triangles");
    let receiver = Receiver { point: [0.2, 0.2, 1.0], triangle: TriangleId(NO_TRIANGLE) };
    let lost = Receiver { point: [0.2, f32::NAN, 1.0], ..receiver };
    let ask =
        |light, receiver| shadowed(&triangles, light, &[receiver], &Options::default()).map(|found| found.0);
    assert_eq!(ask(Origin::Point(DVec3::new(0.2, 0.2, -1.0)), receiver), Ok(vec![true]));
    assert_eq!(ask(Origin::Infinity(DVec3::Z), receiver), Ok(vec![true]));
    assert_eq!(ask(Origin::Infinity(DVec3::NEG_Z), receiver), Ok(vec![false]));
    for (light, receiver, what) in [
        (Origin::Point(DVec3::NAN), receiver, "origin [NaN"),
        (Origin::Infinity(DVec3::ZERO), receiver, "direction [0.0"),
        (Origin::Point(DVec3::ZERO), lost, "origin [0.2"),
    ] {
        let error = ask(light, receiver).expect_err("out of range").to_string();
        assert!(error.starts_with(what), "{error}");
    }
    let none = shadowed(&triangles, Origin::Point(DVec3::ZERO), &[], &Options::default()).expect("in range");
    assert!(none.0.is_empty());
}
