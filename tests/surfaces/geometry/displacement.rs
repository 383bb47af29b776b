//! Displacement against formulas, and height maps.

use common::place;
use common::random::Random;
use umbel::Error;
use umbel::engine::{Detail, OnDemand};
use umbel::files::{Channel, Samples, write_exr, write_png_rgb8};
use umbel::glam::DVec3;
use umbel::surfaces::{DisplacedMesh, Displacement, HeightMap, Noise, Relief};

use super::meshes::{cube, sphere};
use super::{patches, points};

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// Every point of a displaced sphere lies at its noise above the triangle that it comes from: p' − p is h(p)·n.
#[test]
fn a_displaced_sphere_follows_its_formula() {
    let scene = sphere(48, 24);
    let noise = Noise::new(2.0, 7);
    let flat = DisplacedMesh::new(&scene, Displacement::NONE);
    let displaced = DisplacedMesh::new(&scene, Displacement { relief: Relief::Noise(noise), height: 0.3 });
    for patch in patches(&flat) {
        for place in [[0.0, 0.0], [0.5, 0.25], [1.0, 1.0], [0.125, 1.0]] {
            let base = wide(points(&flat, &patch, &[place])[0]);
            let point = wide(points(&displaced, &patch, &[place])[0]);
            // The normals are those of the sphere, interpolated: they point away from its middle.
            let expected = base + base.normalize() * (0.3 * noise.at(base));
            assert!((point - expected).length() < 2e-3, "{point} {expected}");
            assert!((point - base).length() <= 0.3 + 1e-6);
            if place == [0.0, 0.0] {
                // At vertices the normal is exact.
                assert!((point - expected).length() < 1e-6, "{point} {expected}");
            }
        }
    }
}

#[test]
fn zero_height_moves_nothing_and_great_heights_stay_finite() {
    let flat = DisplacedMesh::new(&cube(), Displacement::NONE);
    for relief in [Relief::Noise(Noise::new(2.0, 1)), Relief::Map(HeightMap::new(1, &[1.0])), Relief::Flat] {
        let zero = DisplacedMesh::new(&cube(), Displacement { relief: relief.clone(), height: 0.0 });
        let huge = DisplacedMesh::new(&cube(), Displacement { relief, height: 1e300 });
        for patch in patches(&flat) {
            let places = [[0.0, 0.5], [0.3, 0.7]];
            assert_eq!(points(&flat, &patch, &places), points(&zero, &patch, &places));
            let far = points(&huge, &patch, &places);
            let bounds = huge.bounds(&patch, umbel::engine::Domain::UNIT, &Detail::all());
            assert!(far.iter().flatten().chain(&bounds.lo).chain(&bounds.hi).all(|x| x.is_finite()));
        }
    }
}

#[test]
fn height_maps_are_bilinear_and_repeat() {
    let map = HeightMap::new(2, &[0.0, 1.0, 0.5, 0.25]);
    // Centres of texels.
    for (uv, height) in [([0.25, 0.25], 0.0), ([0.75, 0.25], 1.0), ([0.25, 0.75], 0.5), ([0.75, 0.75], 0.25)]
    {
        assert!((map.at(uv) - height).abs() < 1e-12);
        assert!((map.at([uv[0] - 3.0, uv[1] + 5.0]) - height).abs() < 1e-12);
    }
    assert!((map.at([0.5, 0.25]) - 0.5).abs() < 1e-12);
    assert!((map.at([0.5, 0.5]) - 0.4375).abs() < 1e-12);
    // Over the edge: texels 1 and 0.
    assert!((map.at([1.0, 0.25]) - 0.5).abs() < 1e-12);
}

/// A map moves each side of a cube by what its image shows there: row 0 is v = 1 of an OBJ file.
#[test]
fn maps_are_found_by_texture_coordinates() {
    let heights = [0.0, 0.0, 1.0, 1.0].map(|h: f32| h);
    let scene = cube();
    let displaced = DisplacedMesh::new(
        &scene,
        Displacement { relief: Relief::Map(HeightMap::new(1, &heights)), height: 1.0 },
    );
    let flat = DisplacedMesh::new(&scene, Displacement::NONE);
    let mut seen = 0;
    for patch in patches(&displaced) {
        let place = [0.25, 0.25];
        let moved = (wide(points(&displaced, &patch, &[place])[0])
            - wide(points(&flat, &patch, &[place])[0]))
        .length();
        // Patches of corners with v = 0 see the lower half of the image, white.
        assert!(moved < 1e-6 || (moved - 1.0).abs() < 1e-6, "{moved}");
        seen += usize::from(moved > 0.5);
    }
    assert_eq!(seen, 12);
}

