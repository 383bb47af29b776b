//! Distance cubes: values by formula, orientation, edges and corners of faces, lights in awkward places.

use std::collections::HashMap;

use common::generators::Mesh;
use common::generators::meshes::{cube, sphere, star};
use common::place;
use common::scenes::cube_direction;
use umbel::engine::{Film, GridFilm};
use umbel::glam::DVec3;
use umbel::scene::CUBE_FACES;
use umbel::shadow::{cube_map, cube_pencil, distances, face_matrices};
use umbel::{Frame, Options, Origin, Pencil, closest_hit};

use super::BOX;

/// The box's corners.
const LO: DVec3 = DVec3::new(-1.0, -2.0, -3.0);
const HI: DVec3 = DVec3::new(4.0, 5.0, 6.0);

/// The distance from inside the box to its walls.
fn distance_in_box(light: DVec3, direction: DVec3) -> f64 {
    let unit = direction.normalize();
    let along = |k: usize| {
        let wall = if unit[k] > 0.0 { HI[k] } else { LO[k] };
        if unit[k] == 0.0 { f64::INFINITY } else { (wall - light[k]) / unit[k] }
    };
    along(0).min(along(1)).min(along(2))
}

#[test]
fn a_box_around_the_light() {
    let place = place!();
    place.put("box.obj", BOX);
    for (light, size) in [([0.5, 1.25, -1.0], 7), ([3.9, 4.75, 5.5], 16), ([1.0, 1.0, 1.0], 1)] {
        let [x, y, z] = light;
        place.quiet_run(&format!("shadow box.obj --light {x},{y},{z} --cube-size {size} -o a.npy"));
        let array = place.npy("a.npy");
        assert_eq!(array.shape, [6, size, size]);
        for (texel, distance) in array.f32().into_iter().enumerate() {
            let expected = distance_in_box(light.into(), cube_direction(size, texel));
            let error = (f64::from(distance) - expected).abs();
            assert!(error <= 1.3e-7 * expected, "{texel}: {distance} for {expected}");
        }
    }
}

#[test]
fn matrices_take_texels_to_directions() {
    let size = 5;
    let pencil = cube_pencil(DVec3::ZERO, size as u32).expect("a cube");
    for texel in 0..6 * size * size {
        let (face, i, j) = (texel / (size * size), texel % size, texel / size % size);
        let [x, y] = [i, j].map(|k| (2 * k + 1) as f64 / size as f64 - 1.0);
        let matrix = face_matrices()[face];
        let by_matrix = DVec3::from_array(matrix.map(|[a, b, c]| a * x + b * y + c));
        let error = |d: DVec3| (d - cube_direction(size, texel)).abs().max_element();
        assert!(error(by_matrix) < 1e-15 && error(pencil.ray(texel).direction) < 1e-15);
    }
}

/// The six faces with every ray moved by half a texel: those of one side lie exactly on the face's edges and corners.
fn moved_faces(light: DVec3, size: u32, offset: [i32; 2]) -> Pencil {
    let scale = 1.0 / f64::from(size);
    let faces = CUBE_FACES.map(|[m, s, t]| {
        let span = [m, s * scale, -t * scale];
        Film::Grid(GridFilm::with_subpixel(size, size, span, 1, offset).expect("a face"))
    });
    Pencil::new(Origin::Point(light), faces.to_vec()).expect("a cube")
}

#[test]
fn edges_and_corners_are_the_same_from_either_face() {
    let meshes = [cube(1), cube(8), sphere(3, |_| 1.0), sphere(4, |_| 1.0), star(3, 5)];
    for (mesh, light) in
        meshes.iter().flat_map(|mesh| [(mesh, DVec3::ZERO), (mesh, DVec3::new(0.25, 0.125, -0.5))])
    {
        // Powers of two: the edges of faces are rays exactly.
        for size in [1_u32, 2, 8, 32] {
            let mut answers: HashMap<[u64; 3], (u32, u32)> = HashMap::new();
            let mut shared = 0;
            for offset in [[1, 1], [1, -1], [-1, 1], [-1, -1]] {
                let pencil = moved_faces(light, size, offset);
                let (hits, _) = closest_hit(&mesh.geometry(), &pencil, &Options::default()).expect("rays");
                let found = distances(&mesh.geometry(), &pencil, &hits);
                for (k, distance) in found.into_iter().enumerate() {
                    let key = pencil.ray(k).direction.to_array().map(|x| (x + 0.0).to_bits());
                    let answer = (hits.ids()[k], distance.to_bits());
                    let first = *answers.entry(key).or_insert(answer);
                    assert_eq!(first, answer, "{light:?} {:?}", pencil.ray(k).direction);
                    let largest = DVec3::from_array(key.map(f64::from_bits)).abs();
                    shared += usize::from(largest.to_array().iter().filter(|&&x| x == 1.0).count() > 1);
                }
            }
            // Each of the 12 edges and 8 corners, from each of their faces.
            assert!(shared as u32 >= 12 * (size - 1) * 2 + 8 * 3, "{shared} rays on edges of {size}");
        }
    }
}

