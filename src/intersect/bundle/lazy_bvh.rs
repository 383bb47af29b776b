//! A tree of boxes over the objects, for arbitrary rays: nodes of eight, built lazily where rays enter, dropped with
//! the query.
//!
//! It is a bounding volume hierarchy, of which only what rays enter exists, and nothing after the last ray: 63 bytes a
//! triangle where rays enter all of it. The other paths have none: pencils keep 6 bytes a triangle.
//!
//! Objects are one part. When rays first enter a part, it is divided into up to eight,
//! [`crate::intersect::bundle::sah`]: boxes that rays are asked about together, and behind each a part of its own or up
//! to eight triangles, a leaf. What no ray enters is never divided. A division lasts as long as the query, for the
//! streams of rays that come later; many objects are divided before the first ray comes, by all threads.
//!
//! Rays on other threads that enter a part while it is being divided wait for it.
//!
//! Children that are alike in capacity, so that a node's place tells all and nothing points anywhere, cost rays 1.4
//! (sponza), 1.0 (koala) and 1.6 times (chess) as many nodes, and 1.2, 1.1 and 1.7 times as many leaves.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (objects are divided where rays are); Timothy Kay and James Kajiya, "Ray Tracing Complex Scenes",
//! 1986 (boxes).

use std::mem::size_of;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use fearless_simd::{Level, dispatch, prelude::*};
use prefetch_index::prefetch_index;
use rayon::prelude::*;

use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::cull_space::CullingSpace;
use crate::intersect::bundle::sah::{FANOUT, MANY, Section, divide};
use crate::objects::boxes::Boxes;
use crate::objects::gather::eight_corners;
use crate::objects::split::Item;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::{LANES, Narrow};

/// Divisions on the way from all objects to a part; deeper ones are by number alone. Real scenes have ten.
const DEEP: u32 = 40;

/// Eight triangles in the culling space. Lanes without one repeat another.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct EightTriangles {
    /// The corners a.
    pub(crate) a: [[f32; LANES]; 3],
    /// b − a.
    pub(crate) e1: [[f32; LANES]; 3],
    /// c − a.
    pub(crate) e2: [[f32; LANES]; 3],
    /// [`NO_TRIANGLE`] for none.
    pub(crate) ids: [u32; LANES],
}

/// Objects that are divided when rays first enter them.
#[derive(Debug)]
pub(crate) struct Part {
    /// None, once they are divided.
    undivided: Mutex<Vec<Item>>,
    division: OnceLock<Box<Division>>,
    depth: u32,
}

/// A division of objects.
#[derive(Debug)]
pub(crate) struct Division {
    /// Of the parts, then of the leaves, in the culling space.
    pub(crate) boxes: Boxes,
    parts: Box<[Part]>,
    leaves: Box<[EightTriangles]>,
}

/// What stands behind a box.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Child<'a> {
    /// More objects than a leaf has.
    Part(&'a Part),
    /// Up to eight triangles.
    Triangles(&'a EightTriangles),
}

/// Triangles, divided by cost where rays enter.
#[derive(Debug)]
pub(crate) struct LazyBvh<'a> {
    triangles: &'a Triangles<'a>,
    space: CullingSpace,
    level: Level,
    all: Part,
    /// Bytes of divisions.
    bytes: AtomicUsize,
    /// Objects that are not in leaves.
    undivided: AtomicUsize,
}

impl<'a> LazyBvh<'a> {
    /// All triangles. O(n log n) for them and the rays together.
    pub(crate) fn new(triangles: &'a Triangles<'a>, space: CullingSpace, level: Level) -> Self {
        // In range: there are fewer than 2³² triangles.
        let ids = (0..triangles.len() as u32).into_par_iter().with_min_len(MANY);
        let items: Vec<Item> = ids.map(|id| Item::new(&space.aabb(&triangles.bounds(id)), id)).collect();
        let undivided = AtomicUsize::new(items.len());
        let divided =
            Self { triangles, space, level, all: Part::new(items, 0), bytes: AtomicUsize::new(0), undivided };
        divided.divide_early(&divided.all, triangles.len());
        divided
    }

