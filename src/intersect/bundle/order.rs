//! The order of arbitrary rays: by where they begin, along Lebesgue's (Morton's) curve over the scene.
//!
//! Rays of a stream then go through the same parts of the scene, whatever order they were given in. They are ordered in
//! chunks, each by one thread, so that what is read at random stays in the cache. Of 2 million diffuse-bounce rays in
//! the order of a picture, streams meet 0.54 (sponza) to 0.6 (koala, chess) as many nodes, which pays for the ordering
//! and no more; in a random order, the time is 0.8 of what it was. Origins outside the scene count for the cells at its
//! border.
//!
//! All rays at once, by [`crate::objects::morton`], are no faster: what is saved goes into reading rays at random, and
//! into the pages of 16 bytes a ray. Chunks of 2¹⁵ gain half as much in a random order.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966; Bochang Moon et al., "Cache-Oblivious Ray
//! Reordering", 2010.

use std::ops::Range;

use fearless_simd::prelude::*;

use crate::intersect::bundle::cull_space::{CullingSpace, OCTANTS, octant};
use crate::intersect::ray_set::{A_RAY, RaySet};
use crate::objects::{gather, morton};
use crate::simd::lanes::LANES;

/// The most rays that are ordered together.
pub(crate) const CHUNK: usize = 1 << 17;
/// Cells along each axis.
const SIDE: u32 = 16;
/// Cells.
const CELLS: usize = (SIDE * SIDE * SIDE) as usize;
/// The place of the octant in an entry, above the number of the ray in its chunk.
const OCTANT: u32 = 24;

/// A ray of a chunk, and its octant.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Entry(u32);

impl Entry {
    /// The number of the ray, given the first one of its chunk.
    pub(crate) fn number(self, first: u32) -> u32 {
        first + (self.0 & ((1 << OCTANT) - 1))
    }

    /// The octant.
    pub(crate) fn octant(self) -> usize {
        (self.0 >> OCTANT) as usize
    }
}

/// What a thread keeps from chunk to chunk.
#[derive(Debug, Default)]
pub(crate) struct RayOrder {
    /// The cell and the octant of each ray of a chunk.
    keys: Vec<u16>,
    /// The rays in order.
    entries: Vec<Entry>,
}

impl RayOrder {
    /// Orders the rays of a part of a set, at most [`CHUNK`]. O(n).
    #[inline(always)]
    pub(crate) fn of<S: Simd>(
        &mut self,
        simd: S,
        set: &RaySet<'_>,
        chunk: Range<u32>,
        space: &CullingSpace,
    ) -> &[Entry] {
        let mut next = [0_u32; CELLS];
        self.keys.clear();
        for first in chunk.clone().step_by(LANES) {
            let count = LANES.min((chunk.end - first) as usize);
            let mut eight = [first; LANES];
            (0..count).zip(first..).for_each(|(lane, number)| eight[lane] = number);
            let mut made = [A_RAY; LANES];
            let rays = set.eight(eight, &mut made);
            let origins = rays.map(|ray| ray.origin.as_vec3().to_array());
            for (&cell, ray) in cells(simd, &origins, space).iter().zip(rays).take(count) {
                next[cell as usize % CELLS] += 1;
                // In range: there are 2¹² cells, and eight octants.
                self.keys.push((cell as usize * OCTANTS + octant(ray.direction)) as u16);
            }
        }
        let mut sum = 0;
        for next in &mut next {
            sum += std::mem::replace(next, sum);
        }
        self.entries.resize(self.keys.len(), Entry::default());
        for (index, &key) in (0..).zip(&self.keys) {
            let place = &mut next[usize::from(key) / OCTANTS % CELLS];
            self.entries[*place as usize] = Entry((u32::from(key) % OCTANTS as u32) << OCTANT | index);
            *place += 1;
        }
        &self.entries
    }

    /// Bytes for a chunk of so many rays.
    pub(crate) fn bytes_for(rays: usize) -> usize {
        rays * (size_of::<u16>() + size_of::<Entry>())
    }
}

/// The cells of eight origins, numbered along the curve.
#[inline(always)]
fn cells<S: Simd>(simd: S, origins: &[[f32; 3]; LANES], space: &CullingSpace) -> [u32; LANES] {
    let mut cells = gather::transposed_points(simd, origins);
    let half = SIDE as f32 * 0.5;
    for (k, x) in cells.iter_mut().enumerate() {
        *x = space.coordinate(*x, k) * half + half;
    }
    morton::numbers(simd, cells, SIDE - 1)
}
