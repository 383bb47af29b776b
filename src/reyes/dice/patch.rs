//! Parts of patches, and the rates at which they are diced: without cracks.
//!
//! A part is a rectangle of dyadic parameters. Each of its four edges has a *rate* of its own, found from points of
//! that edge alone: 2^s segments per unit of the parameter, or none yet where a grid would be too large. A part with an
//! edge, or a middle line, without a rate is split there; halves of the edge are then measured as edges of their own.
//! An edge that has its rate keeps it, whatever becomes of the parts along it. Both neighbours see the same edges, so
//! they find the same rates.
//!
//! A part whose edges all have rates is diced: a grid as fine as the finest of its lines. A point of the grid on an
//! edge with a coarser rate goes down to the nearest multiple of 2^−s. So the border of the grid is the border that the
//! edge asks for, whoever dices, and some triangles have no area. Where parts are narrower than a segment, all of their
//! points on that edge go to its start, outside the part; bounds have to hold them too.
//!
//! No triangle turns over by this: points of a row move along the row and keep their order, and those of two
//! neighbouring rows span triangles between two lines. A point that lies inside two rated edges would have to lie on a
//! crossing, but one of the two was there first and ends the other.
//!
//! Based on: Matthew Fisher et al., "DiagSplit: Parallel, Crack-free, Adaptive Tessellation for Micropolygon
//! Rendering",
//! 2009.

use crate::reyes::dice::rule::Domain;

/// The most segments along an edge of a grid: two to the power of this. For a displaced sheet at 1920x1080 and half a
/// pixel, grids of up to 8 segments took half as long again as those of up to 16, as every part is measured; those of
/// up to 32 took 5 % less time, but made a fifth more micropolygons, which costs more where points are dearer.
pub(crate) const GRID_BITS: u8 = 4;
/// The most halvings of a patch along one parameter.
pub(crate) const MAX_LEVEL: u8 = 20;

/// The interval [index, index + 1]/2^level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dyadic {
    pub(crate) level: u8,
    pub(crate) index: u32,
}

impl Dyadic {
    const UNIT: Self = Self { level: 0, index: 0 };

    /// One of the halves.
    fn half(self, second: bool) -> Self {
        Self { level: self.level + 1, index: self.index * 2 + u32::from(second) }
    }

    /// The parameter at `place` of 2^`bits` steps through the interval.
    pub(crate) fn at(self, place: u32, bits: u8) -> f64 {
        dyadic(self.lattice(place, bits), self.level + bits)
    }

    /// The same, down to a multiple of 2^−rate.
    fn snapped(self, place: u32, bits: u8, rate: Rate) -> f64 {
        let (lattice, level) = (self.lattice(place, bits), self.level + bits);
        let coarser = level.saturating_sub(rate.0);
        dyadic(lattice >> coarser << coarser, level)
    }

    fn lattice(self, place: u32, bits: u8) -> u64 {
        (u64::from(self.index) << bits) + u64::from(place)
    }
}

/// index/2^level: exact.
fn dyadic(index: u64, level: u8) -> f64 {
    // The bits of 2^−level.
    index as f64 * f64::from_bits((1023 - u64::from(level)) << 52)
}

/// 2^s segments per unit of a parameter, or none yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rate(u8);

impl Rate {
    /// None yet: the edge is too long.
    pub(crate) const NONE: Self = Self(u8::MAX);

    /// The rate of an edge that splitting does not make shorter: the points at which it was measured, four segments.
    pub(crate) fn measured(interval: Dyadic) -> Self {
        Self(interval.level + 2)
    }

    /// The rate of an edge over an interval that asks for some segments: the nearest power of two.
    pub(crate) fn of(interval: Dyadic, segments: f64) -> Self {
        let (mut bits, mut most) = (0, std::f64::consts::SQRT_2);
        while segments > most && bits <= GRID_BITS {
            (bits, most) = (bits + 1, most * 2.0);
        }
        if bits <= GRID_BITS {
            Self(interval.level + bits)
        } else if interval.level >= MAX_LEVEL {
            Self(interval.level + GRID_BITS)
        } else {
            Self::NONE
        }
    }
}

