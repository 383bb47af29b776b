//! Openness: the weighted part of the open rays of a receiver, and the mean direction of them.
//!
//! ```text
//! openness = Σ w_k V_k / Σ w_k   over the directions with n·d_k > 0,   w_k = n·d_k (cosine) or 1 (uniform),
//! bent normal = Σ w_k V_k d_k, of unit length; the normal itself where nothing is open.
//! ```
//!
//! n is the receiver's unit shading normal, V_k = 1 where ray k is open. Where directions are distributed as the weights
//! are, w_k = 1 for all and openness is a count.
//!
//! n·d_k and w_k are f32. Sums are f32 within a word of 32 rays and f64 from word to word, in the order of the samples, so that they depend
//! on nothing else. Both sums take the same steps: all rays open is exactly 1, none is exactly 0.
//!
//! Eight receivers lie side by side in plain arrays, and a closed ray is masked out, not branched over: the compiler turns that
//! into vector instructions, of SSE2 as of any other. Products and sums are never fused, so lanes are as good as scalars.
//!
//! Based on: Sergey Zhukov, Andrei Iones, Grigorij Kronin, "An Ambient Light Illumination Model", 1998; Hayden Landis,
//! "Production-Ready Global Illumination", 2002 (bent normals).

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{OpenRays, RaySample};

use crate::bake::sample_sets::{OwnSets, Weighting};

/// Receivers side by side.
const LANES: usize = 8;
/// Rays in a word.
const WORD: usize = 32;
/// Receivers that one task takes: whole groups.
const TASK: usize = 128 * LANES;

/// One number for each of the receivers side by side.
type Lanes = [f32; LANES];

/// What rays tell of receivers, in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sums {
    /// Σ w V / Σ w; 1 where there are no directions.
    pub(crate) openness: Vec<f64>,
    /// Bent normals; empty unless they were asked for.
    pub(crate) bent: Vec<[f32; 3]>,
    /// The rays that were weighed: those above a horizon.
    pub(crate) rays: u64,
}

/// Weighs the open rays of receivers that share the directions.
pub(crate) fn weigh_shared(
    open: &OpenRays,
    normals: &[[f32; 3]],
    samples: &[RaySample],
    weighting: Weighting,
    with_bent: bool,
) -> Sums {
    let directions: Vec<[f32; 3]> =
        samples.iter().map(|sample| sample.direction.to_array().map(|x| x as f32)).collect();
    let mut openness = vec![0.0; normals.len()];
    let tasks = openness.par_chunks_mut(TASK).zip(normals.par_chunks(TASK)).enumerate();
    let rays = tasks.map(|(task, (openness, normals))| {
        let groups = openness.chunks_mut(LANES).zip(normals.chunks(LANES)).enumerate();
        let of_group = |(group, (openness, normals)): (usize, (&mut [f64], &[[f32; 3]]))| {
            let first = task * TASK + group * LANES;
            let sums = match weighting {
                Weighting::Cosine => weigh_group::<true>(open, first, normals, &directions),
                Weighting::Uniform => weigh_group::<false>(open, first, normals, &directions),
            };
            let parts = sums.open.iter().zip(&sums.all);
            for (openness, (&open, &all)) in openness.iter_mut().zip(parts) {
                *openness = if all > 0.0 { open / all } else { 1.0 };
            }
            sums.rays
        };
        groups.map(of_group).sum::<u64>()
    });
    let rays = rays.sum();
    let bent = |(receiver, &normal): (usize, &[f32; 3])| {
        let of_ray = |&(ray, d): &(usize, &[f32; 3])| open.is_open(receiver, ray) && dot(normal, *d) > 0.0;
        let weighted = |(_, d): (usize, &[f32; 3])| {
            let weight = if weighting == Weighting::Cosine { dot(normal, *d) } else { 1.0 };
            widen(*d) * f64::from(weight)
        };
        bent_normal(directions.iter().enumerate().filter(of_ray).map(weighted), normal)
    };
    let bent = if with_bent { normals.par_iter().enumerate().map(bent).collect() } else { Vec::new() };
    Sums { openness, bent, rays }
}

