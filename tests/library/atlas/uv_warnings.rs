//! What the check says, and that it is silent where nothing is wrong.

use umbel::Scene;
use umbel::bake::check_uvs;

use super::scenes::{at, atlas, push, push_quad, soup, square};

fn warnings(scene: &Scene) -> Vec<String> {
    check_uvs(&atlas(scene, 16, 4)).warnings()
}

#[test]
fn a_clean_atlas_is_silent() {
    let mut scene = Scene { name: "square".into(), ..Scene::default() };
    push_quad(&mut scene, at(0.0, square(0.0, 1.0)), square(0.0, 1.0));
    let check = check_uvs(&atlas(&scene, 16, 4));
    assert_eq!(check.warnings(), [""; 0]);
    assert_eq!((check.texels, check.covered, check.charts, check.outside), (256, 256, 1, 0));
}

#[test]
fn each_fault_has_a_sentence() {
    let mut scene = soup(&[
        [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]],
        [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]],
        [[0.5, 0.5], [0.9, 0.5], [0.5, 0.9]],
        [[0.9, 0.5], [0.5, 0.5], [0.5, 0.9]],
        [[0.7, 0.1]; 3],
        [[2.5, 1.5], [2.6, 1.5], [2.5, 1.6]],
    ]);
    push(&mut scene, [[0.0; 3], [1.0, 0.0, 9.0], [0.0, 1.0, 9.0]], [[f32::NAN; 2]; 3]);
    let check = check_uvs(&atlas(&scene, 16, 4));
    assert!(check.overlapping > check.mirrored_overlap && check.mirrored_overlap > 0);
    assert_eq!(check.other_tiles, [([2, 1], 1)]);
    let warnings = check.warnings();
    let words = ["share texels", "mirrored", "not baked: 1 of 7", "without area in the texture", "(2, 1): 1"];
    assert_eq!(warnings.len(), words.len());
    for (warning, words) in warnings.iter().zip(words) {
        assert!(warning.contains(words) && warning.contains(';'), "{warning}");
    }
}

#[test]
fn neighbours_that_share_edges_do_not_overlap() {
    let mut scene = Scene { name: "two".into(), ..Scene::default() };
    // Different charts whose borders coincide, through the centres of texels.
    let left = [[0.0, 0.0], [0.53125, 0.0], [0.53125, 1.0], [0.0, 1.0]];
    let right = [[0.53125, 0.0], [1.0, 0.0], [1.0, 1.0], [0.53125, 1.0]];
    push_quad(&mut scene, at(0.0, left), left);
    push_quad(&mut scene, at(5.0, right), right);
    assert_eq!(warnings(&scene), [""; 0]);
    assert_eq!(check_uvs(&atlas(&scene, 16, 1)).overlapping, 0);
}

#[test]
fn a_chart_that_reaches_out_is_not_in_a_tile() {
    let scene = soup(&[[[0.5, 0.5], [1.5, 0.5], [0.5, 0.9]]]);
    let check = check_uvs(&atlas(&scene, 16, 1));
    assert_eq!((check.outside, check.other_tiles.len()), (1, 0));
    assert!(warnings(&scene)[0].contains("unit square"));
}
