//! On which side of triangles the receivers of a parcel lie, exactly: decided once, and used along all directions.
//!
//! Receivers lie on surfaces: at corners of triangles, in their planes, or so near to one that f32 cannot tell. Each of their rays
//! along each direction would ask anew, and the answer is the same: a ray may meet a triangle only where A·N, which is the
//! receiver's, has the sign of d·N, which is the direction's. In particular never from within the plane.
//!
//! Vertices of a mesh take about six doubts a ray less with that, and half the time.
//!
//! The memory is bounded: a later pair of a triangle and a packet takes the place of an earlier one.

use glam::DVec3;

use crate::exact::filter::Sign;
use crate::exact::predicates::orientation;
use crate::geometry::triangles::Triangle;
use crate::rays::hits::NO_TRIANGLE;
use crate::simd::lanes::bits;

/// Pairs that are remembered: a power of two.
const PAIRS: usize = 4096;

/// The receivers of a packet, as bits.
#[derive(Debug, Clone, Copy)]
struct Pair {
    id: u32,
    packet: u16,
    /// Those that were asked for; of these, those in the plane, and those with A·N > 0.
    known: u16,
    within: u16,
    positive: u16,
}

/// The sides of pairs of a triangle and a packet.
#[derive(Debug)]
pub(crate) struct Sides {
    pairs: Box<[Pair; PAIRS]>,
    used: bool,
}

impl Sides {
    const NONE: Pair = Pair { id: NO_TRIANGLE, packet: 0, known: 0, within: 0, positive: 0 };

    /// Bytes of a memory.
    pub(crate) const BYTES: usize = size_of::<Pair>() * PAIRS;

    /// Nothing is known.
    pub(crate) fn new() -> Self {
        Self { pairs: Box::new([Self::NONE; PAIRS]), used: false }
    }

    /// Readies the memory for another parcel.
    pub(crate) fn forget(&mut self) {
        if self.used {
            self.pairs.fill(Self::NONE);
            self.used = false;
        }
    }

    /// Of some receivers of a packet, those in the plane of a triangle, and those with A·N > 0. `find` tells the triangle, and where a
    /// receiver is.
    #[inline]
    pub(crate) fn of(
        &mut self,
        (id, packet): (u32, u16),
        asked: u16,
        find: &impl Fn(usize) -> (Triangle, DVec3),
    ) -> [u16; 2] {
        let place = (id.wrapping_mul(0x9E37_79B1) >> 16) as usize ^ usize::from(packet);
        let pair = &mut self.pairs[place % PAIRS];
        if (pair.id, pair.packet) != (id, packet) {
            *pair = Pair { id, packet, ..Self::NONE };
        }
        if asked & !pair.known != 0 {
            self.used = true;
            pair.learn(asked, find);
        }
        [pair.within, pair.positive]
    }
}

impl Pair {
    #[inline(never)]
    fn learn(&mut self, asked: u16, find: &impl Fn(usize) -> (Triangle, DVec3)) {
        for lane in bits(u64::from(asked & !self.known)) {
            let (Triangle { a, b, c }, point) = find(lane);
            match orientation(a, b, c, point) {
                Sign::Negative => {}
                Sign::Zero => self.within |= 1 << lane,
                Sign::Positive => self.positive |= 1 << lane,
            }
        }
        self.known |= asked;
    }
}
