//! `verify` through the library: pencil, general path and tiny-skia agree; and a wrong answer is noticed.
//!
//! The wrong answers come from a scene that lacks a triangle, and from `Accuracy::Fast`. Its pencils keep rounded decisions, the general path never does, so rays
//! that meet vertices exactly must show a difference.

use common::place;
use common::random::Random;
use umbel::builtin::builtin_view;
use umbel::engine::Accuracy;
use umbel::glam::DVec3;
use umbel::render::{Mark, Verification, verify, verify_buffer};
use umbel::{Camera, Hit, Hits, Lens, Options, Scene, TriangleId, VisibilityBuffer, builtin, visibility};

const WIDTH: u32 = 150;
const HEIGHT: u32 = 100;
const PINHOLE: Lens = Lens::Pinhole { fov: 60.0 };

fn camera(eye: [f64; 3], target: [f64; 3], lens: Lens) -> Camera {
    Camera {
        eye: DVec3::from_array(eye),
        target: DVec3::from_array(target),
        up: DVec3::new(0.1, 1.0, 0.03),
        lens,
        width: if lens == Lens::Cube { 64 } else { WIDTH },
        height: HEIGHT,
    }
}

/// Verifies one view, which must be clean, see something, and excuse no more than thin edges.
fn check(scene: &Scene, camera: &Camera) -> Verification {
    let found = verify(scene, camera, &Options::default()).expect("a scene and a camera");
    let said = format!("{} {camera:?}", scene.name);
    assert!(found.is_clean(), "{said}: {} {}", found.path_differences, found.raster_differences);
    assert!(!found.marks.contains(&Mark::Difference), "{said}");
    assert_eq!(found.marks.len(), found.rays, "{said}");
    assert!(found.hits * 50 > found.rays, "{said}: only {} hits", found.hits);
    if !matches!(camera.lens, Lens::Equirect | Lens::Fisheye { .. }) {
        assert_eq!(found.pixels, found.rays, "{said}");
    }
    let tolerated = found.marks.iter().filter(|&&mark| mark == Mark::Tolerated).count();
    assert_eq!(tolerated, found.near_edges + found.same_depth, "{said}");
    assert!(tolerated * 12 < found.rays, "{said}: {tolerated} tolerated");
    found
}

/// Views of the whole from several sides, through lenses that see it at a useful size.
fn check_around(scene: &Scene) {
    let directions = [[1.0, 0.7, 1.0], [-1.0, 0.1, 0.2], [0.3, -1.0, -0.4], [0.0, 0.0, -1.0]];
    for direction in directions.map(DVec3::from_array) {
        for lens in [PINHOLE, Lens::Pinhole { fov: 5.0 }, Lens::Ortho { height: 1.0 }] {
            check(scene, &Camera::framing(&scene.bounds(), direction, lens, WIDTH, HEIGHT));
        }
    }
}

#[test]
fn cornell_from_outside_and_inside() {
    let scene = builtin("cornell").expect("it exists");
    check_around(&scene);
    let view = builtin_view("cornell").expect("it exists");
    check(&scene, &camera(view.eye, view.target, Lens::Pinhole { fov: view.fov_degrees }));
    // In the room, in the tall block, on the floor, in the plane of the ceiling and of the light.
    let eyes = [[278.0, 273.0, 200.0], [368.0, 100.0, 351.0], [278.0, 0.0, 200.0], [100.0, 548.8, 100.0]];
    for eye in eyes {
        for lens in [PINHOLE, Lens::Cube, Lens::Equirect, Lens::Fisheye { fov: 220.0 }] {
            check(&scene, &camera(eye, [300.0, 200.0, 400.0], lens));
        }
    }
}

/// The picture of a room without one wall is not that of the room: both references must say so.
#[test]
fn a_buffer_of_another_scene_is_noticed() {
    let scene = builtin("cornell").expect("it exists");
    let view = builtin_view("cornell").expect("it exists");
    let camera = camera(view.eye, view.target, Lens::Pinhole { fov: view.fov_degrees });
    let options = Options::default();
    let (buffer, _) = visibility(&scene, &camera, &options).expect("a view");
    assert!(verify_buffer(&scene, &buffer, &options).expect("a view").is_clean());

    let middle = (HEIGHT / 2 * WIDTH + WIDTH / 2) as usize;
    let seen = buffer.hits.get(middle).expect("the room is in the middle").id.0;
    let mut damaged = scene.clone();
    damaged.triangles[seen as usize] = [0, 0, 0];
    let (buffer, _) = visibility(&damaged, &camera, &options).expect("a view");
    let found = verify_buffer(&scene, &buffer, &options).expect("a view");
    assert!(found.path_differences > 100, "{} differ from the general path", found.path_differences);
    assert!(found.raster_differences > 100, "{} differ from tiny-skia", found.raster_differences);
    assert!(!found.is_clean());
}

