//! obvhs as an engine: its two trees, its fastest and medium builders, single rays in blocks of pixels.
//!
//! The build includes what its users do as well: triangles from positions and indices, and their order in the tree.

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{INVALID_ID, Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use umbel::glam::Vec3A;

use crate::Result;
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::subjects::ambient::Ambient;
use crate::subjects::ambient_rays::AmbientRays;
use crate::subjects::answer::{Blocked, Hits, MISS, OpenBits};
use crate::subjects::bounce::Bounce;
use crate::subjects::bounce_rays::BounceRays;
use crate::subjects::picture::Picture;
use crate::subjects::shadow::Shadow;
use crate::subjects::shadow_rays::{EPSILON, ShadowRays};
use crate::subjects::view_rays::ViewRays;
use crate::subjects::{Model, Subject};

/// One way of using obvhs.
#[derive(Debug)]
pub(crate) struct Obvhs {
    name: &'static str,
    wide: bool,
    params: BvhBuildParams,
    /// Built before, outside the times.
    prebuilt: Option<Built>,
}

/// All variants: whether the tree is wide, the builder, whether it is built before, and the name.
const VARIANTS: [(bool, BvhBuildParams, bool, &str); 6] = [
    (false, BvhBuildParams::fastest_build(), false, "obvhs-bvh2-fastest"),
    (false, BvhBuildParams::medium_build(), false, "obvhs-bvh2-medium"),
    (true, BvhBuildParams::fastest_build(), false, "obvhs-cwbvh-fastest"),
    (true, BvhBuildParams::medium_build(), false, "obvhs-cwbvh-medium"),
    (false, BvhBuildParams::medium_build(), true, "obvhs-bvh2-medium-prebuilt"),
    (true, BvhBuildParams::medium_build(), true, "obvhs-cwbvh-medium-prebuilt"),
];

/// Prepares the variants that are wanted.
pub(crate) fn variants<S: Subject>(subject: &S, wanted: impl Fn(&str) -> bool) -> Vec<Box<dyn Engine<S>>>
where
    Obvhs: Engine<S>,
{
    let wanted = VARIANTS.into_iter().filter(|(_, _, _, name)| wanted(name));
    let engine = wanted.map(|(wide, params, prebuilt, name)| {
        let prebuilt = prebuilt.then(|| Built::new(subject.model(), wide, params));
        Box::new(Obvhs { name, wide, params, prebuilt }) as Box<dyn Engine<S>>
    });
    engine.collect()
}

impl Obvhs {
    /// Builds, unless that is done, and traces.
    fn times(&mut self, model: &Model, trace: impl FnOnce(&Built)) -> Result<Times> {
        let (build, new) = match &self.prebuilt {
            Some(_) => (0.0, None),
            None => {
                let (build, built) = timed(|| Built::new(model, self.wide, self.params));
                (build, Some(built))
            }
        };
        let Some(built) = new.as_ref().or(self.prebuilt.as_ref()) else {
            return Err("no tree".into());
        };
        let (trace, ()) = timed(|| trace(built));
        Ok(Times { build, trace })
    }
}

impl Variant for Obvhs {
    fn name(&self) -> &str {
        self.name
    }

    fn prebuilt(&self) -> bool {
        self.prebuilt.is_some()
    }
}

impl Engine<Picture> for Obvhs {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        self.times(&picture.model, |built| built.trace(&picture.rays, answer))
    }
}

impl Engine<Shadow> for Obvhs {
    fn run(&mut self, shadow: &Shadow, answer: &mut Blocked) -> Result<Times> {
        self.times(&shadow.model, |built| built.shade(&shadow.rays, answer))
    }
}

impl Engine<Ambient> for Obvhs {
    fn run(&mut self, ambient: &Ambient, answer: &mut OpenBits) -> Result<Times> {
        self.times(&ambient.model, |built| built.open(&ambient.rays, answer))
    }
}

impl Engine<Bounce> for Obvhs {
    fn run(&mut self, bounce: &Bounce, answer: &mut Hits) -> Result<Times> {
        self.times(&bounce.model, |built| built.bounce(&bounce.rays, answer))
    }
}

enum Tree {
    Binary(Bvh2),
    Wide(CwBvh),
}

