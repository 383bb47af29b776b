//! What two triangles are to each other along all rays of a tile: decided once, remembered, used for all of them.
//!
//! Faces coincide in ordinary scenes: exports with two sides, overlays, decals, copies that were forgotten. The bounds of their keys
//! overlap at every ray, and asking each ray would take a hundred times as long as all else. But often one decision holds for
//! the tile:
//! - triangles with the same corners, in whatever order, have the same hits; so a copy with a larger id is dropped unseen, once
//!   the first copy was met ([`Twins`]);
//! - triangles in one plane have the same t along every ray, and more such rules in [`crate::intersect::grid::compare`];
//! - where the order depends on the ray it is that of an affine function, which is made once some rays have asked: see
//!   [`crate::exact::planes`].
//!
//! The memory is bounded: a place for each of some pairs, where a later pair drops an earlier one. It changes time only.

use crate::exact::distance::same_corners;
use crate::exact::planes::Order;
use crate::geometry::triangles::{Triangle, Triangles};
use crate::rays::hits::NO_TRIANGLE;

/// Pairs that are remembered, and triangles that may have twins: powers of two.
const PAIRS: usize = 128;
const TWINS: usize = 512;

/// Where a triangle lies to another one along all rays of a tile that hit both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Relation {
    Nearer,
    Equal,
    Farther,
    /// It depends on the ray, as a function says: that with this number.
    Along(u8),
    /// It depends on the ray, and so many have asked.
    Asked(u32),
}

/// The relations that were asked for last.
#[derive(Debug)]
pub(crate) struct Relations {
    pairs: [([u32; 2], Relation); PAIRS],
    /// Functions of the pairs that have one, place by place.
    orders: [Order; PAIRS],
    /// Whether the triangle at hand has had some relation, and whether any triangle of the tile was found equal to another: there may be
    /// more of that kind.
    found: bool,
    equal: bool,
    /// Whether there is anything to forget.
    used: bool,
}

impl Relations {
    pub(crate) const NONE: Self = Self {
        pairs: [([NO_TRIANGLE; 2], Relation::Asked(0)); PAIRS],
        orders: [Order::ZERO; PAIRS],
        found: false,
        equal: false,
        used: false,
    };

    /// Turns to another triangle.
    pub(crate) fn begin(&mut self) {
        self.found = self.equal;
    }

    /// Whether blocks are worth looking at together.
    pub(crate) fn are_found(&self) -> bool {
        self.found
    }

    /// Readies the memory for another tile.
    pub(crate) fn forget(&mut self) {
        if self.used {
            self.pairs = Self::NONE.pairs;
            (self.found, self.equal, self.used) = (false, false, false);
        }
    }

    /// The place of a pair.
    #[inline]
    fn place([id, other]: [u32; 2]) -> usize {
        ((id.wrapping_mul(0x9E37_79B1) ^ other.wrapping_mul(0x85EB_CA77)) >> 16) as usize % PAIRS
    }

    /// The relation of two triangles, if it is remembered.
    #[inline]
    pub(crate) fn recall(&self, pair: [u32; 2]) -> Option<Relation> {
        let (remembered, relation) = self.pairs[Self::place(pair)];
        (remembered == pair).then_some(relation)
    }

    /// Notes a relation of the triangle at hand.
    #[inline]
    pub(crate) fn note(&mut self, relation: Relation) {
        self.found |= !matches!(relation, Relation::Asked(_));
        self.equal |= matches!(relation, Relation::Equal | Relation::Along(_));
    }

    /// Remembers the order of two triangles.
    pub(crate) fn remember_order(&mut self, pair: [u32; 2], order: Order) -> Relation {
        let place = Self::place(pair);
        self.orders[place] = order;
        // In range: at most 256 places.
        Relation::Along(place as u8)
    }

    /// The function with a number.
    #[inline]
    pub(crate) fn order(&self, number: u8) -> &Order {
        &self.orders[usize::from(number) % PAIRS]
    }

    /// Remembers the relation of two triangles.
    pub(crate) fn remember(&mut self, pair: [u32; 2], relation: Relation) {
        self.pairs[Self::place(pair)] = (pair, relation);
        self.used = true;
    }
}

/// Triangles of a tile whose twins, those with the same corners and larger ids, need not be tested.
#[derive(Debug)]
pub(crate) struct Twins {
    /// Whether any were seen: nothing is remembered before.
    seen: bool,
    ids: [u32; TWINS],
}

impl Twins {
    pub(crate) const NONE: Self = Self { seen: false, ids: [NO_TRIANGLE; TWINS] };

    /// Readies the memory for another tile.
    pub(crate) fn forget(&mut self) {
        if self.seen {
            self.ids = [NO_TRIANGLE; TWINS];
        }
    }

    /// Notes that there are twins.
    pub(crate) fn see(&mut self) {
        if !self.seen {
            *self = Self { seen: true, ..Self::NONE };
        }
    }

    /// Whether a triangle has a twin with a smaller id that was met before, which comes first wherever both are hit. Remembers
    /// it otherwise.
    #[inline(always)]
    pub(crate) fn hide(&mut self, triangles: &Triangles<'_>, id: u32) -> bool {
        self.seen && self.hide_twin(triangles, id)
    }

    #[inline(never)]
    fn hide_twin(&mut self, triangles: &Triangles<'_>, id: u32) -> bool {
        let triangle = triangles.triangle(id);
        let met = &mut self.ids[place_of(&triangle)];
        let is_twin = *met != NO_TRIANGLE && same_corners(&triangle, &triangles.triangle(*met));
        if is_twin && *met < id {
            return true;
        }
        *met = id;
        false
    }
}

/// A place that does not depend on the order of the corners.
fn place_of(triangle: &Triangle) -> usize {
    let mixed = |p: glam::DVec3| {
        // The low bits of f32 coordinates are zero.
        let [x, y, z] = p.to_array().map(|x| x.to_bits() >> 28);
        let sum = x.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        (sum ^ z.wrapping_mul(0x1656_67B1_9E37_79F9)).wrapping_mul(0xFF51_AFD7_ED55_8CCD)
    };
    let sum = mixed(triangle.a).wrapping_add(mixed(triangle.b)).wrapping_add(mixed(triangle.c));
    (sum >> 40) as usize % TWINS
}