#[test]
fn noise_stays_in_its_range_and_differs_by_seed() {
    let mut random = Random(8);
    let (one, other) = (Noise::new(3.0, 1), Noise::new(3.0, 2));
    let mut extremes = [1.0_f64, 0.0_f64];
    for _ in 0..20_000 {
        let p = DVec3::new(random.unit(), random.unit(), random.unit()) * 50.0 - 25.0;
        let value = one.at(p);
        extremes = [extremes[0].min(value), extremes[1].max(value)];
        assert!((0.0..=1.0).contains(&value) && value != other.at(p));
        // Without a jump.
        assert!((one.at(p + 1e-7) - value).abs() < 1e-4);
    }
    assert!(extremes[0] < 0.2 && extremes[1] > 0.8, "{extremes:?}");
}

#[test]
fn missing_and_truncated_maps_are_refused() {
    let place = place!();
    write_png_rgb8(&place.path("map.png"), 8, 8, &[90; 192]).expect("written");
    assert!(HeightMap::read(&place.path("map.png")).is_ok());
    let bytes = place.bytes("map.png");
    place.put("cut.png", &bytes[..bytes.len() / 2]);
    place.put("text.png", "no image");
    for name in ["absent.png", "cut.png", "text.png"] {
        match HeightMap::read(&place.path(name)) {
            Err(Error::Input { path, problem, remedy, .. }) => {
                assert!(path.ends_with(name) && problem.contains("PNG") && !remedy.is_empty());
            }
            other => panic!("{name}: {:?}", other.map(|_| ())),
        }
    }
}

/// A small file can stand for an image of gigabytes: what it would take is counted before its pixels are decoded.
#[test]
fn maps_that_stand_for_more_than_they_are() {
    let place = place!();
    let side = 600_usize;
    write_png_rgb8(&place.path("map.png"), 600, 600, &vec![90; side * side * 3]).expect("written");
    let channel = Channel { name: "Y".into(), samples: Samples::F32(vec![0.5; side * side]) };
    write_exr(&place.path("map.exr"), side, side, vec![channel]).expect("written");
    for name in ["map.png", "map.exr"] {
        let path = place.path(name);
        assert!(
            place.bytes(name).len() < 1_500_000 && HeightMap::read_within(&path, Some(40_000_000)).is_ok()
        );
        match HeightMap::read_within(&path, Some(2_000_000)) {
            Err(Error::Limit(text)) => {
                assert!(text.contains(name) && text.contains("would need at least"), "{text}");
            }
            other => panic!("{name}: {:?}", other.map(|_| ())),
        }
    }
    place.put("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    let run = place.run("reyes one.obj --displace map.png --height 0.1 --size 8x8 -o a.png --max-memory 2M");
    assert_eq!(run.code, Some(4), "{}", run.stderr);
    assert!(run.stderr.contains("map.png") && run.stderr.contains("--max-memory"), "{}", run.stderr);
}

/// An EXR has its heights as they are, in a channel Y, R, or the only one.
#[test]
fn maps_of_floats() {
    let place = place!();
    let heights = [0.25, -3.0, 17.5, 0.0];
    let path = place.path("map.exr");
    let channel =
        |name: &str, samples: &[f32]| Channel { name: name.into(), samples: Samples::F32(samples.to_vec()) };
    let other = [9.0; 4];
    for channels in [
        vec![channel("height", &heights)],
        vec![channel("B", &other), channel("R", &heights)],
        vec![channel("R", &other), channel("Y", &heights)],
    ] {
        write_exr(&path, 2, 2, channels).expect("written");
        assert_eq!(HeightMap::read(&path).expect("a map"), HeightMap::new(2, &heights));
    }
    for (channels, words) in [
        (vec![channel("G", &other), channel("B", &other)], "B, G"),
        (vec![channel("Y", &[0.0, 1.0, 2.0, f32::NAN])], "column 1 of row 1"),
    ] {
        write_exr(&path, 2, 2, channels).expect("written");
        let error = HeightMap::read(&path).expect_err("refused").to_string();
        assert!(error.contains(words) && error.contains("map.exr"), "{error}");
    }
    assert!(HeightMap::read(&place.path("none.exr")).is_err());
}
