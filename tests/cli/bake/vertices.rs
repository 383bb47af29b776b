//! Vertices through the command: exact 1 and 0, owners, normals, unused vertices.

use common::command::Place;
use common::place;

use super::{CUBE, FLOOR};

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("cube.obj", CUBE);
    place
}

/// The values of a bake of all vertices.
fn bake(place: &Place, line: &str) -> Vec<f32> {
    place.quiet_run(&format!("bake {line} --vertices -o a.npy"));
    place.npy("a.npy").f32()
}

const SETS: [&str; 3] = ["shared", "interleaved", "independent"];

#[test]
fn an_open_plane_is_one() {
    let place = place();
    for set in SETS {
        for weighting in ["cosine", "uniform"] {
            let line = format!("floor.obj --set {set} --weighting {weighting} --rays 200");
            assert_eq!(bake(&place, &line), [1.0; 5], "{line}");
            assert_eq!(bake(&place, &format!("{line} --polarity occlusion")), [0.0; 5], "{line}");
        }
    }
}

/// From outside a cube is convex: nothing occludes. From inside there is no way out.
#[test]
fn a_cube_from_outside_and_inside() {
    let place = place();
    let inward: String = CUBE
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    place.put("inward.obj", inward);
    for set in SETS {
        for weighting in ["cosine", "uniform"] {
            let with = format!("--set {set} --weighting {weighting} --rays 100");
            assert_eq!(bake(&place, &format!("cube.obj {with}")), [1.0; 8], "{with}");
            assert_eq!(bake(&place, &format!("inward.obj {with}")), [0.0; 8], "{with}");
        }
    }
    // Nearby nothing is hit but the neighbouring walls; as far as 300 % everything is.
    let near = bake(&place, "inward.obj --max-distance 0.05%");
    assert!(near.iter().all(|&value| value > 0.2 && value < 0.5), "a corner sees a quarter: {near:?}");
    assert_eq!(bake(&place, "inward.obj --max-distance 300%"), [0.0; 8]);
}

/// At the inside edge of two walls a vertex sees a quarter of all directions: cos 45° of the half space above its normal, which leans
/// as far from both.
#[test]
fn the_inside_edge_of_two_planes() {
    let place = place();
    place.put(
        "edge.obj",
        "v -900 0 0\nv 0 0 0\nv 900 0 0\nv 0 0 900\nv 0 900 0\nf 1 4 2\nf 2 4 3\nf 1 2 5\nf 2 3 5\n",
    );
    let value = bake(&place, "edge.obj --rays 4000")[1];
    assert!((value - std::f32::consts::FRAC_1_SQRT_2).abs() < 0.01, "{value}");
}

/// The owner is the triangle with the largest angle, never one without area; a vertex of none has no value.
#[test]
fn owners_and_vertices_without() {
    let place = place();
    // Vertex 1: a needle that faces down, a wide triangle that faces up, and one without area. Below there is a floor.
    place.put(
        "owners.obj",
        "v 0 1 0\nv 9 1 0.1\nv 9 1 0\nv 1 1 -1\nv -1 1 -1\nv 5 5 5\nv 0 1 1\n\
         v -900 0 900\nv 900 0 900\nv 0 0 -900\n\
         f 1 7 7\nf 1 3 2\nf 1 4 5\nf 8 9 10\n",
    );
    let values = bake(&place, "owners.obj");
    assert_eq!(values.len(), 10);
    assert_eq!(values[0], 1.0, "the wide triangle faces up");
    assert!(values[5].is_nan() && values[6].is_nan(), "{values:?}");
    assert!(values[7..].iter().all(|&value| value > 0.95), "the floor is mostly open: {values:?}");
    place.quiet_run("bake owners.obj --vertices --bent b.npy");
    let bent = place.npy("b.npy");
    assert_eq!(bent.shape, [10, 3]);
    let bent = bent.f32();
    assert!(bent[15..21].iter().all(|x| x.is_nan()));
    assert!(bent[1] > 0.99, "up: {:?}", &bent[..3]);
}