/// Kinds of damage to single pixels, each with what must notice it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    /// The id of a triangle that is nowhere near.
    Id,
    /// No triangle.
    Hole,
    /// What the pixel to the left sees.
    Shift,
    /// The next greater t: ids stay, so tiny-skia has nothing to say.
    Ulp,
    /// The pixel and its right neighbour exchange what they see.
    Swap,
}

/// The hits with some pixels damaged, and how many of them now say something else.
fn damaged(hits: &Hits, damage: Damage, triangles: u32, random: &mut Random) -> (Hits, usize) {
    let mut all: Vec<Option<Hit>> = (0..hits.len()).map(|ray| hits.get(ray)).collect();
    for _ in 0..60 {
        // Not in the last column: the right neighbour is one.
        let column = (random.unit() * f64::from(WIDTH - 2)) as usize + 1;
        let pixel = (random.unit() * f64::from(HEIGHT)) as usize * WIDTH as usize + column;
        let seen = all[pixel];
        match damage {
            Damage::Id => {
                all[pixel] =
                    seen.map(|hit| Hit { id: TriangleId((hit.id.0 + triangles / 2) % triangles), ..hit })
            }
            Damage::Hole => all[pixel] = None,
            Damage::Shift => all[pixel] = all[pixel - 1],
            Damage::Ulp => all[pixel] = seen.map(|hit| Hit { t: hit.t.next_up(), ..hit }),
            Damage::Swap => all.swap(pixel, pixel + 1),
        }
    }
    let changed = (0..hits.len()).filter(|&ray| all[ray] != hits.get(ray)).count();
    (all.into_iter().collect(), changed)
}

/// Each kind of damage is noticed by each reference that can: the general path by every pixel, tiny-skia by every pixel whose
/// id is wrong and that is not at an edge, coplanar neighbours included.
#[test]
fn damage_is_noticed_by_both_references() {
    let (mut random, options) = (Random(11), Options::default());
    for name in ["cornell", "umbel:2000"] {
        let scene = builtin(name).expect("it exists");
        let view = builtin_view(name).expect("it exists");
        let camera = camera(view.eye, view.target, Lens::Pinhole { fov: view.fov_degrees });
        let (whole, _) = visibility(&scene, &camera, &options).expect("a view");
        let count = u32::try_from(scene.triangles.len()).expect("few triangles");
        let excused = verify_buffer(&scene, &whole, &options).expect("a view").same_depth;
        for damage in [Damage::Id, Damage::Hole, Damage::Shift, Damage::Ulp, Damage::Swap] {
            let (hits, changed) = damaged(&whole.hits, damage, count, &mut random);
            let ids = (0..hits.len()).filter(|&ray| hits.ids()[ray] != whole.hits.ids()[ray]).count();
            let buffer = VisibilityBuffer { hits, ..whole.clone() };
            let found = verify_buffer(&scene, &buffer, &options).expect("a view");
            let said = format!(
                "{name} {damage:?}: {changed} pixels, {ids} ids, {found:?}",
                found = { Verification { marks: Vec::new(), ..found.clone() } }
            );
            assert_eq!(found.path_differences, changed, "{said}");
            assert!(!found.is_clean(), "{said}");
            // Neighbours differ at edges only, where few are far enough from them for tiny-skia to be sure.
            let least = match damage {
                Damage::Id | Damage::Hole => ids * 3 / 4,
                Damage::Shift | Damage::Swap => ids / 2,
                Damage::Ulp => 0,
            };
            assert!(found.raster_differences >= least, "{said}");
            assert_eq!(found.raster_differences == 0, damage == Damage::Ulp, "{said}");
            assert!(found.same_depth <= excused, "{said}");
        }
    }
}

#[test]
fn umbel_from_outside_and_inside() {
    let scene = builtin("umbel:5000").expect("it exists");
    check_around(&scene);
    let view = builtin_view("umbel:5000").expect("it exists");
    check(&scene, &camera(view.eye, view.target, Lens::Pinhole { fov: view.fov_degrees }));
    // Under the umbel, inside the stalk, below the ground.
    for eye in [[0.1, 1.5, 0.1], [0.0, 0.5, 0.0], [0.0, -0.05, 0.3]] {
        for lens in [PINHOLE, Lens::Cube, Lens::Equirect] {
            check(&scene, &camera(eye, [0.05, 2.0, 0.02], lens));
        }
    }
}

