//! Arbitrary rays, in bundles: rays and objects divided together, with one bound for many rays.
//!
//! ```text
//! for each chunk of consecutive rays, in parallel: order them by their origins
//! for each stream of these:
//!     cut the rays to the scene; sort them by the octant of their direction
//!     for each octant: descend(rays, all objects)
//!
//! descend(rays, objects):
//!     keep the parts of the objects, eight, that the shaft of the rays may meet
//!     ask each ray which of these it may meet, and list it there
//!     for each part, near ones first: descend(its list, part); eight triangles are a leaf
//! ```
//!
//! A stream has thousands of rays, so that what is prepared for a part, boxes and triangles, serves many. A part is
//! divided when the first rays enter it, see [`crate::intersect::bundle::lazy_bvh`]. The lists of rays are indices on a
//! stack. All rays of a list have one octant: for them the planes of a box that come first are the same, and so is the
//! order of the parts.
//!
//! Measured with 2 million diffuse-bounce rays: with the runs of [`crate::objects::runs`] a ray asked 47 nodes and was
//! tested with 48 times eight triangles (sponza), 16 and 16 (koala); with [`crate::intersect::bundle::lazy_bvh`] it is
//! 12 and 3.7, 8 and 2.3. A ray goes on into 1.6 of a part's eight. Lists are made eight rays at a time: their answers
//! are a matrix of bits, transposed, and each row compresses the eight numbers. Ray by ray that took 1.2 times the time
//! of the whole, most of it for branches guessed wrong. Pairs that the filter of a leaf lets pass wait until they are
//! eight ([`crate::intersect::bundle::pairs`]): one by one, in f64, they took a third.
//!
//! A quarter of the time is waiting for memory: parts, triangles and rays are asked for ahead (0.91 of the time).
//!
//! Streams of 2¹² to 2¹⁴ rays take the same time; ones of 2¹⁶ a fifth more. Tried and dropped: streams of one octant,
//! of rays from a larger place, meet half as many parts and triangles, but take longer (1.0 to 1.15): their rays are
//! read from farther away. Asking ahead for the vertices of pairs (1.03); rays of 32 bytes for boxes apart from those
//! for triangles (1.0); parts in the order in which the rays of a list enter them on average (1.0); two rays at a time
//! in the leaf, in vectors of sixteen lanes, with errors that their box bounds (0.99 on Zen 5, whose vectors are that
//! wide). On SSE2 alone, without a byte shuffle to compress with, lists and pairs made eight at a time are slower than
//! one by one: 1.13 (sponza) to 1.25 times (koala) the whole.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1; Rasmus Barringer and Tomas Akenine-Möller, "Dynamic Ray Stream Traversal", 2014
//! (lists of rays per node); Alexander Reshetov, Alexei Soupikov, Jim Hurley, "Multi-Level Ray Tracing Algorithm", 2005
//! (one bound for many rays).

pub(crate) mod cull_space;
pub(crate) mod eight_rays;
pub(crate) mod lazy_bvh;
pub(crate) mod leaf;
pub(crate) mod order;
pub(crate) mod pairs;
pub(crate) mod sah;
pub(crate) mod shaft;
pub(crate) mod stream;

use std::ops::Range;

use fearless_simd::{Level, dispatch, mask16x8, prelude::*, u16x8};

use crate::geometry::ray::Ray;
use crate::intersect::bundle::cull_space::{CulledRay, Parameter, planes};
use crate::intersect::bundle::lazy_bvh::{Child, EightTriangles, LazyBvh, Part};
use crate::intersect::bundle::leaf::EightLoaded;
use crate::intersect::bundle::pairs::{Pairs, Verdicts};
use crate::intersect::bundle::shaft::Shaft;
use crate::intersect::ray_set::{Nearest, Question};
use crate::objects::boxes::Boxes;
use crate::simd::lanes::{LANES, bits};
use crate::stats::Stats;

/// The query that all streams share.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) question: Question<'a>,
    pub(crate) objects: &'a LazyBvh<'a>,
    pub(crate) level: Level,
    /// Whether the pairs of each ray are counted.
    pub(crate) counts: bool,
}

/// What a ray has found, and how its t is seen in the culling space.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    pub(crate) nearest: Nearest,
    pub(crate) parameter: Parameter,
}

/// Rays of one octant.
pub(crate) struct Bundle<'a> {
    pub(crate) query: &'a Query<'a>,
    pub(crate) octant: usize,
    pub(crate) shaft: Shaft,
    pub(crate) rays: &'a mut [CulledRay],
    pub(crate) exact: &'a [Ray],
    pub(crate) found: &'a mut [Found],
    /// Pairs of each ray; empty where nobody counts them.
    pub(crate) tested: &'a mut [u32],
    pub(crate) lists: &'a mut Vec<u16>,
    pub(crate) pairs: Pairs,
    pub(crate) stats: &'a mut Stats,
}

