//! What a shadow map gets wrong: exact shadows of a point light, and where a cube of 256 x 256 texels per face differs.
//!
//! `cargo run --release --example shadow_map_errors [SCENE X,Y,Z]` writes `shadow_map_errors.png`: white is lit, gray in
//! shadow; red is *acne*, lit but shadowed in the map; blue is a *leak*, the other way round. X,Y,Z is the light.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::path::Path;

use umbel::files::write_png_rgb8;
use umbel::glam::DVec3;
use umbel::shadow::{Receivers, compare_maps, cube_map, point_light, receivers};
use umbel::{Camera, Error, Frame, Lens, LoadOptions, NO_TRIANGLE, Options, load, visibility};

/// Pixels of the picture.
const SIZE: (u32, u32) = (960, 540);
/// Texels along one side of a face.
const TEXELS: u32 = 256;
/// The colour of what is in shadow.
const SHADOW: [u8; 3] = [110, 112, 120];

fn main() -> Result<(), Error> {
    let mut words = std::env::args().skip(1);
    let name = words.next().unwrap_or_else(|| "builtin:umbel".to_owned());
    let light = words.next().unwrap_or_else(|| "-1.5,7,3.5".to_owned());
    let numbers: Vec<f64> = light.split(',').filter_map(|number| number.parse().ok()).collect();
    let &[x, y, z] = &numbers[..] else {
        return Err(Error::Usage(format!("{light}: a light has three numbers, such as 1,2,3")));
    };
    let light = DVec3::new(x, y, z);
    let scene = load(&name, LoadOptions::default())?;
    let triangles = scene.geometry()?;
    let lens = Lens::Pinhole { fov: 45.0 };
    let camera = Camera::framing(&scene.bounds(), DVec3::new(1.0, 0.9, 1.0), lens, SIZE.0, SIZE.1);

    // What the camera sees, and which of that the light sees: exactly, and as the map has it.
    let options = Options::default();
    let (buffer, _) = visibility(&scene, &camera, &options)?;
    let lights = [point_light(light)];
    let of_lights = receivers(&triangles, &buffer.shot.pencil, &buffer.hits, &lights)?;
    let Receivers { points, rays } = &of_lights[0];
    let mut frame = Frame::keeping_order();
    let (shadowed, _) = frame.shadowed(&triangles, lights[0], points, &options)?;
    let (map, _) = cube_map(&triangles, light, TEXELS, &mut frame, &options)?;

    // What turns away from the light is in shadow whatever the map says.
    let surface = |id: &u32| if *id == NO_TRIANGLE { [255; 3] } else { SHADOW };
    let mut pixels: Vec<u8> = buffer.ids().iter().flat_map(surface).collect();
    for ((receiver, &ray), &shadowed) in points.iter().zip(rays).zip(&shadowed) {
        let point = DVec3::from_array(receiver.point.map(f64::from));
        let colour = match (shadowed, map.is_lit(point, triangles.normal(receiver.triangle))) {
            (false, true) => [235, 235, 230],
            (true, false) => SHADOW,
            (false, false) => [220, 30, 30],
            (true, true) => [40, 80, 230],
        };
        pixels[3 * ray as usize..][..3].copy_from_slice(&colour);
    }
    let found = compare_maps(&triangles, &map, points, &shadowed);
    println!("{} receivers turn to the light: {} acne, {} leaks", found.receivers, found.acne, found.leaks);
    write_png_rgb8(Path::new("shadow_map_errors.png"), SIZE.0, SIZE.1, &pixels)
}
