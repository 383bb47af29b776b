//! One triangle in memory, one picture in a file: the shortest way through the library.
//!
//! `cargo run --release --example hello` writes `hello.png`.

use std::path::Path;

use umbel::files::{srgb_encode, write_png_rgb8};
use umbel::glam::DVec3;
use umbel::render::preview;
use umbel::{Camera, Error, Lens, Options, Scene, visibility};

fn main() -> Result<(), Error> {
    let scene = Scene {
        positions: vec![[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [0.0, 1.1, -0.5]],
        triangles: vec![[0, 1, 2]],
        ..Scene::default()
    };
    let camera = Camera {
        eye: DVec3::new(0.6, 0.4, 3.0),
        target: DVec3::new(0.0, 0.2, 0.0),
        up: DVec3::Y,
        lens: Lens::Pinhole { fov: 45.0 },
        width: 640,
        height: 360,
    };
    let options = Options::default();

    // Which triangle each pixel sees; the colours follow from that.
    let (seen, _) = visibility(&scene, &camera, &options)?;
    let samples = 16;
    let linear = preview(&scene, &camera, &seen, samples, &options, |_| ())?;

    let bytes: Vec<u8> = linear.into_iter().map(srgb_encode).collect();
    write_png_rgb8(Path::new("hello.png"), camera.width, camera.height, &bytes)
}
