//! Which texels are covered, and where their receivers lie.

use std::collections::BTreeSet;

use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use umbel::Scene;

use super::clipper::touched;
use super::scenes::{at, atlas, place, push_quad, receivers, soup, square, triangles};

/// A texture coordinate: on a coarse lattice, where squares and triangles share borders, anywhere, or far away.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => (-3_i8..=12).prop_map(|k| f32::from(k) / 8.0),
        2 => (-2_i8..=10).prop_map(|k| f32::from(k) / 7.0),
        4 => -0.2_f32..1.2,
        1 => prop_oneof![Just(1e-30_f32), Just(-1e-30), Just(1e9), Just(-3e20), Just(1.0_f32.next_up())],
    ]
}

fn corners() -> impl Strategy<Value = [[f32; 2]; 3]> {
    prop::array::uniform3(prop::array::uniform2(coordinate()))
}

/// Up to five charts, with v up or down.
fn scenes() -> impl Strategy<Value = Scene> {
    let described = (prop::collection::vec(corners(), 1..6), any::<bool>());
    described.prop_map(|(uvs, uv_v_down)| Scene { uv_v_down, ..soup(&uvs) })
}

/// The texels that the oracle finds covered.
fn expected(scene: &Scene, size: u32) -> BTreeSet<u32> {
    let corners = scene.uv_indices.iter().map(|corners| corners.map(|index| scene.uvs[index as usize]));
    let places = corners.flat_map(|uv| touched(uv, size));
    let row = |line: u32| if scene.uv_v_down { line } else { size - 1 - line };
    places.map(|[column, line]| row(line) * size + column).collect()
}

