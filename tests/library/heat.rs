//! Heat maps: doubts are where things coincide.

use umbel::engine::Path;
use umbel::glam::DVec3;
use umbel::{Aov, AovData, Camera, Lens, Options, Scene, visibility};

/// Two layers of other tessellations, so far apart, that fill the picture.
fn layers(gap: f32) -> Scene {
    let layer = |z: f32, diagonal: [usize; 2]| {
        let corners = [[-9.0, -9.0, z], [9.0, -9.0, z + 1.0], [9.0, 9.0, z + 1.0], [-9.0, 9.0, z]];
        let [from, to] = diagonal;
        [corners[from], corners[from + 1], corners[to], corners[from], corners[to], corners[(to + 1) % 4]]
    };
    let positions = [layer(-5.0, [0, 2]), layer(-5.0 - gap, [1, 3])].concat();
    Scene { positions, triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]], ..Scene::default() }
}

fn doubts(gap: f32, lens: Lens, path: Path) -> Vec<f32> {
    let (eye, target) = (DVec3::new(0.12, 0.05, 0.3), DVec3::new(0.1, 0.0, -5.0));
    let camera = Camera { eye, target, up: DVec3::Y, lens, width: 100, height: 40 };
    let (buffer, _) =
        visibility(&layers(gap), &camera, &Options { path, ..Options::default() }).expect("in range");
    match buffer.derive(Aov::Doubts, &layers(gap)).expect("a scene") {
        AovData::F32(1, doubts) => doubts,
        other => panic!("{other:?} is not one number a pixel"),
    }
}

#[test]
fn doubts_are_where_things_coincide() {
    for lens in [Lens::Pinhole { fov: 60.0 }, Lens::Ortho { height: 6.0 }] {
        let (together, apart) = (doubts(0.0, lens, Path::Pencil), doubts(0.1, lens, Path::Pencil));
        assert_eq!((together.len(), apart.len()), (4000, 4000));
        // Diagonals through the centre of pixels are in doubt in any case.
        let sum = |doubts: &[f32]| doubts.iter().sum::<f32>();
        assert!(sum(&together) > 4.0 * sum(&apart), "{} against {}", sum(&together), sum(&apart));
        // One number for each of the two tiles.
        let tiles = [together[0], together[99]];
        assert!(tiles.iter().all(|&doubts| doubts > 0.0));
        assert!((0..4000).all(|k| together[k] == tiles[usize::from(k % 100 >= 64)]));
    }
    let bent = doubts(0.0, Lens::Equirect, Path::Pencil);
    assert!(bent.iter().all(|&doubts| doubts > 0.0 && doubts == bent[0]));
    assert!(doubts(0.0, Lens::Pinhole { fov: 60.0 }, Path::General).iter().all(|doubts| doubts.is_nan()));
}