#[test]
fn both_paths_and_all_threads_agree() {
    let place = place!();
    let line = "shadow builtin:umbel:2000 --light=-1.5,7,3.5 --cube-size 33 -o";
    place.quiet_run(&format!("{line} a.npy --threads 1"));
    for (k, more) in
        ["--path general", "--threads 3", "--isa sse2", "--repeat 2 --keep-order"].iter().enumerate()
    {
        if cfg!(not(target_arch = "x86_64")) && more.contains("sse2") {
            continue;
        }
        place.quiet_run(&format!("{line} b{k}.npy {more}"));
        assert!(place.bytes("a.npy") == place.bytes(&format!("b{k}.npy")), "{more}");
    }
    assert!(place.npy("a.npy").f32().contains(&f32::INFINITY), "the sky");
}

/// Several lights, and a frame that keeps the order of the triangles between them: the same as each alone.
#[test]
fn lights_do_not_disturb_each_other() {
    let mesh = star(4, 9);
    let lights = [DVec3::ZERO, DVec3::new(3.0, 0.5, 0.25), DVec3::new(1e6, -1e6, 2e6), DVec3::splat(0.3)];
    let (mut frame, options) = (Frame::keeping_order(), Options::default());
    for light in lights.iter().chain(&lights) {
        let (kept, _) = cube_map(&mesh.geometry(), *light, 17, &mut frame, &options).expect("a cube");
        let (alone, _) = cube_map(&mesh.geometry(), *light, 17, &mut Frame::new(), &options).expect("a cube");
        assert_eq!(kept, alone);
    }
}

#[test]
fn lights_in_awkward_places() {
    let mesh = cube(4);
    let cube_of = |light: DVec3| {
        let answer = cube_map(&mesh.geometry(), light, 9, &mut Frame::new(), &Options::default());
        answer.expect("a cube").0.distances().to_vec()
    };
    // On a wall, an edge, a vertex: that wall is not seen, those across are, and no ray gets lost between them.
    for light in [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::ONE, DVec3::new(1.0, 0.5, 0.25)] {
        for (texel, distance) in cube_of(light).into_iter().enumerate() {
            let d = cube_direction(9, texel);
            // Along the wall as well: ties move d by (ε, ε², ε³), which is outward.
            let leaves = (0..3).any(|k| light[k] == 1.0 && d[k] >= 0.0);
            assert!(leaves || distance.is_finite() && distance > 0.0, "{light:?} {d:?} {distance}");
            assert!(!leaves || distance == f32::INFINITY, "{light:?} {d:?} {distance}");
        }
    }
    // Inside everything is seen, from far outside nearly nothing.
    assert!(cube_of(DVec3::new(0.1, 0.2, 0.3)).iter().all(|t| t.is_finite()));
    let far = cube_of(DVec3::new(1e9, 0.25, 0.125));
    assert_eq!(far.iter().filter(|t| t.is_finite()).count(), 1, "the middle of the face toward it");
    // Without triangles nothing is hit.
    let empty = Mesh::default();
    let (map, _) =
        cube_map(&empty.geometry(), DVec3::ONE, 3, &mut Frame::new(), &Options::default()).expect("a cube");
    assert!(map.distances().iter().all(|&t| t == f32::INFINITY));
}

/// A distance that no f32 holds is the largest one: +∞ is a miss and nothing else.
#[test]
fn the_end_of_the_range_is_no_miss() {
    let far = 3e38;
    let corners = [[far, -far, -far], [far, far, -far], [far, far, far]].map(DVec3::from_array);
    let mesh = Mesh::of([corners]);
    let answer = cube_map(&mesh.geometry(), DVec3::ZERO, 64, &mut Frame::new(), &Options::default());
    let distances = answer.expect("a cube").0.distances().to_vec();
    assert!(distances.contains(&f32::MAX) && distances.iter().any(|t| (3e38..3.1e38).contains(t)));
    let hits = distances.iter().filter(|t| t.is_finite()).count();
    assert!((2016..=2080).contains(&hits), "half of the first face, not {hits}");
}
