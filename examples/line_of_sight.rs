//! Who sees whom: three guards watch a room, each through a colour of its own.
//!
//! `cargo run --release --example line_of_sight` writes `line_of_sight.png`, a map of the Cornell box from above. A place
//! is white where all guards see it, yellow where only the red and the green one do, and black where nobody does.
//!
//! The direction of a ray is the whole way, so t runs from 0 to 1, exclusive, and *any* hit blocks the view. No epsilon
//! keeps the ends of a ray off surfaces: they are no part of it.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::path::Path;

use umbel::files::write_png_rgb8;
use umbel::glam::DVec3;
use umbel::{Error, Options, Ray, any_hit, builtin};

/// Places along one side of the room.
const SIDE: u32 = 512;
/// Millimetres above the floor: the blocks are higher.
const HEIGHT: f64 = 50.0;

fn main() -> Result<(), Error> {
    let scene = builtin("cornell")?;
    let triangles = scene.geometry()?;
    let guards = [(60.0, 520.0), (500.0, 480.0), (280.0, 30.0)];
    let guards = guards.map(|(x, z)| DVec3::new(x, HEIGHT, z));

    // From above, x runs to the left as in the camera's picture, and z away from the viewer.
    let place = |k: u32| 549.0 - 548.0 * (f64::from(k) + 0.5) / f64::from(SIDE);
    let places = (0..SIDE * SIDE).map(|k| DVec3::new(place(k % SIDE), HEIGHT, place(k / SIDE)));
    let rays: Vec<Ray> = places
        .flat_map(|place| guards.map(|guard| (place, guard - place)))
        .map(|(place, way)| Ray { t_max: 1.0, ..Ray::new(place, way) })
        .collect();
    let (blocked, stats) = any_hit(&triangles, rays.as_slice(), &Options::default())?;

    let pixels: Vec<u8> = blocked.iter().map(|&b| if b { 25 } else { 240 }).collect();
    let free = blocked.iter().filter(|&&b| !b).count();
    println!("{free} of {} lines of sight are free", rays.len());
    println!("{} pairs of a ray and a triangle tested", stats.samples_tested);
    write_png_rgb8(Path::new("line_of_sight.png"), SIDE, SIDE, &pixels)
}
