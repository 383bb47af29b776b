//! Where receivers are looked up in depth maps: points in the units of their box, side by side, with the normals of their planes.
//!
//! A receiver right at an edge of its triangle has two places, see [`crate::bake::depth_maps`]: one moved inwards by 1/64 of 1/N, so
//! that it lies on the inner side of what meets the triangle there, and one by 1/N, most of a texel. To move inwards is to move
//! towards the centroid g: at p + λ(g − p) the distance from each edge is at least λ times that of g, which is at least a third of the
//! triangle's least height. λ is at most ¼, and the way at most four times what was asked for: needles are not left at their far end.

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Aabb, Above, Hemisphere, NO_TRIANGLE, Side, TriangleId, Triangles};

use crate::error::{Argument, Error};

/// Places side by side.
pub(crate) const LANES: usize = 8;

/// One number for each of the places side by side.
pub(crate) type Lanes = [f32; LANES];

/// How far from an edge both places of a receiver lie, in 1/N.
const INSETS: [f64; 2] = [1.0 / 64.0, 1.0];
/// The greatest part of the way to the centroid, and the longest way over the distance that is asked for.
const MOST_PART: f64 = 0.25;
const MOST_WAY: f64 = 4.0;
/// How far outside of the box a receiver may lie, in units of it: rounding.
const OUTSIDE: f64 = 1.0 / (1 << 17) as f64;

/// The box of the receivers, as the unit of length.
pub(crate) struct Units {
    pub(crate) centre: DVec3,
    /// Half of the diagonal.
    pub(crate) length: f64,
    /// Half of the extent along each axis, in that unit.
    pub(crate) half: DVec3,
}

impl Units {
    pub(crate) fn new(bounds: &Aabb) -> Self {
        let bounds = if bounds.is_empty() { Aabb { lo: [0.0; 3], hi: [0.0; 3] } } else { *bounds };
        let (centre, half) = (DVec3::from_array(bounds.centre()), DVec3::from_array(bounds.extent()) * 0.5);
        let spacing = centre.abs().max_element() * f64::from(f32::EPSILON);
        // A box without extent still has points that are apart.
        let length = half.length().max(spacing).max(f64::from(f32::MIN_POSITIVE));
        Self { centre, length, half: half / length }
    }

    /// A point in these units.
    pub(crate) fn place(&self, point: DVec3) -> DVec3 {
        (point - self.centre) / self.length
    }

    /// How far the box lies from the origin: its f32 coordinates are as coarse as that.
    pub(crate) fn distance(&self) -> f64 {
        (self.centre.abs().max_element() / self.length).min(f64::from(f32::MAX))
    }
}

/// Places side by side, the last of them without a normal where there are not enough.
#[derive(Clone, Copy, Default)]
pub(crate) struct Place {
    pub(crate) points: [Lanes; 3],
    /// Of unit length, to the side that rays leave to.
    pub(crate) normals: [Lanes; 3],
}

/// The places of all receivers, in their order, and behind them the second places of some.
pub(crate) struct Places {
    pub(crate) groups: Vec<Place>,
    receivers: usize,
    /// The receivers that have a second place, in order.
    seconds: Vec<u32>,
}

impl Places {
    /// Bytes for each receiver, at most.
    pub(crate) const RECEIVER_BYTES: u64 = 2 * (24 + 24) + 8;

