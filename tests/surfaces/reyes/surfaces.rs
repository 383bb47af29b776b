//! Surfaces on demand that are simple to check.

use umbel::engine::{Aabb, Detail, Domain, OnDemand};

/// One patch or a group of a scene.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Thing {
    /// A face of a cube that is blown up to a sphere and displaced: axis, side, which sphere.
    Face { sphere: usize, axis: usize, positive: bool },
    /// A flat patch.
    Plane(usize),
    /// A bicubic Bézier patch.
    Bezier(usize),
    /// A square of the field: its place in units of its size, 2^−level of the field.
    Square { field: usize, level: u32, place: [u32; 2] },
}

/// centre + direction·(radius + height·bumps).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sphere {
    pub(crate) centre: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) height: f64,
    /// Bumps along a side of the cube.
    pub(crate) bumps: f64,
    pub(crate) id: u32,
}

/// corner + u·sides₀ + v·sides₁.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) corner: [f64; 3],
    pub(crate) sides: [[f64; 3]; 2],
    pub(crate) id: u32,
}

/// 4x4 control points, row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bezier {
    pub(crate) points: [[f64; 3]; 16],
    pub(crate) id: u32,
}

/// Squares of 4^levels on a plane y = height(x, z), each half as large as its cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Field {
    pub(crate) corner: [f64; 3],
    pub(crate) size: f64,
    pub(crate) levels: u32,
    pub(crate) id: u32,
}

/// A scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surfaces {
    pub(crate) spheres: Vec<Sphere>,
    pub(crate) planes: Vec<Plane>,
    pub(crate) beziers: Vec<Bezier>,
    pub(crate) fields: Vec<Field>,
}

impl Sphere {
    /// The point of the cube's (x, y, z). Neighbouring faces give the same numbers on their border.
    fn point(&self, p: [f64; 3]) -> [f32; 3] {
        let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        let wave = |x: f64| {
            let part = (x * self.bumps * 0.5).rem_euclid(1.0);
            4.0 * part * (1.0 - part)
        };
        let bump = (wave(p[0]) + wave(p[1]) + wave(p[2])) / 3.0;
        let radius = self.radius + self.height * bump;
        [0, 1, 2].map(|k| (self.centre[k] + p[k] / length * radius) as f32)
    }

    fn bounds(&self, axis: usize, positive: bool, domain: Domain) -> Aabb {
        let mut sides = [[if positive { 1.0 } else { -1.0 }; 2]; 3];
        let (b, c) = across(axis, positive);
        (sides[b], sides[c]) = (domain.u.map(|u| 2.0 * u - 1.0), domain.v.map(|v| 2.0 * v - 1.0));
        let square = |[lo, hi]: [f64; 2]| {
            let least = if lo <= 0.0 && hi >= 0.0 { 0.0 } else { (lo * lo).min(hi * hi) };
            [least, (lo * lo).max(hi * hi)]
        };
        let [least, most] = [0, 1].map(|end| sides.iter().map(|&side| square(side)[end]).sum::<f64>().sqrt());
        let radii = [self.radius.min(self.radius + self.height), self.radius.max(self.radius + self.height)];
        let mut bounds = Aabb::EMPTY;
        for (k, ends_of_side) in sides.into_iter().enumerate() {
            let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
            for side in ends_of_side {
                for length in [least, most] {
                    for radius in radii {
                        let x = self.centre[k] + side / length * radius;
                        ends = [ends[0].min(x), ends[1].max(x)];
                    }
                }
            }
            let slack = (ends[0].abs() + ends[1].abs()) * 1e-6;
            (bounds.lo[k], bounds.hi[k]) = ((ends[0] - slack) as f32, (ends[1] + slack) as f32);
        }
        bounds
    }
}

/// The axes of u and v of a face, so that their normal points outward.
fn across(axis: usize, positive: bool) -> (usize, usize) {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    if positive { (b, c) } else { (c, b) }
}

impl Field {
    /// Corner, size and height of a cell.
    fn cell(&self, level: u32, place: [u32; 2]) -> ([f64; 2], f64) {
        let size = self.size / f64::from(1_u32 << level);
        ([self.corner[0] + f64::from(place[0]) * size, self.corner[2] + f64::from(place[1]) * size], size)
    }
}

impl OnDemand for Surfaces {
    type Object = Thing;

