//! The oracle against cases that a person can check, against a literal reading of the specification
//! in small integers, and against what closed meshes promise. Nothing here touches the engine.
//!
//! Meshes have coordinates that are multiples of 2^-10, so that midpoints, sums and differences of
//! them are exact in f64 and rays meet edges and vertices exactly, not nearly.
//!
//! Based on: section 5 of the design (coverage, nearest); H. Edelsbrunner and E. P. Muecke,
//! "Simulation of simplicity", 1990.

mod closed;
mod numbers;
mod order;

use closed::{marks, meshes};
use common::oracle::{OracleRay, Ties, covers};

const BOTH: [Ties; 2] = [Ties::Direction, Ties::Origin];

/// Positions and triangles.
type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// SplitMix64 (G. Steele et al., "Fast splittable pseudorandom number generators", 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// An integer in -n..=n.
    fn around(&mut self, n: u64) -> i64 {
        i64::try_from(self.next() % (2 * n + 1)).unwrap() - i64::try_from(n).unwrap()
    }

    /// A lattice point in [-n, n]^3.
    fn lattice(&mut self, n: u64) -> [i64; 3] {
        [(); 3].map(|()| self.around(n))
    }

    /// A point in [-1, 1]^3 with all 53 bits.
    fn cube(&mut self) -> [f64; 3] {
        [(); 3].map(|()| self.around(1 << 53) as f64 / 2f64.powi(53))
    }
}

fn ray(origin: [f64; 3], direction: [f64; 3], ties: Ties) -> OracleRay {
    OracleRay { origin, direction, t_min: 0.0, t_max: f64::INFINITY, ties }
}

/// How many triangles the ray hits.
fn hits((positions, triangles): &Mesh, ray: &OracleRay) -> usize {
    let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
    triangles.iter().filter(|t| covers(corners(t), ray)).count()
}

fn combine(a: [f64; 3], s: f64, b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] + s * b[k])
}

fn wide(p: [f32; 3]) -> [f64; 3] {
    p.map(f64::from)
}

// ---------------------------------------------------------------------------------------------
// The specification, word for word, in small integers.