    /// # Errors
    /// When a receiver lies outside of the box.
    pub(crate) fn new(
        triangles: &Triangles<'_>,
        hemispheres: &[Hemisphere],
        units: &Units,
        size: u32,
    ) -> Result<Self, Error> {
        let outside = |hemisphere: &Hemisphere| {
            let place = units.place(DVec3::from_array(hemisphere.receiver.point.map(f64::from)));
            !(place.abs() - units.half).cmple(DVec3::splat(OUTSIDE)).all()
        };
        if let Some(index) = hemispheres.par_iter().position_first(outside) {
            let point = hemispheres[index].receiver.point;
            return Err(Argument::OutsideOfMaps { receiver: index, point }.into());
        }
        let [near, far] = INSETS.map(|inset| inset / f64::from(size) * units.length);
        let row = |hemisphere: &Hemisphere, inset: f64| row(triangles, hemisphere, units, inset);
        let mut rows: Vec<[f32; 6]> = hemispheres.par_iter().map(|one| row(one, near)).collect();
        let is_second = |one: &Hemisphere| moved_inwards(triangles, one, far).is_some();
        let numbered = hemispheres.par_iter().enumerate().filter(|(_, one)| is_second(one));
        // In range: a query has fewer than 2³² receivers.
        let seconds: Vec<u32> = numbered.map(|(index, _)| index as u32).collect();
        rows.par_extend(seconds.par_iter().map(|&index| row(&hemispheres[index as usize], far)));
        let group = |rows: &[[f32; 6]]| {
            let mut place = Place::default();
            for (lane, row) in rows.iter().enumerate() {
                for k in 0..3 {
                    (place.points[k][lane], place.normals[k][lane]) = (row[k], row[3 + k]);
                }
            }
            place
        };
        let groups = rows.par_chunks(LANES).map(group).collect();
        Ok(Self { groups, receivers: hemispheres.len(), seconds })
    }

    /// How many places there are.
    pub(crate) fn len(&self) -> usize {
        self.receivers + self.seconds.len()
    }

    /// Leaves open what is open at both places of a receiver, and only the receivers' own words.
    pub(crate) fn join(&self, words: &mut Vec<u32>, words_each: usize) {
        let (own, seconds) = words.split_at_mut(self.receivers * words_each);
        for (k, &index) in self.seconds.iter().enumerate() {
            let own = &mut own[index as usize * words_each..][..words_each];
            own.iter_mut().zip(&seconds[k * words_each..]).for_each(|(own, second)| *own &= second);
        }
        words.truncate(self.receivers * words_each);
    }
}

/// A point, and the normal there.
fn row(triangles: &Triangles<'_>, hemisphere: &Hemisphere, units: &Units, inset: f64) -> [f32; 6] {
    let point = moved_inwards(triangles, hemisphere, inset);
    let point =
        units.place(point.unwrap_or_else(|| DVec3::from_array(hemisphere.receiver.point.map(f64::from))));
    let normal = match hemisphere.above {
        Above::Side(Side::Front) => triangles.normal(hemisphere.receiver.triangle),
        Above::Side(Side::Back) => -triangles.normal(hemisphere.receiver.triangle),
        Above::Normal(normal) => DVec3::from_array(normal.map(f64::from)),
    };
    let normal = normal.normalize_or_zero();
    [point.x, point.y, point.z, normal.x, normal.y, normal.z].map(|x| x as f32)
}

/// The point of a receiver that is nearer than `inset` to an edge of its triangle, moved towards the centroid; else none.
fn moved_inwards(triangles: &Triangles<'_>, hemisphere: &Hemisphere, inset: f64) -> Option<DVec3> {
    let TriangleId(id) = hemisphere.receiver.triangle;
    if id == NO_TRIANGLE {
        return None;
    }
    let point = DVec3::from_array(hemisphere.receiver.point.map(f64::from));
    let corners = triangles.corners(TriangleId(id)).map(|corner| DVec3::from_array(corner.map(f64::from)));
    let edges = [0, 1, 2].map(|k| corners[(k + 1) % 3] - corners[k]);
    let lengths = edges.map(DVec3::length);
    let is_near = |k: usize| edges[k].cross(point - corners[k]).length() < inset * lengths[k];
    let way = (corners[0] + corners[1] + corners[2]) / 3.0 - point;
    let (double_area, distance) = (edges[0].cross(edges[1]).length(), way.length());
    if !(0..3).any(is_near) || double_area == 0.0 || distance == 0.0 {
        return None;
    }
    let longest = lengths[0].max(lengths[1]).max(lengths[2]);
    let part = (3.0 * inset * longest / double_area).min(MOST_PART).min(MOST_WAY * inset / distance);
    Some(point + way * part)
}
