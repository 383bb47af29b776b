//! Triangles as the engine takes them: borrowed positions and indices, checked once at the door.

use std::borrow::Cow;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, first_wrong};
use crate::geometry::aabb::{Aabb, widen};

/// The id of a triangle: its index in the slice given to [`Triangles::new`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TriangleId(pub u32);

/// Borrowed triangles: finite positions, indices in range. Nothing is copied.
#[derive(Debug, Clone)]
pub struct Triangles<'a> {
    positions: &'a [[f32; 3]],
    indices: &'a [[u32; 3]],
    /// Where groups end; empty where all are one.
    group_ends: Cow<'a, [u32]>,
}

impl<'a> Triangles<'a> {
    /// Checks and borrows `indices.len()` triangles over `positions`. O(n).
    ///
    /// Triangles without area are fine: no ray hits them, and they keep their id.
    ///
    /// # Errors
    /// The first position that is not finite, the first index out of range, or too many triangles.
    pub fn new(positions: &'a [[f32; 3]], indices: &'a [[u32; 3]]) -> Result<Self, Error> {
        if u32::try_from(indices.len()).map_or(true, |count| count == u32::MAX) {
            return Err(Error::TooManyTriangles { triangles: indices.len() });
        }
        let not_finite = |p: &[f32; 3]| !p.iter().all(|x| x.is_finite());
        if let Some(vertex) = first_wrong(positions, not_finite) {
            return Err(Error::NonFinitePosition { vertex, position: positions[vertex] });
        }
        let vertices = positions.len();
        let outside = |&&v: &&u32| v as usize >= vertices;
        let wrong = |corners: &[u32; 3]| corners.iter().find(outside).is_some();
        if let Some(triangle) = first_wrong(indices, wrong)
            && let Some(&vertex) = indices[triangle].iter().find(outside)
        {
            return Err(Error::IndexOutOfRange { triangle, vertex, vertices });
        }
        Ok(Self { positions, indices, group_ends: Cow::Borrowed(&[]) })
    }

    /// Tells where groups of consecutive triangles end, such as the objects of a scene: the k-th group has the
    /// triangles from `ends[k - 1]`, or 0, to `ends[k]`. Without groups, all triangles are one. O(groups).
    ///
    /// [`Partition::Given`](crate::options::Partition::Given) divides between groups before it divides a group. A
    /// hierarchy is given flat, its leaves in the order of a walk through it: neighbours are then of one parent. Never
    /// changes an output.
    ///
    /// ```
    /// # use umbel_core::Triangles;
    /// # let (positions, indices) = ([[0.0; 3]; 3], [[0, 1, 2]; 8]);
    /// // A table of two triangles, and a vase of six.
    /// let triangles = Triangles::new(&positions, &indices)?.with_groups(&[2, 8])?;
    /// # Ok::<(), umbel_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// The first group that does not end after the one before it, or groups that have more or fewer triangles than
    /// there are.
    pub fn with_groups(self, ends: impl Into<Cow<'a, [u32]>>) -> Result<Self, Error> {
        let group_ends = ends.into();
        let mut before = 0;
        for (group, &end) in group_ends.iter().enumerate() {
            if end <= before {
                return Err(Error::EmptyGroup { group, end, before });
            }
            before = end;
        }
        if before as usize != self.len() {
            return Err(Error::GroupsEnd { end: before, triangles: self.len() });
        }
        Ok(Self { group_ends, ..self })
    }

    /// Where groups end, in ascending order; empty where all triangles are one.
    pub(crate) fn group_ends(&self) -> &[u32] {
        &self.group_ends
    }

    /// Appends a copy of all of them.
    pub(crate) fn append_to(&self, positions: &mut Vec<[f32; 3]>, indices: &mut Vec<[u32; 3]>) {
        positions.extend_from_slice(self.positions);
        indices.extend_from_slice(self.indices);
    }

    /// The number of triangles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The corners of a triangle.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn corners(&self, id: TriangleId) -> [[f32; 3]; 3] {
        self.indices[id.0 as usize].map(|v| self.positions[v as usize])
    }

    /// All positions, used or not.
    pub(crate) fn positions(&self) -> &[[f32; 3]] {
        self.positions
    }

    /// The vertices of a triangle.
    #[inline(always)]
    pub(crate) fn vertices(&self, id: u32) -> [u32; 3] {
        self.indices[id as usize]
    }

    /// A position, and whatever follows it.
    #[inline(always)]
    pub(crate) fn four_from(&self, vertex: u32) -> [f32; 4] {
        let (flat, first) = (self.positions.as_flattened(), vertex as usize * 3);
        match flat.get(first..first + 4) {
            Some(four) => [four[0], four[1], four[2], four[3]],
            None => [flat[first], flat[first + 1], flat[first + 2], 0.0],
        }
    }

    /// The corners of a triangle in f64, which is exact.
    pub(crate) fn triangle(&self, id: u32) -> Triangle {
        let [a, b, c] = self.indices[id as usize].map(|v| widen(self.positions[v as usize]));
        Triangle { a, b, c }
    }

    /// The box of all positions, used or not.
    pub(crate) fn position_bounds(&self) -> Aabb {
        let of_chunk = |chunk: &[[f32; 3]]| Aabb::of_points(chunk.iter().copied());
        self.positions.par_chunks(1 << 14).map(of_chunk).reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// The box of one triangle.
    pub(crate) fn bounds(&self, id: u32) -> Aabb {
        Aabb::of_points(self.corners(TriangleId(id)))
    }
}

/// One triangle in f64: each coordinate is an f32 value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Triangle {
    pub(crate) a: DVec3,
    pub(crate) b: DVec3,
    pub(crate) c: DVec3,
}

impl Triangle {
    /// Whether a point is one of the corners, bit by bit. No ray from there hits the triangle, as its plane holds the point.
    #[inline]
    pub(crate) fn has_corner(&self, point: DVec3) -> bool {
        point == self.a || point == self.b || point == self.c
    }
}