/// The length of the longest side in the texture, in texels: what an error of the weights is multiplied with.
fn reach(scene: &Scene, size: u32) -> f64 {
    let farthest = scene.uvs.iter().flatten().fold(1.0_f64, |far, &x| far.max(f64::from(x).abs()));
    4.0 * farthest * f64::from(size)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_texel_that_a_triangle_touches_is_covered_and_no_other(
        scene in scenes(),
        size in 1_u32..11,
        samples in 1_u32..9,
    ) {
        let expected = expected(&scene, size);
        match umbel::bake::Atlas::new(&scene, &umbel::bake::AtlasOptions { size, samples }) {
            Ok(atlas) => {
                let found = triangles(&atlas.band(0..size));
                prop_assert_eq!(found.into_keys().collect::<BTreeSet<_>>(), expected.clone());
                prop_assert_eq!(umbel::bake::check_uvs(&atlas).covered, expected.len() as u64);
            }
            Err(_) => prop_assert!(expected.is_empty()),
        }
    }

    #[test]
    fn receivers_lie_on_their_triangles_and_in_their_texels(scene in scenes(), size in 1_u32..11, samples in 1_u32..9) {
        let Ok(atlas) = umbel::bake::Atlas::new(&scene, &umbel::bake::AtlasOptions { size, samples }) else { return Ok(()) };
        let all = atlas.band(0..size);
        let slack = 2e-7 * reach(&scene, size);
        for of_texel in all.chunk_by(|one, other| one.texel == other.texel) {
            let texel = of_texel[0].texel;
            let centre = [texel % size, texel / size].map(|k| f64::from(k) + 0.5);
            for receiver in of_texel {
                let weights = receiver.barycentrics();
                prop_assert!(weights.iter().all(|&weight| (0.0..=1.0).contains(&weight)));
                prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
                let place = place(&scene, size, receiver);
                let apart = [0, 1].map(|k| (place[k] - centre[k]).abs());
                if of_texel.len() > 1 {
                    prop_assert!(apart.iter().all(|&far| far < 0.5 + slack), "{receiver:?} at {place:?}");
                } else {
                    prop_assert!(apart[0].hypot(apart[1]) < 0.5_f64.sqrt() + slack, "{receiver:?} at {place:?}");
                }
            }
        }
    }

    /// A lone triangle: no point of it is nearer to the centre than the receiver, if it does not hold the centre.
    #[test]
    fn a_clamped_receiver_is_the_nearest_point(
        uv in prop::array::uniform3(prop::array::uniform2(-0.2_f32..1.2)),
        size in 1_u32..9,
    ) {
        let scene = soup(&[uv]);
        let Ok(atlas) = umbel::bake::Atlas::new(&scene, &umbel::bake::AtlasOptions { size, samples: 1 }) else { return Ok(()) };
        for receiver in atlas.band(0..size) {
            let centre = [receiver.texel % size, receiver.texel / size].map(|k| f64::from(k) + 0.5);
            let far = |[x, y]: [f64; 2]| (x - centre[0]).hypot(y - centre[1]);
            let found = far(place(&scene, size, &receiver));
            for k in 0..=40 {
                for l in 0..=40 - k {
                    let (b, c) = (f64::from(k) / 40.0, f64::from(l) / 40.0);
                    let mean = |axis: usize| {
                        let [p, q, r] = uv.map(|corner| f64::from(corner[axis]));
                        p + b * (q - p) + c * (r - p)
                    };
                    let other = far([mean(0) * f64::from(size), (1.0 - mean(1)) * f64::from(size)]);
                    prop_assert!(found <= other + 1e-5, "{receiver:?}: {found} > {other}");
                }
            }
        }
    }

    /// A mesh without folds that fills the square: each sub-position is held exactly once.
    #[test]
    fn a_mesh_that_fills_the_texture_has_each_sub_position_once(
        moves in prop::collection::vec(prop::array::uniform2(-3_i8..=3), 9),
        size in 1_u32..14,
        samples in 1_u32..=64,
    ) {
        // Inner vertices of a 4 x 4 grid move by up to 3/8 of a cell: its triangles may not fold over.
        let vertex = |i: usize, j: usize| {
            let inner = (1..4).contains(&i) && (1..4).contains(&j);
            let moved = if inner { moves[(i - 1) * 3 + j - 1] } else { [0, 0] };
            [0, 1].map(|k| ([i, j][k] as f32 + f32::from(moved[k]) / 16.0) / 4.0)
        };
        let mut scene = Scene { name: "grid".into(), ..Scene::default() };
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let corners = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            push_quad(&mut scene, at(0.0, corners), corners);
        }
        let atlas = atlas(&scene, size, samples);
        prop_assert_eq!(atlas.charts(), 1);
        let found = triangles(&atlas.band(0..size));
        prop_assert_eq!(found.len(), (size * size) as usize);
        prop_assert!(found.values().all(|of_texel| of_texel.len() == samples as usize));
        prop_assert_eq!(umbel::bake::check_uvs(&atlas).overlapping, 0);
    }

    #[test]
    fn bands_joined_are_all_rows(scene in scenes(), size in 1_u32..70, samples in 1_u32..5, cut in 1_u32..40) {
        let Ok(atlas) = umbel::bake::Atlas::new(&scene, &umbel::bake::AtlasOptions { size, samples }) else { return Ok(()) };
        let cuts = (0..size).step_by(cut as usize);
        let joined: Vec<_> = cuts.flat_map(|row| atlas.band(row..row + cut)).collect();
        prop_assert_eq!(joined, atlas.band(0..size));
    }

    /// Coordinates with 20 bits: 1 − v is exact, and no edge passes through a sub-position.
    #[test]
    fn v_down_is_v_up_upside_down(
        uvs in prop::collection::vec(prop::array::uniform3(prop::array::uniform2(1_u32..1 << 20)), 1..5),
        size in 1_u32..20,
        samples in 1_u32..5,
    ) {
        let uvs: Vec<_> = uvs.iter().map(|t| t.map(|uv| uv.map(|x| x as f32 / (1 << 20) as f32))).collect();
        let up = soup(&uvs);
        let flipped: Vec<_> = uvs.iter().map(|t| t.map(|[u, v]| [u, 1.0 - v])).collect();
        let down = Scene { uv_v_down: true, ..soup(&flipped) };
        let (up, down) = (receivers(&up, size, samples), receivers(&down, size, samples));
        prop_assert_eq!(triangles(&up), triangles(&down));
        for (up, down) in up.iter().zip(&down) {
            let apart = up.barycentrics().into_iter().zip(down.barycentrics()).map(|(a, b)| (a - b).abs());
            prop_assert!(apart.fold(0.0, f64::max) < 1e-5, "{up:?} {down:?}");
        }
    }
}

