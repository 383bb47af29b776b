//! Opens what a rule speaks of: groups into their parts, patches into smaller ones, and those into grids of points.
//!
//! What comes out of an object depends on the object and on the density of all rays, never on a sub-pencil. So it does
//! not matter who opens it, how often, and what is dropped meanwhile.
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987.

use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::reyes::dice::density::{Density, SAMPLES};
use crate::reyes::dice::detail::Detail;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::patch::{Line, Rate, SubPatch};
use crate::reyes::dice::rule::{Domain, OnDemand};
use crate::stats::Stats;

/// An object, or a part of a patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece<O> {
    pub(crate) object: O,
    /// What part of a patch; none where nobody has asked yet whether it is one.
    pub(crate) part: Option<SubPatch>,
}

impl<O: Copy> Piece<O> {
    /// An object as the rule gives it.
    pub(crate) fn of(object: O) -> Self {
        Self { object, part: None }
    }

    /// The part, if there is nothing left to do but to dice it.
    pub(crate) fn ready(&self) -> Option<SubPatch> {
        self.part.filter(|part| part.must_split().is_none())
    }

    /// A box around all that the piece can show.
    pub(crate) fn bounds<S: OnDemand<Object = O>>(&self, surfaces: &S, detail: &Detail) -> Aabb {
        surfaces.bounds(&self.object, self.part.map_or(Domain::UNIT, |part| part.domain()), detail)
    }
}

/// Opens pieces of some surfaces, with room to work in.
pub(crate) struct Dicer<'a, S: OnDemand> {
    pub(crate) surfaces: &'a S,
    pub(crate) density: &'a Density,
    pub(crate) detail: Detail,
    pub(crate) shading_rate: f64,
    objects: Vec<S::Object>,
    /// The parameters of the points.
    pub(crate) parameters: Vec<[f64; 2]>,
    /// The points of the grid that was diced last, row by row: v grows from row to row.
    pub(crate) points: Vec<[f32; 3]>,
}

impl<'a, S: OnDemand> Dicer<'a, S> {
    pub(crate) fn new(surfaces: &'a S, density: &'a Density, dicing: &Dicing) -> Self {
        Self {
            surfaces,
            density,
            detail: density.detail.of_micropolygons(dicing),
            shading_rate: dicing.shading_rate,
            objects: Vec::new(),
            parameters: Vec::new(),
            points: Vec::new(),
        }
    }

    /// Bytes of the buffers.
    pub(crate) fn bytes(&self) -> usize {
        self.objects.capacity() * size_of::<S::Object>()
            + self.parameters.capacity() * size_of::<[f64; 2]>()
            + self.points.capacity() * size_of::<[f32; 3]>()
    }

    /// Appends the parts of a piece that is not ready. One that turns out to be ready has none: it is returned.
    /// `bounds` is the box of the piece.
    pub(crate) fn open(
        &mut self,
        piece: &Piece<S::Object>,
        bounds: &Aabb,
        parts: &mut Vec<Piece<S::Object>>,
        stats: &mut Stats,
    ) -> Option<Piece<S::Object>> {
        let object = piece.object;
        let whole = match piece.part {
            Some(part) => part,
            None => {
                self.objects.clear();
                let spacing = self.detail.least_spacing(bounds);
                if self.surfaces.expand(&object, spacing, &self.detail, &mut self.objects) {
                    stats.surfaces_expanded += 1;
                    parts.extend(self.objects.iter().map(|&object| Piece::of(object)));
                    return None;
                }
                let mut whole = SubPatch::WHOLE;
                self.measure(&object, &mut whole);
                whole
            }
        };
        let Some(axis) = whole.must_split() else {
            return Some(Piece { object, part: Some(whole) });
        };
        stats.surfaces_split += 1;
        for second in [false, true] {
            let mut half = whole.half(axis, second);
            self.measure(&object, &mut half);
            parts.push(Piece { object, part: Some(half) });
        }
        None
    }

    /// Measures the lines of a part that have no rates.
    fn measure(&mut self, object: &S::Object, part: &mut SubPatch) {
        let lines = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)];
        let missing = |&(axis, which): &(usize, usize)| part.rates[axis][which] == Rate::NONE;
        self.parameters.clear();
        for (axis, which) in lines.into_iter().filter(missing) {
            self.parameters.extend(samples(part.line(axis, which)));
        }
        self.points.clear();
        self.surfaces.evaluate(object, &self.parameters, &self.detail, &mut self.points);
        // At most six lines.
        let measured = self.points.as_chunks::<SAMPLES>().0;
        let lengths = self.density.lengths(measured);
        let mut measured = measured.iter().zip(lengths);
        for (axis, which) in lines {
            let rate = &mut part.rates[axis][which];
            if *rate == Rate::NONE {
                let side = part.sides[axis];
                *rate = match measured.next() {
                    // Points that are missing are an error when the part is diced.
                    None => Rate::of(side, 0.0),
                    Some((points, length)) => match Rate::of(side, length / self.shading_rate) {
                        Rate::NONE if self.density.is_mostly_rounding(points, length) => Rate::measured(side),
                        rate => rate,
                    },
                };
            }
        }
    }

    /// Dices a part: its points are in [`Dicer::points`]. Returns the segments along u and v as powers of two.
    pub(crate) fn dice(&mut self, object: &S::Object, part: &SubPatch) -> Result<[u8; 2], Error> {
        let bits = part.grid_bits();
        self.parameters.clear();
        part.grid(bits, &mut self.parameters);
        self.points.clear();
        self.surfaces.evaluate(object, &self.parameters, &self.detail, &mut self.points);
        if self.points.len() == self.parameters.len() {
            Ok(bits)
        } else {
            let (points, parameters) = (self.points.len(), self.parameters.len());
            Err(Error::SurfacePoints { surface: self.surfaces.id(object), points, parameters })
        }
    }

    /// The error for a grid with a point that is not finite, if there is one.
    pub(crate) fn check_points(&self, object: &S::Object) -> Result<(), Error> {
        let wrong = |(_, point): &(&[f64; 2], &[f32; 3])| !point.iter().all(|x| x.is_finite());
        match self.parameters.iter().zip(&self.points).find(wrong) {
            None => Ok(()),
            Some((&parameters, &position)) => {
                Err(Error::SurfacePoint { surface: self.surfaces.id(object), parameters, position })
            }
        }
    }
}

/// The parameters at which a line is measured.
fn samples(line: Line) -> [[f64; 2]; SAMPLES] {
    let mut parameters = [[line.across; 2]; SAMPLES];
    for (place, parameters) in (0..).zip(&mut parameters) {
        // A quarter of the interval each.
        parameters[line.axis] = line.interval.at(place, 2);
    }
    parameters
}
