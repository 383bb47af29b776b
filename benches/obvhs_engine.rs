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
use crate::answer::{Answer, MISS};
use crate::engine::{Engine, Times, timed};
use crate::subject::Subject;

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
pub(crate) fn variants(subject: &Subject, wanted: impl Fn(&str) -> bool) -> Vec<Box<dyn Engine>> {
    let wanted = VARIANTS.into_iter().filter(|(_, _, _, name)| wanted(name));
    let engine = wanted.map(|(wide, params, prebuilt, name)| {
        let prebuilt = prebuilt.then(|| Built::new(subject, wide, params));
        Box::new(Obvhs { name, wide, params, prebuilt }) as Box<dyn Engine>
    });
    engine.collect()
}

impl Engine for Obvhs {
    fn name(&self) -> &str {
        self.name
    }

    fn prebuilt(&self) -> bool {
        self.prebuilt.is_some()
    }

    fn run(&mut self, subject: &Subject, answer: &mut Answer) -> Result<Times> {
        let (build, new) = match &self.prebuilt {
            Some(_) => (0.0, None),
            None => {
                let (build, built) = timed(|| Built::new(subject, self.wide, self.params));
                (build, Some(built))
            }
        };
        let Some(built) = new.as_ref().or(self.prebuilt.as_ref()) else {
            return Err("no tree".into());
        };
        let (trace, ()) = timed(|| built.trace(subject, answer));
        Ok(Times { build, trace })
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
    fn new(subject: &Subject, wide: bool, params: BvhBuildParams) -> Self {
        let corners = subject.triangles.par_iter();
        let triangles: Vec<Triangle> = corners
            .map(|corners| {
                let [v0, v1, v2] = corners.map(|v| Vec3A::from_array(subject.positions[v as usize]));
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

    /// Traces all rays.
    fn trace(&self, subject: &Subject, answer: &mut Answer) {
        let origin = Vec3A::from_array(subject.rays.origin);
        let found = |hit: RayHit, order: &[u32]| match hit.primitive_id {
            INVALID_ID => (MISS, f32::INFINITY),
            place => (order[place as usize], hit.t),
        };
        let test = |ray: &Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Tree::Binary(tree) => subject.rays.trace_singly(answer, |direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(Ray::new_inf(origin, Vec3A::from_array(direction)), &mut hit, test);
                found(hit, &tree.primitive_indices)
            }),
            Tree::Wide(tree) => subject.rays.trace_singly(answer, |direction| {
                let mut hit = RayHit::none();
                tree.ray_traverse(Ray::new_inf(origin, Vec3A::from_array(direction)), &mut hit, test);
                found(hit, &tree.primitive_indices)
            }),
        }
    }
}