/// Triangles with corners before, behind and in the plane of the eye.
#[test]
fn triangles_that_cross_the_eye_plane() {
    let mut random = Random(7);
    let mut scene = Scene { name: "crossing".into(), ..Scene::default() };
    for index in 0..40_u32 {
        let mut corner = || [(); 3].map(|()| (random.unit() * 8.0 - 4.0) as f32);
        let mut corners = [corner(), corner(), corner()];
        if index % 4 == 0 {
            corners[0][2] = 0.0;
        }
        scene.positions.extend(corners);
        scene.triangles.push([0, 1, 2].map(|k| 3 * index + k));
    }
    // A floor far beyond the view on all sides.
    scene.positions.extend([[-9e3, -5.0, -9e3], [9e3, -5.0, -9e3], [9e3, -5.0, 9e3], [-9e3, -5.0, 9e3]]);
    scene.triangles.extend([[120, 121, 122], [120, 122, 123]]);
    for target in [[0.0, 0.0, -1.0], [0.3, 0.1, 1.0], [1.0, 0.0, 0.0], [0.1, -1.0, 0.2]] {
        for lens in [PINHOLE, Lens::Pinhole { fov: 150.0 }, Lens::Ortho { height: 6.0 }, Lens::Cube] {
            check(&scene, &camera([0.0; 3], target, lens));
        }
    }
    // The eye on a corner: triangles that contain it are never seen.
    let eye = scene.positions[0].map(f64::from);
    check(&scene, &camera(eye, [0.0, -3.0, 0.5], PINHOLE));
}

/// Fans of triangles around points that lie exactly on the rays of [`fan_camera`], one fan per ray.
fn fans() -> Scene {
    let mut random = Random(3);
    let mut scene = Scene { name: "fans".into(), ..Scene::default() };
    for pixel in 0..256_u32 {
        // d = (x, y, −1) has 4 bits and t has 19, so that the hub t·d is exact in f32.
        let [x, y] = [pixel % 16, pixel / 16].map(|k| (2.0 * f64::from(k) - 15.0) / 16.0);
        let t = (65536.0 + (random.unit() * 65536.0).floor()) / 65536.0 * 3.0;
        let hub = [x, -y, -1.0].map(|c| (t * c) as f32);
        let first = u32::try_from(scene.positions.len()).expect("few vertices");
        scene.positions.push(hub);
        for corner in 0..7 {
            let angle = f64::from(corner) * std::f64::consts::TAU / 7.0 + random.unit() * 0.5;
            let reach = 0.01 + 0.04 * random.unit();
            let [x, y] = [x + angle.cos() * reach, angle.sin() * reach - y];
            // Near the eye and far from it, so that no f64 holds the products of differences.
            let scale = (14.0 * random.unit() - 12.0).exp2();
            scene.positions.push([x, y, -1.0].map(|c| (c * scale) as f32));
        }
        scene.triangles.extend((0..7).map(|k| [first, first + 1 + k, first + 1 + (k + 1) % 7]));
    }
    scene
}

/// A cube, whose directions are exact. The fans fill its last face.
fn fan_camera() -> Camera {
    Camera { width: 16, ..camera([0.0; 3], [0.0, 0.0, -1.0], Lens::Cube) }
}

#[test]
fn a_wrong_answer_is_noticed() {
    let (scene, camera) = (fans(), fan_camera());
    let exact = verify(&scene, &camera, &Options::default()).expect("verified");
    assert!(exact.is_clean());
    assert!(!exact.marks[5 * 256..].contains(&Mark::Miss), "each ray meets its hub");
    let fast = Options { accuracy: Accuracy::Fast, ..Options::default() };
    let fast = verify(&scene, &camera, &fast).expect("verified");
    assert!(fast.path_differences > 0 && !fast.is_clean());
    assert!(fast.marks.contains(&Mark::Difference));
}

#[test]
fn a_difference_is_exit_code_5() {
    let (scene, place) = (fans(), place!());
    let vertices = scene.positions.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = scene.triangles.iter().map(|t| t.map(|v| v + 1));
    let faces = faces.map(|[a, b, c]| format!("f {a} {b} {c}\n"));
    place.put("fans.obj", vertices.chain(faces).collect::<String>());
    let line = "verify fans.obj --eye 0,0,0 --camera cube --cube-size 16";
    assert_eq!(place.run(line).code, Some(0));
    let run = place.run(&format!("{line} --accuracy fast --difference d.png"));
    assert_eq!(run.code, Some(5), "{}", run.stdout);
    assert!(run.stderr.starts_with("error: "), "{}", run.stderr);
    let (_, _, pixels) = umbel::files::read_png_rgb8(&place.path("d.png")).expect("a picture");
    assert!(pixels.chunks(3).any(|p| p == [235, 30, 30]), "red is a real difference");
}
