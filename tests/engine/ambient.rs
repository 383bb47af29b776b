//! Open rays of receivers: both groupings, the general path and exact arithmetic decide each ray alike.
//!
//! On scenes that provoke coincidences, with receivers on surfaces, on features and anywhere, directions shared and not, with limits
//! and without; and on whole scenes, in several orders, on several instruction sets and numbers of threads.
//!
//! The longer run takes that many times as many scenes:
//!
//! ```text
//! UMBEL_AMBIENT_TIMES=50 cargo test --release -p umbel --test engine -- ambient:: --nocapture
//! ```
//!
//! Based on: section 5 of the design, "AO".

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

use common::generators::{self, KINDS, Kind, Mesh, widen};
use common::oracle::{self, OracleRay};
use common::random::Random;
use common::sides;
use umbel::engine::{
    Above, Accuracy, Grouping, Hemisphere, Isa, Occlusion, OpenRays, RaySample, RaySamples, Receiver, Side,
    open_rays,
};
use umbel::glam::DVec3;
use umbel::{NO_TRIANGLE, Options, Path, Scene, Stats, TriangleId, Triangles, builtin};

/// How many times as much as usual.
fn times() -> usize {
    std::env::var("UMBEL_AMBIENT_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// The sample of a ray.
fn sample_of(occlusion: &Occlusion<'_>, receiver: usize, ray: usize) -> RaySample {
    match occlusion.samples {
        RaySamples::Shared(samples) => samples[ray],
        RaySamples::Own { of, .. } => of(receiver, ray),
    }
}

/// Answers of the general path, of both groupings and of bundles, which must be one.
fn ask(triangles: &Triangles<'_>, occlusion: Occlusion<'_>) -> OpenRays {
    let general = Options { path: Path::General, ..Options::default() };
    let (expected, _) = open_rays(triangles, &occlusion, &general).expect("in range");
    let groupings = [Grouping::Auto, Grouping::Direction, Grouping::Origin];
    // The same rays as if no receivers shared them go in bundles.
    let of = |receiver, ray| sample_of(&occlusion, receiver, ray);
    let own = RaySamples::Own { count: expected.rays(), of: &of };
    let shared = groupings.map(|grouping| (grouping, occlusion.samples));
    for (grouping, samples) in shared.into_iter().chain([(Grouping::Origin, own)]) {
        let is_shared = matches!(samples, RaySamples::Shared(_));
        let occlusion = Occlusion { grouping, samples, ..occlusion };
        let (answer, _) = open_rays(triangles, &occlusion, &Options::default()).expect("in range");
        for (receiver, hemisphere) in occlusion.hemispheres.iter().enumerate() {
            for ray in 0..answer.rays() {
                let [one, other] = [&answer, &expected].map(|open| open.is_open(receiver, ray));
                if one != other {
                    let corners: Vec<_> =
                        (0..triangles.len()).map(|id| triangles.corners(TriangleId(id as u32))).collect();
                    panic!(
                        "{grouping:?}, shared: {is_shared}: {one}, general: {other}; ray {ray} of {hemisphere:?} among {:?}\n{corners:?}",
                        sample_of(&occlusion, receiver, ray)
                    );
                }
            }
        }
    }
    expected
}

/// In exact arithmetic; `None` for what does not point above the surface.
fn expected(mesh: &Mesh, hemisphere: &Hemisphere, sample: &RaySample, back_faces: bool) -> bool {
    let d = sample.direction;
    let Receiver { point, triangle } = hemisphere.receiver;
    let is_above = match hemisphere.above {
        Above::Side(Side::Front) => sides::facing(mesh.corners(triangle.0 as usize), d) > 0,
        Above::Side(Side::Back) => sides::facing(mesh.corners(triangle.0 as usize), d) < 0,
        Above::Normal(normal) => {
            // (b − a)×(c − a) of a triangle with that normal is not at hand: use the oracle's facing on axes.
            let n = widen(normal);
            exact_dot_sign(n, d) > 0
        }
    };
    if !is_above {
        return false;
    }
    let ray = OracleRay {
        origin: widen(point).to_array(),
        direction: d.to_array(),
        t_min: 0.0,
        t_max: f64::from(sample.t_max),
        ties: oracle::Ties::Origin,
    };
    let counts =
        |id: &usize| triangle.0 as usize != *id && (back_faces || sides::facing(mesh.corners(*id), d) < 0);
    let others: Vec<[u32; 3]> =
        (0..mesh.triangles.len()).filter(counts).map(|id| mesh.triangles[id]).collect();
    !oracle::any(&mesh.positions, &others, &ray)
}

/// The sign of a dot product in exact arithmetic.
fn exact_dot_sign(a: DVec3, b: DVec3) -> i32 {
    use num_rational::BigRational;
    let exact = |x: f64| BigRational::from_float(x).expect("finite");
    let sum = (0..3).map(|k| exact(a[k]) * exact(b[k])).fold(exact(0.0), |sum, term| sum + term);
    match sum.cmp(&exact(0.0)) {
        std::cmp::Ordering::Less => -1,
        std::cmp::Ordering::Equal => 0,
        std::cmp::Ordering::Greater => 1,
    }
}

/// A receiver on a triangle, on a feature, or anywhere.
fn hemisphere(random: &mut Random, kind: Kind, mesh: &Mesh) -> Hemisphere {
    let id = TriangleId(random.below(mesh.triangles.len()) as u32);
    let side = random.pick(&[Side::Front, Side::Back]);
    if random.once_in(2) {
        let [a, b] = [random.signed().abs(), random.signed().abs()];
        let [a, b] = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
        let point = if random.once_in(8) {
            generators::eye(random, kind, mesh).to_array().map(|x| x as f32)
        } else {
            mesh.geometry().leave(id, [a, b, 1.0 - a - b], side)
        };
        return Hemisphere { receiver: Receiver { point, triangle: id }, above: Above::Side(side) };
    }
    let point = if random.once_in(2) {
        generators::feature(random, mesh)
    } else {
        generators::eye(random, kind, mesh)
    };
    let normal = generators::direction(random, kind, mesh, point).to_array().map(|x| x as f32);
    let receiver = Receiver {
        point: point.to_array().map(|x| x as f32),
        triangle: random.pick(&[id, TriangleId(NO_TRIANGLE)]),
    };
    Hemisphere { receiver, above: Above::Normal(normal) }
}

/// Directions at features as seen from a receiver, and anywhere; every other one with a limit near what it meets.
fn samples(random: &mut Random, kind: Kind, mesh: &Mesh, from: &Hemisphere, count: usize) -> Vec<RaySample> {
    let eye = widen(from.receiver.point);
    let mut sample = || {
        let direction = generators::direction(random, kind, mesh, eye);
        let t_max = random.pick(&[f32::INFINITY, f32::INFINITY, 1.0, 0.5, 2.0]);
        RaySample { direction, t_min: 0.0, t_max }
    };
    (0..count).map(|_| sample()).collect()
}

fn run(kind: Kind, scenes: usize, most: usize) {
    let mut random = Random(kind as u64 + 1977);
    let (mut total, mut count) = (0, 0);
    for scene in 0..scenes * times() {
        let mesh = generators::scene(&mut random, kind, most);
        let hemispheres: Vec<Hemisphere> = (0..20).map(|_| hemisphere(&mut random, kind, &mesh)).collect();
        let samples = samples(&mut random, kind, &mesh, &hemispheres[0], [9, 40][scene % 2]);
        let back_faces = scene % 3 != 0;
        let occlusion = Occlusion {
            hemispheres: &hemispheres,
            samples: RaySamples::Shared(&samples),
            back_faces,
            grouping: Grouping::Auto,
        };
        let open = ask(&mesh.geometry(), occlusion);
        for (receiver, hemisphere) in hemispheres.iter().enumerate() {
            for (ray, sample) in samples.iter().enumerate() {
                let answer = open.is_open(receiver, ray);
                let truth = expected(&mesh, hemisphere, sample, back_faces);
                assert_eq!(answer, truth, "{hemisphere:?} along {sample:?}\n{mesh:?}");
                total += 1;
                count += usize::from(answer);
            }
        }
    }
    println!("{kind:?}: {total} rays, {count} open, no mismatch");
    assert!(count * 100 > total && count < total, "{kind:?}: {count} of {total}");
}

#[test]
fn small_scenes_of_all_kinds() {
    for kind in KINDS {
        run(kind, if kind == Kind::Mixed { 10 } else { 40 }, 20);
    }
}

#[test]
fn larger_scenes_of_all_kinds() {
    for kind in KINDS {
        run(kind, if kind == Kind::Mixed { 1 } else { 4 }, 300);
    }
}

/// Adds a closed surface: a tetrahedron, a cube or a sphere on integers, as it is or with each vertex anywhere, so that
/// it cuts through itself; inside out or not, and sometimes without a triangle. Its triangles share vertices or have
/// their own.
fn add_closed(random: &mut Random, mesh: &mut Mesh) {
    let mut part = match random.below(3) {
        0 => generators::meshes::cube(1),
        1 => generators::meshes::sphere(random.below(2) as u32, |_| 2.0),
        _ => Mesh {
            positions: vec![[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]],
            triangles: vec![[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]],
        },
    };
    let (is_wild, size, centre) = (random.once_in(2), random.pick(&[1.0, 1.0, 2.0]), random.lattice(2));
    for position in &mut part.positions {
        let p = if is_wild { random.lattice(3) } else { (widen(*position) * size).round() + centre };
        *position = p.to_array().map(|x| x as f32);
    }
    if random.once_in(3) {
        part.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    }
    if random.once_in(4) {
        part.triangles.pop();
    }
    for _ in 0..random.pick(&[1, 1, 1, 2]) {
        if random.once_in(2) {
            (0..part.triangles.len()).for_each(|id| mesh.triangle(part.corners(id)));
        } else {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(&part.positions);
            mesh.triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
        }
    }
}

/// A receiver inside a triangle, or exactly on a corner, on an edge, in the plane, or anywhere, where other triangles may
/// be as well.
fn receiver_on_closed(random: &mut Random, mesh: &Mesh) -> Hemisphere {
    let id = random.below(mesh.triangles.len());
    let [a, b, c] = mesh.corners(id);
    let side = random.pick(&[Side::Front, Side::Front, Side::Back]);
    let triangle = TriangleId(id as u32);
    let point = match random.below(8) {
        0 => a,
        1 => (b + c) * 0.5,
        2 => a + (b - a) * 0.25 + (c - a) * 0.5,
        3 => a + (b - a) * random.around(2) + (c - a) * random.around(2),
        4 => random.lattice(6) * 0.5,
        _ => widen(mesh.geometry().leave(triangle, [0.25, 0.5, 0.25], side)),
    };
    let triangle = random.pick(&[triangle, triangle, triangle, TriangleId(NO_TRIANGLE)]);
    let is_named = triangle.0 != NO_TRIANGLE;
    let normal = random.lattice(2).to_array().map(|x| x as f32);
    let above = if is_named && !random.once_in(8) { Above::Side(side) } else { Above::Normal(normal) };
    Hemisphere { receiver: Receiver { point: point.to_array().map(|x| x as f32), triangle }, above }
}

/// Closed surfaces of which back faces need no test: the rule in `closed.rs` and all that it presupposes.
#[test]
fn closed_surfaces() {
    let mut random = Random(4242);
    let (mut total, mut count) = (0, 0);
    for scene in 0..150 * times() {
        let mut mesh = Mesh::default();
        (0..=random.below(4)).for_each(|_| add_closed(&mut random, &mut mesh));
        if random.once_in(3) {
            let corners = [(); 3].map(|()| random.lattice(3));
            mesh.triangle(corners);
        }
        let hemispheres: Vec<Hemisphere> =
            (0..[24, 24, 24, 600][scene % 4]).map(|_| receiver_on_closed(&mut random, &mesh)).collect();
        let mut direction = |_| {
            let eye = widen(hemispheres[random.below(hemispheres.len())].receiver.point);
            generators::direction(&mut random, Kind::Lattice, &mesh, eye)
        };
        let samples: Vec<RaySample> = (0..20).map(&mut direction).map(RaySample::unlimited).collect();
        let occlusion = Occlusion {
            hemispheres: &hemispheres,
            samples: RaySamples::Shared(&samples),
            back_faces: scene % 5 != 0,
            grouping: Grouping::Auto,
        };
        let open = ask(&mesh.geometry(), occlusion);
        for (receiver, hemisphere) in hemispheres.iter().enumerate().take(24) {
            for (ray, sample) in samples.iter().enumerate() {
                let truth = expected(&mesh, hemisphere, sample, occlusion.back_faces);
                assert_eq!(open.is_open(receiver, ray), truth, "{hemisphere:?} along {sample:?}\n{mesh:?}");
                total += 1;
                count += usize::from(truth);
            }
        }
    }
    println!("closed surfaces: {total} rays, {count} open, no mismatch");
    assert!(count * 20 > total && count < total, "{count} of {total}");
}

/// Receivers all over a scene, on both sides of its triangles.
fn all_over(scene: &Scene, count: usize) -> Vec<Hemisphere> {
    let triangles = scene.geometry().expect("a valid scene");
    let mut random = Random(3);
    let mut one = || {
        let id = TriangleId(random.below(triangles.len()) as u32);
        let side = random.pick(&[Side::Front, Side::Front, Side::Back]);
        let [a, b] = [random.signed().abs(), random.signed().abs()];
        let [a, b] = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
        let point = triangles.leave(id, [a, b, 1.0 - a - b], side);
        Hemisphere { receiver: Receiver { point, triangle: id }, above: Above::Side(side) }
    };
    (0..count).map(|_| one()).collect()
}

/// Directions all around, of several lengths; some along axes, where coincidences are.
fn all_around(count: usize, t_max: f32) -> Vec<RaySample> {
    let mut random = Random(8);
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let direction = |k: usize| axes.get(k).copied().unwrap_or_else(|| random.cube() * 3.0);
    (0..count).map(direction).map(|direction| RaySample { direction, t_min: 0.0, t_max }).collect()
}

#[test]
fn whole_scenes_in_any_order_on_any_machine() {
    for (name, receivers, rays) in [("umbel:3000", 5000, 150), ("cornell", 3000, 33)] {
        let scene = builtin(name).expect("a built-in scene");
        let triangles = scene.geometry().expect("a valid scene");
        let [x, y, z] = scene.bounds().extent();
        for t_max in [f32::INFINITY, (0.1 * x.max(y).max(z)) as f32] {
            let (hemispheres, samples) = (all_over(&scene, receivers), all_around(rays, t_max));
            let occlusion = |hemispheres| Occlusion {
                hemispheres,
                samples: RaySamples::Shared(&samples),
                back_faces: true,
                grouping: Grouping::Auto,
            };
            let few: Vec<Hemisphere> = hemispheres.iter().step_by(20).copied().collect();
            ask(&triangles, occlusion(&few));
            let ask = |hemispheres, options: &Options| -> (OpenRays, Stats) {
                open_rays(&triangles, &occlusion(hemispheres), options).expect("in range")
            };
            let (open, _) = ask(&hemispheres, &Options::default());
            let backward: Vec<Hemisphere> = hemispheres.iter().rev().copied().collect();
            let (moved, _) = ask(&backward, &Options::default());
            let same = |k: usize| open.words(k) == moved.words(receivers - 1 - k);
            assert!((0..receivers).all(same), "{name}, t_max {t_max}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
            let narrow = Options { isa: Isa::Sse2, ..Options::default() };
            let (other, stats) = pool.install(|| ask(&hemispheres, &narrow));
            assert_eq!(open, other, "{name}, t_max {t_max}");
            // What the docs of `open_rays` say, on one thread.
            let most = 64 * triangles.len() + 4 * receivers + (512 << 10);
            assert!(stats.engine_bytes <= most as u64, "{name}: {} of {most}", stats.engine_bytes);
            let fast = Options { accuracy: Accuracy::Fast, ..Options::default() };
            let (fast, _) = ask(&hemispheres, &fast);
            let bits =
                |open: &OpenRays| (0..receivers).flat_map(|k| open.words(k).to_vec()).collect::<Vec<u32>>();
            let differing: u32 =
                bits(&open).iter().zip(bits(&fast)).map(|(one, other)| (one ^ other).count_ones()).sum();
            assert!((differing as usize) * 1000 < receivers * rays, "{name}: {differing} differ");
        }
    }
}

#[test]
fn receivers_with_rays_of_their_own() {
    let scene = builtin("umbel:3000").expect("a built-in scene");
    let triangles = scene.geometry().expect("a valid scene");
    let (hemispheres, samples) = (all_over(&scene, 50), all_around(64, f32::INFINITY));
    let of = |receiver: usize, ray: usize| samples[(receiver * 7 + ray) % samples.len()];
    let own = RaySamples::Own { count: 40, of: &of };
    let occlusion =
        |samples, grouping| Occlusion { hemispheres: &hemispheres, samples, back_faces: true, grouping };
    let ask = |samples, grouping| {
        open_rays(&triangles, &occlusion(samples, grouping), &Options::default()).map(|(open, _)| open)
    };
    let shared = ask(RaySamples::Shared(&samples), Grouping::Direction).expect("in range");
    let own_rays = ask(own, Grouping::Origin).expect("in range");
    for receiver in 0..hemispheres.len() {
        for ray in 0..40 {
            let as_shared = shared.is_open(receiver, (receiver * 7 + ray) % samples.len());
            assert_eq!(own_rays.is_open(receiver, ray), as_shared);
        }
    }
    let error = ask(own, Grouping::Direction).expect_err("no common directions").to_string();
    assert!(error.contains("cannot be grouped by direction"), "{error}");
}

#[test]
fn what_is_out_of_range_is_refused() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangles = Triangles::new(&positions, &[[0, 1, 2]]).expect("valid triangles");
    let fine = Hemisphere {
        receiver: Receiver { point: [0.2, 0.2, -1.0], triangle: TriangleId(NO_TRIANGLE) },
        above: Above::Normal([0.0, 0.0, 1.0]),
    };
    let up = RaySample::unlimited(DVec3::Z);
    let ask = |hemisphere: Hemisphere, sample: RaySample| {
        let occlusion = Occlusion {
            hemispheres: &[hemisphere],
            samples: RaySamples::Shared(&[sample]),
            back_faces: true,
            grouping: Grouping::Auto,
        };
        open_rays(&triangles, &occlusion, &Options::default()).map(|(open, _)| open.is_open(0, 0))
    };
    assert_eq!(ask(fine, up), Ok(false));
    assert_eq!(ask(fine, RaySample { t_max: 1.0, ..up }), Ok(true));
    assert_eq!(ask(fine, RaySample { t_max: 1.0_f32.next_up(), ..up }), Ok(false));
    assert_eq!(ask(fine, RaySample::unlimited(DVec3::NEG_Z)), Ok(false));
    let lost = Receiver { point: [0.2, f32::NAN, 1.0], ..fine.receiver };
    let elsewhere = Receiver { triangle: TriangleId(1), ..fine.receiver };
    for (hemisphere, sample, what) in [
        (Hemisphere { receiver: lost, ..fine }, up, "origin [0.2"),
        (Hemisphere { receiver: elsewhere, ..fine }, up, "receiver 0 lies on triangle 1"),
        (
            Hemisphere { above: Above::Side(Side::Front), ..fine },
            up,
            "receiver 0 lies on triangle 4294967295",
        ),
        (
            Hemisphere { above: Above::Normal([0.0, f32::INFINITY, 0.0]), ..fine },
            up,
            "the normal of receiver 0",
        ),
        (fine, RaySample::unlimited(DVec3::ZERO), "direction [0.0"),
        (fine, RaySample { t_max: 0.0, ..up }, "ray interval (0, 0)"),
    ] {
        let error = ask(hemisphere, sample).expect_err("out of range").to_string();
        assert!(error.starts_with(what), "{error}");
    }
}
