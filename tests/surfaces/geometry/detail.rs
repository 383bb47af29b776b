//! What rays can tell apart: spacing by formula, octaves that are left out, the same bits with all instructions.

use common::random::Random;
use umbel::engine::{Detail, Dicing, Film, GridFilm, Isa, OnDemand};
use umbel::glam::DVec3;
use umbel::surfaces::{DisplacedMesh, Displacement, Noise, Relief, SubdivisionSurface, Terrain};
use umbel::{Origin, Pencil};

use super::meshes::{cube, sphere};
use super::{patches, points, points_for};

const PIXEL: f64 = 1.0 / 512.0;

/// The detail of a film of 2x2 pixels, which see the same angle but for a few millionths.
fn detail_of(origin: Origin, shading_rate: f64, isa: Isa) -> Detail {
    let film = GridFilm::new(2, 2, DVec3::NEG_Z, DVec3::X * PIXEL / 2.0, DVec3::Y * PIXEL / 2.0);
    let pencil = Pencil::new(origin, vec![Film::Grid(film.expect("a film"))]).expect("a pencil");
    Detail::new(&pencil, &Dicing { shading_rate, ..Dicing::default() }, isa).expect("detail")
}

pub(crate) fn from_eye(eye: DVec3) -> Detail {
    detail_of(Origin::Point(eye), 0.5, Isa::Auto)
}

#[test]
fn spacing_is_angle_times_distance() {
    let (eye, far) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 6.0, 15.0));
    let near = |got: f64, expected: f64| (got - expected).abs() <= expected * 1e-5;
    let [least, greatest] = from_eye(eye).spacing([far; 2]);
    assert!(near(least, 13.0 * PIXEL) && near(greatest, least), "{least} {greatest}");
    // From the eye to the nearest and to the farthest point of a box, and in a box that holds it.
    let [least, greatest] = from_eye(eye).spacing([DVec3::new(1.0, 2.0, 5.0), far]);
    assert!(near(least, 2.0 * PIXEL) && near(greatest, 13.0 * PIXEL));
    assert_eq!(from_eye(eye).spacing([DVec3::ZERO, far])[0], 0.0);
    // Micropolygons of four pixels.
    let coarse = detail_of(Origin::Point(eye), 4.0, Isa::Auto);
    assert!(near(coarse.spacing([far; 2])[0], 52.0 * PIXEL));
    // Parallel rays are everywhere as far apart.
    let sun = detail_of(Origin::Infinity(DVec3::NEG_Z), 0.5, Isa::Auto);
    assert!(sun.spacing([far, far * 9.0]).iter().all(|&spacing| near(spacing, PIXEL)));
    assert_eq!(Detail::all().spacing([far; 2]), [0.0; 2]);
}

/// Eight boxes at once are told as one is, and boxes within boxes have no smaller spacing.
#[test]
fn spacings_of_eight_and_of_parts() {
    let mut random = Random(3);
    for _ in 0..2000 {
        let detail = from_eye(DVec3::new(random.unit(), random.unit(), random.unit()));
        let (mut lo, mut hi) = ([[0.0; 8]; 3], [[0.0; 8]; 3]);
        for (lo, hi) in lo.iter_mut().flatten().zip(hi.iter_mut().flatten()) {
            *lo = (random.unit() - 0.3) * 4.0;
            *hi = *lo + random.unit() * f64::from(random.bits() as u32 % 2);
        }
        let eight = detail.spacings([&lo, &hi]);
        for (lane, spacing) in eight.into_iter().enumerate() {
            let [lo, hi] = [lo, hi].map(|[x, y, z]| DVec3::new(x[lane], y[lane], z[lane]));
            let [least, greatest] = detail.spacing([lo, hi]);
            assert_eq!(spacing, least);
            let inner = lo + (hi - lo) * DVec3::new(random.unit(), random.unit(), random.unit());
            let of_point = detail.spacing([inner.min(hi); 2]);
            assert!(least <= of_point[0] && of_point[1] <= greatest);
        }
    }
}

#[test]
fn shares_fall_from_all_to_none() {
    let shares = [1.0, 1.9, 2.0, 3.0, 4.0, 9.0].map(|wavelength| Detail::share(wavelength, 1.0));
    assert_eq!(shares, [0.0, 0.0, 0.0, 0.5, 1.0, 1.0]);
    assert_eq!([Detail::share(1.0, 0.0), Detail::share(1.0, f64::INFINITY)], [1.0, 0.0]);
}

