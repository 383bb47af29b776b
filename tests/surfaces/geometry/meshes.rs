//! Meshes that several tests displace and subdivide.

use common::place;
use common::random::Random;
use umbel::Scene;
use umbel::formats::read_obj;

/// A scene from OBJ text.
pub(crate) fn obj(text: &str) -> Scene {
    let place = place!();
    place.put("mesh.obj", text);
    read_obj(&place.path("mesh.obj"), &Default::default()).expect("an OBJ file")
}

/// A cube of quads, ±1, with one texture chart per face.
pub(crate) fn cube() -> Scene {
    let mut text = String::new();
    for k in 0..8 {
        let side = |bit: i32| if k >> bit & 1 == 0 { -1 } else { 1 };
        text += &format!("v {} {} {}\n", side(0), side(1), side(2));
    }
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {a}/1 {b}/2 {c}/3 {d}/4\n");
    }
    obj(&text)
}

/// A closed sphere of triangles, with exact normals and texture coordinates that have a seam.
pub(crate) fn sphere(columns: u32, rows: u32) -> Scene {
    let mut text = String::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            // The seam closes to the bit.
            let (sin, cos) = (f64::from(i % columns) / f64::from(columns) * std::f64::consts::TAU).sin_cos();
            let (ring, y) = match j {
                0 => (0.0, -1.0),
                j if j == rows => (0.0, 1.0),
                _ => (v * std::f64::consts::PI).sin_cos(),
            };
            let y = if j == 0 || j == rows { y } else { -y };
            let p = format!("{} {} {}", (ring * cos) as f32, y as f32, (ring * sin) as f32);
            text += &format!("v {p}\nvn {p}\nvt {u} {v}\n");
        }
    }
    let index = |i: u32, j: u32| {
        let k = j * (columns + 1) + i + 1;
        format!("{k}/{k}/{k}")
    };
    for (i, j) in (0..columns * rows).map(|k| (k % columns, k / columns)) {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        if j + 1 < rows {
            text += &format!("f {a} {d} {c}\n");
        }
        if j > 0 {
            text += &format!("f {a} {c} {b}\n");
        }
    }
    obj(&text)
}

/// Quads in a plane with one vertex of so many faces in the middle, heights at random: a fan of `faces` quads within a ring of
/// others, so that the middle and what is around it lie inside.
pub(crate) fn star(faces: u32, random: &mut Random) -> Scene {
    let mut text = String::from("v 0 0.5 0\n");
    // Rings of 2·faces vertices each: ends of edges and farthest vertices of quads, alternately.
    for ring in 1..=2 {
        for k in 0..2 * faces {
            let angle = f64::from(k) / f64::from(2 * faces) * std::f64::consts::TAU;
            let radius = f64::from(ring) * if k % 2 == 0 { 1.0 } else { 1.3 };
            let height = random.unit() - 0.5;
            text += &format!("v {} {height} {}\n", radius * angle.cos(), -radius * angle.sin());
        }
    }
    let at = |ring: u32, k: u32| 2 + (ring - 1) * 2 * faces + k % (2 * faces);
    for k in 0..faces {
        text += &format!("f 1 {} {} {}\n", at(1, 2 * k), at(1, 2 * k + 1), at(1, 2 * k + 2));
    }
    for k in 0..2 * faces {
        text += &format!("f {} {} {} {}\n", at(1, k), at(2, k), at(2, k + 1), at(1, k + 1));
    }
    obj(&text)
}

/// An open sheet of n x n quads over the square ±1, heights at random.
pub(crate) fn sheet(n: u32, random: &mut Random) -> Scene {
    let mut text = String::new();
    for (i, j) in (0..(n + 1) * (n + 1)).map(|k| (k % (n + 1), k / (n + 1))) {
        let [x, z] = [i, j].map(|k| f64::from(k) / f64::from(n) * 2.0 - 1.0);
        text += &format!("v {x} {} {}\n", random.unit() - 0.5, -z);
    }
    for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
        let at = |i: u32, j: u32| j * (n + 1) + i + 1;
        text += &format!("f {} {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
    obj(&text)
}

/// Triangles, a quad and a pentagon, closed: a house with a roof.
pub(crate) fn house() -> Scene {
    obj("v 0 0 0\nv 2 0 0\nv 2 0 3\nv 0 0 3\nv 0 2 0\nv 2 2 0\nv 2 2 3\nv 0 2 3\nv 1 3 0\nv 1 3 3\n\
         f 1 2 3 4\nf 2 1 5 9 6\nf 4 3 7 10 8\nf 1 4 8 5\nf 3 2 6 7\nf 5 8 10\nf 5 10 9\nf 6 9 10 7\n")
}

/// Three squares at one edge, and two pyramids that meet in one vertex: nothing of it is a manifold.
pub(crate) fn tangle() -> Scene {
    obj("v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv -1 0 1\nv -1 1 1\nv -1 0 -1\nv -1 1 -1\n\
         v 0 2 1\nv 1 2 1\nv 0 2 2\nv 1 3 1\n\
         f 1 3 4 2\nf 1 2 6 5\nf 1 7 8 2\nf 2 9 10\nf 2 12 11\n")
}
