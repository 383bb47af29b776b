//! Closed meshes: spheres, star shapes, cubes and tori. Triangles of one edge have bit-equal ends.

use std::collections::HashMap;
use std::f64::consts::PI;

use umbel::glam::DVec3;

use super::Mesh;
use crate::random::Random;

/// An octahedron whose faces are cut in four `levels` times, vertices moved to `radius` of their direction.
pub fn sphere(levels: u32, radius: impl Fn(DVec3) -> f64) -> Mesh {
    let corners = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut points = corners.to_vec();
    let mut triangles = Vec::new();
    for k in 0..8_u32 {
        let [x, y, z] = [k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2)];
        let odd = k.count_ones() % 2 == 1;
        triangles.push(if odd { [x, z, y] } else { [x, y, z] });
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let split = triangles.iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        });
        triangles = split.collect();
    }
    let mut mesh = Mesh::default();
    for p in points {
        mesh.vertex(p * radius(p));
    }
    mesh.triangles = triangles;
    mesh
}

/// A closed star-shaped mesh: each vertex of a sphere at a radius of its own.
pub fn star(levels: u32, seed: u64) -> Mesh {
    sphere(levels, |p| {
        let seed = p.to_array().iter().fold(seed, |s, x| s ^ x.to_bits());
        0.6 + 0.4 * Random(seed).signed().abs()
    })
}

/// The cube [-1, 1]^3 with n x n squares per face.
pub fn cube(n: i32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
                let at = |i: i32, j: i32| {
                    let on = |k: i32| f64::from(2 * k - n) / f64::from(n);
                    let mut p = DVec3::ZERO;
                    p[axis] = side;
                    p[(axis + 1) % 3] = on(i);
                    p[(axis + 2) % 3] = on(j);
                    p
                };
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                // Counterclockwise from outside.
                let [b, d] = if side > 0.0 { [b, d] } else { [d, b] };
                mesh.triangle([a, b, c]);
                mesh.triangle([a, c, d]);
            }
        }
    }
    mesh
}

/// A torus of radii 1 and 0.4.
pub fn torus(n: u32, m: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for k in 0..n * m {
        let angle = |k: u32, n: u32| 2.0 * PI * f64::from(k) / f64::from(n);
        let (a, b) = (angle(k / m, n), angle(k % m, m));
        let r = 1.0 + 0.4 * b.cos();
        mesh.vertex(DVec3::new(r * a.cos(), 0.4 * b.sin(), r * a.sin()));
    }
    for (i, j) in (0..n * m).map(|k| (k / m, k % m)) {
        let at = |i: u32, j: u32| i % n * m + j % m;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// Whether each oriented edge between bit-equal positions has its opposite, once: then the triangles are a closed surface.
pub fn is_closed(mesh: &Mesh) -> bool {
    let mut balance: HashMap<_, i32> = HashMap::new();
    let key = |v: u32| mesh.positions[v as usize].map(|x| (x + 0.0).to_bits());
    for [a, b, c] in &mesh.triangles {
        let [a, b, c] = [a, b, c].map(|&v| key(v));
        for (a, b) in [(a, b), (b, c), (c, a)] {
            // Opposite edges cancel; a degenerate edge cancels itself.
            *balance.entry((a.min(b), a.max(b))).or_default() += i32::from(a < b) - i32::from(a > b);
        }
    }
    balance.values().all(|&n| n == 0)
}
