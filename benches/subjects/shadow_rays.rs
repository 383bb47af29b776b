//! The rays of an exact shadow for engines that take single rays or packets: from the light to each receiver.
//!
//! Receivers that are seen through neighbouring pixels follow each other: blocks of 4x4 pixels, row of blocks by row of
//! blocks, each in rows of 4, so that a block of 4x2 is one half of it. A block has as many points as it has receivers.
//!
//! A ray ends at [`EPSILON`] of its length before the point, lest it hit the surface that the point lies on.
//!
//! Tried with Embree on koala and sponza: rays from the point to the light, and packets that are filled up across blocks.
//! Neither was faster by more than the noise; rays from the point took up to an eighth longer on sponza.
//!
//! Based on: Matt Pharr, Wenzel Jakob, Greg Humphreys, "Physically Based Rendering" (shadow rays go 1 − 0.0001 of the way).

use rayon::prelude::*;

use crate::subjects::answer::Blocked;

/// What is left out at a ray's end, in parts of its length: that of pbrt.
pub(crate) const EPSILON: f32 = 1e-4;

/// Pixels along the side of a block.
const SIDE: u32 = 4;

/// Blocks that one task takes.
const BLOCKS_OF_TASK: usize = 128;

/// Points that may be in the shadow of one light, block by block.
#[derive(Debug, Clone)]
pub(crate) struct ShadowRays {
    pub(crate) light: [f32; 3],
    points: Vec<[f32; 3]>,
    /// The place of each point among umbel's receivers.
    order: Vec<u32>,
    /// Where each block of 4x2 pixels begins, and the end.
    halves: Vec<usize>,
    /// Where each block of 4x4 pixels begins, and the end.
    wholes: Vec<usize>,
}

/// Some whole blocks, for one task.
#[derive(Debug)]
pub(crate) struct Blocks<'a> {
    points: &'a [[f32; 3]],
    blocked: &'a mut [bool],
    /// Where each block begins, and the end.
    starts: &'a [usize],
}

impl ShadowRays {
    /// Puts points in order that are seen through pixels of a picture.
    pub(crate) fn new(light: [f32; 3], points: &[[f32; 3]], pixels: &[u32], width: u32) -> Self {
        let place = |k: u32| {
            let (x, y) = (pixels[k as usize] % width, pixels[k as usize] / width);
            (y / SIDE, x / SIDE, y % SIDE, x % SIDE)
        };
        // In range: a picture has fewer than 2³² pixels.
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        order.par_sort_unstable_by_key(|&k| place(k));
        let half = |k: u32| {
            let (below, right, row, _) = place(k);
            (below, right, row / 2)
        };
        let whole = |k: u32| {
            let (below, right, ..) = place(k);
            (below, right)
        };
        let (halves, wholes) = (starts(&order, half), starts(&order, whole));
        let points = order.iter().map(|&k| points[k as usize]).collect();
        Self { light, points, order, halves, wholes }
    }

    /// The number of points.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Takes over what umbel found of its receivers.
    pub(crate) fn put_in_order(&self, shadowed: &[bool], answer: &mut Blocked) {
        for (blocked, &k) in answer.0.iter_mut().zip(&self.order) {
            *blocked = shadowed[k as usize];
        }
    }

    /// Lets all threads fill blocks of 4 x `rows` pixels, 2 or 4.
    pub(crate) fn trace_blocks(
        &self,
        rows: usize,
        answer: &mut Blocked,
        trace: impl Fn(Blocks<'_>) + Sync + Send,
    ) {
        let starts = if rows == 2 { &self.halves } else { &self.wholes };
        let mut rest = &mut answer.0[..];
        let mut tasks = Vec::new();
        for first in (0..starts.len() - 1).step_by(BLOCKS_OF_TASK) {
            let starts = &starts[first..starts.len().min(first + BLOCKS_OF_TASK + 1)];
            let (begin, end) = (starts[0], starts[starts.len() - 1]);
            let blocked = rest.split_off_mut(..end - begin).unwrap_or_default();
            tasks.push(Blocks { points: &self.points[begin..end], blocked, starts });
        }
        tasks.into_par_iter().with_max_len(1).for_each(trace);
    }

    /// Lets all threads trace single rays, block by block. `is_blocked` is asked of each point.
    pub(crate) fn trace_singly(&self, answer: &mut Blocked, is_blocked: impl Fn([f32; 3]) -> bool + Sync) {
        self.trace_blocks(SIDE as usize, answer, |blocks| {
            for (&point, blocked) in blocks.points.iter().zip(blocks.blocked) {
                *blocked = is_blocked(point);
            }
        });
    }
}

impl Blocks<'_> {
    /// Lets the points of each block be traced together, and their answers be written.
    #[inline]
    pub(crate) fn for_each(self, mut trace: impl FnMut(&[[f32; 3]], &mut [bool])) {
        let begin = self.starts[0];
        for bounds in self.starts.windows(2) {
            let block = bounds[0] - begin..bounds[1] - begin;
            trace(&self.points[block.clone()], &mut self.blocked[block]);
        }
    }
}

/// Where each run of equal keys begins, and the end.
fn starts<K: PartialEq>(order: &[u32], key: impl Fn(u32) -> K) -> Vec<usize> {
    let begins = |k: &usize| *k == 0 || key(order[*k]) != key(order[*k - 1]);
    let mut starts: Vec<usize> = (0..order.len()).filter(begins).collect();
    starts.push(order.len());
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 6 x 5 pixels, every other pixel of which sees a receiver.
    fn chequered() -> (ShadowRays, Vec<u32>) {
        let pixels: Vec<u32> = (0..30).filter(|pixel| (pixel % 6 + pixel / 6) % 2 == 0).rev().collect();
        let points: Vec<[f32; 3]> = pixels.iter().map(|&pixel| [pixel as f32, 0.0, 0.0]).collect();
        (ShadowRays::new([0.0; 3], &points, &pixels, 6), pixels)
    }

    #[test]
    fn blocks_hold_neighbours() {
        let (rays, _) = chequered();
        for (rows, sizes) in [(4, vec![8, 4, 2, 1]), (2, vec![4, 4, 2, 2, 2, 1])] {
            let mut answer = Blocked(vec![false; rays.len()]);
            let found = std::sync::Mutex::new(Vec::new());
            rays.trace_blocks(rows, &mut answer, |blocks| {
                blocks.for_each(|points, _| found.lock().expect("a lock").push(points.len()));
            });
            assert_eq!(found.into_inner().expect("a lock"), sizes);
        }
    }

    #[test]
    fn answers_have_one_order() {
        let (rays, pixels) = chequered();
        let (mut umbel, mut other) = (Blocked(vec![false; 15]), Blocked(vec![false; 15]));
        let shadowed: Vec<bool> = pixels.iter().map(|&pixel| pixel > 11).collect();
        rays.put_in_order(&shadowed, &mut umbel);
        rays.trace_singly(&mut other, |point| point[0] > 11.0);
        assert_eq!(umbel, other);
    }
}
