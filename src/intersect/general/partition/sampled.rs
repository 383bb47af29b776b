//! The cost-driven partition: a sample of the active rays says what each split would cost.
//!
//! Centres fall into bins along each axis. A sampled ray is tested against the boxes of the bins, so that it meets the
//! left side of a plane if it meets any bin left of it. With αL and αR the parts of the sample that meet the sides, and
//! nL and nR their objects, the split with the least r(αL·nL + αR·nR), the number of pairs, is taken. Where α > ½,
//! finding out which rays meet that side saves less than it costs and is left out; the sampled majority says which side
//! comes first.
//!
//! Of many objects a few thousand fall into bins: all of them cost more than better planes gained.
//!
//! Based on: Kosuke Nabata, Kei Iwasaki, Yoshinori Dobashi, Tomoyuki Nishita, "Efficient Divide-And-Conquer Ray Tracing
//! using Ray Sampling", 2013; Benjamin Mora, "Naive Ray-Tracing: A Divide-and-Conquer Approach", 2011 (planes from a
//! part of the objects).

use crate::geometry::aabb::Aabb;
use crate::geometry::triangles::Triangles;
use crate::intersect::general::active::{Active, move_to_front};

/// Rays from which on it pays to sample.
const RAYS: usize = 1000;
/// Rays in a sample.
const SAMPLE: usize = 100;
/// Bins along each axis: as many as a mask has bits.
const BINS: usize = 8;
/// Objects that fall into bins: of more, every so manieth.
const BINNED: usize = 1 << 12;
/// A side holds at least this part of the objects: the depth of the recursion is at most log(n)/log(16/15), 344 steps
/// for 2³².
const LEAST_PART: usize = 16;

/// Two sides by cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampledSplit {
    /// How many objects are on the left side, which has the lesser coordinates.
    pub(crate) left: usize,
    pub(crate) axis: usize,
    pub(crate) sampled: Sampled,
    /// Rays that were sampled.
    pub(crate) rays: usize,
}

/// What a sample of the active rays says about two sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampled {
    /// Whether so many rays meet the side that finding out which ones does not pay: left and right.
    pub(crate) met_by_most: [bool; 2],
    /// Whether most rays go towards greater coordinates on the axis.
    pub(crate) most_ascend: bool,
}

/// The objects whose centres lie in one slice of the scene.
#[derive(Debug, Clone, Copy)]
struct Bin {
    count: usize,
    bounds: Aabb,
}

/// Objects in bins along each axis.
#[derive(Debug)]
struct Binning {
    /// The least centres.
    lo: [f64; 3],
    /// Bins per unit; 0 where all centres are the same.
    scale: [f64; 3],
    bins: [[Bin; BINS]; 3],
}

/// A plane between bins, and what it costs.
#[derive(Debug, Clone, Copy)]
struct Plane {
    axis: usize,
    /// The first bin of the right side.
    first: usize,
    /// Sampled rays that meet the sides.
    met: [usize; 2],
    cost: usize,
}

impl Binning {
    fn new(triangles: &Triangles<'_>, objects: &[u32]) -> Self {
        let binned = || objects.iter().step_by(objects.len().div_ceil(BINNED).max(1));
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &id in binned() {
            let centre = triangles.bounds(id).centre();
            for k in 0..3 {
                (lo[k], hi[k]) = (lo[k].min(centre[k]), hi[k].max(centre[k]));
            }
        }
        let scale = [0, 1, 2].map(|k| if hi[k] > lo[k] { BINS as f64 / (hi[k] - lo[k]) } else { 0.0 });
        let mut binning = Self { lo, scale, bins: [[Bin { count: 0, bounds: Aabb::EMPTY }; BINS]; 3] };
        for &id in binned() {
            let bounds = triangles.bounds(id);
            for axis in 0..3 {
                let place = binning.place(axis, bounds.centre()[axis]);
                let bin = &mut binning.bins[axis][place];
                *bin = Bin { count: bin.count + 1, bounds: bin.bounds.union(bounds) };
            }
        }
        binning
    }

    /// The bin of a centre. What is not a number goes into the first.
    fn place(&self, axis: usize, centre: f64) -> usize {
        (((centre - self.lo[axis]) * self.scale[axis]) as usize).min(BINS - 1)
    }

    /// The bins of an axis that a ray meets, as bits.
    fn met_by(&self, axis: usize, active: &Active) -> u32 {
        let meets = |bin: &Bin| bin.count > 0 && active.slabs.may_meet(&bin.bounds, active.nearest.hi);
        self.bins[axis].iter().enumerate().fold(0, |mask, (k, bin)| mask | u32::from(meets(bin)) << k)
    }

    /// The planes of an axis that leave enough on both sides.
    fn planes(&self, axis: usize, sample: &[&Active]) -> impl Iterator<Item = Plane> {
        let masks: Vec<u32> = sample.iter().map(|active| self.met_by(axis, active)).collect();
        let counts = self.bins[axis].map(|bin| bin.count);
        (1..BINS).filter_map(move |first| {
            let left: usize = counts[..first].iter().sum();
            let right: usize = counts[first..].iter().sum();
            let low = (1 << first) - 1;
            let met = [low, !low].map(|side| masks.iter().filter(|&mask| mask & side != 0).count());
            let fits = left.min(right) * LEAST_PART >= left + right;
            fits.then_some(Plane { axis, first, met, cost: met[0] * left + met[1] * right })
        })
    }
}

/// Divides objects by cost, in place; `None` where rays are few, or no plane divides.
pub(crate) fn split(triangles: &Triangles<'_>, rays: &[Active], objects: &mut [u32]) -> Option<SampledSplit> {
    if rays.len() <= RAYS {
        return None;
    }
    let sample: Vec<&Active> = (0..SAMPLE).map(|k| &rays[k * rays.len() / SAMPLE]).collect();
    let binning = Binning::new(triangles, objects);
    let planes = (0..3).flat_map(|axis| binning.planes(axis, &sample));
    let Plane { axis, first, met, .. } = planes.min_by_key(|plane| plane.cost)?;

    let left = move_to_front(objects, |&id| binning.place(axis, triangles.bounds(id).centre()[axis]) < first);
    // Not all of them were binned.
    if left.min(objects.len() - left) * LEAST_PART < objects.len() {
        return None;
    }
    let ascending = sample.iter().filter(|active| active.slabs.ascends(axis)).count();
    let sampled =
        Sampled { met_by_most: met.map(|met| met * 2 > SAMPLE), most_ascend: ascending * 2 > SAMPLE };
    Some(SampledSplit { left, axis, sampled, rays: SAMPLE })
}
