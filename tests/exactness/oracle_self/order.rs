//! What is dropped, and in which order hits come.

use common::oracle::{OracleRay, any, closest, covers};

use super::closed::octahedron;
use super::{BOTH, ray};

#[test]
fn edge_on_and_degenerate_triangles_are_dropped() {
    let flat = [[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]];
    for ties in BOTH {
        // The ray runs in the plane x = 0, through the triangle.
        assert!(!covers(flat, &ray([0.0, -4.0, 0.0], [0.0, 1.0, 0.0], ties)));
        // All corners on a line, or in a point, on the ray.
        let line = [[-1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0]];
        assert!(!covers(line, &ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], ties)));
        assert!(!covers([[0.0; 3]; 3], &ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], ties)));
    }
}

#[test]
fn a_triangle_that_contains_the_origin_is_never_hit() {
    let tri = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    for ties in BOTH {
        for o in [[0.0; 3], [0.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [7.0, 0.0, 0.0]] {
            for d in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 2.0, 1.0], [-1.0, 0.0, 0.0]] {
                assert!(!covers(tri, &ray(o, d, ties)));
            }
        }
        let least = f64::from(f32::from_bits(1));
        assert!(covers(tri, &ray([0.0, 0.0, least], [0.0, 0.0, -1.0], ties)));
        assert!(!covers(tri, &ray([0.0, 0.0, -least], [0.0, 0.0, -1.0], ties)));
    }
}

#[test]
fn equal_distances_go_to_the_smaller_id() {
    let (positions, mut triangles) = octahedron();
    triangles.extend(triangles.clone());
    for ties in BOTH {
        let real = ray([0.0; 3], [1.0, 2.0, 4.0], ties);
        // Triangle 0 has all coordinates positive: x + y + z = 1 at t = 1/7.
        let expected = Some((0, 1.0 / 7.0));
        assert_eq!(closest(&positions, &triangles, &real), expected);
        let reversed: Vec<_> = triangles.iter().rev().copied().collect();
        assert_eq!(closest(&positions, &reversed, &real), Some((7, 1.0 / 7.0)));
    }
}

#[test]
fn nearer_wins_by_exact_distance() {
    // Two planes at 1 and one f32 step less: far below what f64 sees once the origin is far away.
    let at = |x: f32| [[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 0.0, 1.0]];
    let step = f32::from_bits(1);
    let positions = [at(0.0), at(-step), at(step)].concat();
    let triangles = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];
    for ties in BOTH {
        let right = ray([-(2f64.powi(100)), 0.0, 0.0], [1.0, 0.0, 0.0], ties);
        assert_eq!(closest(&positions, &triangles, &right), Some((1, 2f32.powi(100))));
        let left = ray([2f64.powi(100), 0.0, 0.0], [-1.0, 0.0, 0.0], ties);
        assert_eq!(closest(&positions, &triangles, &left), Some((2, 2f32.powi(100))));
    }
}

#[test]
fn the_range_of_t_is_open() {
    let positions = [[-1.0, -1.0, 3.0], [1.0, -1.0, 3.0], [0.0, 1.0, 3.0]];
    let seen = |t_min, t_max| {
        BOTH.map(|ties| {
            let real = OracleRay { t_min, t_max, ..ray([0.0; 3], [0.0, 0.0, 2.0], ties) };
            let found = closest(&positions, &[[0, 1, 2]], &real);
            assert_eq!(found.is_some(), any(&positions, &[[0, 1, 2]], &real));
            assert!(found.is_none() || found == Some((0, 1.5)));
            found.is_some()
        })
    };
    assert_eq!(seen(0.0, f64::INFINITY), [true; 2]);
    assert_eq!(seen(1.5, f64::INFINITY), [false; 2]);
    assert_eq!(seen(0.0, 1.5), [false; 2]);
    assert_eq!(seen(1.5f64.next_down(), 1.5f64.next_up()), [true; 2]);
    assert_eq!(seen(-1.0, 0.0), [false; 2]);
}
