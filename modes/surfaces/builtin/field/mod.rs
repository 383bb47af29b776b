//! `builtin:field`: 10⁸ blades of grass and some umbels among them, by a rule.
//!
//! The field is a quadtree of 4096² cells of half a metre; a cell holds six blades, and now and then an umbel. Nothing is stored: a
//! cell's hash gives each blade its place, height, direction, lean and width. A group whose parts are smaller than the distance
//! between rays is drawn by six blades of its own, wider by the number of cells they stand for along a side.
//!
//! See `blades.rs` for what stands there, and `hills.rs` for the ground.
//!
//! Based on: William Reeves and Ricki Blau, "Approximate and Probabilistic Algorithms for Shading and Rendering Structured Particle
//! Systems", 1985; Robert Cook, John Halstead, Maxwell Planck and David Ryu, "Stochastic Simplification of Aggregate Detail", 2007.

pub(crate) mod blades;
pub(crate) mod hills;

use fearless_simd::Level;
use glam::DVec3;
use umbel_core::{Aabb, Detail, Domain, OnDemand};

use crate::random::{mix, uniform};
use crate::surfaces::builtin::field::blades::{Blade, head_extent, on_head};
use crate::surfaces::builtin::field::hills::HALF_SIDE;
use crate::surfaces::extent::{Extent, rounded};
use crate::surfaces::lanes::{LANES, map_points};
use crate::surfaces::noise::plane::Rectangle;

/// Levels of the quadtree above its cells: 2¹² cells to each side.
const LEVELS: u32 = 12;
/// The side of a cell, in metres.
const CELL: f64 = 2.0 * HALF_SIDE / (1 << LEVELS) as f64;
/// Blades of a cell.
const BLADES: u32 = 6;
/// The share of cells with an umbel.
const UMBELS: f64 = 0.008;
const SEED: u64 = 0x06ab_1ade;

/// Blades and umbels reach no farther than this from their roots, to any side and upwards, in metres: the sums of what they are made
/// of below. Blades alone stay lower.
const BESIDE: f64 = 0.6;
const ABOVE: f64 = 1.5;
const BLADES_ABOVE: f64 = 0.81;

/// Ids of umbels and of the ground begin here; below are blades.
const UMBEL_IDS: u32 = 1 << 28;
const GROUND_IDS: u32 = 1 << 30;

/// A meadow on hills, 2048 metres to each side around the origin, y upwards, with 100,663,296 blades.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Field;

/// What a [`Field`] consists of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldObject {
    /// A square of 2ˡᵉᵛᵉˡ cells to each side.
    Cells {
        /// Level of the quadtree; 0 is a cell.
        level: u32,
        /// Column and row among the squares of this level.
        place: [u32; 2],
    },
    /// A blade of such a square.
    Blade {
        /// Level of the square.
        level: u32,
        /// Column and row among the squares of this level.
        place: [u32; 2],
        /// Which of its blades; the one behind the last is the stalk of an umbel.
        index: u32,
        /// The height of the ground at its root: the bits of an f64.
        ground: u64,
    },
    /// The head of the umbel of a square.
    Head {
        /// Level of the square.
        level: u32,
        /// Column and row among the squares of this level.
        place: [u32; 2],
        /// The height of the ground at the root of its stalk: the bits of an f64.
        ground: u64,
    },
    /// A patch of the ground.
    Ground(u32),
}

impl Field {
    /// How many blades there are.
    pub const BLADES: u64 = BLADES as u64 * (1 << (2 * LEVELS));

    /// The height of the ground at (x, z).
    #[must_use]
    pub fn ground(&self, x: f64, z: f64) -> f64 {
        hills::height(x, z)
    }

    /// Whether an id is that of the ground, of an umbel, or of a blade.
    pub(crate) fn kind(id: u32) -> FieldKind {
        match id {
            GROUND_IDS.. => FieldKind::Ground,
            UMBEL_IDS.. => FieldKind::Umbel,
            _ => FieldKind::Blade,
        }
    }
}

