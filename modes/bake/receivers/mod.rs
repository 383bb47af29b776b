//! Where ambient occlusion is asked for: vertices, texels and given points.

pub(crate) mod angles;
pub mod fans;
pub mod points;
pub(crate) mod texels;
pub mod vertices;

use std::ops::Range;

use umbel_core::Hemisphere;

use crate::bake::receivers::fans::Fans;

/// Points whose openness is asked for. All parts are of the same length, `fans` may be empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BakeReceivers {
    /// Where rays start, and the half spaces that they leave into.
    pub hemispheres: Vec<Hemisphere>,
    /// Shading normals, of unit length.
    pub normals: Vec<[f32; 3]>,
    /// The numbers of the vertices, points or texels: they choose the directions. Several receivers of a texel follow each
    /// other.
    pub indices: Vec<u32>,
    /// Further faces by which rays leave, of vertices; for all receivers or, empty, for none.
    pub fans: Fans,
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

    /// Adds one without a fan.
    pub fn push(&mut self, hemisphere: Hemisphere, normal: [f32; 3], index: u32) {
        self.hemispheres.push(hemisphere);
        self.normals.push(normal);
        self.indices.push(index);
    }

    /// Adds others behind these.
    pub fn append(&mut self, others: &Self) {
        self.fans.append(self.hemispheres.len(), (&others.fans, others.len()));
        self.hemispheres.extend_from_slice(&others.hemispheres);
        self.normals.extend_from_slice(&others.normals);
        self.indices.extend_from_slice(&others.indices);
    }

    /// Those at the places of a range.
    ///
    /// # Panics
    /// When there are not so many.
    #[must_use]
    pub fn slice(&self, places: Range<usize>) -> Self {
        Self {
            hemispheres: self.hemispheres[places.clone()].to_vec(),
            normals: self.normals[places.clone()].to_vec(),
            indices: self.indices[places.clone()].to_vec(),
            fans: self.fans.picked(places),
        }
    }

    /// Those at some places.
    ///
    /// # Panics
    /// When there are not so many.
    #[must_use]
    pub fn picked(&self, places: &[usize]) -> Self {
        Self {
            hemispheres: places.iter().map(|&place| self.hemispheres[place]).collect(),
            normals: places.iter().map(|&place| self.normals[place]).collect(),
            indices: places.iter().map(|&place| self.indices[place]).collect(),
            fans: self.fans.picked(places.iter().copied()),
        }
    }
}
