//! What occludes: the scene itself, further scenes, and a ground plane below all of them.
//!
//! The triangles of the scene come first and keep their ids; those of the others follow in order, and the ground's two are the last.
//!
//! The ground is a square with the normal up, of 1000 times the diagonal of the box of everything else, below the lowest
//! point along up. Not through it: faces that stand on the ground would lie in its plane, and what lies in a receiver's plane
//! never occludes. It is lower by 2⁻²⁰ of the largest coordinate, 8 to 16 spacings of f32, and where up is no axis by as much as
//! its own corners may be rounded.
//!
//! Based on: Tom Duff et al., "Building an Orthonormal Basis, Revisited", 2017.

use std::borrow::Cow;

use glam::DVec3;
use umbel_core::{Aabb, Triangles};

use crate::bake::sample_sets::tangents;
use crate::error::{Argument, Error};
use crate::scene::Scene;

/// Half the side of the ground over the diagonal of what stands on it.
const GROUND: f64 = 500.0;
/// How far below the lowest point the ground lies, over the largest coordinate.
const BELOW: f64 = 1.0 / (1 << 20) as f64;

/// Triangles of a scene and of what else occludes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Occluders<'a> {
    positions: Cow<'a, [[f32; 3]]>,
    triangles: Cow<'a, [[u32; 3]]>,
    /// Where the objects of all scenes end.
    group_ends: Vec<u32>,
    /// That of the first scene, in whose frame everything is.
    offset: DVec3,
}

impl<'a> Occluders<'a> {
    /// A scene that occludes itself. Its triangles are not copied.
    #[must_use]
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            positions: Cow::Borrowed(&scene.positions),
            triangles: Cow::Borrowed(&scene.triangles),
            group_ends: scene.group_ends(),
            offset: scene.offset,
        }
    }

    /// Adds the triangles of another scene.
    ///
    /// # Errors
    /// [`Error::Usage`] when there are more vertices than indices.
    pub fn add(&mut self, scene: &Scene) -> Result<(), Error> {
        let between = scene.offset - self.offset;
        if between == DVec3::ZERO {
            return self.append(&scene.positions, &scene.triangles, &scene.group_ends());
        }
        // Both offsets are exact, so positions are rounded once more and no more than that.
        let moved =
            |p: &[f32; 3]| (DVec3::from_array(p.map(f64::from)) + between).to_array().map(|x| x as f32);
        let positions: Vec<[f32; 3]> = scene.positions.iter().map(moved).collect();
        self.append(&positions, &scene.triangles, &scene.group_ends())
    }

    /// Adds a ground below all that there is so far. An empty scene has none.
    ///
    /// # Errors
    /// [`Error::Argument`] when `up` is zero or not finite, or the ground would leave the range of f32.
    pub fn add_ground(&mut self, up: DVec3) -> Result<(), Error> {
        let size = up.abs().max_element();
        if !(up.is_finite() && size > 0.0) {
            return Err(Argument::GroundUp.into());
        }
        let up = (up / size).normalize();
        let used = || self.triangles.iter().flatten().map(|&vertex| self.positions[vertex as usize]);
        let bounds = Aabb::of_points(used());
        if bounds.is_empty() {
            return Ok(());
        }
        let [lo, hi] = [bounds.lo, bounds.hi].map(|p| DVec3::from_array(p.map(f64::from)));
        let height = |p: [f32; 3]| DVec3::from_array(p.map(f64::from)).dot(up);
        let lowest = used().map(height).fold(f64::INFINITY, f64::min);
        let (middle, half) = ((lo + hi) * 0.5, ((hi - lo) * GROUND).length());
        let largest = lo.abs().max(hi.abs()).max_element();
        let is_axis = up.abs().max_element() == 1.0;
        let rounded = if is_axis { 0.0 } else { (largest + half) * f64::from(f32::EPSILON) };
        let foot = middle + up * (lowest - middle.dot(up) - largest * BELOW - rounded);
        let (s, t) = tangents(up);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(a, b)| (foot + (s * a + t * b) * half).to_array().map(|x| x as f32));
        if !corners.iter().flatten().all(|x| x.is_finite()) {
            return Err(Argument::GroundSize.into());
        }
        self.append(&corners, &[[0, 1, 2], [0, 2, 3]], &[2])
    }

    /// The triangles as the engine takes them, checked, with the objects of all scenes as their groups.
    ///
    /// # Errors
    /// When a position is not finite or an index is out of range.
    pub fn geometry(&self) -> Result<Triangles<'_>, Error> {
        let triangles = Triangles::new(&self.positions, &self.triangles)?;
        Ok(triangles.with_groups(&self.group_ends)?)
    }

    /// Bytes that are held beside the scene.
    #[must_use]
    pub fn copied_bytes(&self) -> u64 {
        let positions = if let Cow::Owned(owned) = &self.positions { size_of_val(&owned[..]) } else { 0 };
        let triangles = if let Cow::Owned(owned) = &self.triangles { size_of_val(&owned[..]) } else { 0 };
        (positions + triangles) as u64
    }

    fn append(
        &mut self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        group_ends: &[u32],
    ) -> Result<(), Error> {
        let (first, first_triangle) = (self.positions.len(), self.triangles.len());
        if u32::try_from(first + positions.len()).is_err() {
            return Err(Error::Usage(
                "the occluders have more vertices together than 32 bits can count".into(),
            ));
        }
        let moved = |corners: &[u32; 3]| corners.map(|vertex| vertex + first as u32);
        self.positions.to_mut().extend_from_slice(positions);
        self.triangles.to_mut().extend(triangles.iter().map(moved));
        // In range, or else the engine refuses so many triangles.
        self.group_ends.extend(group_ends.iter().map(|&end| (first_triangle + end as usize) as u32));
        Ok(())
    }
}
