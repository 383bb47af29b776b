//! parry3d as an engine: `TriMesh` and its tree, single rays in blocks of pixels. It builds on one thread.

use parry3d::math::Vector;
use parry3d::query::Ray;
use parry3d::shape::{CompositeShapeRef, TriMesh};

use crate::Result;
use crate::engines::engine::{Engine, Times, Variant, timed};
use crate::subjects::answer::{Hits, MISS};
use crate::subjects::picture::Picture;

/// parry3d with its defaults.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parry;

impl Variant for Parry {
    fn name(&self) -> &str {
        "parry3d"
    }
}

impl Engine<Picture> for Parry {
    fn run(&mut self, picture: &Picture, answer: &mut Hits) -> Result<Times> {
        let (build, mesh) = timed(|| {
            let positions = picture.model.positions.iter().map(|&[x, y, z]| Vector::new(x, y, z)).collect();
            TriMesh::new(positions, picture.model.triangles.clone())
        });
        let mesh = mesh?;
        let [x, y, z] = picture.rays.origin;
        let origin = Vector::new(x, y, z);
        let (trace, ()) = timed(|| {
            picture.rays.trace_singly(answer, |[x, y, z]| {
                let ray = Ray::new(origin, Vector::new(x, y, z));
                CompositeShapeRef(&mesh)
                    .cast_local_ray(&ray, f32::MAX, false)
                    .unwrap_or((MISS, f32::INFINITY))
            });
        });
        Ok(Times { build, trace })
    }
}
