//! Where ambient occlusion is asked for: vertices, texels and given points.

pub mod points;
pub(crate) mod texels;
pub mod vertices;

use umbel_core::Hemisphere;

/// Points whose openness is asked for. All parts are of the same length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BakeReceivers {
    /// Where rays start, and the half spaces that they leave into.
    pub hemispheres: Vec<Hemisphere>,
    /// Shading normals, of unit length.
    pub normals: Vec<[f32; 3]>,
    /// The numbers of the vertices, points or texels: they choose the directions. Several receivers of a texel follow each
    /// other.
    pub indices: Vec<u32>,
}

impl BakeReceivers {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.hemispheres.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.hemispheres.is_empty()
    }

    /// Adds one.
    pub fn push(&mut self, hemisphere: Hemisphere, normal: [f32; 3], index: u32) {
        self.hemispheres.push(hemisphere);
        self.normals.push(normal);
        self.indices.push(index);
    }

    /// Those at some places.
    pub(crate) fn picked(&self, places: &[usize]) -> Self {
        Self {
            hemispheres: places.iter().map(|&place| self.hemispheres[place]).collect(),
            normals: places.iter().map(|&place| self.normals[place]).collect(),
            indices: places.iter().map(|&place| self.indices[place]).collect(),
        }
    }
}
