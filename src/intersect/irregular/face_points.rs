//! Receivers as a light sees them: where its rays pierce the faces of a cube around it, or the plane of two
//! coordinates.
//!
//! Places, faces and depths are those of [`crate::rays::projection`]; the depth key of a point is 1/w, that of parallel
//! rays follows from the coordinate ±p_k. Each place is a few roundings of f64 from the true one, as a part of the
//! coordinates: at most 4u on a face.
//!
//! Based on: Ned Greene, "Environment Mapping and Other Applications of World Projections", 1986 (cube maps).

use fearless_simd::prelude::*;

use crate::objects::gather;
use crate::rays::origin::Origin;
use crate::rays::projection::EightSeen;
use crate::rays::receiver::Receiver;
use crate::simd::lanes::{LANES, Lanes, Narrow, Points, bits, narrow, widen};

/// Rounding a key to f32, with its own error of a few roundings of f64.
const KEY_SLACK: f32 = 1.0 / (1 << 22) as f32;
/// Keys beyond this are as good as infinite.
const KEY_LIMIT: f64 = 1e37;

/// The most points of a tile.
pub(crate) const TILE_POINTS: usize = 4096;

/// What makes columns, rows and keys of places and depths: (x − offset)·factor for each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ToTile {
    pub(crate) at: [[f64; 2]; 2],
    pub(crate) depth: [f64; 2],
}

/// The receivers of a tile on one face.
#[derive(Debug)]
pub(crate) struct FacePoints {
    pub(crate) count: usize,
    /// Places on the face. The last one is repeated up to a multiple of eight.
    pub(crate) at: [[f64; TILE_POINTS]; 2],
    /// 1/w from a point; the coordinate ±p_k for a direction.
    pub(crate) depth: [f64; TILE_POINTS],
    /// Their places among the receivers.
    pub(crate) places: [u16; TILE_POINTS],
}

/// What receivers on a face cover.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    /// The least and the greatest place on each axis.
    pub(crate) at: [[f64; 2]; 2],
    /// The depth of one of them, and the greatest magnitude of a depth.
    pub(crate) depth: f64,
    pub(crate) greatest_depth: f64,
}

impl FacePoints {
    /// Room for a tile; no receivers.
    pub(crate) fn new() -> Self {
        Self { count: 0, at: [[0.0; TILE_POINTS]; 2], depth: [0.0; TILE_POINTS], places: [0; TILE_POINTS] }
    }

    /// Sees at most [`TILE_POINTS`] receivers: those on one face, or all of them. Tells the first and the last face.
    #[inline(always)]
    pub(crate) fn see<S: Simd>(
        &mut self,
        simd: S,
        light: Origin,
        (receivers, ids): (&[Receiver], &[u32]),
        only: Option<usize>,
    ) -> [usize; 2] {
        let mut count = 0;
        let mut first_face = Lanes::simd_from(simd, f64::INFINITY);
        let mut last_face = -first_face;
        for (index, eight) in ids.chunks(LANES).enumerate() {
            let point = |lane: usize| receivers[eight[lane] as usize].point;
            let [x, y, z] = gather::points_by_lane(simd, eight.len(), point);
            let points = Points { x: widen(x), y: widen(y), z: widen(z) };
            let EightSeen { at, depth, face } = see_eight(simd, light, points);
            (first_face, last_face) = (first_face.min(face), last_face.max(face));
            let Some(only) = only else {
                at[0].store_slice(&mut self.at[0][count..count + LANES]);
                at[1].store_slice(&mut self.at[1][count..count + LANES]);
                depth.store_slice(&mut self.depth[count..count + LANES]);
                count += LANES;
                continue;
            };
            let (at, depth) = ([at[0].to_array(), at[1].to_array()], depth.to_array());
            let here = (1 << eight.len()) - 1;
            for lane in bits(face.simd_eq(only as f64).to_bitmask() & here) {
                (self.at[0][count], self.at[1][count]) = (at[0][lane], at[1][lane]);
                // In range: a tile is smaller.
                (self.depth[count], self.places[count]) = (depth[lane], (index * LANES + lane) as u16);
                count += 1;
            }
        }
        self.count = count.min(ids.len());
        if only.is_none() {
            (0..).zip(&mut self.places[..self.count]).for_each(|(index, place)| *place = index);
        } else if let Some(last) = self.count.checked_sub(1) {
            let end = self.count.next_multiple_of(LANES);
            let [x, y] = &mut self.at;
            for numbers in [x, y, &mut self.depth] {
                let repeated = numbers[last];
                numbers[self.count..end].fill(repeated);
            }
        }
        // In range: 0 to 5.
        let least = first_face.to_array().into_iter().fold(f64::INFINITY, f64::min);
        let greatest = last_face.to_array().into_iter().fold(0.0, f64::max);
        [least as usize, greatest as usize]
    }