fn minus(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Section 5, "Coverage". The second value says whether an edge function was zero.
fn covers_by_rule(tri: [[i64; 3]; 3], o: [i64; 3], d: [i64; 3], ties: Ties) -> (bool, bool) {
    let [a, b, c] = tri;
    let n = cross(minus(b, a), minus(c, a));
    let drop = match ties {
        Ties::Direction => dot(minus(a, o), cross(minus(b, o), minus(c, o))),
        Ties::Origin => dot(d, n),
    };
    if drop == 0 {
        return (false, false);
    }
    let edges = [(a, b), (b, c), (c, a)].map(|(a, b)| match ties {
        Ties::Direction => {
            let n = cross(minus(a, o), minus(b, o));
            (dot(d, n), n)
        }
        Ties::Origin => {
            let n = cross(d, minus(b, a));
            (dot(minus(o, a), n), n)
        }
    });
    let sign = |(e, n): (i64, [i64; 3])| match e {
        0 => n.iter().find(|&&k| k != 0).expect("not dropped").signum(),
        _ => e.signum(),
    };
    let [p, q, r] = edges.map(sign);
    let behind = dot(minus(a, o), n).signum() != dot(d, n).signum();
    (p == q && q == r && !behind, edges.iter().any(|(e, _)| *e == 0))
}

#[test]
fn the_rule_of_the_first_component_is_the_move_by_epsilon() {
    let mut random = Random(1);
    let (mut covered, mut tied) = (0, 0);
    for round in 0..60_000 {
        let size = [1, 2, 3, 9][round % 4];
        let [a, b, c, o, d] = [(); 5].map(|()| random.lattice(size));
        if d == [0; 3] {
            continue;
        }
        for ties in BOTH {
            let real = ray(o.map(|k| k as f64), d.map(|k| k as f64), ties);
            let (expected, tie) = covers_by_rule([a, b, c], o, d, ties);
            for order in [[a, b, c], [b, c, a], [c, b, a]] {
                let tri = order.map(|p| p.map(|k| k as f32));
                assert_eq!(covers(tri, &real), expected, "{order:?} {real:?}");
            }
            covered += usize::from(expected);
            tied += usize::from(expected && tie);
        }
    }
    assert!(covered > 3_000 && tied > 1_000, "{covered} covered, {tied} by a tie");
}

// ---------------------------------------------------------------------------------------------
// Edges and vertices.

/// A unit square over [-1, 1]^2 in the plane `axis` = 0, cut along one of its diagonals.
fn square(axis: usize, other_diagonal: bool, flip: bool) -> [[[f32; 3]; 3]; 2] {
    let at = |x: f32, y: f32| {
        let mut p = [0.0; 3];
        p[(axis + 1) % 3] = if other_diagonal { -x } else { x };
        p[(axis + 2) % 3] = y;
        p
    };
    let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
    if flip { [[a, c, b], [a, c, d]] } else { [[a, b, c], [a, c, d]] }
}

#[test]
fn a_shared_edge_belongs_to_one_triangle() {
    for case in 0..48 {
        let (axis, ties) = (case % 3, BOTH[case / 3 % 2]);
        let [other, flip, below] = [6, 12, 24].map(|n| case / n % 2 == 1);
        let tris = square(axis, other, flip);
        for s in [0.0, 0.5, -0.25, 0.984375] {
            let mut target = [s; 3];
            target[axis] = 0.0;
            target[(axis + 1) % 3] = if other { -s } else { s };
            for slope in [[0.0, 0.0], [0.5, 0.5], [-0.25, 0.125], [3.0, -1.0]] {
                let mut d = [0.0; 3];
                d[axis] = if below { 1.0 } else { -1.0 };
                d[(axis + 1) % 3] = slope[0];
                d[(axis + 2) % 3] = slope[1];
                let real = ray(combine(target, -2.0, d), d, ties);
                let count = tris.iter().filter(|t| covers(**t, &real)).count();
                assert_eq!(count, 1, "{tris:?} {real:?}");
            }
        }
    }
}

#[test]
fn a_tie_goes_where_the_shift_points() {
    // Plane z = 0, diagonal x = y: the first triangle has x > y, the second x < y.
    // d + (e, e^2, e^3) and p + (e, e^2, e^3) meet the plane at greater x than y.
    let [right, left] = square(2, false, false);
    for ties in BOTH {
        let down = ray([0.5, 0.5, 4.0], [0.0, 0.0, -1.0], ties);
        assert!(covers(right, &down) && !covers(left, &down));
    }
    // From below, to the centre: still x + e, whatever way the ray goes.
    for ties in BOTH {
        let up = ray([0.0, 0.0, -4.0], [0.0, 0.0, 8.0], ties);
        assert!(covers(right, &up) && !covers(left, &up));
    }
    // The outer edge x = 1 is lost, the outer edge x = -1 is kept; so with y.
    for ties in BOTH {
        let at = |x, y| ray([x, y, 1.0], [0.0, 0.0, -1.0], ties);
        assert!(!covers(right, &at(1.0, 0.0)) && covers(left, &at(-1.0, 0.5)));
        assert!(covers(right, &at(0.5, -1.0)) && !covers(left, &at(-0.5, 1.0)));
    }
}

#[test]
fn a_fan_vertex_belongs_to_one_triangle() {
    // Rim points all around the axis, so that every half plane is met; not all at one height.
    let ring = [(4, 0), (3, 2), (0, 5), (-2, 2), (-4, 0), (-3, -3), (0, -4), (1, -1)];
    for case in 0..12 {
        let (axis, ties) = (case % 3, BOTH[case / 3 % 2]);
        let lift = if case / 6 == 0 { 0 } else { 1 };
        let rim: Vec<[f32; 3]> = (0..)
            .zip(ring)
            .map(|(i, (x, y))| {
                let mut p = [0.0; 3];
                p[axis] = (lift * (i % 3)) as f32;
                p[(axis + 1) % 3] = x as f32;
                p[(axis + 2) % 3] = y as f32;
                p
            })
            .collect();
        for (from, to) in [([0.0, 0.0], [0.0, 0.0]), ([1.0, -0.5], [0.0, 0.0]), ([1.0, 0.5], [2.0, 1.0])] {
            let mut o = [16.0; 3];
            let mut target = [0.0; 3];
            for k in 0..2 {
                o[(axis + 1 + k) % 3] = from[k];
                target[(axis + 1 + k) % 3] = if lift == 0 { to[k] } else { 0.0 };
            }
            let real = ray(o, combine(target, -1.0, o), ties);
            let fan = (0..8).map(|i| [[0.0; 3], rim[i], rim[(i + 1) % 8]]);
            assert_eq!(fan.filter(|t| covers(*t, &real)).count(), 1, "{rim:?} {real:?}");
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Speed.

/// Not a test of anything: `cargo test --release --test exactness -- oracle_self:: --ignored --nocapture`.
#[test]
#[ignore = "measures the speed"]
#[expect(clippy::print_stdout, reason = "the measurement is the output")]
fn speed() {
    let mut random = Random(5);
    let measure = |name: &str, mesh: &Mesh, rays: &[OracleRay]| {
        let start = std::time::Instant::now();
        let count: usize = rays.iter().map(|r| hits(mesh, r)).sum();
        let seconds = start.elapsed().as_secs_f64();
        let decisions = (rays.len() * mesh.1.len()) as f64;
        println!("{name}: {:.2} M/s, {count} hits", decisions / seconds / 1e6);
    };
    let [.., sphere] = meshes();
    let lattice: Vec<_> = marks(&sphere).iter().map(|m| ray([0.0; 3], *m, Ties::Direction)).collect();
    measure("marks of the sphere (ties)", &sphere, &lattice);
    let mut soup = |size: f64, n: u32| -> Mesh {
        let positions = (0..n).flat_map(|_| {
            let centre = random.cube();
            [(); 3].map(|()| combine(centre, size, random.cube()).map(|k| k as f32))
        });
        (positions.collect(), (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    };
    let scenes = [("large triangles", soup(1.0, 1000)), ("small triangles", soup(0.05, 1000))];
    for (name, mesh) in &scenes {
        for ties in BOTH {
            let rays: Vec<_> = (0..300).map(|_| ray(random.cube(), random.cube(), ties)).collect();
            measure(&format!("{name}, random f64 rays, {ties:?}"), mesh, &rays);
        }
    }
}