    fn roots(&self) -> Vec<Thing> {
        let mut roots = Vec::new();
        for sphere in 0..self.spheres.len() {
            for axis in 0..3 {
                roots.extend([true, false].map(|positive| Thing::Face { sphere, axis, positive }));
            }
        }
        roots.extend((0..self.planes.len()).map(Thing::Plane));
        roots.extend((0..self.beziers.len()).map(Thing::Bezier));
        roots.extend((0..self.fields.len()).map(|field| Thing::Square { field, level: 0, place: [0; 2] }));
        roots
    }

    fn bounds(&self, object: &Thing, domain: Domain, detail: &Detail) -> Aabb {
        match *object {
            Thing::Face { sphere, axis, positive } => self.spheres[sphere].bounds(axis, positive, domain),
            Thing::Plane(_) => {
                let mut corners = Vec::new();
                let parameters: Vec<[f64; 2]> =
                    domain.u.iter().flat_map(|&u| domain.v.map(|v| [u, v])).collect();
                self.evaluate(object, &parameters, detail, &mut corners);
                Aabb::of_points(corners)
            }
            Thing::Bezier(patch) => {
                let Bezier { points, .. } = self.beziers[patch];
                let hull = Aabb::of_points(points.map(|p| p.map(|x| x as f32)));
                let slack = hull.lo.iter().chain(&hull.hi).fold(0.0_f32, |most, x| most.max(x.abs())) * 1e-6;
                Aabb { lo: hull.lo.map(|x| x - slack), hi: hull.hi.map(|x| x + slack) }
            }
            Thing::Square { field, level, place } => {
                let ([x, z], size) = self.fields[field].cell(level, place);
                let y = self.fields[field].corner[1] as f32;
                let [x0, z0, x1, z1] = [x, z, x + size, z + size].map(|x| x as f32);
                Aabb { lo: [x0, y, z0], hi: [x1, y, z1] }
            }
        }
    }

    fn expand(&self, object: &Thing, _: f64, _: &Detail, parts: &mut Vec<Thing>) -> bool {
        let Thing::Square { field, level, place: [x, z] } = *object else { return false };
        if level == self.fields[field].levels {
            return false;
        }
        for (dx, dz) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            parts.push(Thing::Square { field, level: level + 1, place: [2 * x + dx, 2 * z + dz] });
        }
        true
    }

    fn evaluate(&self, patch: &Thing, parameters: &[[f64; 2]], _: &Detail, points: &mut Vec<[f32; 3]>) {
        match *patch {
            Thing::Face { sphere, axis, positive } => {
                let (b, c) = across(axis, positive);
                points.extend(parameters.iter().map(|&[u, v]| {
                    let mut p = [if positive { 1.0 } else { -1.0 }; 3];
                    (p[b], p[c]) = (2.0 * u - 1.0, 2.0 * v - 1.0);
                    self.spheres[sphere].point(p)
                }));
            }
            Thing::Plane(plane) => {
                let Plane { corner, sides: [s, t], .. } = self.planes[plane];
                points.extend(
                    parameters
                        .iter()
                        .map(|&[u, v]| [0, 1, 2].map(|k| (corner[k] + (u * s[k] + v * t[k])) as f32)),
                );
            }
            Thing::Bezier(bezier) => {
                let Bezier { points: control, .. } = self.beziers[bezier];
                points.extend(parameters.iter().map(|&[u, v]| {
                    let (bu, bv) = (bernstein(u), bernstein(v));
                    let mut p = [0.0; 3];
                    for (place, point) in control.iter().enumerate() {
                        let weight = bu[place % 4] * bv[place / 4];
                        p = [0, 1, 2].map(|k| p[k] + weight * point[k]);
                    }
                    p.map(|x| x as f32)
                }));
            }
            Thing::Square { field, level, place } => {
                let ([x, z], size) = self.fields[field].cell(level, place);
                let y = self.fields[field].corner[1] as f32;
                let (x, z, size) = (x + size * 0.25, z + size * 0.25, size * 0.5);
                points.extend(
                    parameters.iter().map(|&[u, v]| [(x + v * size) as f32, y, (z + u * size) as f32]),
                );
            }
        }
    }

    fn id(&self, patch: &Thing) -> u32 {
        match *patch {
            Thing::Face { sphere, .. } => self.spheres[sphere].id,
            Thing::Plane(plane) => self.planes[plane].id,
            Thing::Bezier(bezier) => self.beziers[bezier].id,
            Thing::Square { field, .. } => self.fields[field].id,
        }
    }
}

/// The cubic Bernstein polynomials.
fn bernstein(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}
