//! Closed meshes: a ray from inside leaves once, one from outside hits an even number of triangles, through edges and vertices too.

use std::collections::HashMap;

use common::oracle::{OracleRay, any, closest};

use super::{BOTH, Mesh, combine, hits, ray, wide};

fn tetrahedron() -> Mesh {
    let positions = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    (positions, vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
}

pub(crate) fn octahedron() -> Mesh {
    let positions = (0..6)
        .map(|i| {
            let mut p = [0.0; 3];
            p[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
            p
        })
        .collect();
    let triangles = (0..8).map(|i| [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)]).collect();
    (positions, triangles)
}

/// Every edge halved and pushed to the unit sphere, rounded to multiples of 2^-10.
pub(crate) fn subdivided((mut positions, triangles): Mesh) -> Mesh {
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let sum = combine(wide(positions[a as usize]), 1.0, wide(positions[b as usize]));
            let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
            positions.push(sum.map(|k| ((k / length * 1024.0).round() / 1024.0) as f32));
            u32::try_from(positions.len()).unwrap() - 1
        })
    };
    let mut parts = Vec::new();
    for [a, b, c] in triangles {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (positions, parts)
}

pub(crate) fn meshes() -> [Mesh; 4] {
    let once = subdivided(octahedron());
    [tetrahedron(), octahedron(), once.clone(), subdivided(once)]
}

/// All vertices and all midpoints of edges.
pub(crate) fn marks((positions, triangles): &Mesh) -> Vec<[f64; 3]> {
    let mut marks: Vec<_> = positions.iter().map(|p| wide(*p)).collect();
    for t in triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].iter().filter(|(a, b)| a < b) {
            let [a, b] = [a, b].map(|v| wide(positions[*v as usize]));
            marks.push(combine(a, -0.5, combine(a, -1.0, b)));
        }
    }
    marks
}

#[test]
fn a_ray_from_inside_leaves_once() {
    let origins = [[0.0; 3], [0.125, 0.0, 0.0], [0.0625, -0.03125, 0.125], [0.0, 0.125, -0.125]];
    for mesh in meshes() {
        for (target, o) in marks(&mesh).iter().flat_map(|m| origins.map(|o| (*m, o))) {
            for ties in BOTH {
                let real = ray(o, combine(target, -1.0, o), ties);
                assert_eq!(hits(&mesh, &real), 1, "{real:?}");
                assert!(any(&mesh.0, &mesh.1, &real));
                // A vertex or a midpoint is where the direction ends: t = 1, unless it is hidden
                // (rounding to 2^-10 leaves the spheres not quite convex).
                let (_, t) = closest(&mesh.0, &mesh.1, &real).unwrap();
                assert!((t - 1.0).abs() < 0.01, "{t} {real:?}");
            }
        }
    }
}

#[test]
fn a_ray_from_outside_hits_an_even_number() {
    let directions = [[1, 0, 0], [0, 0, -1], [1, 1, 0], [0, -1, 1], [1, -1, 1], [3, 1, -2]];
    let mut silhouettes = 0;
    for mesh in meshes() {
        for target in marks(&mesh) {
            for d in directions.map(|d| d.map(f64::from)) {
                for ties in BOTH {
                    let real = ray(combine(target, -4.0, d), d, ties);
                    let count = hits(&mesh, &real);
                    assert_eq!(count % 2, 0, "{count} {real:?}");
                    silhouettes += usize::from(count == 0);
                    // Backwards from the same place there is nothing.
                    let back = OracleRay { direction: d.map(|k| -k), ..real };
                    assert_eq!(hits(&mesh, &back), 0, "{real:?}");
                }
            }
        }
    }
    assert!(silhouettes > 0, "no ray slipped past: the shift does nothing");
}
