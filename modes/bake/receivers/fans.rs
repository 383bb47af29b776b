//! The faces around vertices, and the rays that leave a vertex by another face than its owner's.
//!
//! The openness of a vertex is that of the directions d above its normal n, d·n > 0, which lead out of the solid whose surface
//! the faces around the vertex are. The owner's start p is good for those above its own plane only: at a convex corner others are open,
//! too. Let C be the cone of the solid at the vertex v, made of the half-planes that the faces F_i span, and let the start p_i lie
//! on F_i near v (on its outer side, as [`Triangles::leave`] has it).
//!
//! - *No ray into the solid is open.* If d points into the inside of C, p_i + td has the direction of d for large t, so that it lies
//!   in C in the end; starting outside it has crossed a face. This holds for every i, and for a single sheet as for a solid.
//! - *At a convex vertex every ray out of it is open.* Then C is the intersection of the half spaces behind its faces, d leads out
//!   iff d·N_i > 0 for some i, and p_i + td with this i never comes behind the plane of F_i again.
//! - *At a concave vertex every ray out of it is open.* Then the outside is convex, and it contains p_i and d, so p_i + td.
//! - At a saddle p_i may stand in the shade of another face. Then the answer is that of the start on a face, as it is
//!   everywhere else on the surface.
//!
//! So any face with d·N_i > 0 will do. Where one face has the largest angle, rays start at it if they can; else, and where several
//! have it, at the face that they leave most steeply: then nothing depends on the order of faces in the file, and equal corners
//! are equal. Faces of one plane count as one. What lies beyond the faces at v is decided exactly for (p_i, d), as ever.
//!
//! Based on: Jakob Andreas Bærentzen and Henrik Aanæs, "Signed Distance Computation Using the Angle Weighted Pseudonormal",
//! 2005 (the faces around a vertex, weighted by angle).

use std::cmp::Ordering;

use glam::DVec3;
use umbel_core::{Above, Hemisphere, NO_TRIANGLE, Receiver, Side, TriangleId, Triangles};

use crate::bake::receivers::angles::{angles, dot, unit};
use crate::scene::Scene;

/// The cosine from which faces are of one plane: rounding of their normals does not get so far.
const COS_SAME: f64 = 1.0 - 1e-12;
/// Of two angles the larger one is larger by this factor, beyond the rounding of equal corners.
const LARGER: f64 = 1.0 + 1e-6;

/// The most rays by other faces that one call of the engine takes, and the fewest that it waits for.
pub(crate) const CALL: [usize; 2] = [1 << 12, 1 << 17];
/// Bytes of such a ray while it is asked for.
const RAY_BYTES: u64 = 120;
/// Rays by other faces of a vertex, of which a call takes as many as there are vertices; smooth surfaces have 2 to 4.
pub(crate) const USUAL_RAYS: usize = 4;

/// Faces around receivers. Empty where receivers have no other face than their owner's.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fans {
    /// Where the faces of each receiver end.
    ends: Vec<u32>,
    /// Corners of triangles, one of each plane.
    faces: Vec<Corner>,
    /// Whether the owner of a receiver comes before the others.
    owner_first: Vec<bool>,
}

impl Fans {
    /// Bytes that rays by other faces of so many vertices take at once, beside their receivers.
    #[must_use]
    pub fn bytes(vertices: u64) -> u64 {
        vertices.saturating_mul(USUAL_RAYS as u64).min(CALL[1] as u64) * RAY_BYTES
    }

    /// Adds a receiver's.
    fn push(&mut self, fan: &Fan) {
        self.faces.extend_from_slice(&fan.faces);
        // In range: there are not more corners of triangles with different planes than 32-bit ids can name, or the piece
        // is cut by memory long before.
        self.ends.push(self.faces.len() as u32);
        self.owner_first.push(fan.owner_first);
    }

    /// Those of some receivers.
    pub(crate) fn of(fans: impl IntoIterator<Item = Fan>) -> Self {
        let mut all = Self::default();
        fans.into_iter().for_each(|fan| all.push(&fan));
        all
    }

    /// Those of the receivers at some places.
    pub(crate) fn picked(&self, places: impl IntoIterator<Item = usize>) -> Self {
        if self.ends.is_empty() {
            return Self::default();
        }
        Self::of(places.into_iter().map(|place| self.at(place)))
    }

    /// Adds those of so many receivers behind those of so many others.
    pub(crate) fn append(&mut self, own: usize, (others, count): (&Self, usize)) {
        if self.is_empty() && others.is_empty() {
            return;
        }
        (self.ends.len()..own).for_each(|_| self.push(&Fan::default()));
        (0..count)
            .for_each(|place| self.push(&if others.is_empty() { Fan::default() } else { others.at(place) }));
    }

    /// Whether no receiver has a fan.
    pub(crate) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// The other faces of a receiver.
    fn at(&self, place: usize) -> Fan {
        let first = place.checked_sub(1).map_or(0, |before| self.ends[before] as usize);
        let faces = self.faces[first..self.ends[place] as usize].to_vec();
        Fan { faces, owner_first: self.owner_first[place] }
    }
}

/// A corner of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Corner {
    pub(crate) triangle: u32,
    /// 0, 1 or 2.
    pub(crate) corner: u8,
}

/// The faces around one vertex.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Fan {
    /// A corner of each plane but the owner's.
    pub(crate) faces: Vec<Corner>,
    /// Whether the owner's plane has the largest angle, alone.
    pub(crate) owner_first: bool,
}

