//! Charts, and which of them owns a texel.

use proptest::prelude::*;
use umbel::bake::check_uvs;
use umbel::scene::NO_INDEX;
use umbel::{Scene, TriangleId};

use super::scenes::{at, atlas, push, push_quad, receivers, soup, square, triangles};

fn charts(scene: &Scene) -> Vec<Option<u32>> {
    let atlas = atlas(scene, 8, 1);
    (0_u32..).zip(&scene.triangles).map(|(id, _)| atlas.chart(TriangleId(id))).collect()
}

#[test]
fn triangles_that_share_an_edge_in_space_and_texture_are_one_chart() {
    let mut scene = Scene { name: "quads".into(), ..Scene::default() };
    // A quad whose vertices are repeated; −0 is 0.
    push_quad(&mut scene, at(0.0, square(-0.0, 1.0)), square(0.0, 0.25));
    scene.positions[3] = [0.0, -0.0, 0.0];
    // The same place in space, elsewhere in the texture; the same texture coordinates, elsewhere in space.
    push_quad(&mut scene, at(0.0, square(0.0, 1.0)), square(0.5, 0.75));
    push_quad(&mut scene, at(2.0, square(0.0, 1.0)), square(0.0, 0.25));
    assert_eq!(charts(&scene), [0, 0, 1, 1, 2, 2].map(Some));
    // Indices that are shared make no difference.
    scene.uv_indices[1] = [0, 2, 5];
    scene.triangles[1] = [0, 2, 5];
    assert_eq!(charts(&scene), [0, 0, 1, 1, 2, 2].map(Some));
    // One vertex in common does not connect.
    let mut corner = Scene { name: "corner".into(), ..Scene::default() };
    push_quad(&mut corner, at(0.0, square(0.0, 0.5)), square(0.0, 0.5));
    push_quad(&mut corner, at(0.0, square(0.5, 1.0)), square(0.5, 1.0));
    assert_eq!(charts(&corner), [0, 0, 1, 1].map(Some));
}

/// A roof whose two halves are folded onto each other along the ridge.
fn mirrored_halves() -> Scene {
    let mut scene = Scene { name: "halves".into(), ..Scene::default() };
    let uv = [[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]];
    push_quad(&mut scene, [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, 1.0, 0.0]], uv);
    let [p, q, r, s] = uv;
    push_quad(&mut scene, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]], [q, p, s, r]);
    scene
}

#[test]
fn mirrored_halves_are_two_charts_and_never_mixed() {
    let scene = mirrored_halves();
    assert_eq!(charts(&scene), [0, 0, 1, 1].map(Some));
    let all = receivers(&scene, 10, 4);
    assert!(all.iter().all(|receiver| receiver.triangle.0 < 2), "equal coverage: the first chart owns");
    let check = check_uvs(&atlas(&scene, 10, 4));
    assert_eq!((check.mirrored_charts, check.overlapping, check.mirrored_overlap), (1, 64, 64));
    // Moved out by a whole unit, the second half is not baked and does not overlap.
    let mut moved = mirrored_halves();
    moved.uvs[6..].iter_mut().for_each(|uv| uv[0] += 1.0);
    let check = check_uvs(&atlas(&moved, 10, 4));
    assert_eq!((check.mirrored_charts, check.overlapping), (1, 0));
    assert_eq!(check.other_tiles, [([1, 0], 1)]);
    assert_eq!(receivers(&moved, 10, 4), all);
}

#[test]
fn the_chart_with_most_coverage_owns_a_texel() {
    // Of one texel the second chart covers 3/4.
    let mut scene = Scene { name: "two".into(), ..Scene::default() };
    for (z, lo, hi) in [(0.0, 0.0, 0.25), (1.0, 0.25, 1.0)] {
        let corners = [[lo, 0.0], [hi, 0.0], [hi, 1.0], [lo, 1.0]];
        push_quad(&mut scene, at(z, corners), corners);
    }
    let all = receivers(&scene, 1, 16);
    assert_eq!(all.len(), 12);
    assert!(all.iter().all(|receiver| receiver.triangle.0 >= 2));
    assert_eq!(check_uvs(&atlas(&scene, 1, 16)).overlapping, 0);
}

#[test]
fn without_coverage_the_nearest_chart_owns_a_texel() {
    // Both leave out the centre (0.5, 0.5) of the only texel; the second comes nearer.
    let scene = soup(&[[[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]], [[0.6, 0.6], [0.7, 0.6], [0.6, 0.7]]]);
    assert_eq!(triangles(&receivers(&scene, 1, 1))[&0], [1]);
    // As near as each other: the first.
    let scene = soup(&[[[0.6, 0.6], [0.7, 0.6], [0.6, 0.7]], [[0.4, 0.4], [0.3, 0.4], [0.4, 0.3]]]);
    let distances = [0.6_f32, 0.4].map(|x| (f64::from(x) - 0.5).abs());
    let nearest = u32::from(distances[1] < distances[0]);
    assert_eq!(triangles(&receivers(&scene, 1, 1))[&0], [nearest]);
}

