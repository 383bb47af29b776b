//! `builtin:cornell`: the Cornell box as it was measured, in millimetres.
//!
//! The light lies in the plane of the ceiling, as published. It comes first, because of two triangles at the same distance
//! the one with the smaller id is seen. No wall is quite square; the numbers are meant so.
//!
//! Based on: Cindy Goral, Kenneth Torrance, Donald Greenberg, Bennett Battaile, "Modeling the Interaction of Light
//! Between Diffuse Surfaces", 1984; Cornell University Program of Computer Graphics, "The Cornell Box", 1998 (the data).

use crate::builtin::sweep::index;
use crate::scene::optics::Optics;
use crate::scene::{Material, Object, Scene};

/// Linear diffuse reflectances: the measured spectra, as they are commonly rounded to RGB.
const CORNELL_MATERIALS: [(&str, [f32; 3]); 4] = [
    ("white", [0.73, 0.73, 0.73]),
    ("red", [0.63, 0.065, 0.05]),
    ("green", [0.14, 0.45, 0.091]),
    ("light", [0.78, 0.78, 0.78]),
];

/// The quads of the box, counter-clockwise seen from inside, each with its material.
const CORNELL_QUADS: [(&str, u32, [[f32; 3]; 4]); 6] = [
    (
        "light",
        3,
        [[343.0, 548.8, 227.0], [343.0, 548.8, 332.0], [213.0, 548.8, 332.0], [213.0, 548.8, 227.0]],
    ),
    ("floor", 0, [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]]),
    ("ceiling", 0, [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]]),
    ("back wall", 0, [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]]),
    ("green wall", 2, [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]]),
    ("red wall", 1, [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]]),
];

/// The blocks: height and the top's corners (x, z), counter-clockwise seen from above.
const CORNELL_BLOCKS: [(&str, f32, [[f32; 2]; 4]); 2] = [
    ("short block", 165.0, [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]]),
    ("tall block", 330.0, [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]]),
];

/// The Cornell box: y up, open towards −z.
pub(crate) fn cornell(name: String) -> Scene {
    let materials = CORNELL_MATERIALS.map(|(name, diffuse)| Material {
        name: name.to_owned(),
        diffuse,
        optics: Optics::OPAQUE,
    });
    let mut scene = Scene { name, materials: materials.to_vec(), ..Scene::default() };
    for (name, material, corners) in CORNELL_QUADS {
        add_object(&mut scene, name, material, &corners, &[[0, 1, 2, 3]]);
    }
    for (name, height, top) in CORNELL_BLOCKS {
        let [[a, b, c, d], [e, f, g, h]] = [height, 0.0].map(|y| top.map(|[x, z]| [x, y, z]));
        let sides = [[3, 2, 6, 7], [2, 1, 5, 6], [1, 0, 4, 5], [0, 3, 7, 4]];
        let quads = [&[[0, 1, 2, 3]], &sides[..], &[[7, 6, 5, 4]]].concat();
        add_object(&mut scene, name, 0, &[a, b, c, d, e, f, g, h], &quads);
    }
    scene
}

/// Adds an object of quads, two triangles each.
fn add_object(scene: &mut Scene, name: &str, material: u32, corners: &[[f32; 3]], quads: &[[u32; 4]]) {
    let (first, start) = (index(scene.positions.len()), index(scene.triangles.len()));
    scene.positions.extend(corners);
    for [a, b, c, d] in quads.iter().map(|quad| quad.map(|corner| first + corner)) {
        scene.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let triangles = start..index(scene.triangles.len());
    scene.objects.push(Object { name: name.to_owned(), triangles, material: Some(material) });
}