/// The normals of the file weigh the rays and say which side is out.
#[test]
fn normals_of_the_file() {
    let place = place();
    let wall = "v 0 0 -900\nv 0 0 900\nv 0 900 900\nv 0 900 -900\nv 0.5 0 0\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
    let with = |normal: &str| format!("{wall}vn {normal}\nf 5//1 6//1 7//1\n");
    let mut values = Vec::new();
    for (name, normal) in [("up", "0 1 0"), ("leaning", "3 4 0"), ("down", "0 -2 0"), ("zero", "0 0 0")] {
        place.put(&format!("{name}.obj"), with(normal));
        values.push(bake(&place, &format!("{name}.obj --rays 1000"))[4]);
    }
    let [up, leaning, down, zero] = values[..] else { panic!("four values") };
    // The wall hides half of the upper hemisphere, and none of the lower one.
    assert!((up - 0.5).abs() < 0.02, "{up}");
    assert!(leaning > up + 0.15 && leaning < 0.95, "{leaning}");
    assert_eq!(down, 1.0, "the back of the triangle is out");
    assert_eq!(zero, up, "no normal is as none");
}

/// The normal is that of all faces around a vertex, however steep; where the file has two vertices there is an edge.
#[test]
fn smooth_and_sharp() {
    let place = place();
    // Two faces along the z axis, each so much steeper than level; the bent normal of the ridge is its normal.
    let ridge = |height: f32| format!("v 0 {height} 0\nv 0 {height} -4\nv -1 0 -2\nv 1 0 -2\n");
    for (height, faces, smooth) in [
        (0.2, "f 2 3 1\nf 1 4 2\n", true),
        (1.0, "f 2 3 1\nf 1 4 2\n", true),
        (1.0, "v 0 1 0\nv 0 1 -4\nf 2 3 1\nf 5 4 6\n", false),
    ] {
        place.put("roof.obj", ridge(height) + faces);
        place.quiet_run("bake roof.obj --vertices --bent b.npy --rays 4000 --set independent");
        let bent = place.npy("b.npy").f32();
        assert_eq!(bent[0].abs() < 0.05, smooth, "{height}: {bent:?}");
    }
}