    /// The part of all objects.
    pub(crate) fn all(&self) -> &Part {
        &self.all
    }

    /// The division of a part: made now, unless rays were here before.
    #[inline]
    pub(crate) fn division<'b>(&self, part: &'b Part) -> &'b Division {
        part.division.get_or_init(|| self.divide(part))
    }

    /// Divides a part of so many objects, and its parts, by all threads.
    fn divide_early(&self, part: &Part, objects: usize) {
        if objects > MANY {
            self.division(part).parts.par_iter().for_each(|part| {
                let objects = part.lock().len();
                self.divide_early(part, objects);
            });
        }
    }

    #[cold]
    fn divide(&self, part: &Part) -> Box<Division> {
        let mut items = std::mem::take(&mut *part.lock());
        let sections =
            if items.is_empty() { Vec::new() } else { divide(self.level, &mut items, part.depth >= DEEP) };
        let division = dispatch!(self.level, simd => self.divided(simd, &items, &sections, part.depth + 1));
        let leaves = division.leaves.len() * size_of::<EightTriangles>();
        let parts = division.parts.len() * size_of::<Part>();
        self.bytes.fetch_add(size_of::<Division>() + leaves + parts, Ordering::Relaxed);
        Box::new(division)
    }

    #[inline(always)]
    fn divided<S: Simd>(&self, simd: S, items: &[Item], sections: &[Section], depth: u32) -> Division {
        let (mut boxes, mut lane) = (Boxes::EMPTY, 0);
        let (mut parts, mut leaves, mut in_leaves) = (Vec::new(), Vec::new(), 0);
        let are_parts = sections.iter().filter(|section| section.objects.len() > FANOUT);
        let are_leaves = sections.iter().filter(|section| section.objects.len() <= FANOUT);
        for section in are_parts.chain(are_leaves) {
            let items = &items[section.objects.clone()];
            boxes.set(lane, &section.bounds);
            lane += 1;
            if items.len() > FANOUT {
                parts.push(Part::new(items.to_vec(), depth));
            } else {
                leaves.push(EightTriangles::new(simd, self.triangles, &self.space, items));
                in_leaves += items.len();
            }
        }
        self.undivided.fetch_sub(in_leaves, Ordering::Relaxed);
        Division { boxes, parts: parts.into(), leaves: leaves.into() }
    }

    /// Bytes: what all objects took before they were divided, while their first parts were made, or what there is now.
    pub(crate) fn bytes(&self) -> usize {
        let undivided = self.undivided.load(Ordering::Relaxed) * size_of::<Item>();
        let first = 2 * self.triangles.len() * size_of::<Item>();
        first.max(self.bytes.load(Ordering::Relaxed) + undivided)
    }
}

impl Part {
    fn new(items: Vec<Item>, depth: u32) -> Self {
        Self { undivided: Mutex::new(items), division: OnceLock::new(), depth }
    }

    /// Nothing can go wrong while it is held.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Item>> {
        self.undivided.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Child<'_> {
    /// Has what is needed of it read into the cache, while something else is done.
    #[inline]
    pub(crate) fn prefetch(self) {
        match self {
            // The vectors that begin the five lines of a leaf.
            Self::Triangles(EightTriangles { a, e1, e2, .. }) => {
                let begins = [&a[0], &a[2], &e1[1], &e2[0], &e2[2]];
                begins.into_iter().for_each(|vector| prefetch_index(vector, 0));
            }
            Self::Part(part) => {
                if let Some(division) = part.division.get() {
                    let Boxes { lo, hi } = &division.boxes;
                    [&lo[0], &lo[2], &hi[1]].into_iter().for_each(|vector| prefetch_index(vector, 0));
                }
            }
        }
    }
}

