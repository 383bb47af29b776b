//! The look of the preview: a headlight, a sky and the lights asked for, in linear light.
//!
//! L = albedo·(h·|n·v| + s·(1 + n·up)/2 + E), h warm and s cool, with n the normal on the viewer's side, interpolated where
//! the file has normals, v the direction toward the viewer, and E what arrives from the lights (`lamps.rs`). Where there are
//! any, the headlight is dimmed so that their shadows are dark. It is meant to show shape, not to be physically right.
//!
//! Based on: James Blinn, "Models of Light Reflection for Computer Synthesized Pictures", 1977 (hemisphere and headlight).

use glam::DVec3;
use umbel_core::{Hit, Ray, Triangles};

use crate::render::lamps::Lamps;
use crate::scene::CLAY;
use crate::scene::Scene;
use crate::scene::camera::{Camera, Lens};

/// The light of the headlight: warm.
const HEADLIGHT: [f64; 3] = [0.70, 0.66, 0.61];
/// The part of the headlight that stays on beside other lights.
const DIMMED: f64 = 0.2;
/// The light of the whole sky: cool.
const SKY: [f64; 3] = [0.26, 0.32, 0.39];
/// The background at the upper and the lower edge, linear.
const BACKGROUND: [[f32; 3]; 2] = [[0.52, 0.64, 0.78], [0.93, 0.95, 0.97]];

/// What shading needs to know of a scene.
#[derive(Debug)]
pub(crate) struct Shader<'a> {
    scene: &'a Scene,
    triangles: &'a Triangles<'a>,
}

impl<'a> Shader<'a> {
    pub(crate) fn new(scene: &'a Scene, triangles: &'a Triangles<'a>) -> Self {
        Self { scene, triangles }
    }

    /// The linear colour of the hit of ray `index`.
    pub(crate) fn shade(
        &self,
        (index, ray): (usize, &Ray),
        hit: &Hit,
        up: DVec3,
        lamps: &Lamps<'_>,
    ) -> [f32; 3] {
        let viewer = -ray.direction.normalize_or_zero();
        let [normal, _] = self.scene.normals_toward(self.triangles, ray, hit);
        let point = ray.origin + ray.direction * f64::from(hit.t);
        let lamps = (!lamps.is_empty()).then(|| lamps.light_at(index, point, normal));
        Appearance { albedo: self.albedo(hit.id.0), normal, viewer, up, lamps }.colour()
    }

    /// The diffuse colour of a triangle's material.
    fn albedo(&self, triangle: u32) -> [f32; 3] {
        self.scene.material_of(triangle).map_or(CLAY, |material| material.diffuse)
    }
}

/// What a surface looks like.
pub(crate) struct Appearance {
    pub(crate) albedo: [f32; 3],
    /// Of unit length, on the viewer's side.
    pub(crate) normal: DVec3,
    /// The unit direction toward the viewer.
    pub(crate) viewer: DVec3,
    pub(crate) up: DVec3,
    /// What arrives from lights; `None` where there are none.
    pub(crate) lamps: Option<[f64; 3]>,
}

impl Appearance {
    /// The linear colour.
    pub(crate) fn colour(&self) -> [f32; 3] {
        let headlight = self.normal.dot(self.viewer).max(0.0);
        let sky = (1.0 + self.normal.dot(self.up.normalize_or_zero())) * 0.5;
        let headlight = if self.lamps.is_none() { headlight } else { headlight * DIMMED };
        let lamps = self.lamps.unwrap_or_default();
        [0, 1, 2].map(|k| self.albedo[k] * (HEADLIGHT[k] * headlight + SKY[k] * sky + lamps[k]) as f32)
    }
}

/// The background that a ray of a camera sees.
pub(crate) fn background_of(camera: &Camera, ray_index: usize, ray: &Ray) -> [f32; 3] {
    if matches!(camera.lens, Lens::Pinhole { .. } | Lens::Ortho { .. }) {
        let (width, rows) = (camera.width as usize, camera.rows() as usize);
        return background((ray_index / width) as f32 / rows as f32);
    }
    // All around, the sky is where the ray points.
    background_toward(ray.direction, camera.up)
}

/// The background from 0 (above) to 1 (below).
fn background(height: f32) -> [f32; 3] {
    [0, 1, 2].map(|k| BACKGROUND[0][k] + (BACKGROUND[1][k] - BACKGROUND[0][k]) * height)
}

/// The background in a direction: the sky is all around. `up` is up in the picture.
pub(crate) fn background_toward(direction: DVec3, up: DVec3) -> [f32; 3] {
    background((0.5 - 0.5 * direction.normalize_or_zero().dot(up.normalize_or_zero())) as f32)
}
