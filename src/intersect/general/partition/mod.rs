//! How the general path divides objects: the heuristics of the paper, and one that came after it.
//!
//! | partition | objects | what decides |
//! |---|---|---|
//! | middle | in place | the middle of the longest side of their box |
//! | given | as they are | the ends of groups, within a group the middle of its order: [`crate::intersect::general::partition::given`] |
//! | spatial | referenced by each voxel that their boxes meet | the middle of the longest side of the voxel |
//! | sampled | in place | what a sample of the active rays meets |
//!
//! Where given or spatial halves do not help, the middle takes over: for what is given, from there on.
//!
//! Hits are ordered by (t, id), which is total: the order of work, and testing a pair twice, change no hit.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011; Kosuke Nabata, Kei Iwasaki, Yoshinori Dobashi, Tomoyuki Nishita, "Efficient Divide-And-Conquer Ray
//! Tracing using Ray Sampling", 2013.

pub(crate) mod given;
pub(crate) mod middle;
pub(crate) mod sampled;
pub(crate) mod spatial;

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::general::active::Active;
use crate::intersect::general::partition::sampled::{Sampled, SampledSplit};
use crate::intersect::general::partition::spatial::{Halves, Ledger};
use crate::options::Partition;
use crate::stats::Stats;

/// How objects are divided.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Partitioner<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) partition: Partition,
    /// Of the voxels.
    pub(crate) ledger: &'a Ledger,
}

/// Two parts of some objects: left and right.
#[derive(Debug)]
pub(crate) struct Parts<'o> {
    lists: Lists<'o>,
    /// The boxes of the parts.
    pub(crate) bounds: [Aabb; 2],
    /// The axis along which the parts lie one behind the other.
    pub(crate) axis: usize,
    /// Whether the left part has the lesser coordinates.
    pub(crate) ascending: bool,
    /// What a sample of the rays says.
    pub(crate) sampled: Option<Sampled>,
    /// How the parts are divided.
    pub(crate) partition: Partition,
}

/// The objects of two parts.
#[derive(Debug)]
enum Lists<'o> {
    /// Where they were.
    InPlace([&'o mut [u32]; 2]),
    /// In lists of their own: some are in both.
    Voxels(Box<Halves<'o>>),
}

impl Parts<'_> {
    /// The objects of both parts.
    pub(crate) fn objects(&mut self) -> [&mut [u32]; 2] {
        match &mut self.lists {
            Lists::InPlace([left, right]) => [left, right],
            Lists::Voxels(halves) => {
                let [left, right] = &mut halves.lists;
                [left, right]
            }
        }
    }
}

impl<'a> Partitioner<'a> {
    /// Divides objects within a box, as the active rays meet them; both parts hold some.
    pub(crate) fn partition<'o>(
        &self,
        rays: &[Active],
        objects: &'o mut [u32],
        bounds: &Aabb,
        stats: &mut Stats,
    ) -> Parts<'o>
    where
        'a: 'o,
    {
        match self.partition {
            Partition::Middle => {}
            // As they are given they stay: their ids are consecutive.
            Partition::Given => {
                let left = given::half(self.triangles.group_ends(), objects[0], objects.len());
                let boxes = self.boxes(objects, left, bounds);
                if !given::separates(bounds, &boxes, [left, objects.len() - left]) {
                    return Self { partition: Partition::Middle, ..*self }
                        .partition(rays, objects, bounds, stats);
                }
                let (axis, ascending) = given::order(&boxes);
                return Parts { ascending, ..self.in_place(objects, left, axis, boxes) };
            }
            Partition::Spatial => {
                if let Some(halves) = Halves::new(self.triangles, objects, bounds, self.ledger) {
                    stats.references_made += halves.references();
                    let (bounds, axis) = (halves.bounds, halves.axis);
                    let lists = Lists::Voxels(Box::new(halves));
                    return Parts {
                        lists,
                        bounds,
                        axis,
                        ascending: true,
                        sampled: None,
                        partition: self.partition,
                    };
                }
            }
            Partition::Sampled => {
                if let Some(SampledSplit { left, axis, sampled, rays }) =
                    sampled::split(self.triangles, rays, objects)
                {
                    stats.rays_sampled += rays as u64;
                    let boxes = self.boxes(objects, left, bounds);
                    return Parts { sampled: Some(sampled), ..self.in_place(objects, left, axis, boxes) };
                }
            }
        }
        let (left, axis) = middle::split(self.triangles, objects, bounds);
        let boxes = self.boxes(objects, left, bounds);
        self.in_place(objects, left, axis, boxes)
    }

    /// The boxes of the first objects and of the others; in a voxel, only what lies within it.
    fn boxes(&self, objects: &[u32], left: usize, bounds: &Aabb) -> [Aabb; 2] {
        let (left, right) = objects.split_at(left);
        [left, right].map(|side| bounds_of(self.triangles, side).common(*bounds))
    }

    /// Parts of objects that stay where they are.
    fn in_place<'o>(&self, objects: &'o mut [u32], left: usize, axis: usize, bounds: [Aabb; 2]) -> Parts<'o> {
        let lists = Lists::InPlace(objects.split_at_mut(left).into());
        Parts { lists, bounds, axis, ascending: true, sampled: None, partition: self.partition }
    }
}

/// The box of some triangles.
pub(crate) fn bounds_of(triangles: &Triangles<'_>, objects: &[u32]) -> Aabb {
    objects.iter().fold(Aabb::EMPTY, |bounds, &id| bounds.union(triangles.bounds(id)))
}
