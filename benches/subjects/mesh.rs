//! Positions and triangles of subjects that are made by rule, and how parts are put together.

use umbel::glam::{DMat3, DVec3};
use umbel::{Scene, Triangles};

use crate::Result;

/// Positions and triangles.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// A point, rounded.
pub(crate) fn rounded(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}

/// A point of a mesh.
pub(crate) fn exact(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

impl Mesh {
    /// The triangles as the engine takes them.
    pub(crate) fn geometry(&self) -> Result<Triangles<'_>> {
        Ok(Triangles::new(&self.positions, &self.triangles)?)
    }

    /// The mesh as a scene of one object without a material.
    pub(crate) fn scene(self) -> Scene {
        Scene { positions: self.positions, triangles: self.triangles, ..Scene::default() }
    }

    /// Adds a triangle with corners of its own.
    pub(crate) fn push(&mut self, corners: [[f32; 3]; 3]) {
        // At most 2²⁴ triangles are made.
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    /// The mesh, turned around the origin.
    pub(crate) fn turned(mut self, turn: DMat3) -> Self {
        for p in &mut self.positions {
            *p = rounded(turn * exact(*p));
        }
        self
    }

    /// The mesh, moved.
    pub(crate) fn shifted(mut self, by: DVec3) -> Self {
        for p in &mut self.positions {
            *p = rounded(exact(*p) + by);
        }
        self
    }

    /// The mesh with all faces turned over.
    pub(crate) fn reversed(mut self) -> Self {
        for [_, b, c] in &mut self.triangles {
            std::mem::swap(b, c);
        }
        self
    }

    /// This mesh and another one behind it.
    pub(crate) fn and(mut self, other: Self) -> Self {
        // At most 2²⁴ triangles are made.
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.into_iter().map(|corners| corners.map(|v| v + first)));
        self
    }

    /// Each triangle of this mesh followed by that of another with as many.
    pub(crate) fn interleaved(self, other: Self) -> Self {
        let half = self.triangles.len();
        let mut mesh = self.and(other);
        mesh.triangles = (0..half).flat_map(|k| [mesh.triangles[k], mesh.triangles[half + k]]).collect();
        mesh
    }

    /// A parallelogram from a corner along two sides, in n x m parts of two triangles.
    pub(crate) fn quad(at: DVec3, [u, v]: [DVec3; 2], [n, m]: [u32; 2]) -> Self {
        let place =
            |i: u32, j: u32| at + u * (f64::from(i) / f64::from(n)) + v * (f64::from(j) / f64::from(m));
        let positions = (0..=m).flat_map(|j| (0..=n).map(move |i| rounded(place(i, j)))).collect();
        let part = |k: u32| {
            let a = k / n * (n + 1) + k % n;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            [[a, b, d], [a, d, c]]
        };
        Self { positions, triangles: (0..n * m).flat_map(part).collect() }
    }

    /// The six sides of a box, seen from outside.
    pub(crate) fn cuboid(at: DVec3, size: DVec3) -> Self {
        let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
        [(at, [y, x]), (at + z, [x, y]), (at, [x, z]), (at + y, [z, x]), (at, [z, y]), (at + x, [y, z])]
            .into_iter()
            .map(|(at, sides)| Self::quad(at, sides, [1; 2]))
            .fold(Self::default(), Self::and)
    }
}
