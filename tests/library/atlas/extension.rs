//! Extension beyond the borders of charts, against a search through all texels.

use proptest::prelude::*;
use umbel::Scene;
use umbel::bake::{TexelImage, TexelReceiver};

use super::scenes::{receivers, soup};

/// An image whose covered texels hold their index.
fn image(size: u32, all: &[TexelReceiver]) -> TexelImage<1> {
    let mut image = TexelImage::new(size);
    let values: Vec<[f32; 1]> = all.iter().map(|receiver| [receiver.texel as f32]).collect();
    image.cover(all, &values);
    image
}

/// The value that a texel should have: of the nearest covered one, then of the one farthest to the left, then the upper one.
fn expected(image: &TexelImage<1>, texel: u32, margin: u32) -> Option<u32> {
    let size = image.size();
    let apart = |other: u32| {
        let far = |one: u32, other: u32| u64::from(one.abs_diff(other)).pow(2);
        far(texel % size, other % size) + far(texel / size, other / size)
    };
    let covered = (0..size * size).filter(|&other| image.covered()[other as usize]);
    let nearest = covered.min_by_key(|&other| (apart(other), other % size, other / size))?;
    (apart(nearest) <= u64::from(margin).pow(2)).then_some(nearest)
}

/// Small triangles anywhere.
fn scenes() -> impl Strategy<Value = Scene> {
    let one = (prop::array::uniform2(0_u8..16), 0_u8..3).prop_map(|([x, y], wide)| {
        let [x, y, wide] = [x, y, wide].map(|k| f32::from(k) / 16.0 + 0.01);
        [[x, y], [x + wide, y], [x, y + wide]]
    });
    prop::collection::vec(one, 1..6).prop_map(|uvs| soup(&uvs))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn each_texel_takes_the_value_of_the_nearest(scene in scenes(), size in 1_u32..40, margin in 0_u32..50) {
        let before = image(size, &receivers(&scene, size, 1));
        let mut after = before.clone();
        after.extend(margin);
        prop_assert_eq!(after.covered(), before.covered());
        for texel in 0..size * size {
            let [value] = after.values()[texel as usize];
            let value = if value.is_nan() { None } else { Some(value as u32) };
            prop_assert_eq!(value, expected(&before, texel, margin), "texel {}", texel);
        }
    }
}

#[test]
fn bands_of_a_tall_image_meet() {
    // 300 rows are several bands; one texel in the middle reaches all that the margin allows.
    let scene = soup(&[[[0.5, 0.5], [0.501, 0.5], [0.5, 0.501]]]);
    let before = image(300, &receivers(&scene, 300, 1));
    for margin in [1, 16, 90, u32::MAX] {
        let mut after = before.clone();
        after.extend(margin);
        for texel in (0..300 * 300).step_by(7) {
            let is_reached = expected(&before, texel, margin).is_some();
            assert_eq!(after.values()[texel as usize][0].is_nan(), !is_reached, "{texel} {margin}");
        }
    }
}

#[test]
fn an_image_without_coverage_stays_empty_and_black_is_a_value() {
    let mut nothing = TexelImage::<3>::new(5);
    nothing.extend(5);
    assert!(nothing.values().as_flattened().iter().all(|value| value.is_nan()));
    let scene = soup(&[[[0.1, 0.1], [0.15, 0.1], [0.1, 0.15]]]);
    let all = receivers(&scene, 5, 1);
    let mut black = TexelImage::new(5);
    black.cover(&all, &vec![[0.0]; all.len()]);
    black.extend(10);
    assert!(black.values().iter().all(|&value| value == [0.0]));
    assert_eq!(black.covered().iter().filter(|&&covered| covered).count(), all.len());
}
