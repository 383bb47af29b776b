//! Sets of directions over the hemispheres of receivers, with the distance up to which an occluder counts along each.
//!
//! *Shared* and *interleaved* sets cover the whole sphere with M = 2·N directions, so that about N of them lie in any
//! hemisphere: the spherical Fibonacci points
//!
//! ```text
//! z_k = 1 − (2k + 1)/M,   φ_k = 2π k/Φ,   d_k = (√(1 − z²) cos φ, √(1 − z²) sin φ, z),   Φ = (1 + √5)/2,
//! ```
//!
//! turned by a random rotation, one for each set. *Independent* directions are N of a hemisphere about the normal n of one
//! receiver, shifted by random numbers ξ of its own (Cranley and Patterson): x_k = (k + ξ₁)/N, φ_k = 2π(k/Φ + ξ₂), and
//! cos θ = √(1 − x) for a density in proportion to cos θ, or 1 − x for a uniform one.
//!
//! *Linear falloff* over a distance D: an occluder at t counts 1 − t/D. For u uniform in (0, 1) the mean of
//! \[t < u·D\] is just that, so direction k has the limit u_k·D, with u_k = {k·√2 + ½} or {k·√2 + ξ₃}: evenly spread, and
//! unrelated to the angles.
//!
//! All directions are rounded to f32, and so is each limit: t_max = u_k·D/|d_k|.
//!
//! Based on: Robert Marques, Christian Bouville, Mickaël Ribardière, Luís Paulo Santos, Kadi Bouatouch, "Spherical
//! Fibonacci Point Sets for Illumination Integrals", 2013; Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling",
//! 2001; Roy Cranley and Thomas Patterson, "Randomization of Number Theoretic Methods for Multiple Integration", 1976;
//! Ken Shoemake, "Uniform Random Rotations", 1992; Tom Duff et al., "Building an Orthonormal Basis, Revisited", 2017.

use std::f64::consts::{SQRT_2, TAU};

use glam::DVec3;
use umbel_core::RaySample;

use crate::random::{mix, random};

/// 1/Φ.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Sets of an interleaved pattern: tiles of 4 x 4.
pub(crate) const INTERLEAVED: usize = 16;
/// The steps of rotations from set to set, 1/g, 1/g² and 1/g³ for g⁴ = g + 1: points that fill a cube evenly.
const ROTATION_STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];
/// The greatest x: no direction is so near the horizon that rounding could take it below.
const HIGHEST: f64 = 1.0 - 1.0 / (1 << 20) as f64;
/// The fewest directions of a set on the sphere: no hemisphere is without one.
const LEAST_DIRECTIONS: u32 = 8;

/// How directions are shared among receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SampleSet {
    /// All receivers have the same: the fastest, but shadows of small things may show as bands.
    #[default]
    Shared,
    /// 16 sets in turn, over tiles of 4 x 4 texels or over the numbers of the receivers.
    Interleaved,
    /// Each receiver has its own.
    Independent,
}

/// How much a direction at the angle θ from the normal counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weighting {
    /// cos θ: what an even sky contributes to the light that arrives.
    #[default]
    Cosine,
    /// 1: the part of the sky that is seen.
    Uniform,
}

/// How much an occluder at a distance counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Falloff {
    /// Wholly, up to the greatest distance.
    #[default]
    None,
    /// 1 − t/D, where D is the greatest distance.
    Linear,
}

/// How far occluders count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reach {
    /// The greatest distance at which something occludes, exclusive, in world units; 0 is unlimited.
    pub max_distance: f64,
    /// How much that depends on the distance.
    pub falloff: Falloff,
    /// The distance up to which nothing occludes, in world units; 0 for all that lies above the surface. Above it rays take longer: they
    /// are traced receiver by receiver.
    pub min_distance: f64,
}

impl Reach {
    /// The sample of a direction with the number u of (0, 1).
    fn sample(self, direction: DVec3, u: f64) -> RaySample {
        let direction = DVec3::from_array(direction.to_array().map(|x| f64::from(x as f32)));
        let part = if self.falloff == Falloff::Linear { u } else { 1.0 };
        let t_min = if self.min_distance > 0.0 { limit(self.min_distance, direction) } else { 0.0 };
        // Where a falloff ends before the least distance nothing is in between.
        let t_max = limit(self.max_distance * part, direction).max(t_min.next_up());
        RaySample { direction, t_min, t_max }
    }
}

