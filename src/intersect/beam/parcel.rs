//! A parcel: up to 256 neighbouring receivers in 16 packets of 16. What all its beams read.
//!
//! Receivers are ordered along a curve; blocks of some thousands are then divided at medians of their longest axis,
//! down to parcels and to packets. Compactness is what counts: parcels cut from the curve alone take 2 to 3 times as
//! long.
//!
//! Coordinates count from the middle of the parcel, so that f32 is as fine as receivers are near each other. Which
//! receivers a direction leaves above their surface follows from the sign of d·N. With N and d over their greatest
//! components, both rounded to f32, each of three products errs by less than six roundings of 1, sums included, and by
//! what N errs in f64. Signs within that are decided exactly.

use fearless_simd::{Level, prelude::*, u32x16};
use rayon::prelude::*;

use crate::exact::filter::Cross;
use crate::geometry::aabb::{Aabb, U, widen};
use crate::geometry::triangles::{TriangleId, Triangles};
use crate::intersect::beam::direction::Direction;
use crate::intersect::beam::query::Query;
use crate::objects::morton::along_curve;
use crate::objects::offset::Side;
use crate::rays::hemisphere::{Above, Hemisphere};
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::point_order::PointGrid;
use crate::simd::lanes::{WIDTH, Wide, bits};

/// Packets of a parcel, and its receivers.
pub(crate) const PACKETS: usize = 16;
pub(crate) const RECEIVERS: usize = PACKETS * WIDTH;
/// Receivers along the curve that are divided at medians.
const BLOCK: usize = 16 * RECEIVERS;

/// Rounding in f32 of components of N and of d, their products and two sums, for |d_k| ≤ 1.
const FACING_ERROR: f64 = 18.0 / (1 << 24) as f64;
/// A component of N: the differences of its corners, their products and the difference of those, as parts of the
/// permanent.
const NORMAL_ERROR: f64 = 8.0 * U;

/// A bit for each receiver of a parcel.
pub(crate) type Bits = [u16; PACKETS];

/// Sixteen numbers for each packet of a parcel.
type PerReceiver = [[f32; WIDTH]; PACKETS];

/// Receivers side by side.
#[derive(Debug)]
pub(crate) struct Parcel {
    pub(crate) count: usize,
    /// The index of each, and the triangle that it lies on.
    pub(crate) ids: [u32; RECEIVERS],
    pub(crate) owners: [u32; RECEIVERS],
    /// The middle, scaled, and coordinates from there, packet by packet. Places without a receiver repeat one.
    pub(crate) middle: [f32; 3],
    pub(crate) at: [[[f32; WIDTH]; 3]; PACKETS],
    /// The same, one receiver of each packet after the other.
    pub(crate) transposed: [[[f32; PACKETS]; 3]; WIDTH],
    /// A bound of the coordinates.
    pub(crate) reach: f32,
    normals: [PerReceiver; 3],
    /// d·N is certain beyond this.
    tolerance: PerReceiver,
    /// Receivers that no triangle of closed components encloses, see [`crate::objects::closed`].
    pub(crate) outside: Bits,
    /// Receivers of which the rule does not hold: their rays are tested from both sides.
    pub(crate) both_sides: Bits,
    /// Whether some rays may meet the triangle that their receiver names.
    strays: bool,
}