impl Division {
    /// What stands behind a box that is not empty.
    #[inline]
    pub(crate) fn child(&self, lane: usize) -> Child<'_> {
        match self.parts.get(lane) {
            Some(part) => Child::Part(part),
            None => Child::Triangles(&self.leaves[lane - self.parts.len()]),
        }
    }
}

impl EightTriangles {
    /// One triangle or up to eight.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        triangles: &Triangles<'_>,
        space: &CullingSpace,
        items: &[Item],
    ) -> Self {
        let [mut a, mut e1, mut e2] = [[[0.0; LANES]; 3]; 3];
        let mut ids = [NO_TRIANGLE; LANES];
        let mut eight = [items[0].id(); LANES];
        for (lane, item) in items.iter().enumerate() {
            (ids[lane], eight[lane]) = (item.id(), item.id());
        }
        let corners = eight_corners(simd, triangles, &eight);
        for k in 0..3 {
            let corner = |corner: usize| Narrow::load_array_ref(simd, &corners[corner][k]);
            let from = space.coordinate(corner(0), k);
            a[k] = from.to_array();
            e1[k] = (space.coordinate(corner(1), k) - from).to_array();
            e2[k] = (space.coordinate(corner(2), k) - from).to_array();
        }
        Self { a, e1, e2, ids }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::aabb::Aabb;
    use crate::simd::isa::Isa;

    /// Small triangles at places of a sequence, and a few that are as large as all of them.
    fn scattered(count: u16, step: f32) -> Vec<[f32; 3]> {
        let corner = |i: u16, k: u16| {
            let place = |m: u16| f32::from(i * m % 101) * step;
            let size = if i.is_multiple_of(50) { 60.0 } else { 0.5 };
            [place(37) + f32::from(k) * size, place(17) + f32::from(k * k) * size, place(5)]
        };
        (0..count).flat_map(|i| (0..3).map(move |k| corner(i, k))).collect()
    }

    fn check(positions: &[[f32; 3]]) {
        let indices: Vec<[u32; 3]> =
            (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let triangles = Triangles::new(positions, &indices).expect("valid triangles");
        let space = CullingSpace::over(&triangles.position_bounds()).expect("a space");
        let level = Isa::Auto.level().expect("every machine has one");
        let divided = LazyBvh::new(&triangles, space, level);
        let mut seen = vec![0; triangles.len()];
        let mut parts = vec![(divided.all(), Aabb { lo: [-1.0; 3], hi: [1.0; 3] })];
        while let Some((part, around)) = parts.pop() {
            let division = divided.division(part);
            for lane in 0..LANES {
                let bounds = division.boxes.get(lane);
                if bounds.is_empty() {
                    continue;
                }
                assert_eq!(bounds.union(around), around, "{bounds:?} in {around:?}");
                match division.child(lane) {
                    Child::Triangles(eight) => {
                        for id in eight.ids.into_iter().filter(|&id| id != NO_TRIANGLE) {
                            seen[id as usize] += 1;
                            let own = space.aabb(&triangles.bounds(id));
                            assert_eq!(own.union(bounds), bounds, "triangle {id}");
                        }
                    }
                    Child::Part(part) => parts.push((part, bounds)),
                }
            }
        }
        assert!(seen.iter().all(|&count| count == 1), "each triangle stands in one leaf");
    }

    #[test]
    fn every_triangle_stands_in_one_leaf_and_all_boxes_around_it() {
        for count in [1, 8, 9, 64, 65, 999, 5000] {
            check(&scattered(count, 1.0));
        }
    }

    #[test]
    fn points_without_triangles_are_one_empty_leaf() {
        check(&[[0.0; 3], [1.0; 3]]);
    }

    #[test]
    fn triangles_at_one_place_are_divided_by_number() {
        check(&scattered(1000, 0.0));
        check(&vec![[1.0, 2.0, 3.0]; 3 * 300]);
    }
}
