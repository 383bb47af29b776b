//! Bézier points of limit surfaces as sums of the vertices around a quad.
//!
//! The surface over a regular quad is one bicubic patch, whose 16 Bézier points are a linear map of the quad's neighbourhood: B. A
//! step of subdivision is a linear map S of the neighbourhood of an irregular quad to that of one of its children, so the child's
//! patch, if it is regular, is B·S. Where the first child has the shape of its parent, which is so once an extraordinary vertex
//! stands alone, the patches of its children are B·S·A, B·S·A², ..., with the step A that makes the first child: the surface near
//! the vertex is a spiral of patches, none of which needs the steps before it. All of that depends on the shape alone.
//!
//! Based on: Jos Stam, "Exact Evaluation of Catmull-Clark Subdivision Surfaces at Arbitrary Parameter Values", 1998 (powers of A);
//! Matthias Nießner, Charles Loop, Mark Meyer and Tony DeRose, "Feature-Adaptive GPU Rendering of Catmull-Clark Subdivision Surfaces",
//! 2012 (which quads are patches).

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::surfaces::bezier::bicubic::Bicubic;
use crate::surfaces::lanes::{LANES, Lanes, splat};
use crate::surfaces::subdivision::cage::Rows;

/// Rings of a spiral: beyond, parameters are within 2⁻⁸ of the extraordinary vertex, and steps are taken one by one.
const RINGS: usize = 8;

/// Bytes of the rows of all shapes of a mesh; what comes after that is found by steps.
const MOST_BYTES: usize = 16 << 20;

/// The weights of 16 Bézier points, vertex by vertex.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct BezierRows {
    weights: Vec<[[f64; LANES]; 2]>,
}

impl BezierRows {
    /// Of a uniform bicubic B-spline, whose 16 control points are rows over so many vertices.
    pub(crate) fn of_b_spline(controls: &Rows, vertices: usize) -> Self {
        let weights = (0..vertices).map(|vertex| {
            let weight = |k: usize| {
                let own = controls.row(k).iter().filter(|entry| entry.0 as usize == vertex);
                DVec3::X * own.map(|entry| entry.1).sum::<f64>()
            };
            // The same linear map of numbers as of points.
            let bezier = Bicubic::of_b_spline(&std::array::from_fn(weight)).0;
            [0, LANES].map(|first| std::array::from_fn(|k| bezier[first + k].x))
        });
        Self { weights: weights.collect() }
    }

    /// Whether there are any.
    pub(crate) fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// The same points from the vertices before a step, so many, that makes those of these rows.
    fn after(&self, step: &Rows, vertices: usize) -> Self {
        let mut before = vec![[[0.0; LANES]; 2]; vertices];
        for (made, weights) in self.weights.iter().enumerate() {
            for &(vertex, share) in step.row(made) {
                let sums = before[vertex as usize].iter_mut().flatten();
                sums.zip(weights.iter().flatten()).for_each(|(sum, weight)| *sum += share * weight);
            }
        }
        Self { weights: before }
    }

    /// The patch over the vertices of a neighbourhood.
    pub(crate) fn patch(&self, points: &[DVec3], level: Level) -> Bicubic {
        dispatch!(level, simd => self.patch_lanes(simd, points))
    }

    #[inline(always)]
    fn patch_lanes<S: Simd>(&self, simd: S, points: &[DVec3]) -> Bicubic {
        let mut sums = [splat(simd, DVec3::ZERO); 2];
        for (weights, point) in self.weights.iter().zip(points) {
            for (sum, weights) in sums.iter_mut().zip(weights) {
                let weights = Lanes::load_array_ref(simd, weights);
                for k in 0..3 {
                    sum[k] += weights * point[k];
                }
            }
        }
        let mut bezier = [DVec3::ZERO; 16];
        for (bezier, sum) in bezier.chunks_mut(LANES).zip(&sums) {
            let [x, y, z] = [sum[0].as_array(), sum[1].as_array(), sum[2].as_array()];
            for (k, point) in bezier.iter_mut().enumerate() {
                *point = DVec3::new(x[k], y[k], z[k]);
            }
        }
        Bicubic(bezier)
    }

    fn bytes(&self) -> usize {
        self.weights.len() * size_of::<[[f64; LANES]; 2]>()
    }
}

/// The patches that an irregular quad consists of, ring by ring: those at its corners, then, where the first child has the shape of
/// its parent, those at the corners of that, and so on.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Rings {
    rings: Vec<[Option<BezierRows>; 4]>,
}

impl Rings {
    /// Of a shape of so many vertices, from the steps to its children and what these have if they are regular. `spirals` tells whether
    /// the first has the shape of its parent. `bytes` counts what the mesh has.
    pub(crate) fn new(
        (children, vertices): ([(&Rows, Option<&BezierRows>); 4], usize),
        spirals: bool,
        bytes: &mut usize,
    ) -> Self {
        let mut ring = children.map(|(step, rows)| rows.map(|rows| rows.after(step, vertices)));
        let count = if spirals && ring[1..].iter().all(Option::is_some) { RINGS } else { 1 };
        let mut rings: Vec<[Option<BezierRows>; 4]> = Vec::with_capacity(count);
        loop {
            *bytes += ring.iter().flatten().map(BezierRows::bytes).sum::<usize>();
            if *bytes > MOST_BYTES {
                break;
            }
            rings.push(ring);
            if rings.len() == count {
                break;
            }
            ring = rings[rings.len() - 1]
                .each_ref()
                .map(|rows| rows.as_ref().map(|rows| rows.after(children[0].0, vertices)));
        }
        Self { rings }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.rings.len()
    }

    /// Whether each ring lies at the first corner of the one before.
    pub(crate) fn spirals(&self) -> bool {
        self.rings.len() > 1
    }

    /// The patch at a corner of a ring, if it is one.
    pub(crate) fn get(&self, ring: usize, corner: usize) -> Option<&BezierRows> {
        self.rings.get(ring)?[corner].as_ref()
    }
}