/// What lies around vertices decides, and nothing else: convex corners, cones, and spheres are open, equal corners are equal.
#[test]
fn corners_see_the_whole_cone_of_their_faces() {
    let place = place();
    let sphere = |steps: usize| {
        // An octahedron's faces, cut into triangles and put on the sphere; vertices are shared.
        let mut indices = std::collections::BTreeMap::new();
        let (mut positions, mut faces) = (String::new(), String::new());
        let mut index = |x: i64, y: i64, z: i64| {
            let next = indices.len() + 1;
            *indices.entry((x, y, z)).or_insert_with(|| {
                let length = ((x * x + y * y + z * z) as f64).sqrt();
                positions +=
                    &format!("v {} {} {}\n", x as f64 / length, y as f64 / length, z as f64 / length);
                next
            })
        };
        let n = steps as i64;
        for octant in 0..8 {
            let sign = |bit: i64| if octant >> bit & 1 == 0 { 1 } else { -1 };
            let (sx, sy, sz) = (sign(0), sign(1), sign(2));
            let mut corner = |i: i64, j: i64| index(sx * i, sy * j, sz * (n - i - j));
            for i in 0..n {
                for j in 0..n - i {
                    let mut triangles = vec![[corner(i, j), corner(i + 1, j), corner(i, j + 1)]];
                    if i + j + 1 < n {
                        triangles.push([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                    }
                    for [a, b, c] in triangles {
                        let (b, c) = if sx * sy * sz > 0 { (b, c) } else { (c, b) };
                        faces += &format!("f {a} {b} {c}\n");
                    }
                }
            }
        }
        positions + &faces
    };
    place.put("octahedron.obj", sphere(1));
    place.put("sphere.obj", sphere(5));
    // A spike: a pyramid of 40 sides, ten times as high as it is wide.
    let ring: String = (0..40)
        .map(|k| {
            let angle = f64::from(k) * std::f64::consts::TAU / 40.0;
            format!("v {} 0 {}\n", angle.sin(), angle.cos())
        })
        .collect();
    let sides: String = (0..40).map(|k| format!("f 1 {} {}\n", k + 2, (k + 1) % 40 + 2)).collect();
    let bottom: Vec<String> = (2..42).rev().map(|k| k.to_string()).collect();
    place.put("spike.obj", format!("v 0 20 0\n{ring}{sides}f {}\n", bottom.join(" ")));
    for set in SETS {
        for scene in ["cube", "octahedron", "sphere", "spike"] {
            let values = bake(&place, &format!("{scene}.obj --rays 300 --set {set}"));
            assert!(values.iter().all(|&value| value == 1.0), "{scene} {set}: {values:?}");
        }
    }
    // A box of shared vertices in the middle of a floor: a quarter turn maps the scene to itself.
    place.put(
        "box.obj",
        "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
         f 4 3 2 1\nf 5 6 7 8\nf 9 12 11 10\nf 5 9 10 6\nf 6 10 11 7\nf 7 11 12 8\nf 8 12 9 5\n",
    );
    let values = bake(&place, "box.obj --rays 4000");
    for corners in [&values[4..8], &values[8..12]] {
        assert!(corners.iter().all(|value| (value - corners[0]).abs() < 0.01), "{values:?}");
    }
}

/// A saddle and a valley: the part of the half space above the normal that lies outside of the solid, as a count by
/// barycentric signs has it. The scene is a single sheet, so that only the faces at the vertex occlude.
#[test]
fn corners_of_sheets_hide_what_lies_below_them() {
    let place = place();
    // Four faces around the origin; corners as high as given: a valley, a ridge, a saddle.
    for (name, heights) in [
        ("valley", [1.0, 0.0, 1.0, 0.0]),
        ("ridge", [-1.0, 0.0, -1.0, 0.0]),
        ("bowl", [1.0; 4]),
        ("peak", [-1.0; 4]),
    ] {
        let [e, n, w, s] = heights;
        place.put(
            "sheet.obj",
            format!("v 0 0 0\nv 1000 {0} 0\nv 0 {1} -1000\nv -1000 {2} 0\nv 0 {3} 1000\nf 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\n", 1000.0 * e, 1000.0 * n, 1000.0 * w, 1000.0 * s),
        );
        let value = bake(&place, "sheet.obj --rays 20000 --set independent")[0];
        // The normal is up. Above the sheet: of the direction (x, y, z) y > e·x or so in the quarter where it points to.
        let height = |x: f64, z: f64| {
            let (east, north) = (if x > 0.0 { e } else { w }, if z < 0.0 { n } else { s });
            east * x.abs() + north * z.abs()
        };
        let mut inside = 0;
        let count = 200_000;
        for k in 0..count {
            let (u, v) = ((f64::from(k) + 0.5) / f64::from(count), f64::from(k) * 0.618_033_988_749_894_9);
            let (radius, angle) = (u.sqrt(), v * std::f64::consts::TAU);
            let (x, z, y) = (radius * angle.cos(), radius * angle.sin(), (1.0 - u).sqrt());
            inside += u32::from(y > height(x, z));
        }
        let expected = f64::from(inside) / f64::from(count);
        assert!((f64::from(value) - expected).abs() < 0.01, "{name}: {value} for {expected}");
    }
}

#[test]
fn a_scene_without_triangles() {
    let place = place();
    place.put("points.obj", "v 1 2 3\nv 4 5 6\n");
    let run = place.run("bake points.obj --vertices -o a.npy --bent b.npy --dump-rays d.npy");
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(place.npy("a.npy").f32().iter().all(|value| value.is_nan()));
    assert_eq!(place.npy("b.npy").shape, [2, 3]);
    assert_eq!(place.npy("d.npy").shape, [0, 8]);
}
