//! The rays that a hit spawns: one mirrored, one through the surface, each from the side of the triangle that it leaves to.
//!
//! Directions follow the shading normal, as far as they stay on their side of the triangle, else the triangle's own. Starts are
//! exact ([`Triangles::ray_from`]): there is no epsilon, and the triangle itself is never hit again.
//!
//! Based on: Turner Whitted, "An Improved Illumination Model for Shaded Display", 1980.

use glam::DVec3;
use umbel_core::{Hit, Ray, Side, Triangles};

use crate::scene::Scene;
use crate::scene::camera::unit;
use crate::scene::optics::{mirrored, refracted};

/// Components of directions below this are set to 0: rays take none below 2⁻²⁴⁰.
const LEAST_COMPONENT: f64 = 1e-60;

/// Which rays hits spawn, and how often one follows the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Bounces {
    /// Whether surfaces mirror.
    pub reflect: bool,
    /// Whether light passes through them; what is mirrored totally inside counts as well.
    pub refract: bool,
    /// The most rays in a row behind the camera's own; 0 is a plain picture.
    pub most: u32,
}

/// What a hit sends on. The shares of all parts add up to at most 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spawned {
    /// The share of the surface's own look.
    pub own: [f32; 3],
    /// The mirrored ray, and the share of what it sees.
    pub reflected: Option<(Ray, [f32; 3])>,
    /// The ray through the surface, and the share of what it sees.
    pub refracted: Option<(Ray, [f32; 3])>,
}

impl Spawned {
    /// Nothing but the surface's own look.
    pub(crate) const NOTHING: Self = Self { own: [1.0; 3], reflected: None, refracted: None };
}

impl Bounces {
    /// The rays that leave where a ray hits a triangle of a scene. `geometry` is that of the scene.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn spawn(&self, scene: &Scene, geometry: &Triangles<'_>, ray: &Ray, hit: &Hit) -> Spawned {
        let optics = scene.material_of(hit.id.0).map_or_else(Default::default, |material| material.optics);
        let refracts = self.refract && optics.transmits();
        let reflects = self.reflect && optics.reflects();
        // A ray that hits a triangle is never parallel to it.
        let side = geometry.side_toward(hit.id, -ray.direction).filter(|_| refracts || reflects);
        let Some(side) = side else {
            return Spawned::NOTHING;
        };
        let boundary = Boundary::new(scene, geometry, ray, hit, side);
        let ior = f64::from(optics.ior);
        let eta = if side == Side::Front { 1.0 / ior } else { ior };
        let through = if refracts { boundary.through(eta) } else { None };
        let total = refracts && through.is_none();
        let mirrored = match (total, reflects) {
            (true, _) => [1.0; 3],
            (false, true) => optics.reflectance(boundary.cosine(), if refracts { eta } else { 1.0 / ior }),
            (false, false) => [0.0; 3],
        };
        let transmission = optics.transmission.map(|share| if refracts { f64::from(share) } else { 0.0 });
        let share = |part: &dyn Fn(usize) -> f64| [0, 1, 2].map(|k| part(k) as f32);
        let reflected = if total || reflects { boundary.back() } else { None };
        Spawned {
            own: share(&|k| (1.0 - mirrored[k]) * (1.0 - transmission[k])),
            reflected: reflected.map(|ray| (ray, share(&|k| mirrored[k]))),
            refracted: through.map(|ray| (ray, share(&|k| (1.0 - mirrored[k]) * transmission[k]))),
        }
    }
}

/// Where a ray meets a surface.
struct Boundary<'a> {
    geometry: &'a Triangles<'a>,
    ray: &'a Ray,
    hit: &'a Hit,
    weights: [f64; 3],
    /// The side that the ray comes from.
    side: Side,
    /// The ray's direction, of unit length.
    direction: DVec3,
    /// The shading normal and the triangle's own, on that side.
    normals: [DVec3; 2],
}

impl<'a> Boundary<'a> {
    fn new(scene: &Scene, geometry: &'a Triangles<'a>, ray: &'a Ray, hit: &'a Hit, side: Side) -> Self {
        let normals = scene.normals_toward(geometry, ray, hit);
        let weights = geometry.barycentrics(hit.id, ray);
        Self { geometry, ray, hit, weights, side, direction: unit(ray.direction), normals }
    }

    /// The cosine between the shading normal and the way back.
    fn cosine(&self) -> f64 {
        (-self.direction.dot(self.normals[0])).clamp(0.0, 1.0)
    }

    /// The mirrored ray.
    fn back(&self) -> Option<Ray> {
        let directions = self.normals.map(|normal| Some(mirrored(self.direction, normal)));
        self.leaving(directions, self.side)
    }

    /// The ray through the surface; `None` where all is mirrored.
    fn through(&self, eta: f64) -> Option<Ray> {
        let other = if self.side == Side::Front { Side::Back } else { Side::Front };
        if eta == 1.0 {
            return self.leaving([Some(self.ray.direction), None], other);
        }
        let directions = self.normals.map(|normal| refracted(self.direction, normal, eta));
        // A shading normal that mirrors all is not replaced by another that does not.
        self.leaving([directions[0], directions[0].and(directions[1])], other)
    }

    /// The ray along the first direction that leaves to a side.
    fn leaving(&self, directions: [Option<DVec3>; 2], side: Side) -> Option<Ray> {
        directions.into_iter().flatten().find_map(|direction| {
            let direction = representable(direction);
            let leaves = self.geometry.side_toward(self.hit.id, direction) == Some(side);
            leaves.then(|| self.geometry.ray_from(self.hit.id, self.weights, direction)).flatten()
        })
    }
}

/// A direction without components that are too small for rays.
pub(crate) fn representable(direction: DVec3) -> DVec3 {
    DVec3::from_array(direction.to_array().map(|x| if x.abs() < LEAST_COMPONENT { 0.0 } else { x }))
}
