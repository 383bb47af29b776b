//! Mirrors and glass from outside: against mirrored scenes rendered directly, against formulas, as files.
//!
//! - A level mirror at y = 0: the reflected ray hits what the camera's own ray would hit in the scene mirrored at y = 0.
//! - A slab of thickness h and index n shifts a ray by s = h sin θ (1 − cos θ/√(n² − sin² θ)) and keeps its direction.
//! - A prism of 45° turns a ray by 90°: the critical angle of n = 1.5 is 41.8°.
//!
//! Based on: Max Born and Emil Wolf, "Principles of Optics", 1959 (slab and prism).

mod files;
mod rays;

use umbel::glam::DVec3;
use umbel::render::Bounces;
use umbel::scene::{Material, Object, Optics};
use umbel::{Camera, Lens, Scene};

/// Mirrors and glass.
const BOTH: Bounces = Bounces { reflect: true, refract: true, most: 4 };

/// Adds an object of triangles with a material of its own.
fn add(scene: &mut Scene, name: &str, optics: Optics, positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
    let (first, start) = (scene.positions.len() as u32, scene.triangles.len() as u32);
    scene.positions.extend(positions);
    scene.triangles.extend(triangles.iter().map(|corners| corners.map(|k| first + k)));
    scene.materials.push(Material { name: name.to_owned(), diffuse: [0.5, 0.4, 0.3], optics });
    let triangles = start..scene.triangles.len() as u32;
    let material = Some(scene.materials.len() as u32 - 1);
    scene.objects.push(Object { name: name.to_owned(), triangles, material });
}

/// Adds a box whose faces look outwards.
fn add_box(scene: &mut Scene, name: &str, optics: Optics, lo: [f32; 3], hi: [f32; 3]) {
    let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 0 { lo[axis] } else { hi[axis] });
    let corners: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    add(scene, name, optics, &corners, &triangles);
}

/// A camera with a pinhole.
fn camera(eye: DVec3, target: DVec3, [width, height]: [u32; 2]) -> Camera {
    Camera { eye, target, up: DVec3::Y, lens: Lens::Pinhole { fov: 45.0 }, width, height }
}
