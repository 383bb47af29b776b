//! Ambient occlusion of what a camera sees: each pixel's point is a receiver, and no vertex or texel is needed.
//!
//! `cargo run --release --example ambient_picture [SCENE [RAYS]]` writes `ambient_picture.png`: four points in each pixel,
//! each with RAYS (64) of the set that its pass turns anew. Occluders count at any distance.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::path::Path;

use umbel::bake::{Bake, BakeOptions, BakeReceivers};
use umbel::builtin::builtin_view;
use umbel::engine::{Above, Hemisphere, Receiver};
use umbel::files::{GrayBits, srgb_encode, write_png_gray};
use umbel::glam::DVec3;
use umbel::{Camera, Error, Frame, Hits, Lens, LoadOptions, Options, Pencil, Scene, Triangles, load};

/// Pixels of the picture.
const SIZE: (u32, u32) = (640, 360);
/// Points in each pixel.
const PASSES: u32 = 4;
/// The light that comes from where nothing is, and what of it a surface returns.
const SKY: f32 = 1.0;
const SURFACE: f32 = 0.85;

fn main() -> Result<(), Error> {
    let mut words = std::env::args().skip(1);
    let name = words.next().unwrap_or_else(|| "builtin:umbel".to_owned());
    let rays = words.next().map_or(Ok(64), |word| word.parse());
    let rays = rays.map_err(|_| Error::Usage("RAYS is a number, such as 64".to_owned()))?;
    let scene = load(&name, LoadOptions::default())?;
    let triangles = scene.geometry()?;
    let (camera, options) = (camera(&name, &scene), Options::default());

    let mut sums = vec![0.0; (SIZE.0 * SIZE.1) as usize];
    let (mut seen, mut bake_frame) = (Frame::keeping_order(), Frame::new());
    for pass in 0..PASSES {
        let shot = camera.subpixel_shot(pass, PASSES)?;
        seen.closest_hit(&triangles, &shot.pencil, &options)?;
        let receivers = receivers(&scene, &triangles, &shot.pencil, seen.hits());
        let bake = Bake::new(BakeOptions { rays, seed: u64::from(pass), ..BakeOptions::default() })?;
        let found = bake.run(&triangles, &receivers, &mut bake_frame, &options)?;
        let mut light = vec![SKY; sums.len()];
        for (&ray, value) in receivers.indices.iter().zip(found.values) {
            light[ray as usize] = SURFACE * value;
        }
        sums.iter_mut().zip(light).for_each(|(sum, light)| *sum += light / PASSES as f32);
        println!("pass {} of {PASSES}: {} points, {} rays", pass + 1, receivers.len(), found.rays);
    }
    let grays: Vec<f32> = sums.into_iter().map(|light| f32::from(srgb_encode(light)) / 255.0).collect();
    write_png_gray(Path::new("ambient_picture.png"), SIZE.0, SIZE.1, &grays, GrayBits::Eight)
}

/// The view of a built-in scene, or one that holds all of a file.
fn camera(name: &str, scene: &Scene) -> Camera {
    let (width, height) = SIZE;
    match name.strip_prefix("builtin:").and_then(builtin_view) {
        Some(view) => Camera {
            eye: DVec3::from_array(view.eye),
            target: DVec3::from_array(view.target),
            up: DVec3::from_array(view.up),
            lens: Lens::Pinhole { fov: view.fov_degrees },
            width,
            height,
        },
        None => {
            let lens = Lens::Pinhole { fov: 40.0 };
            Camera::framing(&scene.bounds(), DVec3::new(1.0, 0.7, 1.0), lens, width, height)
        }
    }
}

/// The points that rays hit, on the side that they see. Each has the number of its ray.
fn receivers(scene: &Scene, triangles: &Triangles<'_>, pencil: &Pencil, hits: &Hits) -> BakeReceivers {
    let mut receivers = BakeReceivers::default();
    for ray_id in 0..hits.len() {
        let Some(hit) = hits.get(ray_id) else { continue };
        let ray = pencil.ray(ray_id);
        let weights = triangles.barycentrics(hit.id, &ray);
        let Some(side) = triangles.side_toward(hit.id, -ray.direction) else { continue };
        // The shading normal may be on either side, as the file has it.
        let normal = scene.shading_normal(triangles, hit.id, weights);
        let is_turned = triangles.side_toward(hit.id, normal) != Some(side);
        let normal = if is_turned { -normal } else { normal };
        let point = triangles.leave(hit.id, weights, side);
        let receiver = Receiver { point, triangle: hit.id };
        let hemisphere = Hemisphere { receiver, above: Above::Side(side) };
        receivers.push(hemisphere, normal.to_array().map(|x| x as f32), ray_id as u32);
    }
    receivers
}