#[test]
fn row_0_is_v_1_unless_v_points_down() {
    let mut scene = soup(&[[[0.1, 0.9], [0.2, 0.9], [0.1, 0.95]]]);
    assert_eq!(triangles(&receivers(&scene, 4, 1)).into_keys().collect::<Vec<_>>(), [0]);
    scene.uv_v_down = true;
    assert_eq!(triangles(&receivers(&scene, 4, 1)).into_keys().collect::<Vec<_>>(), [12]);
}

#[test]
fn one_texel_holds_a_whole_atlas() {
    let scene = soup(&[[[0.0, 0.0], [0.9, 0.0], [0.0, 0.9]], [[0.95, 0.95], [1.0, 0.95], [1.0, 1.0]]]);
    let [receiver] = receivers(&scene, 1, 1)[..] else { panic!("one receiver") };
    // The first triangle does not hold the centre, but lies nearer to it.
    assert_eq!((receiver.texel, receiver.triangle.0), (0, 0));
    assert_eq!(receiver.barycentrics(), [0.0, 0.5, 0.5]);
    let all = receivers(&scene, 1, 64);
    assert!(all.len() > 20 && all.iter().all(|receiver| receiver.triangle.0 == 0));
}

#[test]
fn the_mean_of_the_receivers_is_weighted_by_coverage() {
    // One chart of two triangles that meet at x = 1/4 of a single texel.
    let mut scene = Scene { name: "strip".into(), ..Scene::default() };
    for (lo, hi) in [(0.0, 0.25), (0.25, 1.0)] {
        let corners = [[lo, 0.0], [hi, 0.0], [hi, 1.0], [lo, 1.0]];
        push_quad(&mut scene, at(0.0, corners), corners);
    }
    let all = receivers(&scene, 1, 16);
    let left = all.iter().filter(|receiver| receiver.triangle.0 < 2).count();
    assert_eq!((left, all.len()), (4, 16));
    let mut image = umbel::bake::TexelImage::new(1);
    let values: Vec<[f32; 1]> = all.iter().map(|r| [if r.triangle.0 < 2 { 1.0 } else { 0.0 }]).collect();
    image.cover(&all, &values);
    assert_eq!((image.values(), image.covered()), (&[[0.25]][..], &[true][..]));
}

#[test]
fn threads_change_nothing() {
    let quads = (0..40_u8).map(|k| {
        let (x, y) = (f32::from(k % 8) / 8.0, f32::from(k / 8) / 5.0);
        [[x, y], [x + 0.15, y + 0.01], [x + 0.02, y + 0.22]]
    });
    let scene = soup(&quads.collect::<Vec<_>>());
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let atlas = atlas(&scene, 200, 4);
            let all = atlas.band(0..200);
            let mut image = umbel::bake::TexelImage::new(200);
            let values: Vec<_> =
                all.iter().map(|r| [r.barycentrics()[0] as f32, r.triangle.0 as f32]).collect();
            image.cover(&all, &values);
            image.extend(7);
            let bits: Vec<_> = image.values().iter().map(|value| value.map(f32::to_bits)).collect();
            (all, umbel::bake::check_uvs(&atlas), bits)
        })
    };
    assert!(run(1) == run(5));
}

#[test]
fn what_touches_a_whole_square_covers_its_neighbours_borders() {
    let mut scene = Scene { name: "square".into(), ..Scene::default() };
    push_quad(&mut scene, at(0.0, square(0.25, 0.5)), square(0.25, 0.5));
    // [1, 2]² in texels, closed: it touches the texels around.
    assert_eq!(receivers(&scene, 4, 1).len(), 9);
}
