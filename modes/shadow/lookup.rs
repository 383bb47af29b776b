//! Looking up a cube map: is a point lit, as far as N x N texels per face can tell?
//!
//! A texel knows one distance, that along its middle; a point p elsewhere in the texel is compared with it. On a plane with
//! normal n the two differ, so a point needs a bias, and the resolution and the slope say which. Let v = p − l be the way
//! from the light, scaled so that its component along the face's m is 1: w = m + x·s + y·t. The middle of its texel is
//! c = w + Δx·s + Δy·t with |Δx|, |Δy| ≤ 1/N. The plane n·(q − p) = 0 is met along any w at t(w)·w with
//!
//!   t(w) = n·(p − l) / n·w,    so 1/t is affine on the face,    and at the distance r(w) = t(w)·|w|.
//!
//! Since |n·c − n·w| ≤ (|n·s| + |n·t|)/N and |c| ≥ |w| − √2/N, the plane is nowhere in the texel nearer than
//!
//!   r_min = r(w) · (1 − √2/(N·|w|)) / (1 + (|n·s| + |n·t|)/(N·|n·w|)).
//!
//! The first factor is the texel's size seen from the light, the quotient (|n·s| + |n·t|)/|n·w| is the slope. A point is
//! lit iff the stored distance is at least r_min(1 − 2⁻²²): t and t·|c| are rounded to f32, 2⁻²⁴ each, the rest is f64.
//! The bias is r(w) − r_min. So a plane never shadows itself, whatever the resolution (no acne); what is nearer to a surface
//! than the bias casts no shadow on it (a leak), and toward grazing light the bias grows up to the whole distance. A curved
//! or folded surface can still shadow itself, such as the inner corner of a room: there a texel's middle sees another
//! triangle than the point is on. What a map gets wrong on a scene, [`compare_maps`](crate::shadow::compare::compare_maps) counts.
//!
//! Tried: the plane's distance along the texel's middle itself, r(c), instead of its least over the texel. On sponza at
//! N = 256 it leaks 0.51 % instead of 0.96 % of the pixels, but has 1.75 % of acne instead of 0.19 %, because the plane of a
//! small triangle says nothing about its neighbours; on the built-in flower 5.6 and 12.1 % instead of 9.2 and 4.0 %.
//!
//! Based on: Lance Williams, "Casting Curved Shadows on Curved Surfaces", 1978; Hang Dou et al., "Adaptive Depth Bias for
//! Shadow Maps", 2014 (the depth of the receiver's plane along the texel's middle; here its least over the texel).

use glam::DVec3;

use crate::error::Error;
use crate::scene::camera::{CUBE_FACES, on_origin_grid};

/// Two roundings to f32 of 2⁻²⁴ each, and less than that much again for all of f64.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// The distances that a point light sees, on six faces in the order +X −X +Y −Y +Z −Z.
#[derive(Debug, Clone, PartialEq)]
pub struct CubeMap {
    light: DVec3,
    size: u32,
    distances: Vec<f32>,
}

/// The place of a direction on a cube.
struct Place {
    /// The face, 0 to 5.
    face: usize,
    /// Coordinates on the face along s and t, −1 to 1.
    at: [f64; 2],
}

impl CubeMap {
    /// Keeps the distances of 6 · `size` · `size` texels around a light.
    ///
    /// # Errors
    /// When there are more or fewer, or none.
    pub fn new(light: DVec3, size: u32, distances: Vec<f32>) -> Result<Self, Error> {
        let texels = 6 * u64::from(size) * u64::from(size);
        if texels == 0 || texels != distances.len() as u64 {
            let count = distances.len();
            return Err(Error::Usage(format!(
                "{count} distances are not a cube map of 6 faces of {size}x{size} texels"
            )));
        }
        Ok(Self { light: on_origin_grid(light), size, distances })
    }

    /// The light.
    #[must_use]
    pub fn light(&self) -> DVec3 {
        self.light
    }

    /// Texels along one side of a face.
    #[must_use]
    pub fn size(&self) -> u32 {
        self.size
    }

    /// The distances: face by face, row by row from the top; +∞ where nothing is seen.
    #[must_use]
    pub fn distances(&self) -> &[f32] {
        &self.distances
    }

    /// The distance stored in the texel that holds a direction.
    #[must_use]
    pub fn distance(&self, direction: DVec3) -> f32 {
        let Place { face, at } = place(direction);
        let size = self.size as usize;
        let [i, j] = at.map(|x| texel(x, self.size) as usize);
        self.distances[(face * size + j) * size + i]
    }

    /// By how much a point of a plane with this normal (of any length) may lie behind the distance stored in its texel and
    /// still be lit: r − r_min above.
    #[must_use]
    pub fn bias(&self, point: DVec3, normal: DVec3) -> f64 {
        let way = point - self.light;
        way.length() - least_distance(way, normal, self.size)
    }

    /// Whether a point of a plane with this normal (of any length) is lit, as far as the map can tell. Which side of
    /// the plane is seen, and whether the light is on it, is the caller's business.
    #[must_use]
    pub fn is_lit(&self, point: DVec3, normal: DVec3) -> bool {
        let way = point - self.light;
        is_lit_at(self.distance(way), way, normal, self.size)
    }
}

/// Whether a point that lies `way` from the light, on a plane with this normal, is lit by what its texel of N x N stores.
pub(crate) fn is_lit_at(stored: f32, way: DVec3, normal: DVec3, size: u32) -> bool {
    f64::from(stored) >= least_distance(way, normal, size) * (1.0 - ROUNDING)
}

/// The direction through the middle of the texel of N x N that holds a direction.
pub(crate) fn texel_middle(direction: DVec3, size: u32) -> DVec3 {
    let Place { face, at } = place(direction);
    let [m, s, t] = CUBE_FACES[face];
    let [x, y] = at.map(|x| (2.0 * f64::from(texel(x, size)) + 1.0) / f64::from(size) - 1.0);
    m + s * x + t * y
}

/// r_min: the least distance of the plane through a point within the point's texel, or less.
fn least_distance(way: DVec3, normal: DVec3, size: u32) -> f64 {
    let Place { face, at: [x, y] } = place(way);
    let [m, s, t] = CUBE_FACES[face];
    let w = m + s * x + t * y;
    let half_texel = 1.0 / f64::from(size);
    let across = (normal.dot(s).abs() + normal.dot(t).abs()) * half_texel;
    let along = normal.dot(w).abs();
    // Seen edge-on, the plane may be as near as anything.
    let slope = if along > 0.0 { along / (along + across) } else { 0.0 };
    let nearer = (1.0 - std::f64::consts::SQRT_2 * half_texel / w.length()).max(0.0);
    way.length() * nearer * slope
}

/// The texel of N along a side that holds a coordinate from −1 to 1.
fn texel(x: f64, size: u32) -> u32 {
    // The cast saturates; NaN, of the direction 0, is texel 0.
    (((x + 1.0) * 0.5 * f64::from(size)) as u32).min(size - 1)
}

/// The face that a direction meets, and where. On an edge X goes before Y before Z.
fn place(direction: DVec3) -> Place {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let face = 2 * axis + usize::from(direction[axis] < 0.0);
    let [m, s, t] = CUBE_FACES[face];
    let depth = direction.dot(m);
    Place { face, at: [direction.dot(s) / depth, direction.dot(t) / depth] }
}