/// A distance in units of a direction's length, above 0; infinite for the distance 0.
fn limit(distance: f64, direction: DVec3) -> f32 {
    if distance == 0.0 {
        return f32::INFINITY;
    }
    ((distance / direction.length()) as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

/// About `rays` directions for any hemisphere: `sets` sets over the sphere.
pub(crate) fn sphere_sets(rays: u32, sets: usize, reach: Reach, seed: u64) -> Vec<Vec<RaySample>> {
    let count = rays.saturating_mul(2).max(LEAST_DIRECTIONS);
    let first = [0, 1, 2].map(|k| random(seed, 0, k));
    let set = |index: usize| {
        let turn = |k: usize| fraction(first[k] + index as f64 * ROTATION_STEPS[k]);
        let axes = rotation([turn(0), turn(1), turn(2)]);
        let sample = |k: u32| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
            let (sin, cos) = libm::sincos(TAU * fraction(f64::from(k) * GOLDEN));
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let direction = axes[0] * (radius * cos) + axes[1] * (radius * sin) + axes[2] * z;
            reach.sample(direction, distance_part(k, 0.5))
        };
        (0..count).map(sample).collect()
    };
    (0..sets).map(set).collect()
}

/// The set that the receiver with a number takes, in rows of `columns` texels; without columns numbers are a plain list.
pub(crate) fn set_of(index: u32, columns: Option<u32>) -> usize {
    let index = match columns {
        Some(columns) => index / columns % 4 * 4 + index % columns % 4,
        // Neighbours in a list get sets in an order without a period that a mesh could have.
        None => mix(u64::from(index)) as u32 % INTERLEAVED as u32,
    };
    index as usize
}

/// The directions of receivers that have their own.
pub(crate) struct OwnSets {
    /// cos φ_k and sin φ_k before the shift.
    turns: Vec<[f64; 2]>,
    weighting: Weighting,
    reach: Reach,
    frames: Vec<OwnFrame>,
}

/// What distinguishes one receiver.
struct OwnFrame {
    /// Two tangents, the first turned by the shift ξ₂, and the normal.
    axes: [[f32; 3]; 3],
    /// ξ₁ and ξ₃.
    shifts: [f32; 2],
}

impl OwnSets {
    /// Bytes for each receiver.
    pub(crate) const RECEIVER_BYTES: u64 = size_of::<OwnFrame>() as u64;

    /// The directions of receivers with these numbers and unit normals.
    pub(crate) fn new(
        (rays, weighting, reach, seed): (u32, Weighting, Reach, u64),
        receivers: impl Iterator<Item = (u32, [f32; 3])>,
    ) -> Self {
        let turn = |k: u32| {
            let (sin, cos) = libm::sincos(TAU * fraction(f64::from(k) * GOLDEN));
            [cos, sin]
        };
        // Receivers of one number that follow each other are told apart by their place among them.
        let (mut last, mut place) = (None, 0_u64);
        let frame = |(index, normal): (u32, [f32; 3])| {
            place = if last.replace(index) == Some(index) { place + 1 } else { 0 };
            // Stream 0 turns the sets on the sphere.
            let stream = (place << 32 | u64::from(index)) + 1;
            let normal = DVec3::from_array(normal.map(f64::from));
            let (s, t) = tangents(normal);
            let (sin, cos) = libm::sincos(TAU * random(seed, stream, 1));
            let axes = [s * cos + t * sin, t * cos - s * sin, normal];
            OwnFrame {
                axes: axes.map(|axis| axis.to_array().map(|x| x as f32)),
                shifts: [0, 2].map(|k| random(seed, stream, k) as f32),
            }
        };
        let frames = receivers.map(frame).collect();
        Self { turns: (0..rays).map(turn).collect(), weighting, reach, frames }
    }

    /// How many directions each receiver has.
    pub(crate) fn count(&self) -> usize {
        self.turns.len()
    }

    /// A direction of a receiver.
    pub(crate) fn sample(&self, receiver: usize, ray: usize) -> RaySample {
        let OwnFrame { axes, shifts } = &self.frames[receiver];
        let [s, t, n] = axes.map(|axis| DVec3::from_array(axis.map(f64::from)));
        let [stratum, part] = shifts.map(f64::from);
        let x = ((ray as f64 + stratum) / self.count() as f64).min(HIGHEST);
        let cos_theta = if self.weighting == Weighting::Cosine { (1.0 - x).sqrt() } else { 1.0 - x };
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let [cos, sin] = self.turns[ray];
        let direction = s * (sin_theta * cos) + t * (sin_theta * sin) + n * cos_theta;
        self.reach.sample(direction, distance_part(ray as u32, part))
    }
}

/// u_k for the shift ξ: at least 2⁻³², so that no limit is 0.
fn distance_part(k: u32, shift: f64) -> f64 {
    fraction(f64::from(k) * SQRT_2 + shift).max(1.0 / (1_u64 << 32) as f64)
}

/// The part of a number behind the point.
fn fraction(x: f64) -> f64 {
    x - x.floor()
}

/// The axes that a rotation turns x, y and z to: uniform over all rotations for three uniform numbers.
fn rotation([a, b, c]: [f64; 3]) -> [DVec3; 3] {
    let ((s, t), (u, v)) = (libm::sincos(TAU * b), libm::sincos(TAU * c));
    let (lower, upper) = ((1.0 - a).sqrt(), a.sqrt());
    let [x, y, z, w] = [lower * s, lower * t, upper * u, upper * v];
    [
        DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    ]
}

/// Two unit vectors that are perpendicular to a unit normal and to each other.
pub(crate) fn tangents(n: DVec3) -> (DVec3, DVec3) {
    let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}
