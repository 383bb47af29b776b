//! A scene in memory: what a reader or a built-in rule makes and what every mode takes.
//!
//! Triangles stand in file order; their index is their id. Objects are runs of consecutive triangles, in file order:
//! the *given* partition of the paper. Normals and texture coordinates have indices of their own, as OBJ has them.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (a given partition, such as the scene graph).

pub mod camera;
pub(crate) mod hit_points;
pub mod info;
pub mod optics;

pub use camera::{CUBE_FACES, Camera, Lens, Shot};
pub use info::{Info, info};
pub use optics::Optics;

use std::ops::Range;

use umbel_core::glam::DVec3;
use umbel_core::{Aabb, TriangleId, Triangles};

use crate::error::Error;

/// The index that stands for "this corner has no normal" or "no texture coordinate".
pub const NO_INDEX: u32 = u32::MAX;

/// The diffuse reflectance of what has no material.
pub(crate) const CLAY: [f32; 3] = [0.72, 0.70, 0.66];

/// A surface's look in the preview.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// The name in the material library.
    pub name: String,
    /// Diffuse reflectance, linear, 0 to 1.
    pub diffuse: [f32; 3],
    /// What is mirrored and let through, where that is followed.
    pub optics: Optics,
}

/// A named run of consecutive triangles: an object or a group of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// The name in the file; empty where the file gives none.
    pub name: String,
    /// The triangles of the object, as a range of triangle ids.
    pub triangles: Range<u32>,
    /// Index into [`Scene::materials`].
    pub material: Option<u32>,
}

impl Object {
    /// One object without a name that holds all triangles, or none where there are none.
    #[cfg(any(feature = "off", feature = "ply"))]
    pub(crate) fn whole(triangles: &[[u32; 3]]) -> Vec<Self> {
        // In range, or else the engine refuses so many triangles.
        let all = 0..triangles.len() as u32;
        if all.is_empty() {
            Vec::new()
        } else {
            vec![Self { name: String::new(), triangles: all, material: None }]
        }
    }
}

/// Edges and vertices of a cage that shall be sharp, by indices of positions in the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Creases {
    /// Edges: the positions at both ends, and the sharpness. 0 is smooth, 10 and more are creases for ever.
    pub edges: Vec<([u32; 2], f32)>,
    /// Vertices: the position and the sharpness.
    pub corners: Vec<(u32, f32)>,
}

/// Triangles with what a preview needs to know of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// A short name: the file's, or `builtin:NAME`.
    pub name: String,
    /// What was taken from the positions of the file before they were rounded to f32: 0 near the origin, else a point near
    /// the middle of the scene. Everything in the scene's frame plus this is in the file's frame.
    pub offset: DVec3,
    /// Vertex positions, in file order, less `offset`.
    pub positions: Vec<[f32; 3]>,
    /// Triangles in file order: indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Corners of each face of the file, in its order; empty where every face is a triangle. A face with n corners is n − 2
    /// consecutive triangles.
    pub face_corners: Vec<u32>,
    /// Vertex normals of the file, of any length; empty where the file has none.
    pub normals: Vec<[f32; 3]>,
    /// For each triangle, the indices of its corners' normals or [`NO_INDEX`]; empty where no triangle has normals.
    pub normal_indices: Vec<[u32; 3]>,
    /// Texture coordinates of the file; empty where the file has none.
    pub uvs: Vec<[f32; 2]>,
    /// For each triangle, the indices of its corners' texture coordinates or [`NO_INDEX`]; empty where no triangle has them.
    pub uv_indices: Vec<[u32; 3]>,
    /// Where v = 0 lies in a texture: in its top row (glTF), or else in its bottom row (OBJ). Coordinates stay as the file
    /// has them.
    pub uv_v_down: bool,
    /// The given partition: disjoint, ascending, covering all triangles.
    pub objects: Vec<Object>,
    /// Materials that the objects name.
    pub materials: Vec<Material>,
    /// What subdivision shall leave sharp.
    pub creases: Creases,
    /// What the reader noticed and mended or left out, one sentence each.
    pub warnings: Vec<String>,
}

