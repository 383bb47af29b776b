//! Polygons as a file lists them, by the indices of their corners.

/// Consecutive faces of a file.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    /// How many there are.
    pub(crate) count: usize,
    /// Corners of each face; empty where all have three.
    pub(crate) arities: Vec<u32>,
    /// The indices of the corners' positions, texture coordinates and normals, counted from 0, or
    /// [`NO_INDEX`](crate::scene::NO_INDEX). A list is empty where no corner has an index of its kind.
    pub(crate) corners: [Vec<u32>; 3],
}

impl Faces {
    /// The same, with texture coordinates and with normals that stand at the vertices, under the indices of the positions.
    #[cfg(any(feature = "off", feature = "ply"))]
    pub(crate) fn with_indices_of_positions(mut self, [uvs, normals]: [bool; 2]) -> Self {
        if uvs {
            self.corners[1] = self.corners[0].clone();
        }
        if normals {
            self.corners[2] = self.corners[0].clone();
        }
        self
    }
}
