//! Scenes with texture coordinates, and what their atlases hold.

use std::collections::BTreeMap;

use umbel::Scene;
use umbel::bake::{Atlas, AtlasOptions, TexelReceiver};

/// Triangles of their own, each with texture coordinates; they lie apart in space, so that each is a chart.
pub(crate) fn soup(uvs: &[[[f32; 2]; 3]]) -> Scene {
    let mut scene = Scene { name: "soup".into(), ..Scene::default() };
    for (k, corners) in (0_u16..).zip(uvs) {
        let z = f32::from(k);
        push(&mut scene, [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]], *corners);
    }
    scene
}

/// Adds a triangle with vertices and texture coordinates of its own.
pub(crate) fn push(scene: &mut Scene, positions: [[f32; 3]; 3], uvs: [[f32; 2]; 3]) {
    let next = |length: usize| [0, 1, 2].map(|k| u32::try_from(length).expect("small") + k);
    scene.triangles.push(next(scene.positions.len()));
    scene.uv_indices.push(next(scene.uvs.len()));
    scene.positions.extend(positions);
    scene.uvs.extend(uvs);
}

/// Adds the quad abcd as abc and acd.
pub(crate) fn push_quad(scene: &mut Scene, [a, b, c, d]: [[f32; 3]; 4], [p, q, r, s]: [[f32; 2]; 4]) {
    push(scene, [a, b, c], [p, q, r]);
    push(scene, [a, c, d], [p, r, s]);
}

/// The corners of a square in the plane z, and of one in the texture.
pub(crate) fn square(lo: f32, hi: f32) -> [[f32; 2]; 4] {
    [[lo, lo], [hi, lo], [hi, hi], [lo, hi]]
}

/// Lifts points of the plane to z.
pub(crate) fn at(z: f32, points: [[f32; 2]; 4]) -> [[f32; 3]; 4] {
    points.map(|[x, y]| [x, y, z])
}

pub(crate) fn atlas(scene: &Scene, size: u32, samples: u32) -> Atlas<'_> {
    Atlas::new(scene, &AtlasOptions { size, samples }).expect("something to bake")
}

/// All receivers.
pub(crate) fn receivers(scene: &Scene, size: u32, samples: u32) -> Vec<TexelReceiver> {
    atlas(scene, size, samples).band(0..size)
}

/// The triangles of the receivers of each covered texel, in their order.
pub(crate) fn triangles(receivers: &[TexelReceiver]) -> BTreeMap<u32, Vec<u32>> {
    let mut found: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    receivers.iter().for_each(|r| found.entry(r.texel).or_default().push(r.triangle.0));
    found
}

/// Where a receiver lies in the texture, in texels: x to the right, y down the image.
pub(crate) fn place(scene: &Scene, size: u32, receiver: &TexelReceiver) -> [f64; 2] {
    let uv = scene.uv_corners(receiver.triangle).expect("texture coordinates");
    let weights = receiver.barycentrics();
    let mean = |k: usize| (0..3).map(|corner| weights[corner] * f64::from(uv[corner][k])).sum::<f64>();
    let v = if scene.uv_v_down { mean(1) } else { 1.0 - mean(1) };
    [mean(0) * f64::from(size), v * f64::from(size)]
}
