//! What two triangles are to each other along all rays of a tile: decided once, remembered, used for all of them.
//!
//! Faces coincide in ordinary scenes: exports with two sides, overlays, decals, copies that were forgotten. The bounds of their keys
//! overlap at every ray, and asking each ray would take a hundred times as long as all else. But often one decision holds for
//! the tile:
//! - triangles with the same corners, in whatever order, have the same hits; so a copy with a larger id is dropped unseen, once
//!   the first copy was met ([`Twins`]);
//! - triangles in one plane have the same t along every ray;
//! - in planes across the same axis, the one with the nearer coordinate is nearer everywhere;
//! - keys are affine: where their difference exceeds its errors at the four corners of the tile, with one sign, it does so on all of it.
//!
//! The memory is bounded: a place for each of some pairs, where a later pair drops an earlier one. It changes time only.

use crate::exact::distance::{across, same_corners};
use crate::exact::filter::Sign;
use crate::exact::predicates::coplanar;
use crate::geometry::triangles::{Triangle, Triangles};
use crate::intersect::grid::depth::{KEY_ERROR, Record, TileDepth};
use crate::intersect::pencil::leaf::Tile;
use crate::intersect::pencil::rect::TILE_SIDE;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::origin::Origin;
use crate::simd::lanes::LANES;
use crate::stats::Stats;

/// Pairs that are remembered, and triangles that may have twins: powers of two.
const PAIRS: usize = 128;
const TWINS: usize = 512;
/// Evaluating a key and taking a difference: a few roundings, as a part of the keys.
const DIFFERENCE_ERROR: f64 = 4.0 * f64::EPSILON;

/// Where a triangle lies to another one along all rays of a tile that hit both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Relation {
    Nearer,
    Equal,
    Farther,
    /// It depends on the ray, or is not known.
    Varies,
}

/// The relations that were asked for last.
#[derive(Debug)]
pub(crate) struct Relations {
    pairs: [([u32; 2], Relation); PAIRS],
    /// Whether the triangle at hand has had some relation, and whether any triangle of the tile was found equal to another: there may be
    /// more of that kind.
    found: bool,
    equal: bool,
    /// Whether there is anything to forget.
    used: bool,
}

impl Relations {
    pub(crate) const NONE: Self = Self {
        pairs: [([NO_TRIANGLE; 2], Relation::Varies); PAIRS],
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
            *self = Self::NONE;
        }
    }

    /// The place of a pair.
    #[inline]
    fn place([id, other]: [u32; 2]) -> usize {
        ((id.wrapping_mul(0x9E37_79B1) ^ other.wrapping_mul(0x85EB_CA77)) >> 16) as usize % PAIRS
    }

    /// The relation of two triangles, if it is remembered.
    #[inline]
    fn recall(&self, pair: [u32; 2]) -> Option<Relation> {
        let (remembered, relation) = self.pairs[Self::place(pair)];
        (remembered == pair).then_some(relation)
    }

    /// Remembers the relation of two triangles.
    fn remember(&mut self, pair: [u32; 2], relation: Relation) {
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
    fn see(&mut self) {
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

impl Tile<'_, TileDepth> {
    /// Where a triangle, set up in a lane, lies to that of a record.
    #[inline]
    pub(crate) fn relation(&mut self, (id, lane): (u32, usize), record: u32, stats: &mut Stats) -> Relation {
        let other = self.work.depth.records[record as usize].id;
        let relation = self.work.depth.relations.recall([id, other]);
        let relation = relation.unwrap_or_else(|| self.find_relation((id, lane), record, stats));
        let relations = &mut self.work.depth.relations;
        relations.found |= relation != Relation::Varies;
        relations.equal |= relation == Relation::Equal;
        relation
    }

    /// The same, not known yet.
    #[inline(never)]
    fn find_relation(&mut self, (id, lane): (u32, usize), record: u32, stats: &mut Stats) -> Relation {
        let record = self.work.depth.records[record as usize];
        let [c, x, y, error] = self.work.setups.key.each_ref().map(|part| part[lane % LANES]);
        let pair = [id, record.id].map(|id| self.query.context.triangles.triangle(id));
        let relation = if same_corners(&pair[0], &pair[1]) {
            self.work.depth.twins.see();
            Relation::Equal
        } else {
            let by_keys = compare_keys(([c, x, y], error), &record);
            by_keys.unwrap_or_else(|| {
                stats.ambiguous_order += 1;
                compare_planes(self.query.view.origin, &pair)
            })
        };
        self.work.depth.relations.remember([id, record.id], relation);
        relation
    }
}

/// By the keys at the corners of the tile, as far as f64 can tell.
fn compare_keys(([c, x, y], error): ([f64; 3], f64), record: &Record) -> Option<Relation> {
    let last = f64::from(TILE_SIDE - 1);
    let (mut nearer, mut farther) = (true, true);
    for [column, row] in [[0.0, 0.0], [last, 0.0], [0.0, last], [last, last]] {
        let [other_c, other_x, other_y] = record.key;
        let (key, other) = (c + x * column + y * row, other_c + other_x * column + other_y * row);
        let error =
            error + f64::from(record.least) * KEY_ERROR + (key.abs() + other.abs()) * DIFFERENCE_ERROR;
        nearer &= key - other > error;
        farther &= key - other < -error;
    }
    match (nearer, farther) {
        (true, _) => Some(Relation::Nearer),
        (_, true) => Some(Relation::Farther),
        _ => None,
    }
}

/// By the planes, exactly.
fn compare_planes(origin: Origin, [one, other]: &[Triangle; 2]) -> Relation {
    if let Some(k) = across(one)
        && across(other) == Some(k)
    {
        // Hits lie ahead, so rays go from the origin toward both planes.
        let up = match origin {
            Origin::Point(o) => one.a[k] > o[k],
            Origin::Infinity(d) => d[k] > 0.0,
        };
        return match Sign::of(one.a[k] - other.a[k]) {
            Sign::Zero => Relation::Equal,
            sign if (sign == Sign::Negative) == up => Relation::Nearer,
            _ => Relation::Farther,
        };
    }
    if coplanar(one, other) { Relation::Equal } else { Relation::Varies }
}