/// Weighs the open rays of receivers that have their own directions, distributed as the weights are.
pub(crate) fn weigh_own(open: &OpenRays, normals: &[[f32; 3]], sets: &OwnSets, with_bent: bool) -> Sums {
    let count = sets.count();
    let part = |receiver: usize| {
        let ones: u32 = open.words(receiver).iter().map(|word| word.count_ones()).sum();
        f64::from(ones) / count as f64
    };
    let bent = |(receiver, &normal): (usize, &[f32; 3])| {
        let rays = (0..count).filter(|&ray| open.is_open(receiver, ray));
        bent_normal(rays.map(|ray| sets.sample(receiver, ray).direction), normal)
    };
    Sums {
        openness: (0..normals.len()).into_par_iter().map(part).collect(),
        bent: if with_bent { normals.par_iter().enumerate().map(bent).collect() } else { Vec::new() },
        rays: count as u64 * normals.len() as u64,
    }
}

/// The sums of receivers side by side.
struct GroupSums {
    open: [f64; LANES],
    all: [f64; LANES],
    rays: u64,
}

/// Weighs the rays of up to [`LANES`] receivers. Where there are fewer, the others have no normal and no weight.
fn weigh_group<const COSINE: bool>(
    open: &OpenRays,
    first: usize,
    normals: &[[f32; 3]],
    directions: &[[f32; 3]],
) -> GroupSums {
    let mut lanes = [[0.0; LANES]; 3];
    for (lane, normal) in normals.iter().enumerate() {
        (0..3).for_each(|k| lanes[k][lane] = normal[k]);
    }
    let mut sums = GroupSums { open: [0.0; LANES], all: [0.0; LANES], rays: 0 };
    for (word, directions) in directions.chunks(WORD).enumerate() {
        let mut bits = [0; LANES];
        for (lane, bits) in bits[..normals.len()].iter_mut().enumerate() {
            *bits = open.words(first + lane)[word];
        }
        let (open, all, rays) = weigh_word::<COSINE>(&lanes, directions, bits);
        for lane in 0..LANES {
            sums.open[lane] += f64::from(open[lane]);
            sums.all[lane] += f64::from(all[lane]);
            sums.rays += u64::from(rays[lane]);
        }
    }
    sums
}

/// The partial sums of the rays of a word: Σ w V, Σ w, and how many have a weight.
fn weigh_word<const COSINE: bool>(
    normals: &[Lanes; 3],
    directions: &[[f32; 3]],
    mut bits: [u32; LANES],
) -> (Lanes, Lanes, [u32; LANES]) {
    let (mut open, mut all, mut rays) = ([0.0; LANES], [0.0; LANES], [0; LANES]);
    for d in directions {
        for lane in 0..LANES {
            let cos = normals[0][lane] * d[0] + normals[1][lane] * d[1] + normals[2][lane] * d[2];
            let above = u32::from(cos > 0.0).wrapping_neg();
            let weight = (if COSINE { cos } else { 1.0_f32 }).to_bits() & above;
            let mask = (bits[lane] & 1).wrapping_neg();
            all[lane] += f32::from_bits(weight);
            open[lane] += f32::from_bits(weight & mask);
            rays[lane] += above & 1;
            bits[lane] >>= 1;
        }
    }
    (open, all, rays)
}

/// The sum of vectors, of unit length; the normal, where there are none.
fn bent_normal(vectors: impl Iterator<Item = DVec3>, normal: [f32; 3]) -> [f32; 3] {
    let sum = vectors.fold(DVec3::ZERO, |sum, v| sum + v);
    let length = (sum.x * sum.x + sum.y * sum.y + sum.z * sum.z).sqrt();
    if length > 0.0 { (sum / length).to_array().map(|x| x as f32) } else { normal }
}

/// n·d as [`weigh_word`] has it.
pub(crate) fn dot(n: [f32; 3], d: [f32; 3]) -> f32 {
    n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
}

/// An f32 vector in f64.
fn widen(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}
