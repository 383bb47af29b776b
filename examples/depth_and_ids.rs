//! Depth, object and normal of every pixel as raw arrays, for training data or compositing: no picture is shaded.
//!
//! `cargo run --release --example depth_and_ids [SCENE]` writes `depth.npy`, `objects.npy` and `normals.npy`; in Python,
//! `numpy.load("depth.npy")` reads one. SCENE is an OBJ file or a built-in scene.

use std::path::Path;

use umbel::files::{Array, write_npy};
use umbel::glam::DVec3;
use umbel::{Aov, AovData, Camera, Error, Lens, LoadOptions, Options, load, visibility};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;

fn main() -> Result<(), Error> {
    let name = std::env::args().nth(1);
    let name = name.unwrap_or_else(|| "builtin:umbel".to_owned());
    let scene = load(&name, LoadOptions::default())?;
    let lens = Lens::Pinhole { fov: 45.0 };
    let from = DVec3::new(1.0, 0.7, 1.0);
    let camera = Camera::framing(&scene.bounds(), from, lens, WIDTH, HEIGHT);

    // One visibility buffer; everything else is derived from it, and only what is asked for.
    let (seen, _) = visibility(&scene, &camera, &Options::default())?;
    for (aov, file) in [(Aov::Depth, "depth.npy"), (Aov::Object, "objects.npy"), (Aov::Normal, "normals.npy")]
    {
        let (height, width) = (HEIGHT as usize, WIDTH as usize);
        match seen.derive(aov, &scene)? {
            AovData::U32(ids) => write_npy(Path::new(file), &[height, width], Array::U32(&ids))?,
            AovData::F32(1, numbers) => {
                write_npy(Path::new(file), &[height, width], Array::F32(&numbers))?;
            }
            AovData::F32(count, numbers) => {
                let shape = [height, width, count];
                write_npy(Path::new(file), &shape, Array::F32(&numbers))?;
            }
        }
    }
    Ok(())
}
