//! A sphere that is unwrapped by longitude and latitude: receivers and normals where the map says.

use std::f64::consts::{PI, TAU};

use umbel::engine::Side;
use umbel::glam::DVec3;
use umbel::scene::NO_INDEX;
use umbel::{Scene, TriangleId};

use super::scenes::{atlas, push_quad, soup};

const SECTORS: u32 = 64;
const RINGS: u32 = 32;

/// The point of the unit sphere at (u, v): u runs around +y, v from the south to the north pole.
fn sphere(u: f64, v: f64) -> DVec3 {
    let (longitude, latitude) = (TAU * u, PI * (v - 0.5));
    DVec3::new(longitude.sin() * latitude.cos(), latitude.sin(), longitude.cos() * latitude.cos())
}

/// The sphere without its poles' rings, outside in front, with normals.
fn globe() -> Scene {
    let mut scene = Scene { name: "globe".into(), ..Scene::default() };
    for (i, j) in (0..SECTORS).flat_map(|i| (1..RINGS - 1).map(move |j| (i, j))) {
        let uv = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]]
            .map(|[i, j]| [i as f32 / SECTORS as f32, j as f32 / RINGS as f32]);
        let points = uv.map(|[u, v]| sphere(f64::from(u), f64::from(v)).as_vec3().to_array());
        push_quad(&mut scene, points, uv);
    }
    scene.normals = scene.positions.clone();
    scene.normal_indices = scene.triangles.clone();
    scene
}

#[test]
fn receivers_of_a_globe_lie_where_the_map_says() {
    let scene = globe();
    let geometry = scene.geometry().expect("finite");
    let (size, samples) = (96, 3);
    let atlas = atlas(&scene, size, samples);
    let all = atlas.band(0..size);
    // And one receiver for each texel beyond, in the two rows that the outermost rings only touch.
    assert_eq!(all.len(), (size * samples * size * (RINGS - 2) / RINGS + 2 * size) as usize);
    for receiver in &all {
        let weights = receiver.barycentrics();
        let normal = scene.shading_normal(&geometry, receiver.triangle, weights);
        assert!((normal.length() - 1.0).abs() < 1e-12);
        assert_eq!(geometry.side_toward(receiver.triangle, normal), Some(Side::Front));
        let point = geometry.leave(receiver.triangle, weights, Side::Front);
        let point = DVec3::from_array(point.map(f64::from));
        // Within a texel of the centre: one is TAU / 96 wide at the equator.
        let (column, row) = (receiver.texel % size, receiver.texel / size);
        let centre = [column, row].map(|k| (f64::from(k) + 0.5) / f64::from(size));
        let expected = sphere(centre[0], 1.0 - centre[1]);
        assert!((point - expected).length() < 0.06, "{receiver:?}: {point} instead of {expected}");
        assert!((normal - point.normalize()).length() < 0.01);
    }
}

#[test]
fn shading_normals_fall_back_to_the_triangle() {
    let mut scene = soup(&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
    let normal = |scene: &Scene, weights: [f64; 3]| {
        scene.shading_normal(&scene.geometry().expect("finite"), TriangleId(0), weights)
    };
    let third = [1.0 / 3.0; 3];
    assert_eq!(normal(&scene, third), DVec3::Z);
    scene.normals = vec![[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [-2.0, 0.0, 0.0]];
    scene.normal_indices = vec![[0, 1, 2]];
    assert_eq!(normal(&scene, third), DVec3::Y);
    assert_eq!(normal(&scene, [1.0, 0.0, 0.0]), DVec3::X);
    // Those of a and c cancel.
    assert_eq!(normal(&scene, [0.5, 0.0, 0.5]), DVec3::Z);
    scene.normal_indices[0][1] = NO_INDEX;
    assert_eq!(normal(&scene, third), DVec3::Z);
}