/// What is left out of mountains is smaller than the rays are apart there, and something is left out.
#[test]
fn mountains_lose_what_nobody_sees() {
    let (mut random, mut differ) = (Random(11), 0);
    for _ in 0..3000 {
        let patch = random.bits() as u32 % 256;
        let eye = DVec3::new(random.unit() - 0.5, random.unit() * 0.2, random.unit() - 0.5) * 8000.0;
        let (detail, place) = (from_eye(eye), [[random.unit(), random.unit()]]);
        let [full] = points(&Terrain, &patch, &place)[..] else { panic!("a point") };
        let [seen] = points_for(&Terrain, &patch, &place, &detail)[..] else { panic!("a point") };
        assert_eq!([full[0], full[2]], [seen[0], seen[2]]);
        let spacing = (DVec3::from_array(full.map(f64::from)) - eye).length() * PIXEL;
        assert!(f64::from(full[1] - seen[1]).abs() <= spacing, "{full:?} {seen:?} {spacing}");
        differ += usize::from(full[1] != seen[1]);
    }
    assert!(differ > 2900, "{differ}");
}

/// Of a displaced sphere no more is left out than the amplitudes of the octaves that are too fine, about their mean.
#[test]
fn displaced_meshes_lose_fine_octaves_alone() {
    let noise = Noise { frequency: 2.0, seed: 4, octaves: 12, gain: 0.6 };
    let (height, mut differ) = (0.3, 0);
    let mesh = DisplacedMesh::new(&sphere(12, 8), Displacement { relief: Relief::Noise(noise), height });
    let mut random = Random(2);
    for patch in patches(&mesh) {
        let eye = DVec3::new(random.unit(), random.unit(), random.unit()) * 20.0;
        let place = [[random.unit(), random.unit()]];
        let [full, seen] = [Detail::all(), from_eye(eye)]
            .map(|detail| DVec3::from_array(points_for(&mesh, &patch, &place, &detail)[0].map(f64::from)));
        let spacing = ((full - eye).length() + 2.0 * height) * PIXEL;
        let amplitudes: Vec<f64> = (0..12).map(|k| 0.6_f64.powi(k)).collect();
        let fine = (0..12).filter(|&k| 1.0 / (2.0 * f64::from(1 << k)) < 2.0 * spacing);
        let lost: f64 = fine.map(|k| amplitudes[k as usize]).sum();
        let most = 0.5 * height * lost / amplitudes.iter().sum::<f64>() + 1e-6;
        assert!((full - seen).length() <= most, "{full} {seen} {most}");
        differ += usize::from(full != seen);
    }
    assert!(differ > 100, "{differ}");
}

/// `--isa` reaches the points of every surface, and changes none.
#[test]
fn instructions_change_no_bit() {
    let displacement = Displacement { relief: Relief::Noise(Noise::new(3.0, 1)), height: 0.2 };
    let mesh = DisplacedMesh::new(&sphere(8, 5), displacement.clone());
    let smooth = SubdivisionSurface::new(&cube(), &umbel::scene::Creases::default(), displacement);
    let places: Vec<[f64; 2]> = (0..81).map(|k| [f64::from(k % 9) / 8.0, f64::from(k / 9) / 8.0]).collect();
    let eye = Origin::Point(DVec3::new(3.0, 4.0, 5.0));
    let sets = [Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon];
    let details: Vec<Detail> =
        sets.into_iter().filter(|isa| isa.resolve().is_ok()).map(|isa| detail_of(eye, 0.5, isa)).collect();
    fn all<S: OnDemand>(surface: &S, patches: &[S::Object], places: &[[f64; 2]], details: &[Detail]) {
        let of = |detail: &Detail| -> Vec<[u32; 3]> {
            let points = patches.iter().flat_map(|patch| points_for(surface, patch, places, detail));
            points.map(|point| point.map(f32::to_bits)).collect()
        };
        let first = of(&details[0]);
        assert!(details.iter().all(|detail| of(detail) == first));
    }
    all(&mesh, &patches(&mesh), &places, &details);
    all(&smooth, &patches(&smooth), &places, &details);
    all(&Terrain, &[7, 130], &places, &details);
    all(&umbel::surfaces::Field, &umbel::surfaces::Field.roots()[..3], &places, &details);
}
