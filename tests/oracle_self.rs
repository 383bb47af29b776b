//! The oracle against cases that a person can check, against a literal reading of the specification
//! in small integers, and against what closed meshes promise. Nothing here touches the engine.
//!
//! Meshes have coordinates that are multiples of 2^-10, so that midpoints, sums and differences of
//! them are exact in f64 and rays meet edges and vertices exactly, not nearly.
//!
//! Based on: section 5 of the design (coverage, nearest); H. Edelsbrunner and E. P. Muecke,
//! "Simulation of simplicity", 1990.

mod oracle;

use std::collections::HashMap;

use num_bigint::BigInt;
use oracle::{Dyadic, OracleRay, Scaled, Ties, any, closest, covers, grid_ray, grid_start, hit_in, round_t};

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
// Closed meshes.

fn tetrahedron() -> Mesh {
    let positions = vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    (positions, vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
}

fn octahedron() -> Mesh {
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
fn subdivided((mut positions, triangles): Mesh) -> Mesh {
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

fn meshes() -> [Mesh; 4] {
    let once = subdivided(octahedron());
    [tetrahedron(), octahedron(), once.clone(), subdivided(once)]
}

/// All vertices and all midpoints of edges.
fn marks((positions, triangles): &Mesh) -> Vec<[f64; 3]> {
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

// ---------------------------------------------------------------------------------------------
// What is dropped, and in which order hits come.

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

// ---------------------------------------------------------------------------------------------
// Numbers.

#[test]
fn t_is_rounded_as_f32_division_rounds() {
    let round = |a: f64, b: f64| round_t(&Dyadic::from_f64(a), &Dyadic::from_f64(b));
    let mut random = Random(2);
    let positive = |bits: u64| f32::from_bits((bits % 0x7f80_0000).max(1) as u32);
    for _ in 0..50_000 {
        // All exponents: quotients overflow, underflow and become subnormal.
        let [a, b] = [(); 2].map(|()| positive(random.next()));
        let expected = (a / b).clamp(f32::from_bits(1), f32::MAX);
        assert_eq!(round(f64::from(a), f64::from(b)), expected, "{a:e} / {b:e}");
        // A power of two divides exactly, so that f64 to f32 is the only rounding.
        let x = f64::from(a) + f64::from(b);
        assert_eq!(round(x * 8.0, 8.0), (x as f32).clamp(f32::from_bits(1), f32::MAX));
    }
    let (two, least) = (2f64.powi(24), 2f64.powi(-149));
    for (n, d, expected) in [
        (two + 1.0, 1.0, 2f32.powi(24)),
        (two + 3.0, 1.0, 2f32.powi(24) + 4.0),
        (2.0 * two - 1.0, 1.0, 2f32.powi(25)),
        (1.0, 3.0, 1.0 / 3.0),
        (least, 2.0, f32::from_bits(1)),
        (least, 1e300, f32::from_bits(1)),
        (3.0 * least, 2.0, f32::from_bits(2)),
        (5.0 * least, 2.0, f32::from_bits(2)),
        (f64::from(f32::MAX) + 2f64.powi(103), 1.0, f32::MAX),
        (1e300, 1e-300, f32::MAX),
    ] {
        assert_eq!(round(n, d), expected, "{n:e} / {d:e}");
    }
}

#[test]
fn both_integer_types_agree() {
    let mut random = Random(3);
    let mut covered = 0;
    for round in 0..20_000 {
        let size = [2, 100][round % 2];
        let mut point = || random.lattice(size).map(|k| k as f64);
        let ([a, b, c, o], d) = ([(); 4].map(|()| point()), point());
        if d == [0.0; 3] {
            continue;
        }
        let points = Scaled::new([o, a, b, c].concat().try_into().unwrap());
        for ties in BOTH {
            let tri = [a, b, c].map(|p| p.map(|k| k as f32));
            let [narrow, wide] = [
                hit_in::<i128>(&points, &Scaled::new(d), ties),
                hit_in::<BigInt>(&points, &Scaled::new(d), ties),
            ];
            assert_eq!(narrow.is_some(), wide.is_some());
            assert_eq!(covers(tri, &ray(o, d, ties)), wide.is_some());
            if let (Some(narrow), Some(wide)) = (narrow, wide) {
                assert!(narrow.compare(&wide).is_eq());
                covered += 1;
            }
        }
    }
    assert!(covered > 1_000, "{covered}");
}

#[test]
fn narrow_integers_are_used_only_where_they_fit() {
    // Corners, starts and directions of all widths around the bounds, with all bits set at random.
    let mut random = Random(6);
    let (mut covered, mut widths) = (0, [0; 2]);
    for _ in 0..15_000 {
        let mut point = |spread: u64| {
            let exponent = i32::try_from(random.around(spread)).unwrap();
            random.cube().map(|k| k * 2f64.powi(exponent))
        };
        let o = point(30);
        let mut corner = || point(20).map(|k| k as f32);
        let tri = [corner(), corner(), corner()];
        let middle = combine(combine(wide(tri[0]), 0.75, wide(tri[1])), 0.5, wide(tri[2]));
        // Towards the triangle, with few or many bits.
        let mask = [!0, !0 << 25, !0 << 40, !0 << 51][usize::try_from(random.next() % 4).unwrap()];
        let cut = |k: f64| f64::from_bits(k.to_bits() & mask);
        let (o, d) = (o.map(cut), combine(middle, -2.25, o).map(cut));
        let [a, b, c] = tri.map(wide);
        let points = Scaled::new([o, a, b, c].concat().try_into().unwrap());
        let direction = Scaled::new(d);
        widths[usize::from(points.bits + direction.bits > 126)] += 1;
        for ties in BOTH {
            let wide = hit_in::<BigInt>(&points, &direction, ties);
            assert_eq!(covers(tri, &ray(o, d, ties)), wide.is_some(), "{tri:?} {o:?} {d:?}");
            covered += usize::from(wide.is_some());
        }
    }
    assert!(covered > 1_000 && widths.iter().all(|n| *n > 500), "{covered} {widths:?}");
}

#[test]
fn extreme_exponents_change_nothing() {
    // A mesh with its origin scaled by 2^k, directions by 2^j: the same answers, t scaled by 2^(k-j).
    let (positions, triangles) = subdivided(octahedron());
    for (k, j) in [(-139, -200), (126, 150), (100, 0), (-100, 60)] {
        let (s, z) = (2f64.powi(k), 2f64.powi(j));
        let scaled: Vec<_> = positions.iter().map(|p| p.map(|x| (f64::from(x) * s) as f32)).collect();
        for target in marks(&(positions.clone(), triangles.clone())) {
            for ties in BOTH {
                let near = ray([0.125, 0.0, 0.0], combine(target, -1.0, [0.125, 0.0, 0.0]), ties);
                let far = ray(near.origin.map(|x| x * s), near.direction.map(|x| x * z), ties);
                let (id, t) = closest(&positions, &triangles, &near).unwrap();
                let scaled_t = (f64::from(t) * (s / z)) as f32;
                let expected = Some((id, scaled_t.clamp(f32::from_bits(1), f32::MAX)));
                // The last bit of a t that became subnormal was rounded twice here.
                if scaled_t == 0.0 || scaled_t >= f32::MIN_POSITIVE {
                    assert_eq!(closest(&scaled, &triangles, &far), expected, "2^{k}, 2^{j}");
                }
            }
        }
    }
}

#[test]
fn mixed_exponents_are_not_rounded() {
    // o is off the plane x = 0 by 2^-149 beside coordinates of 2^127: a - o is not exact in f64.
    let (huge, least) = (2f32.powi(127), 2f64.powi(-149));
    let tri = [[0.0, -huge, -huge], [0.0, huge, -huge], [0.0, 0.0, huge]];
    for ties in BOTH {
        let o = |x: f64| [x, 2f64.powi(126), -(2f64.powi(126))];
        assert!(covers(tri, &ray(o(-least), [1.0, 0.0, 0.0], ties)));
        assert!(!covers(tri, &ray(o(least), [1.0, 0.0, 0.0], ties)));
        assert!(!covers(tri, &ray(o(0.0), [1.0, 0.0, 0.0], ties)));
    }
}

#[test]
fn grid_rays_are_affine_in_the_pixel() {
    let (size, mut random) = ([37, 20], Random(4));
    let at = |[f, r, u]: [[f64; 3]; 3], i, j| grid_ray(f, r, u, size[0], size[1], i, j);
    // Small integers need no rounding: d = F + X R + Y U as it stands.
    let whole = [[5.0, 0.0, -1.0], [0.0, 2.0, 1.0], [1.0, 0.0, 0.25]];
    assert_eq!(at(whole, 0, 0), [5.0 + 19.0, -72.0, -1.0 - 36.0 + 4.75]);
    assert_eq!(at(whole, 36, 19), [5.0 - 19.0, 72.0, -1.0 + 36.0 - 4.75]);
    for _ in 0..50 {
        let fru = [random.cube(), random.cube(), random.cube()];
        let corner = at(fru, 0, 0);
        let [right, down] = [at(fru, 1, 0), at(fru, 0, 1)].map(|d| combine(d, -1.0, corner));
        for (i, j) in [(36, 19), (36, 0), (0, 19), (18, 7)] {
            let sum = combine(combine(corner, f64::from(i), right), f64::from(j), down);
            assert_eq!(at(fru, i, j), sum);
        }
    }
}

#[test]
fn grid_vectors_are_rounded_to_q() {
    // M = 1 + 2^-60 + 2 * 2^-60 on a 2 x 2 film is just above 1: q = 2^(1 - 52), and 2^-60 is lost.
    let tiny = 2f64.powi(-60);
    let [f, r, u] = [[1.0, tiny, 0.0], [tiny, 0.0, 0.0], [0.0, 0.5, 0.0]];
    assert_eq!(grid_ray(f, r, u, 2, 2, 0, 0), [1.0, 0.5, 0.0]);
    // M = 1 exactly: q = 2^-52, and ties go to the even multiple.
    let q = 2f64.powi(-52);
    for (k, rounded) in [(0.5, 0.0), (1.5, 2.0), (3.0, 3.0), (-2.5, -2.0)] {
        let d = grid_ray([1.0, k * q, 0.0], [0.0; 3], [0.0; 3], 2, 2, 1, 1);
        assert_eq!(d, [1.0, rounded * q, 0.0]);
    }
    // One more bit of M doubles q.
    let f = [1.0 + q, 3.0 * q, -2.5 * q];
    let d = grid_ray(f, [0.0; 3], [0.0; 3], 2, 2, 1, 1);
    assert_eq!(d, [1.0, 4.0 * q, -2.0 * q]);
    // Starts of parallel rays stay multiples of 2^-149.
    let f = [2f64.powi(-120), 2f64.powi(-150), 2f64.powi(-149) * 1.5];
    let p = grid_start(f, [0.0; 3], [0.0; 3], 2, 2, 0, 0);
    assert_eq!(p, [f[0], 0.0, 2f64.powi(-148)]);
}

/// Not a test of anything: `cargo test --release --test oracle_self -- --ignored --nocapture`.
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