/// What an id names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FieldKind {
    Blade,
    Umbel,
    Ground,
}

/// Whether a square is drawn by blades of its own where rays are so far apart, not by its quarters.
fn is_drawn(level: u32, spacing: f64) -> bool {
    level == 0 || CELL * f64::from(1_u32 << level) * 0.5 <= spacing
}

/// A box around all that stands in a square.
fn square_extent(level: u32, place: [u32; 2], detail: &Detail) -> Extent {
    let ground = square(level, place);
    let [least, greatest] = hills::range(&ground);
    let mut all = Extent {
        lo: DVec3::new(ground.x[0] - BESIDE, least - 0.1, ground.z[0] - BESIDE),
        hi: DVec3::new(ground.x[1] + BESIDE, greatest + ABOVE, ground.z[1] + BESIDE),
    };
    // In a smaller box rays are as far apart or farther, so it is drawn all the same.
    if is_drawn(level, detail.spacing([all.lo, all.hi])[0]) && !has_umbel(level, place) {
        all.hi.y = greatest + BLADES_ABOVE;
    }
    all
}

/// The square of a level.
fn square(level: u32, [column, row]: [u32; 2]) -> Rectangle {
    let side = CELL * f64::from(1_u32 << level);
    let span = |k: u32| [f64::from(k) * side - HALF_SIDE, f64::from(k + 1) * side - HALF_SIDE];
    Rectangle { x: span(column), z: span(row) }
}

/// Numbers in [0, 1) of a thing in a square.
fn numbers<const N: usize>(level: u32, [column, row]: [u32; 2], index: u32) -> [f64; N] {
    let mut state = mix(SEED ^ mix(u64::from(column) << 32 | u64::from(row)) ^ u64::from(level * 64 + index));
    std::array::from_fn(|_| {
        state = mix(state);
        uniform(state)
    })
}

/// Whether a square has an umbel: as often as any of its cells has.
fn has_umbel(level: u32, place: [u32; 2]) -> bool {
    let [chance] = numbers(level, place, BLADES + 1);
    chance < UMBELS * f64::from(1_u32 << (2 * level.min(10)))
}

/// Where a blade stands.
fn root(level: u32, place: [u32; 2], [x, z]: [f64; 2]) -> [f64; 2] {
    let Rectangle { x: xs, z: zs } = square(level, place);
    [xs[0] + (xs[1] - xs[0]) * x, zs[0] + (zs[1] - zs[0]) * z]
}

/// The heights of the ground at the roots of the first blades of a square, as bits.
fn grounds(level: u32, square: [u32; 2], simd: Level) -> [u64; LANES] {
    // In range: there are fewer things in a square than lanes.
    let roots: [[f64; 2]; LANES] =
        std::array::from_fn(|index| root(level, square, numbers(level, square, index as u32)));
    let places = [roots.map(|[x, _]| x), roots.map(|[_, z]| z)];
    hills::heights(places, simd).map(f64::to_bits)
}

