//! What cannot be baked is refused with a reason and a remedy.

use umbel::bake::{Atlas, AtlasOptions};
use umbel::{Error, Scene};

use super::scenes::{push, soup};

fn refusal(scene: &Scene, size: u32, samples: u32) -> Error {
    Atlas::new(scene, &AtlasOptions { size, samples }).expect_err("refused")
}

#[test]
fn options_out_of_range_are_usage_errors() {
    let scene = soup(&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
    for (size, samples, word) in
        [(0, 1, "texels"), (65_536, 1, "texels"), (8, 0, "samples"), (8, 65, "samples")]
    {
        let error = refusal(&scene, size, samples);
        assert!(matches!(error, Error::Usage(_)) && error.to_string().contains(word), "{error}");
    }
}

#[test]
fn an_empty_atlas_is_bad_input() {
    let without_uvs = Scene { uv_indices: Vec::new(), ..soup(&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]) };
    let outside = soup(&[[[1.0, 0.0], [2.0, 0.0], [1.0, 1.0]], [[-0.5, 0.0], [0.0, 0.0], [-0.5, 1.0]]]);
    let mut thin = Scene { name: "thin".into(), ..Scene::default() };
    push(&mut thin, [[0.0; 3], [1.0; 3], [2.0; 3]], [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let cases = [
        (Scene::default(), "no triangles"),
        (without_uvs, "no triangle has texture coordinates"),
        (outside, "outside of 0 to 1"),
        (thin, "have no area"),
    ];
    for (scene, words) in cases {
        let error = refusal(&scene, 16, 1);
        assert!(matches!(error, Error::Input { .. }) && error.to_string().contains(words), "{error}");
    }
}

#[test]
fn positions_are_checked() {
    let mut scene = soup(&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]]);
    scene.positions[1][2] = f32::NAN;
    let error = Atlas::new(&scene, &AtlasOptions::default()).expect_err("refused");
    assert!(matches!(error, Error::Engine(_)), "{error}");
}
