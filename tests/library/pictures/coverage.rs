//! Samples of a pixel against the part of it that a wall covers.

use umbel::glam::DVec3;
use umbel::render::preview;
use umbel::{Camera, Lens, Options, Scene, visibility};

/// A wall at z = 0 from x = left to x = right, high enough for any picture.
pub(crate) fn wall(left: f32, right: f32) -> Scene {
    Scene {
        name: "wall".into(),
        positions: vec![[left, -50.0, 0.0], [right, -50.0, 0.0], [right, 50.0, 0.0], [left, 50.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Scene::default()
    }
}

/// 3 x 3 pixels of one unit each, centred on the origin.
fn ortho(scene: &Scene, samples: u32) -> Vec<f32> {
    let camera = Camera {
        eye: DVec3::new(0.0, 0.0, 4.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        lens: Lens::Ortho { height: 3.0 },
        width: 3,
        height: 3,
    };
    let options = Options::default();
    let (buffer, _) = visibility(scene, &camera, &options).expect("seen");
    preview(scene, &camera, &buffer, samples, &options, |_| ()).expect("shaded")
}

#[test]
fn samples_converge_to_the_coverage() {
    let (empty, full) = (ortho(&wall(-50.0, -49.0), 64), ortho(&wall(-50.0, 50.0), 64));
    for edge in [-0.5, -0.4, -0.17, 0.0, 0.05, 0.31, 0.5_f32] {
        let got = ortho(&wall(-50.0, edge), 64);
        let part = |pixel: usize| (got[3 * pixel] - empty[3 * pixel]) / (full[3 * pixel] - empty[3 * pixel]);
        for row in 0..3 {
            assert!((part(3 * row) - 1.0).abs() < 1e-5 && part(3 * row + 2).abs() < 1e-5);
            let coverage = edge + 0.5;
            let error = (part(3 * row + 1) - coverage).abs();
            assert!(error <= 1.0 / 64.0 + 1e-5, "{coverage}: error {error}");
        }
    }
    // An edge through the corners and the middle of three pixels.
    let mut half = wall(-50.0, 50.0);
    half.triangles.truncate(1);
    let got = ortho(&half, 64);
    for pixel in [0, 4, 8] {
        let mirrored = [6, 4, 2][pixel / 4];
        let part = (got[3 * mirrored] - empty[3 * mirrored]) / (full[3 * mirrored] - empty[3 * mirrored]);
        // 8 of the 64 samples lie exactly on the diagonal.
        assert!((part - 0.5).abs() <= 4.0 / 64.0 + 1e-5, "{part}");
    }
}

#[test]
fn the_background_is_where_nothing_is() {
    let (empty, full, half) =
        (ortho(&wall(-50.0, -49.0), 1), ortho(&wall(-50.0, 50.0), 1), ortho(&wall(-50.0, 0.6), 1));
    for (pixel, colour) in half.chunks(3).enumerate() {
        let expected = if pixel % 3 == 2 { &empty } else { &full };
        assert_eq!(colour, &expected[3 * pixel..][..3]);
    }
    assert!(empty.iter().all(|&x| (0.0..=1.0).contains(&x)));
}
