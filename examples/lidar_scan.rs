//! A spinning LiDAR in a room: 32 rings of 900 ranges, as points for any viewer of point clouds.
//!
//! `cargo run --release --example lidar_scan [SCENE X Y Z]` writes `lidar_scan.ply`, seen from (X, Y, Z).

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::path::Path;

use umbel::glam::DVec3;
use umbel::render::write_ply;
use umbel::{Camera, Error, Lens, LoadOptions, Options, load, visibility};

fn main() -> Result<(), Error> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (scene, place) = match words.as_slice() {
        [scene, xyz @ ..] => (scene.as_str(), xyz.iter().filter_map(|word| word.parse().ok()).collect()),
        [] => ("builtin:cornell", vec![278.0, 250.0, 150.0]),
    };
    let &[x, y, z] = place.as_slice() else {
        return Err(Error::Usage("after the scene, three numbers say where the LiDAR stands".into()));
    };
    let eye = DVec3::new(x, y, z);

    // Rings between 30 degrees below and 10 above the horizon; the middle column looks towards −Z, up is the axis.
    let lens = Lens::Spinning { elevations: [-30.0, 10.0] };
    let lidar = Camera { eye, target: eye - DVec3::Z, up: DVec3::Y, lens, width: 900, height: 32 };

    let scene = load(scene, LoadOptions::default())?;
    let (seen, _) = visibility(&scene, &lidar, &Options::default())?;
    let points = seen.points(&scene)?;
    println!("{} of {} rays hit", points.len(), seen.hits.len());
    write_ply(Path::new("lidar_scan.ply"), &points)
}
