//! parry3d as an engine: `TriMesh` and its tree, single rays in blocks of pixels. It builds on one thread.

use parry3d::math::Vector;
use parry3d::query::Ray;
use parry3d::shape::{CompositeShapeRef, TriMesh};

use crate::Result;
use crate::answer::{Answer, MISS};
use crate::engine::{Engine, Times, timed};
use crate::subject::Subject;

/// parry3d with its defaults.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Parry;

impl Engine for Parry {
    fn name(&self) -> &str {
        "parry3d"
    }

    fn run(&mut self, subject: &Subject, answer: &mut Answer) -> Result<Times> {
        let (build, mesh) = timed(|| {
            let positions = subject.positions.iter().map(|&[x, y, z]| Vector::new(x, y, z)).collect();
            TriMesh::new(positions, subject.triangles.clone())
        });
        let mesh = mesh?;
        let [x, y, z] = subject.rays.origin;
        let origin = Vector::new(x, y, z);
        let (trace, ()) = timed(|| {
            subject.rays.trace_singly(answer, |[x, y, z]| {
                let ray = Ray::new(origin, Vector::new(x, y, z));
                CompositeShapeRef(&mesh)
                    .cast_local_ray(&ray, f32::MAX, false)
                    .unwrap_or((MISS, f32::INFINITY))
            });
        });
        Ok(Times { build, trace })
    }
}