impl Bundle<'_> {
    /// One step of the recursion: a list of rays, and objects that they may meet. Further lists go to places from
    /// `free` on.
    pub(crate) fn descend(&mut self, part: &Part, list: Range<usize>, free: usize) {
        let Query { objects, level, .. } = *self.query;
        let division = objects.division(part);
        self.stats.nodes += 1;
        let stride = list.len() + LANES;
        let end = free + LANES * stride;
        if self.lists.len() < end {
            self.lists.resize(end, 0);
        }
        let counts = dispatch!(level, simd => self.distribute(simd, &division.boxes, list, free));
        let (near_first, kept) = self.shaft.near_first(&division.boxes, &counts);
        near_first[..kept].iter().for_each(|&lane| division.child(lane).prefetch());
        for &lane in &near_first[..kept] {
            let start = free + lane * stride;
            let list = start..start + counts[lane];
            match division.child(lane) {
                Child::Part(part) => self.descend(part, list, end),
                Child::Triangles(eight) => {
                    let middle = division.boxes.centre(lane);
                    dispatch!(level, simd => self.leaf(simd, (eight, middle), list));
                }
            }
        }
        while self.pairs.len() > 0 {
            dispatch!(level, simd => self.test_pairs(simd));
        }
    }

    /// Asks the shaft, then each ray of a list, which of eight boxes it may meet, and lists the rays of each box from a
    /// place on. Returns their numbers.
    #[inline(always)]
    fn distribute<S: Simd>(
        &mut self,
        simd: S,
        boxes: &Boxes,
        list: Range<usize>,
        free: usize,
    ) -> [usize; LANES] {
        let mut counts = [0; LANES];
        let planes = planes(simd, boxes, self.octant);
        let of_shaft = self.shaft.meets(simd, &planes);
        self.stats.frustum_tests += LANES as u64;
        if of_shaft == 0 {
            return counts;
        }
        self.stats.box_tests += (list.len() * LANES) as u64;
        let stride = list.len() + LANES;
        let (lists, free) = self.lists.split_at_mut(free);
        for rays in lists[list].chunks(LANES) {
            let (mut eight, mut met) = ([0; LANES], 0);
            for (place, &ray) in rays.iter().enumerate() {
                eight[place] = ray;
                met |= self.rays[ray as usize].meets(&planes) << (place * LANES);
            }
            let eight = u16x8::load_array(simd, eight);
            for (lane, rays) in transposed_bits(met).to_le_bytes().into_iter().enumerate() {
                let those = eight.compress(mask16x8::from_bitmask(simd, u64::from(rays)));
                those.store_slice(&mut free[lane * stride + counts[lane]..][..LANES]);
                counts[lane] += rays.count_ones() as usize;
            }
        }
        counts
    }

    /// "DirectlyIntersect": eight triangles against the rays of a list.
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, (eight, middle): (&EightTriangles, [f32; 3]), list: Range<usize>) {
        let set_up = EightLoaded::new(simd, eight, middle);
        self.stats.triangles_set_up += LANES as u64;
        self.stats.samples_tested += (list.len() * LANES) as u64;
        if self.query.counts {
            self.count(list.clone());
        }
        for place in list {
            let ray = self.lists[place];
            let candidates = set_up.candidates(&self.rays[ray as usize]);
            self.pairs.push(simd, u32::from(ray), set_up.ids, candidates);
            if self.pairs.len() >= LANES {
                self.test_pairs(simd);
            }
        }
    }

    /// Counts the pairs of the rays of a list with eight triangles: apart from the kernel, where few ask for it.
    #[cold]
    fn count(&mut self, list: Range<usize>) {
        for &ray in &self.lists[list] {
            let tested = &mut self.tested[ray as usize];
            *tested = tested.saturating_add(LANES as u32);
        }
    }

    /// Tests up to eight pairs of rays and triangles.
    #[inline(always)]
    fn test_pairs<S: Simd>(&mut self, simd: S) {
        let Question { triangles, set, any } = self.query.question;
        let (rays, ids, count) = self.pairs.take();
        self.stats.doubtful_samples += count as u64;
        let mut verdicts = Verdicts::NONE;
        let eight = rays.map(|ray| &self.exact[ray as usize]);
        if set.are_rays() {
            let mut nearest = [0.0; LANES];
            for (nearest, &ray) in nearest.iter_mut().zip(&rays) {
                *nearest = self.found[ray as usize].nearest.hi;
            }
            verdicts = pairs::filter(simd, triangles, &eight, &ids, (&nearest, set.ties()));
        }
        for lane in bits(verdicts.possible & ((1 << count) - 1)) {
            let culled = &mut self.rays[rays[lane] as usize];
            let found = &mut self.found[rays[lane] as usize];
            if any && found.nearest.is_hit() {
                continue;
            }
            let (ray, triangle) = ((culled.number, eight[lane]), (ids[lane], verdicts.known(lane)));
            if set.test_known(ray, triangle, triangles, &mut found.nearest, self.stats) {
                culled.t_max = if any { -1.0 } else { found.parameter.upper(found.nearest.hi) };
            }
        }
    }
}

/// A matrix of 8×8 bits, one row per byte, transposed.
///
/// Based on: Henry Warren, "Hacker's Delight", 2002, section 7-3.
#[inline(always)]
fn transposed_bits(mut rows: u64) -> u64 {
    for (distance, upper) in
        [(7, 0x00AA_00AA_00AA_00AA), (14, 0x0000_CCCC_0000_CCCC), (28, 0x0000_0000_F0F0_F0F0)]
    {
        let swapped = (rows ^ (rows >> distance)) & upper;
        rows ^= swapped ^ (swapped << distance);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::transposed_bits;

    #[test]
    fn rows_become_columns() {
        for bit in 0..64 {
            assert_eq!(transposed_bits(1 << bit), 1 << (bit % 8 * 8 + bit / 8), "{bit}");
        }
        assert_eq!(transposed_bits(0x0123_4567_89AB_CDEF).count_ones(), 32);
    }
}
