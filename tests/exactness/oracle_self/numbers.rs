//! Numbers: rounding, exponents, and the integers in which the oracle computes.

use common::oracle::{Dyadic, Scaled, closest, covers, grid_ray, grid_start, hit_in, round_t};
use num_bigint::BigInt;

use super::closed::{marks, octahedron, subdivided};
use super::{BOTH, Random, combine, ray, wide};

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