/// A line of points of a patch: one parameter runs over an interval, the other stays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    /// 0 where u runs, 1 where v does.
    pub(crate) axis: usize,
    pub(crate) interval: Dyadic,
    /// The parameter that stays.
    pub(crate) across: f64,
}

/// A part of a patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SubPatch {
    /// The intervals of u and v.
    pub(crate) sides: [Dyadic; 2],
    /// Of lines along u, and of lines along v: the rates at the start, at the end, and in the middle of the other
    /// parameter.
    pub(crate) rates: [[Rate; 3]; 2],
}

impl SubPatch {
    /// The whole patch, nothing measured.
    pub(crate) const WHOLE: Self = Self { sides: [Dyadic::UNIT; 2], rates: [[Rate::NONE; 3]; 2] };

    /// One of the lines that have a rate.
    pub(crate) fn line(&self, axis: usize, which: usize) -> Line {
        let other = self.sides[1 - axis];
        let (place, bits) = [(0, 0), (1, 0), (1, 1)][which];
        Line { axis, interval: self.sides[axis], across: other.at(place, bits) }
    }

    /// The parameter along which the part must be split: some line along it has no rate yet.
    pub(crate) fn must_split(&self) -> Option<usize> {
        let missing = self.rates.map(|rates| rates.contains(&Rate::NONE));
        match missing {
            [true, true] => Some(usize::from(self.sides[1].level < self.sides[0].level)),
            [true, false] => Some(0),
            [false, true] => Some(1),
            [false, false] => None,
        }
    }

    /// One of the halves. Rates that it does not inherit are to be measured, the middle ones too.
    pub(crate) fn half(&self, axis: usize, second: bool) -> Self {
        let (mut sides, mut rates) = (self.sides, self.rates);
        sides[axis] = sides[axis].half(second);
        // The middle line across becomes an edge.
        let [start, end, middle] = self.rates[1 - axis];
        rates[1 - axis] = if second { [middle, end, Rate::NONE] } else { [start, middle, Rate::NONE] };
        rates[axis][2] = Rate::NONE;
        Self { sides, rates }
    }

    /// The parameters that points of the part have.
    pub(crate) fn domain(&self) -> Domain {
        let range = |axis: usize| {
            let side = self.sides[axis];
            let [start, end, _] = self.rates[axis].map(|rate| side.snapped(0, 0, rate));
            [if start < end { start } else { end }, side.at(1, 0)]
        };
        Domain { u: range(0), v: range(1) }
    }

    /// The segments of the grid along u and v as powers of two. All lines must have rates.
    pub(crate) fn grid_bits(&self) -> [u8; 2] {
        [0, 1].map(|axis| {
            let finest = self.rates[axis].iter().fold(0, |finest, rate| rate.0.max(finest));
            finest.saturating_sub(self.sides[axis].level)
        })
    }

    /// The parameters of a point of the grid.
    pub(crate) fn parameters(&self, bits: [u8; 2], places: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let (side, bits_here) = (self.sides[axis], bits[axis]);
            let across = places[1 - axis];
            if across == 0 {
                side.snapped(places[axis], bits_here, self.rates[axis][0])
            } else if across == 1 << bits[1 - axis] {
                side.snapped(places[axis], bits_here, self.rates[axis][1])
            } else {
                side.at(places[axis], bits_here)
            }
        })
    }

    /// The parameters of all points of the grid, row by row: v grows from row to row.
    pub(crate) fn grid(&self, bits: [u8; 2], parameters: &mut Vec<[f64; 2]>) {
        let [across, along] = bits.map(|bits| 1_u32 << bits);
        let mut inner = [[0.0; 2]; 1 << GRID_BITS];
        for (u, inner) in (0..across).zip(&mut inner) {
            inner[0] = self.sides[0].at(u, bits[0]);
        }
        let inner = &mut inner[1..across as usize];
        for v in 0..=along {
            if v == 0 || v == along {
                parameters.extend((0..=across).map(|u| self.parameters(bits, [u, v])));
                continue;
            }
            let at = self.sides[1].at(v, bits[1]);
            inner.iter_mut().for_each(|point| point[1] = at);
            parameters.push(self.parameters(bits, [0, v]));
            parameters.extend_from_slice(inner);
            parameters.push(self.parameters(bits, [across, v]));
        }
    }
}
