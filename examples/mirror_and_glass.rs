//! Mirrors and glass: the built-in flowers around a pond, with a ball of glass and one of silver.
//!
//! `cargo run --release --example mirror_and_glass [WIDTH]` writes `mirror_and_glass.png`. The camera's rays are a pencil; what
//! its hits send on are rays of any kind, traced bounce by bounce with nothing to build.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::f64::consts::PI;
use std::path::Path;

use umbel::files::{srgb_encode, write_png_rgb8};
use umbel::glam::DVec3;
use umbel::render::{Bounces, Look, Preview, preview_with};
use umbel::scene::{Material, NO_INDEX, Object, Optics};
use umbel::shadow::sun_light;
use umbel::{Camera, Error, Lens, Options, Scene, builtin, visibility};

/// Water: of what does not pass into the dark, most is mirrored at flat angles.
const WATER: Optics = Optics { mirror: [0.30, 0.33, 0.36], ..Optics::OPAQUE };

fn main() -> Result<(), Error> {
    let width = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(800_u32);
    let mut scene = builtin("umbel")?;
    let pond = add_material(&mut scene, "water", [0.03, 0.09, 0.10], WATER);
    add_disc(&mut scene, pond, DVec3::new(0.0, 0.06, 0.0), 60.0);
    let glass = add_material(&mut scene, "glass", [0.8; 3], Optics::glass(1.5));
    add_ball(&mut scene, glass, DVec3::new(1.50, 0.50, 1.10), 0.44);
    let silver = add_material(&mut scene, "silver", [0.0; 3], Optics::MIRROR);
    add_ball(&mut scene, silver, DVec3::new(-0.25, 0.34, 1.60), 0.28);

    let camera = Camera {
        eye: DVec3::new(4.1, 1.3, 4.5),
        target: DVec3::new(0.16, 0.80, 0.0),
        up: DVec3::Y,
        lens: Lens::Pinhole { fov: 38.0 },
        width,
        height: width * 9 / 16,
    };
    let options = Options::default();
    let (buffer, _) = visibility(&scene, &camera, &options)?;
    let look = Look {
        samples: 8,
        lights: vec![sun_light(DVec3::new(0.3, 2.0, 1.8)), sun_light(DVec3::new(1.8, 1.6, 0.2))],
        bounces: Bounces { reflect: true, refract: true, most: 6 },
    };
    let Preview { linear, followed, .. } = preview_with(&scene, &camera, &buffer, &look, &options, |_| {})?;
    println!("rays of each bounce: {:?}", followed.rays);
    let bytes: Vec<u8> = linear.into_iter().map(srgb_encode).collect();
    write_png_rgb8(Path::new("mirror_and_glass.png"), camera.width, camera.height, &bytes)
}

/// A new material of the scene.
fn add_material(scene: &mut Scene, name: &str, diffuse: [f32; 3], optics: Optics) -> u32 {
    scene.materials.push(Material { name: name.to_owned(), diffuse, optics });
    scene.materials.len() as u32 - 1
}

/// A level disc that faces up.
fn add_disc(scene: &mut Scene, material: u32, centre: DVec3, radius: f64) {
    let corner = |k: u32| {
        centre + DVec3::new((f64::from(k) * PI / 24.0).cos(), 0.0, -(f64::from(k) * PI / 24.0).sin()) * radius
    };
    let rim: Vec<DVec3> = (0..48).map(corner).collect();
    let triangles = (1..47).map(|k| [0, k, k + 1]).collect();
    add_object(scene, material, &rim, None, triangles);
}

/// A ball of 128 x 64 quads with smooth normals.
fn add_ball(scene: &mut Scene, material: u32, centre: DVec3, radius: f64) {
    let (columns, rows) = (128, 64);
    let (mut normals, mut triangles) = (Vec::new(), Vec::new());
    for row in 0..=rows {
        for column in 0..columns {
            let (theta, phi) =
                (PI * f64::from(row) / f64::from(rows), 2.0 * PI * f64::from(column) / f64::from(columns));
            normals.push(DVec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()));
            let (here, right) = (row * columns + column, row * columns + (column + 1) % columns);
            if row < rows {
                triangles.extend([[here, here + columns, right + columns], [here, right + columns, right]]);
            }
        }
    }
    let points: Vec<DVec3> = normals.iter().map(|&normal| centre + normal * radius).collect();
    add_object(scene, material, &points, Some(&normals), triangles);
}

/// A new object of the scene, last in order.
fn add_object(
    scene: &mut Scene,
    material: u32,
    points: &[DVec3],
    normals: Option<&[DVec3]>,
    triangles: Vec<[u32; 3]>,
) {
    let (first, first_normal) = (scene.positions.len() as u32, scene.normals.len() as u32);
    let start = scene.triangles.len() as u32;
    let narrow = |v: &DVec3| v.to_array().map(|x| x as f32);
    scene.positions.extend(points.iter().map(narrow));
    scene.normals.extend(normals.into_iter().flatten().map(narrow));
    for triangle in triangles {
        scene.triangles.push(triangle.map(|k| first + k));
        scene.normal_indices.push(normals.map_or([NO_INDEX; 3], |_| triangle.map(|k| first_normal + k)));
    }
    let triangles = start..scene.triangles.len() as u32;
    let name = scene.materials[material as usize].name.clone();
    scene.objects.push(Object { name, triangles, material: Some(material) });
}
