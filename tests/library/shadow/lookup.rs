//! The lookup of a cube map: a plane never shadows itself, the bias follows resolution and slope, errors are counted.

use common::generators::meshes::{cube, sphere};
use common::generators::{Mesh, widen};
use common::random::Random;
use umbel::engine::{Film, shadowed};
use umbel::glam::DVec3;
use umbel::shadow::{CubeMap, MapErrors, compare_maps, cube_map, receivers};
use umbel::{Frame, Options, Origin, Pencil, TriangleId, closest_hit};

/// The cube map of a light.
fn map(mesh: &Mesh, light: DVec3, size: u32) -> CubeMap {
    let answer = cube_map(&mesh.geometry(), light, size, &mut Frame::new(), &Options::default());
    answer.expect("a cube").0
}

/// What the map gets wrong of what an eye sees in random directions.
fn errors(mesh: &Mesh, eye: DVec3, light: DVec3, size: u32) -> MapErrors {
    let mut random = Random(31);
    let directions = (0..4000).map(|_| random.cube()).collect();
    let pencil = Pencil::new(Origin::Point(eye), vec![Film::Scattered(directions)]).expect("rays");
    let (hits, _) = closest_hit(&mesh.geometry(), &pencil, &Options::default()).expect("hits");
    assert!((0..4000).all(|ray| hits.get(ray).is_some()), "the room is closed");
    let (geometry, origin) = (mesh.geometry(), Origin::Point(light));
    let receivers = receivers(&geometry, &pencil, &hits, &[origin]).expect("receivers").remove(0);
    let exact = shadowed(&geometry, origin, &receivers.points, &Options::default()).expect("answers").0;
    compare_maps(&geometry, &map(mesh, light, size), &receivers.points, &exact)
}

/// Planes at all slopes, near and far, at each resolution: no point of them is in their own shadow.
#[test]
fn planes_do_not_shadow_themselves() {
    let mut random = Random(32);
    let (mut asked, mut seen) = (0, 0);
    for round in 0..400 {
        let scale = random.pick(&[1e-6, 1.0, 1e6]);
        let size = random.pick(&[1, 2, 7, 64]);
        let light = random.cube() * scale;
        // Large against its distance, so that the texels around a point see the plane.
        let (x, y) = (random.cube(), random.cube());
        let middle = light + random.cube() * scale * random.pick(&[1.0, 0.05]);
        let corner = |a: f64, b: f64| middle + (x * a + y * b) * scale * 40.0;
        let mesh = Mesh::of([[corner(-1.0, -1.0), corner(2.0, -1.0), corner(-1.0, 2.0)]]);
        let (geometry, id) = (mesh.geometry(), TriangleId(0));
        let Some(side) = geometry.side_of(id, light) else { continue };
        let map = map(&mesh, light, size);
        for _ in 0..100 {
            let (u, v) = (random.signed().abs() * 0.6, random.signed().abs() * 0.4);
            let near = random.pick(&[1.0, 0.02]);
            let third = (1.0 - near) / 3.0;
            let weights = [1.0 - u - v, u, v].map(|w| w * near + third);
            let point = widen(geometry.leave(id, weights, side));
            let normal = geometry.normal(id);
            assert!(map.is_lit(point, normal), "{round}: {size} {point:?} from {light:?}\n{mesh:?}");
            asked += 1;
            seen += usize::from(map.distance(point - light).is_finite());
        }
    }
    assert!(asked > 30_000 && seen > asked / 2, "{seen} of {asked}");
}

#[test]
fn the_bias_follows_resolution_and_slope() {
    let (light, point) = (DVec3::ZERO, DVec3::new(0.25, -2.0, 0.5));
    let cube_of =
        |size: u32| CubeMap::new(light, size, vec![1.0; 6 * (size * size) as usize]).expect("a cube");
    let bias = |size: u32, slope: f64| cube_of(size).bias(point, DVec3::new(slope, 1.0, 0.0));
    for size in [4, 16, 64, 256] {
        // Twice the resolution, half the bias, nearly.
        let ratio = bias(size, 1.0) / bias(2 * size, 1.0);
        assert!((1.5..=2.1).contains(&ratio), "{ratio}");
        assert!(
            bias(size, 0.0) > 0.0 && bias(size, 0.0) < bias(size, 1.0) && bias(size, 1.0) < bias(size, 3.0)
        );
        // Seen edge-on it is the whole distance.
        let edge_on = cube_of(size).bias(point, DVec3::new(2.0, 0.0, -1.0));
        assert_eq!(edge_on, point.length());
    }
    // Its size does not depend on the length of the normal, nor on its sign.
    let of = |normal: DVec3| cube_of(64).bias(point, normal);
    let n = DVec3::new(0.5, 1.0, -0.25);
    assert!((of(n) - of(n * -7.0)).abs() < 1e-12);
}

#[test]
fn a_texel_answers_for_its_directions() {
    let size = 4;
    let numbered: Vec<f32> = (0..6 * size * size).map(|k| k as f32).collect();
    let map = CubeMap::new(DVec3::ONE, size, numbered).expect("a cube");
    let pencil = umbel::shadow::cube_pencil(DVec3::ONE, size).expect("a cube");
    for texel in 0..pencil.len() {
        for length in [1.0, 1e-6, 1e6] {
            assert_eq!(map.distance(pencil.ray(texel).direction * length), texel as f32);
        }
    }
    // On edges and corners some neighbour answers; so does it for no direction at all.
    for x in [-1.0, 0.0, 1.0] {
        for (y, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)] {
            assert!(map.distance(DVec3::new(x, y, z)) < 96.0);
        }
    }
    assert!(CubeMap::new(DVec3::ONE, 4, vec![1.0; 95]).is_err());
    assert!(CubeMap::new(DVec3::ONE, 0, Vec::new()).is_err());
}

/// In an empty room nothing is in shadow. The map knows, but for inner corners, where a texel's middle sees another wall. A
/// ball in the room makes errors of both kinds, fewer with more texels.
#[test]
fn errors_are_counted() {
    let room = cube(3);
    let (eye, light) = (DVec3::new(0.5, 0.3, -0.4), DVec3::new(-0.5, 0.6, 0.2));
    for size in [1, 16, 100] {
        let found = errors(&room, eye, light, size);
        assert_eq!(found.receivers, 4000);
        assert_eq!(found.leaks, 0, "{size}");
        assert!(found.acne * size as usize <= 400, "{size}: {}", found.acne);
        assert!(found.median_bias > 0.0 && found.greatest_bias >= found.median_bias);
    }
    let mut scene = room;
    let ball = sphere(4, |_| 0.3);
    (0..ball.triangles.len()).for_each(|id| scene.triangle(ball.corners(id)));
    let found = [8, 32, 128, 512].map(|size| errors(&scene, eye, light, size));
    let wrong = found.map(|found| found.acne + found.leaks);
    assert!(wrong[0] > 100 && wrong[1] < wrong[0] && wrong[2] < wrong[1] && wrong[3] < wrong[2], "{wrong:?}");
    assert!(wrong[3] * 100 < 4000, "{wrong:?}");
    assert!(found[0].leaks > 0 && found[0].receivers < 4000, "the ball has a dark side");
}