#[test]
fn triangles_without_area_in_the_texture_cover_but_never_take() {
    // A point in texel (2, 0), a segment through the line y = 1.5, and a triangle that holds two centres of that line.
    let point = [[0.6, 0.1]; 3];
    let segment = [[0.0, 0.375], [0.5, 0.375], [1.0, 0.375]];
    let area = [[0.05, 0.26], [0.45, 0.26], [0.25, 0.9]];
    let scene = Scene { uv_v_down: true, ..soup(&[point, segment, area]) };
    let found = triangles(&receivers(&scene, 4, 1));
    assert_eq!(found[&2], [0]);
    assert_eq!([4, 5, 6, 7].map(|texel| found[&texel][0]), [2, 2, 1, 1]);
    let check = check_uvs(&atlas(&scene, 4, 1));
    assert_eq!((check.flat, check.flat_charts, check.charts, check.overlapping), (2, 2, 3, 0));
}

#[test]
fn without_coverage_area_comes_before_nearness() {
    // A segment that passes the centre of the only texel at 0.1, and a triangle at 0.3.
    let scene = soup(&[[[0.0, 0.6], [0.5, 0.6], [1.0, 0.6]], [[0.8, 0.0], [0.9, 0.0], [0.8, 1.0]]]);
    assert_eq!(triangles(&receivers(&scene, 1, 1))[&0], [1]);
}

#[test]
fn triangles_without_area_in_space_or_texture_coordinates_are_not_baked() {
    let mut scene = soup(&[[[0.0, 0.0], [0.4, 0.0], [0.0, 0.4]]; 1]);
    push(&mut scene, [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]], [[0.6, 0.6], [0.9, 0.6], [0.6, 0.9]]);
    push(&mut scene, [[0.0; 3], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]], [[0.6, 0.0], [0.9, 0.0], [f32::NAN, 0.3]]);
    push(&mut scene, [[0.0; 3], [1.0, 0.0, 6.0], [0.0, 1.0, 6.0]], [[0.6, 0.0], [0.9, 0.0], [0.9, 0.3]]);
    scene.uv_indices[3][1] = NO_INDEX;
    let all = receivers(&scene, 8, 1);
    assert!(!all.is_empty() && all.iter().all(|receiver| receiver.triangle.0 == 0));
    let check = check_uvs(&atlas(&scene, 8, 1));
    assert_eq!((check.without_uvs, check.without_area, check.charts), (2, 1, 2));
    assert_eq!(charts(&scene), [Some(0), Some(1), None, None]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Each chart is also baked alone: the owner is the first of those that then have most receivers, which are the same.
    #[test]
    fn the_owner_of_a_texel_has_most_coverage_alone(
        uvs in prop::collection::vec(prop::array::uniform3(prop::array::uniform2(-4_i8..=12)), 2..7),
        size in 1_u32..7,
        samples in 2_u32..10,
    ) {
        let uvs: Vec<_> = uvs.iter().map(|uv| uv.map(|uv| uv.map(|k| f32::from(k) / 8.0))).collect();
        let texels = |scene: &Scene| {
            let Ok(atlas) = umbel::bake::Atlas::new(scene, &umbel::bake::AtlasOptions { size, samples }) else { return Vec::new() };
            atlas.band(0..size).chunk_by(|one, other| one.texel == other.texel).map(<[_]>::to_vec).collect()
        };
        let alone: Vec<_> = uvs.iter().map(|&uv| texels(&soup(&[uv]))).collect();
        for found in texels(&soup(&uvs)) {
            let of_texel = |all: &Vec<Vec<umbel::bake::TexelReceiver>>| {
                all.iter().find(|other| other[0].texel == found[0].texel).cloned().unwrap_or_default()
            };
            let candidates: Vec<_> = alone.iter().map(of_texel).collect();
            let most = candidates.iter().map(Vec::len).max().unwrap_or(0);
            // One receiver may be a clamped one.
            if most > 1 {
                let owner = candidates.iter().position(|candidate| candidate.len() == most).expect("the largest");
                let weights = |all: &[umbel::bake::TexelReceiver]| {
                    all.iter().map(umbel::bake::TexelReceiver::barycentrics).collect::<Vec<_>>()
                };
                prop_assert!(found.iter().all(|receiver| receiver.triangle.0 as usize == owner));
                prop_assert_eq!(weights(&found), weights(&candidates[owner]));
            }
        }
    }
}

/// Textures that repeat: 20,000 triangles over every texel. Each listed at each texel, they would take 16 GB.
#[test]
fn thousands_of_surfaces_on_top_of_each_other_cost_little() {
    let scene = soup(&vec![[[-9.0, -9.0], [19.0, -9.0], [-9.0, 19.0]]; 20_000]);
    let all = receivers(&scene, 256, 2);
    assert_eq!(all.len(), 2 * 256 * 256);
    assert!(all.iter().all(|receiver| receiver.triangle.0 == 0));
    assert_eq!(check_uvs(&atlas(&scene, 256, 2)).overlapping, 256 * 256);
}
