//! What several tests look at, and where a cube camera looks.

use umbel::engine::{Dicing, dice_all};
use umbel::formats::{SurfaceOptions, load_surfaces};
use umbel::glam::DVec3;
use umbel::{Camera, Lens};

/// The direction of a pixel of a cube camera: the table of OpenGL, Direct3D, Vulkan and KTX, in world axes.
pub fn cube_direction(size: usize, pixel: usize) -> DVec3 {
    let (face, i, j) = (pixel / (size * size), pixel % size, pixel / size % size);
    let at = |k: usize| 2.0 * (k as f64 + 0.5) / size as f64 - 1.0;
    let (s, t) = (at(i), at(j));
    DVec3::from_array(match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    })
}

/// The teapot as an OBJ file: its micropolygons, with edges of about 1/60 of a unit.
pub fn teapot_obj() -> String {
    let lens = Lens::Ortho { height: 6.0 };
    let (eye, target) = (DVec3::new(4.0, 5.0, 6.0), DVec3::new(0.0, 1.5, 0.0));
    let camera = Camera { eye, target, up: DVec3::Y, lens, width: 360, height: 360 };
    let pencil = camera.shot().expect("a camera").pencil;
    let scene = load_surfaces("builtin:teapot", SurfaceOptions::default()).expect("the teapot");
    let dicing = Dicing { shading_rate: 1.0, ..Dicing::default() };
    let diced = dice_all(&scene.surfaces, &pencil, &dicing).expect("triangles");
    let mut obj = String::new();
    for [x, y, z] in diced.positions() {
        obj += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c] in diced.indices() {
        obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    obj
}