/// What is found of a vertex: its owner, its normal and its fan.
pub(crate) struct Around {
    /// [`NO_TRIANGLE`] where no triangle with an area uses the vertex.
    pub(crate) owner: u32,
    /// The mean of the normals of its faces, weighted by angle; the owner's where they cancel.
    pub(crate) normal: DVec3,
    pub(crate) fan: Fan,
}

/// Faces in one plane.
struct Plane {
    normal: DVec3,
    angle: f64,
    /// The corner with the largest angle, of equal ones the first.
    face: Corner,
    largest: f64,
}

impl Around {
    /// Looks at the triangles that use a vertex, ascending.
    pub(crate) fn vertex(scene: &Scene, triangles: &Triangles<'_>, vertex: u32, faces: &[u32]) -> Self {
        let mut planes: Vec<Plane> = Vec::with_capacity(8);
        let mut sum = DVec3::ZERO;
        for &face in faces {
            let Some(angles) = angles(triangles, TriangleId(face)) else { continue };
            let corners = scene.triangles[face as usize];
            let normal = triangles.normal(TriangleId(face));
            let own = (0_u8..).zip(corners).zip(angles).filter(|&((_, corner), _)| corner == vertex);
            for ((corner, _), angle) in own {
                let face = Corner { triangle: face, corner };
                sum += normal * angle;
                match planes.iter_mut().find(|plane| dot(plane.normal, normal) >= COS_SAME) {
                    Some(plane) => {
                        plane.angle += angle;
                        if angle > plane.largest {
                            (plane.face, plane.largest) = (face, angle);
                        }
                    }
                    None => planes.push(Plane { normal, angle, face, largest: angle }),
                }
            }
        }
        // Of equal ones the first.
        let by_angle = |one: &usize, other: &usize| {
            planes[*one].angle.total_cmp(&planes[*other].angle).then(other.cmp(one))
        };
        let Some(owner) = (0..planes.len()).max_by(by_angle) else {
            return Self { owner: NO_TRIANGLE, normal: DVec3::ZERO, fan: Fan::default() };
        };
        let others = || planes.iter().enumerate().filter(|&(k, _)| k != owner).map(|(_, plane)| plane);
        let owner_first = others().all(|plane| planes[owner].angle > plane.angle * LARGER);
        let normal = if dot(sum, sum) > CANCELLED { unit(sum) } else { None };
        Self {
            owner: planes[owner].face.triangle,
            normal: normal.unwrap_or(planes[owner].normal),
            fan: Fan { faces: others().map(|plane| plane.face).collect(), owner_first },
        }
    }
}

/// From this slope on a direction, about as long as 1, is above a plane, with rounding far below.
const CLEAR: f64 = 1e-6;
/// Below this the square of a sum of normals is rounding: both sides of a sheet.
const CANCELLED: f64 = 1e-20;

/// Which face a direction leaves from: its number among the faces after the owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Leaves {
    Owner,
    Other(usize),
    Nowhere,
}

/// The planes around one receiver, ready for directions.
pub(crate) struct Planes {
    /// Outer normals, of unit length; the owner's first.
    normals: Vec<DVec3>,
    faces: Vec<Corner>,
    owner_first: bool,
}

impl Planes {
    /// Those of a receiver with its owner and its normal; `None` where it has no others.
    pub(crate) fn of(
        fans: &Fans,
        place: usize,
        triangles: &Triangles<'_>,
        owner: DVec3,
        up: DVec3,
    ) -> Option<Self> {
        let Fan { faces, owner_first } = fans.at(place);
        if faces.is_empty() {
            return None;
        }
        let outer = |face: &Corner| {
            let normal = triangles.normal(TriangleId(face.triangle));
            if dot(normal, up) < 0.0 { -normal } else { normal }
        };
        let normals = std::iter::once(owner).chain(faces.iter().map(outer)).collect();
        Some(Self { normals, faces, owner_first })
    }

    /// The half space above the face at a number, from its corner.
    pub(crate) fn hemisphere(&self, number: usize, triangles: &Triangles<'_>) -> Hemisphere {
        let Corner { triangle, corner } = self.faces[number];
        let triangle = TriangleId(triangle);
        let is_front = dot(triangles.normal(triangle), self.normals[number + 1]) > 0.0;
        let side = if is_front { Side::Front } else { Side::Back };
        let mut weights = [0.0; 3];
        weights[usize::from(corner)] = 1.0;
        let point = triangles.leave(triangle, weights, side);
        Hemisphere { receiver: Receiver { point, triangle }, above: Above::Side(side) }
    }

    /// Whether a direction leaves clearly by the owner: most do, and need not be looked at more closely.
    pub(crate) fn leaves_by_owner(&self, direction: DVec3) -> bool {
        self.owner_first && dot(self.normals[0], direction) > CLEAR
    }

    /// From where a direction leaves; `above_owner` says, exactly, whether it points above the owner.
    pub(crate) fn leaves(&self, direction: DVec3, above_owner: bool) -> Leaves {
        if above_owner && self.owner_first {
            return Leaves::Owner;
        }
        let slopes = self.normals.iter().map(|&normal| dot(normal, direction)).enumerate();
        let steepest = slopes.max_by(|(k, one), (l, other)| match one.total_cmp(other) {
            Ordering::Equal => l.cmp(k),
            order => order,
        });
        match steepest {
            Some((0, _)) if above_owner => Leaves::Owner,
            Some((number @ 1.., slope)) if slope > 0.0 => Leaves::Other(number - 1),
            _ if above_owner => Leaves::Owner,
            _ => Leaves::Nowhere,
        }
    }
}