impl Scene {
    /// The triangles as the engine takes them, checked, with the objects as their groups.
    ///
    /// # Errors
    /// When a position is not finite or an index is out of range.
    pub fn geometry(&self) -> Result<Triangles<'_>, Error> {
        let triangles = Triangles::new(&self.positions, &self.triangles)?;
        Ok(triangles.with_groups(self.group_ends())?)
    }

    /// Some of the triangles and their ids, which ascend, as the engine takes them; with the same groups.
    pub(crate) fn geometry_of<'a>(
        &'a self,
        triangles: &'a [[u32; 3]],
        ids: &[u32],
    ) -> Result<Triangles<'a>, Error> {
        let some = Triangles::new(&self.positions, triangles)?;
        // In range: they have been counted.
        Ok(some.with_groups(
            self.ends_among(ids.len() as u32, |end| ids.partition_point(|&id| id < end) as u32),
        )?)
    }

    /// Where the objects end. What no object has belongs to the next one, or comes last.
    pub(crate) fn group_ends(&self) -> Vec<u32> {
        // In range, or else the engine refuses so many triangles.
        self.ends_among(self.triangles.len() as u32, |end| end)
    }

    /// Where the objects end among `count` triangles, of which `before(id)` come before a triangle of the scene.
    fn ends_among(&self, count: u32, before: impl Fn(u32) -> u32) -> Vec<u32> {
        let of_objects = self.objects.iter().map(|object| before(object.triangles.end));
        let mut ends = Vec::with_capacity(self.objects.len() + 1);
        for end in of_objects.filter(|&end| end < count).chain([count]) {
            if end > ends.last().copied().unwrap_or(0) {
                ends.push(end);
            }
        }
        ends
    }

    /// The bounds of all vertices that triangles use.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let corners = self.triangles.iter().flatten();
        Aabb::of_points(corners.map(|&index| self.positions[index as usize]))
    }

    /// The texture coordinates (u, v) of a triangle's corners. `None` where a corner has none, where an index is out of range,
    /// and where one is not finite.
    #[must_use]
    pub fn uv_corners(&self, triangle: TriangleId) -> Option<[[f32; 2]; 3]> {
        let [a, b, c] = *self.uv_indices.get(triangle.0 as usize)?;
        let finite =
            |index: u32| self.uvs.get(index as usize).copied().filter(|uv| uv.iter().all(|x| x.is_finite()));
        Some([finite(a)?, finite(b)?, finite(c)?])
    }

    /// The index of the object that holds a triangle, or `None` where no object does. O(log objects).
    #[must_use]
    pub fn object_of(&self, triangle: u32) -> Option<usize> {
        let index = self.objects.partition_point(|object| object.triangles.end <= triangle);
        let object = self.objects.get(index)?;
        object.triangles.contains(&triangle).then_some(index)
    }

    /// The material of a triangle's object, or `None` where it has none. O(log objects).
    #[must_use]
    pub fn material_of(&self, triangle: u32) -> Option<&Material> {
        let index = self.objects[self.object_of(triangle)?].material?;
        self.materials.get(index as usize)
    }

    /// Gives optics to all objects that have this name, or whose material has it. Returns how many there are.
    ///
    /// Other objects of the same material keep theirs; objects without a material get one of their own name.
    pub fn set_optics(&mut self, name: &str, optics: Optics) -> usize {
        let mut copies: Vec<(Option<u32>, u32)> = Vec::new();
        let mut count = 0;
        for object in &mut self.objects {
            let old = object.material.and_then(|index| self.materials.get(index as usize));
            if object.name != name && old.is_none_or(|material| material.name != name) {
                continue;
            }
            count += 1;
            if let Some(&(_, copy)) = copies.iter().find(|(from, _)| *from == object.material) {
                object.material = Some(copy);
                continue;
            }
            let diffuse = old.map_or(CLAY, |material| material.diffuse);
            let name = old.map_or(&object.name, |material| &material.name).clone();
            // More materials than indices cannot be in memory.
            let Ok(copy) = u32::try_from(self.materials.len()) else { continue };
            self.materials.push(Material { name, diffuse, optics });
            copies.push((object.material, copy));
            object.material = Some(copy);
        }
        count
    }
}
