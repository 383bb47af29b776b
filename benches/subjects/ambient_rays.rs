//! Ambient rays for engines that take single rays or packets: from receivers along directions that all of them share.
//!
//! Receivers follow Morton's curve. Which rays are above the horizon is given, as exact bits. A ray begins at [`EPSILON`] of the
//! scene's diagonal, lest it hit the surface that it leaves, and ends at the limit.

use rayon::prelude::*;
use umbel::Triangles;
use umbel::engine::{Hemisphere, OpenRays};
use umbel::glam::DVec3;

use crate::subjects::answer::OpenBits;
use crate::subjects::morton;

/// What is left out at a ray's beginning, in parts of the scene's diagonal.
pub(crate) const EPSILON: f64 = 1e-5;

/// Receivers that one task takes.
const RECEIVERS_OF_TASK: usize = 2048;

/// A point and a direction.
pub(crate) type Departure = ([f32; 3], [f32; 3]);

/// The rays of all receivers.
#[derive(Debug, Clone)]
pub(crate) struct AmbientRays {
    /// Of length 1 up to rounding.
    pub(crate) directions: Vec<[f32; 3]>,
    /// Where rays begin and end.
    pub(crate) interval: [f32; 2],
    points: Vec<[f32; 3]>,
    /// The place of each point among umbel's receivers.
    order: Vec<u32>,
    /// A bit for each direction of each point, 32 to a word.
    above: Vec<u32>,
    /// Words of a point.
    words: usize,
    len: usize,
}

/// Some receivers, for one task.
#[derive(Debug)]
pub(crate) struct Group<'a> {
    pub(crate) points: &'a [[f32; 3]],
    above: &'a [u32],
    open: &'a mut [u32],
    words: usize,
}

impl AmbientRays {
    /// Finds out which rays are above the horizon. The interval is in units of the scene.
    pub(crate) fn new(
        triangles: &Triangles<'_>,
        receivers: &[Hemisphere],
        directions: Vec<[f32; 3]>,
        interval: [f32; 2],
    ) -> Self {
        let points: Vec<[f32; 3]> = receivers.iter().map(|hemisphere| hemisphere.receiver.point).collect();
        let order = morton::order(&points);
        let points = order.iter().map(|&k| points[k as usize]).collect();
        let words = directions.len().div_ceil(32).max(1);
        let mut above = vec![0; receivers.len() * words];
        above.par_chunks_mut(words).zip(&order).for_each(|(bits, &k)| {
            for (n, direction) in directions.iter().enumerate() {
                let direction = DVec3::from_array(direction.map(f64::from));
                let is_above = receivers[k as usize].is_above(triangles, direction);
                bits[n / 32] |= u32::from(is_above) << (n % 32);
            }
        });
        let len = above.par_iter().map(|bits| bits.count_ones() as usize).sum();
        Self { directions, interval, points, order, above, words, len }
    }

    /// The number of rays above the horizon.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// An answer with no open rays.
    pub(crate) fn blank(&self) -> OpenBits {
        OpenBits { words: vec![0; self.above.len()], rays: self.len }
    }

    /// Takes over what umbel found of its receivers.
    pub(crate) fn put_in_order(&self, found: &OpenRays, answer: &mut OpenBits) {
        for (bits, &k) in answer.words.chunks_exact_mut(self.words).zip(&self.order) {
            bits.copy_from_slice(found.words(k as usize));
        }
    }

    /// Adds to each receiver, given its normal, the cosines of its open rays and those of all its rays.
    pub(crate) fn add_cosines(&self, answer: &OpenBits, normals: &[[f32; 3]], sums: &mut [[f64; 2]]) {
        let receivers = self.above.chunks_exact(self.words).zip(answer.words.chunks_exact(self.words));
        for ((above, open), &k) in receivers.zip(&self.order) {
            let normal = normals[k as usize];
            for ray in set_bits(above) {
                let direction = self.directions[ray];
                let cosine: f32 = (0..3).map(|axis| normal[axis] * direction[axis]).sum();
                let is_open = open[ray / 32] >> (ray % 32) & 1 == 1;
                let cosine = f64::from(cosine.max(0.0));
                sums[k as usize][0] += if is_open { cosine } else { 0.0 };
                sums[k as usize][1] += cosine;
            }
        }
    }