/// A unit vector by a number in [0, 1): rational in each quadrant, (1 − f², 2f)/(1 + f²), where sines took half of the time in which a
/// blade is found.
fn direction(turn: f64) -> [f64; 2] {
    let quadrant = (turn * 4.0).floor();
    let f = turn * 4.0 - quadrant;
    let (x, y) = ((1.0 - f * f) / (1.0 + f * f), 2.0 * f / (1.0 + f * f));
    // In range: 0 to 3.
    match quadrant as u32 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

/// A blade, or the stalk of an umbel.
fn blade(level: u32, place: [u32; 2], index: u32, ground: u64) -> Blade {
    let [x, z, tall, turn, lean, wide] = numbers(level, place, index);
    let [x, z] = root(level, place, [x, z]);
    let root = DVec3::new(x, f64::from_bits(ground), z);
    let [cos, sin] = direction(turn);
    let (height, lean, width) = match index < BLADES {
        true => {
            (0.35 + 0.45 * tall, 0.1 + 0.35 * lean, (0.012 + 0.014 * wide) * f64::from(1_u32 << level.min(4)))
        }
        false => (0.95 + 0.3 * tall, 0.12 * lean, 0.008),
    };
    let lean = DVec3::new(cos, 0.0, sin) * lean;
    let spine = [root, root + DVec3::Y * (height * 0.65), root + DVec3::Y * height + lean];
    Blade { spine, half_width: DVec3::new(-sin, 0.0, cos) * width.min(0.1) }
}

/// The head of an umbel: its middle, and its radius.
fn head(level: u32, place: [u32; 2], ground: u64) -> (DVec3, f64) {
    let [size] = numbers(level, place, BLADES + 2);
    (blade(level, place, BLADES, ground).spine[2], 0.1 + 0.08 * size)
}

impl OnDemand for Field {
    type Object = FieldObject;

    fn roots(&self) -> Vec<FieldObject> {
        let ground = (0..hills::PATCHES * hills::PATCHES).map(FieldObject::Ground);
        ground.chain([FieldObject::Cells { level: LEVELS, place: [0, 0] }]).collect()
    }

    fn bounds(&self, object: &FieldObject, domain: Domain, detail: &Detail) -> Aabb {
        let extent = match *object {
            FieldObject::Cells { level, place } => square_extent(level, place, detail),
            FieldObject::Blade { level, place, index, ground } => {
                blade(level, place, index, ground).extent(domain)
            }
            FieldObject::Head { level, place, ground } => head_extent(head(level, place, ground), domain),
            FieldObject::Ground(patch) => hills::patch_extent(patch, domain),
        };
        extent.outward()
    }

    fn expand(
        &self,
        object: &FieldObject,
        spacing: f64,
        detail: &Detail,
        parts: &mut Vec<FieldObject>,
    ) -> bool {
        let FieldObject::Cells { level, place } = *object else {
            return false;
        };
        if !is_drawn(level, spacing) {
            let [column, row] = place.map(|k| 2 * k);
            let quarters = [[0, 0], [1, 0], [0, 1], [1, 1]];
            parts.extend(
                quarters.map(|[i, j]| FieldObject::Cells { level: level - 1, place: [column + i, row + j] }),
            );
            return true;
        }
        let stalks = u32::from(has_umbel(level, place));
        let grounds = grounds(level, place, detail.level());
        for (index, ground) in (0..BLADES + stalks).zip(grounds) {
            parts.push(FieldObject::Blade { level, place, index, ground });
            if index == BLADES {
                parts.push(FieldObject::Head { level, place, ground });
            }
        }
        true
    }

    fn evaluate(
        &self,
        patch: &FieldObject,
        parameters: &[[f64; 2]],
        detail: &Detail,
        points: &mut Vec<[f32; 3]>,
    ) {
        match *patch {
            FieldObject::Cells { .. } => {}
            FieldObject::Blade { level, place, index, ground } => {
                map_points(&mut blade(level, place, index, ground), parameters, detail.level(), points);
            }
            FieldObject::Head { level, place, ground } => {
                let head = head(level, place, ground);
                points.extend(parameters.iter().map(|&at| rounded(on_head(head, at))));
            }
            FieldObject::Ground(patch) => {
                hills::patch_points(patch, parameters, detail.level(), points);
            }
        }
    }

    /// Blades are counted cell by cell; those that stand for many cells have the id of the first.
    fn id(&self, patch: &FieldObject) -> u32 {
        let cell = |level: u32, [column, row]: [u32; 2]| (row << level) << LEVELS | (column << level);
        match *patch {
            FieldObject::Blade { level, place, index, .. } if index < BLADES => {
                cell(level, place) * BLADES + index
            }
            FieldObject::Blade { level, place, .. } | FieldObject::Head { level, place, .. } => {
                UMBEL_IDS + cell(level, place)
            }
            FieldObject::Ground(patch) => GROUND_IDS + patch,
            FieldObject::Cells { .. } => 0,
        }
    }
}