impl Parcel {
    /// No receivers.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self {
            count: 0,
            ids: [NO_TRIANGLE; RECEIVERS],
            owners: [NO_TRIANGLE; RECEIVERS],
            middle: [0.0; 3],
            at: [[[0.0; WIDTH]; 3]; PACKETS],
            transposed: [[[0.0; PACKETS]; 3]; WIDTH],
            reach: 0.0,
            normals: [[[0.0; WIDTH]; PACKETS]; 3],
            tolerance: [[0.0; WIDTH]; PACKETS],
            outside: [0; PACKETS],
            both_sides: [0; PACKETS],
            strays: false,
        })
    }

    /// Takes some receivers in place of those before.
    pub(crate) fn fill(&mut self, query: &Query<'_>, ids: &[u32]) {
        let point = |id: u32| query.scaled(id);
        let bounds = Aabb::of_points(ids.iter().map(|&id| point(id)));
        self.count = ids.len();
        self.middle = [0, 1, 2].map(|k| bounds.lo[k] * 0.5 + bounds.hi[k] * 0.5);
        (self.reach, self.strays) = (0.0, false);
        (self.outside, self.both_sides) = ([0; PACKETS], [0; PACKETS]);
        self.ids.fill(NO_TRIANGLE);
        self.owners.fill(NO_TRIANGLE);
        for index in 0..RECEIVERS {
            let (packet, lane) = (index / WIDTH, index % WIDTH);
            let at = point(ids[index.min(ids.len() - 1)]);
            for (k, (at, middle)) in at.into_iter().zip(self.middle).enumerate() {
                let x = at - middle;
                self.reach = self.reach.max(x.abs());
                (self.at[packet][k][lane], self.transposed[lane][k][packet]) = (x, x);
            }
            if let Some(&id) = ids.get(index) {
                self.push(query, index, id);
            }
        }
    }

    /// What else is known of a receiver.
    fn push(&mut self, query: &Query<'_>, index: usize, id: u32) {
        let (packet, lane) = (index / WIDTH, index % WIDTH);
        let hemisphere = &query.occlusion.hemispheres[id as usize];
        (self.ids[index], self.owners[index]) = (id, hemisphere.receiver.triangle.0);
        let (normal, tolerance) = normal_of(query.triangles, hemisphere);
        for (all, x) in self.normals.iter_mut().zip(normal) {
            all[packet][lane] = x;
        }
        self.tolerance[packet][lane] = tolerance;
        if may_meet_owner(query.triangles, hemisphere) {
            self.strays = true;
            let TriangleId(owner) = hemisphere.receiver.triangle;
            let is_closed = query.objects.any_closed && query.objects.closed.contains(owner);
            self.both_sides[packet] |= u16::from(is_closed) << lane;
        }
    }

    /// The receivers of a packet whose rays may meet a triangle that does not count for them.
    #[inline(always)]
    pub(crate) fn exempt<S: Simd>(&self, simd: S, packet: usize, id: u32) -> u16 {
        if self.strays { self.own(simd, packet, id) } else { 0 }
    }

    /// The receivers of a packet that lie on a triangle.
    #[inline(always)]
    pub(crate) fn own<S: Simd>(&self, simd: S, packet: usize, id: u32) -> u16 {
        let owners = u32x16::from_slice(simd, &self.owners[packet * WIDTH..][..WIDTH]);
        // In range: sixteen bits.
        owners.simd_eq(id).to_bitmask() as u16
    }

    /// Whether no receiver has a triangle that its rays may meet.
    #[inline(always)]
    pub(crate) fn has_no_strays(&self) -> bool {
        !self.strays
    }

    /// Packets that hold receivers.
    pub(crate) fn packets(&self) -> usize {
        self.count.div_ceil(WIDTH)
    }

    /// The receivers whose direction points above their surface.
    #[inline(always)]
    pub(crate) fn above<S: Simd>(&self, simd: S, query: &Query<'_>, direction: &Direction) -> Bits {
        let mut above = [0; PACKETS];
        let d = direction.scaled;
        for (packet, above) in above.iter_mut().enumerate().take(self.packets()) {
            let [x, y, z] = &self.normals;
            let x = Wide::load_array_ref(simd, &x[packet]);
            let y = Wide::load_array_ref(simd, &y[packet]);
            let z = Wide::load_array_ref(simd, &z[packet]);
            let tolerance = Wide::load_array_ref(simd, &self.tolerance[packet]);
            let dot = x * d[0] + y * d[1] + z * d[2];
            let mut up = dot.simd_gt(tolerance).to_bitmask();
            let here = (1_u64 << (self.count - packet * WIDTH).min(WIDTH)) - 1;
            let doubtful = !(up | (-dot).simd_gt(tolerance).to_bitmask()) & here;
            for lane in bits(doubtful) {
                let hemisphere = &query.occlusion.hemispheres[self.ids[packet * WIDTH + lane] as usize];
                up |= u64::from(hemisphere.is_above(query.triangles, direction.sample.direction)) << lane;
            }
            // In range: sixteen bits.
            *above = (up & here) as u16;
        }
        above
    }
}

/// Receivers in an order of which 256 in a row are a parcel, and 16 a packet.
pub(crate) fn in_parcels(hemispheres: &[Hemisphere], level: Level) -> Vec<u32> {
    let mut order = along_curve(&PointGrid::over(hemispheres), hemispheres.len(), level);
    order.par_chunks_mut(BLOCK).for_each_init(Vec::new, |places, block| {
        places.clear();
        places.extend(block.iter().map(|&id| (hemispheres[id as usize].receiver.point, id)));
        divide(places);
        block.iter_mut().zip(places).for_each(|(id, place)| *id = place.1);
    });
    order
}

/// Divides receivers at medians.
fn divide(places: &mut [([f32; 3], u32)]) {
    if places.len() <= WIDTH {
        return;
    }
    let bounds = Aabb::of_points(places.iter().map(|place| place.0));
    let unit = if places.len() > RECEIVERS { RECEIVERS } else { WIDTH };
    let (axis, middle) = (bounds.longest_axis(), (places.len() / 2).next_multiple_of(unit));
    if middle < places.len() {
        places.select_nth_unstable_by(middle, |one, other| one.0[axis].total_cmp(&other.0[axis]));
    }
    let (one, other) = places.split_at_mut(middle.min(places.len()));
    if other.is_empty() {
        return;
    }
    divide(one);
    divide(other);
}

/// Where a receiver's half space points to, and the greatest d·N that is in doubt.
fn normal_of(triangles: &Triangles<'_>, hemisphere: &Hemisphere) -> ([f32; 3], f32) {
    let (normal, permanent) = match hemisphere.above {
        Above::Normal(normal) => (widen(normal), 0.0),
        Above::Side(side) => {
            let triangle = triangles.triangle(hemisphere.receiver.triangle.0);
            let cross = Cross::of(triangle.b - triangle.a, triangle.c - triangle.a);
            let normal = if side == Side::Front { cross.value } else { -cross.value };
            (normal, cross.permanent.max_element())
        }
    };
    let size = normal.abs().max_element();
    let tolerance = (FACING_ERROR + permanent * (3.0 * NORMAL_ERROR) / size) as f32;
    // NaN, from a zero normal, is always in doubt.
    ((normal / size).as_vec3().to_array(), tolerance)
}

/// Whether rays of a receiver may meet its own triangle, which does not count. They do not where all leave that
/// triangle for the side that the receiver lies on.
fn may_meet_owner(triangles: &Triangles<'_>, hemisphere: &Hemisphere) -> bool {
    let TriangleId(owner) = hemisphere.receiver.triangle;
    owner != NO_TRIANGLE
        && match hemisphere.above {
            Above::Normal(_) => true,
            Above::Side(side) => !triangles.is_on_side(owner, widen(hemisphere.receiver.point), side),
        }
}