    /// How many rays are blocked in the first answer and open in the other, and some of them: points and directions.
    pub(crate) fn opened(&self, umbel: &OpenBits, other: &OpenBits, most: usize) -> (usize, Vec<Departure>) {
        let [_, count] = umbel.differences(other);
        let step = (count as usize).div_ceil(most).max(1);
        let pairs = umbel.words.chunks_exact(self.words).zip(other.words.chunks_exact(self.words));
        let of_point = |((umbel, other), &point): ((&[u32], &[u32]), &[f32; 3])| {
            let opened: Vec<u32> = umbel.iter().zip(other).map(|(umbel, other)| other & !umbel).collect();
            set_bits(&opened).map(|ray| (point, self.directions[ray])).collect::<Vec<_>>()
        };
        let some = pairs.zip(&self.points).flat_map(of_point).step_by(step).collect();
        (count as usize, some)
    }

    /// Lets all threads trace groups of neighbours.
    pub(crate) fn trace_groups(&self, answer: &mut OpenBits, trace: impl Fn(Group<'_>) + Sync + Send) {
        let words = self.words;
        let bits = RECEIVERS_OF_TASK * words;
        let points = self.points.par_chunks(RECEIVERS_OF_TASK);
        let above = self.above.par_chunks(bits);
        let open = answer.words.par_chunks_mut(bits);
        points.zip(above).zip(open).with_max_len(1).for_each(|((points, above), open)| {
            open.fill(0);
            trace(Group { points, above, open, words });
        });
    }

    /// Lets all threads trace single rays, receiver by receiver. `is_blocked` is asked of each point and direction.
    pub(crate) fn trace_singly(
        &self,
        answer: &mut OpenBits,
        is_blocked: impl Fn([f32; 3], [f32; 3]) -> bool + Sync,
    ) {
        self.trace_groups(answer, |mut group| {
            for receiver in 0..group.points.len() {
                for ray in group.rays_above(receiver) {
                    if !is_blocked(group.points[receiver], self.directions[ray]) {
                        group.set_open((receiver, ray));
                    }
                }
            }
        });
    }
}

impl<'a> Group<'a> {
    /// The rays of a receiver that are above its horizon.
    #[inline]
    pub(crate) fn rays_above(&self, receiver: usize) -> impl Iterator<Item = usize> + use<'a> {
        set_bits(&self.above[receiver * self.words..][..self.words])
    }

    /// The receivers for which a ray is above the horizon.
    #[inline]
    pub(crate) fn receivers_below(&self, ray: usize) -> impl Iterator<Item = usize> + use<'a> {
        let words = self.above[ray / 32..].iter().step_by(self.words);
        let is_above = move |&(_, &word): &(usize, &u32)| word >> (ray % 32) & 1 == 1;
        words.enumerate().filter(is_above).map(|(receiver, _)| receiver)
    }

    /// Says that a receiver's ray is open.
    #[inline]
    pub(crate) fn set_open(&mut self, (receiver, ray): (usize, usize)) {
        self.open[receiver * self.words + ray / 32] |= 1 << (ray % 32);
    }
}

/// The places of the bits that are set in words of 32.
#[inline]
fn set_bits(words: &[u32]) -> impl Iterator<Item = usize> + use<'_> {
    words.iter().enumerate().flat_map(|(k, &word)| Bits(word).map(move |bit| 32 * k + bit))
}

/// The places of the bits that are set, from the lowest on.
struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let lowest = (self.0 != 0).then(|| self.0.trailing_zeros() as usize);
        self.0 &= self.0.wrapping_sub(1);
        lowest
    }
}