/// A tree and its triangles.
struct Built {
    tree: Tree,
    /// In the order of the tree.
    triangles: Vec<RtTriangle>,
}

impl std::fmt::Debug for Built {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Built").field("triangles", &self.triangles.len()).finish_non_exhaustive()
    }
}

impl Built {
    /// From positions and indices to a tree.
    fn new(model: &Model, wide: bool, params: BvhBuildParams) -> Self {
        let corners = model.triangles.par_iter();
        let triangles: Vec<Triangle> = corners
            .map(|corners| {
                let [v0, v1, v2] = corners.map(|v| Vec3A::from_array(model.positions[v as usize]));
                Triangle { v0, v1, v2 }
            })
            .collect();
        let mut core_time = Duration::ZERO;
        let tree = if wide {
            Tree::Wide(build_cwbvh_from_tris(&triangles, params, &mut core_time))
        } else {
            Tree::Binary(build_bvh2_from_tris(&triangles, params, &mut core_time))
        };
        let order = match &tree {
            Tree::Binary(tree) => &tree.primitive_indices,
            Tree::Wide(tree) => &tree.primitive_indices,
        };
        let triangles = order.par_iter().map(|&id| RtTriangle::from(&triangles[id as usize])).collect();
        Self { tree, triangles }
    }

    /// What a hit is called in the answer.
    fn found(&self, hit: RayHit) -> (u32, f32) {
        let order = match &self.tree {
            Tree::Binary(tree) => &tree.primitive_indices,
            Tree::Wide(tree) => &tree.primitive_indices,
        };
        match hit.primitive_id {
            INVALID_ID => (MISS, f32::INFINITY),
            place => (order[place as usize], hit.t),
        }
    }

    /// Traces all rays.
    fn trace(&self, rays: &ViewRays, answer: &mut Hits) {
        let origin = Vec3A::from_array(rays.origin);
        let test = |ray: &Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Tree::Binary(tree) => rays.trace_singly(answer, |direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(Ray::new_inf(origin, Vec3A::from_array(direction)), &mut hit, test);
                self.found(hit)
            }),
            Tree::Wide(tree) => rays.trace_singly(answer, |direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(Ray::new_inf(origin, Vec3A::from_array(direction)), &mut hit, test);
                self.found(hit)
            }),
        }
    }

    /// Traces rays that share nothing.
    fn bounce(&self, rays: &BounceRays, answer: &mut Hits) {
        let ray = |point, direction| {
            let (point, direction) = (Vec3A::from_array(point), Vec3A::from_array(direction));
            Ray::new(point, direction, rays.epsilon, f32::INFINITY)
        };
        let test = |ray: &Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Tree::Binary(tree) => rays.trace_singly(answer, |point, direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(ray(point, direction), &mut hit, test);
                self.found(hit)
            }),
            Tree::Wide(tree) => rays.trace_singly(answer, |point, direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(ray(point, direction), &mut hit, test);
                self.found(hit)
            }),
        }
    }

    /// Traces a ray from the light to just before each receiver.
    fn shade(&self, rays: &ShadowRays, answer: &mut Blocked) {
        let light = Vec3A::from_array(rays.light);
        let ray = |point: [f32; 3]| Ray::new(light, Vec3A::from_array(point) - light, 0.0, 1.0 - EPSILON);
        let test = |ray: &Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Tree::Binary(tree) => {
                rays.trace_singly(answer, |point| !tree.ray_traverse_miss(ray(point), test))
            }
            Tree::Wide(tree) => rays.trace_singly(answer, |point| !tree.ray_traverse_miss(ray(point), test)),
        }
    }

    /// Traces the rays of receivers.
    fn open(&self, rays: &AmbientRays, answer: &mut OpenBits) {
        let [begin, end] = rays.interval;
        let ray =
            |point, direction| Ray::new(Vec3A::from_array(point), Vec3A::from_array(direction), begin, end);
        let test = |ray: &Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Tree::Binary(tree) => rays.trace_singly(answer, |point, direction| {
                !tree.ray_traverse_miss(ray(point, direction), test)
            }),
            Tree::Wide(tree) => rays.trace_singly(answer, |point, direction| {
                !tree.ray_traverse_miss(ray(point, direction), test)
            }),
        }
    }
}
