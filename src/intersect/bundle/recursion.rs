//! The recursion of bundles: lists of rays of one octant, and the parts of the objects that they may meet.
//!
//! See [`crate::intersect::bundle`] for what is done, and why so.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011, Algorithm 1.

use std::ops::Range;

use fearless_simd::{dispatch, mask16x8, prelude::*, u16x8};

use crate::geometry::ray::Ray;
use crate::intersect::bundle::Objects;
use crate::intersect::bundle::cull_space::{CulledRay, Parameter, planes};
use crate::intersect::bundle::lazy_bvh::{Child, Group, Part};
use crate::intersect::bundle::leaf::GroupTriangles;
use crate::intersect::bundle::pairs;
use crate::intersect::bundle::pairs::{Pairs, Verdicts};
use crate::intersect::bundle::shaft::Shaft;
use crate::intersect::ray_set::{Nearest, Probes};
use crate::simd::lanes::{Boxes, LANES, bits};
use crate::stats::Stats;

/// The query that all windows share.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) objects: &'a Objects<'a>,
    pub(crate) probes: Probes<'a>,
    pub(crate) any: bool,
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
    /// One step of the recursion: a list of rays, and objects that they may meet. Further lists go to places from `free` on.
    pub(crate) fn descend(&mut self, part: &Part, list: Range<usize>, free: usize) {
        let objects = self.query.objects;
        let division = objects.divided.division(part);
        self.stats.nodes += 1;
        let stride = list.len() + LANES;
        let end = free + LANES * stride;
        if self.lists.len() < end {
            self.lists.resize(end, 0);
        }
        let counts = dispatch!(objects.level, simd => self.distribute(simd, &division.boxes, list, free));
        let (near_first, kept) = self.shaft.near_first(&division.boxes, &counts);
        near_first[..kept].iter().for_each(|&lane| division.child(lane).prefetch());
        for &lane in &near_first[..kept] {
            let start = free + lane * stride;
            let list = start..start + counts[lane];
            match division.child(lane) {
                Child::Part(part) => self.descend(part, list, end),
                Child::Group(group) => {
                    let middle = division.boxes.centre(lane);
                    dispatch!(objects.level, simd => self.leaf(simd, (group, middle), list));
                }
            }
        }
        while self.pairs.len() > 0 {
            dispatch!(objects.level, simd => self.test_pairs(simd));
        }
    }

    /// Asks the shaft, then each ray of a list, which of eight boxes it may meet, and lists the rays of each box from a place on. Returns
    /// their numbers.
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

    /// "DirectlyIntersect": a group of triangles against the rays of a list.
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, (group, middle): (&Group, [f32; 3]), list: Range<usize>) {
        let set_up = GroupTriangles::new(simd, group, middle);
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

    /// Counts the pairs of the rays of a list with a group: apart from the kernel, where few ask for it.
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
        let Query { objects, probes, any, .. } = *self.query;
        let (rays, ids, count) = self.pairs.take();
        self.stats.doubtful_samples += count as u64;
        let mut verdicts = Verdicts::NONE;
        let eight = rays.map(|ray| &self.exact[ray as usize]);
        if probes.are_rays() {
            let mut nearest = [0.0; LANES];
            for (nearest, &ray) in nearest.iter_mut().zip(&rays) {
                *nearest = self.found[ray as usize].nearest.hi;
            }
            verdicts = pairs::filter(simd, objects.triangles, &eight, &ids, (&nearest, probes.ties()));
        }
        for lane in bits(verdicts.possible & ((1 << count) - 1)) {
            let culled = &mut self.rays[rays[lane] as usize];
            let found = &mut self.found[rays[lane] as usize];
            if any && found.nearest.is_hit() {
                continue;
            }
            let (ray, triangle) = ((culled.probe, eight[lane]), (ids[lane], verdicts.known(lane)));
            if probes.test_known(ray, triangle, objects.triangles, &mut found.nearest, self.stats) {
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
