//! The mesh of an OBJ file as it stands there, before faces are cut into triangles: what both readers of the text make.

use crate::formats::obj::left_out::LeftOut;
use crate::formats::polygons::faces::Faces;
use crate::scene::Creases;

/// A run of faces under one name and material.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Part {
    pub(crate) name: String,
    pub(crate) material: String,
    /// How many faces of the file stand before it.
    pub(crate) first_face: usize,
}

/// The parts of a file so far. The first one begins with the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parts(pub(crate) Vec<Part>);

impl Default for Parts {
    fn default() -> Self {
        Self(vec![Part::default()])
    }
}

impl Parts {
    /// The part that the next face belongs to, when so many stand before it: begun anew if the last one has faces.
    pub(crate) fn next(&mut self, faces: usize) -> &mut Part {
        let last = self.0.len() - 1;
        if self.0[last].first_face == faces {
            return &mut self.0[last];
        }
        let part = Part { first_face: faces, ..self.0[last].clone() };
        self.0.push(part);
        &mut self.0[last + 1]
    }
}

/// What an OBJ file says.
#[derive(Debug, Default)]
pub(crate) struct ObjMesh {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) normals: Vec<[f32; 3]>,
    /// All faces, in the order of the file.
    pub(crate) faces: Vec<Faces>,
    pub(crate) parts: Vec<Part>,
    /// What follows each `mtllib`.
    pub(crate) libraries: Vec<String>,
    pub(crate) creases: Creases,
    /// What is left out, to be counted in warnings.
    pub(crate) left_out: LeftOut,
    /// Whether a corner names a texture coordinate or a normal though the file has none at all.
    pub(crate) dangling: [bool; 3],
}