    /// What the receivers cover; there is one at least.
    #[inline(always)]
    pub(crate) fn extent<S: Simd>(&self, simd: S) -> Extent {
        let infinite = Lanes::simd_from(simd, f64::INFINITY);
        let (mut lo, mut hi, mut size) = ([infinite; 2], [-infinite; 2], infinite * 0.0);
        size = size.max(Lanes::simd_from(simd, 0.0));
        for first in (0..self.count).step_by(LANES) {
            for axis in 0..2 {
                let at = Lanes::from_slice(simd, &self.at[axis][first..first + LANES]);
                (lo[axis], hi[axis]) = (lo[axis].min(at), hi[axis].max(at));
            }
            size = size.max(Lanes::from_slice(simd, &self.depth[first..first + LANES]).abs());
        }
        let least = |lanes: [f64; LANES]| lanes.into_iter().fold(f64::INFINITY, f64::min);
        let greatest = |lanes: [f64; LANES]| lanes.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let axis = |k: usize| [least(lo[k].to_array()), greatest(hi[k].to_array())];
        Extent { at: [axis(0), axis(1)], depth: self.depth[0], greatest_depth: greatest(size.to_array()) }
    }

    /// Columns and rows of eight receivers from one on.
    #[inline(always)]
    pub(crate) fn places_on<S: Simd>(&self, simd: S, first: usize, to_tile: &ToTile) -> [Narrow<S>; 2] {
        let mut places = [Narrow::simd_from(simd, 0.0); 2];
        for (axis, place) in places.iter_mut().enumerate() {
            let at = Lanes::from_slice(simd, &self.at[axis][first..first + LANES]);
            let [offset, factor] = to_tile.at[axis];
            *place = narrow((at - offset) * factor);
        }
        places
    }

    /// Bounds of their keys in f32. The lower ones are finite or −∞: +∞ is left to mark what is settled.
    #[inline(always)]
    pub(crate) fn keys_on<S: Simd>(&self, simd: S, first: usize, to_tile: &ToTile) -> (Narrow<S>, Narrow<S>) {
        let depth = Lanes::from_slice(simd, &self.depth[first..first + LANES]);
        let [offset, factor] = to_tile.depth;
        keys_around(simd, (depth - offset) * factor)
    }
}

/// Bounds of keys in f32, as in [`FacePoints::keys_on`].
#[inline(always)]
pub(crate) fn keys_around<S: Simd>(simd: S, key: Lanes<S>) -> (Narrow<S>, Narrow<S>) {
    let limit = Lanes::simd_from(simd, KEY_LIMIT);
    let infinite = Narrow::simd_from(simd, f32::INFINITY);
    let rounded = narrow(key.min(limit).max(-limit));
    let slack = rounded.abs() * KEY_SLACK + f32::MIN_POSITIVE;
    let is_less = rounded.simd_lt(KEY_LIMIT as f32);
    let is_more = rounded.simd_gt(-KEY_LIMIT as f32);
    (is_more.select(rounded - slack, -infinite), is_less.select(rounded + slack, infinite))
}

/// Sees eight points.
#[inline(always)]
fn see_eight<S: Simd>(simd: S, light: Origin, points: Points<S>) -> EightSeen<Lanes<S>> {
    match light {
        Origin::Point(light) => {
            let Points { x, y, z } = points.minus(Points::splat(simd, light));
            EightSeen::on_cube(simd, [x, y, z])
        }
        Origin::Infinity(direction) => EightSeen::along(simd, [points.x, points.y, points.z], direction),
    }
}
