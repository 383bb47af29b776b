//! How dense the rays of a pencil are: lengths of lines of points in pixels, and the spacing of rays in a box.
//!
//! Lengths must be defined everywhere, behind the eye too, and must not depend on a sub-pencil: they decide how surfaces are
//! diced. So nothing is projected. From an origin at a point the step from A to B (both from the origin) is the sine of
//! their angle,
//!
//! |A×B|/(|A||B|), or 2 less that where the angle is obtuse,
//!
//! over the angle of a pixel there. That of a film at distance f with pixels of side h is (h/f)·cos θ across and
//! (h/f)·cos²θ along the direction away from its axis; the geometric mean stands for both, θ kept within the film. Of
//! several films that hold the direction the densest counts. From infinity the step is |(B − A)×D|/|D| over the least side
//! of a pixel. Every step has the same bits from A to B as from B to A, and so has their sum.
//!
//! Rays that start all over a box and leave to all sides have no film. Around them a pixel is as wide as they are apart at their
//! start, or the angle between them times the distance from the box, whichever is more, across any direction.
//!
//! Based on: Matthew Fisher et al., "DiagSplit: Parallel, Crack-free, Adaptive Tessellation for Micropolygon Rendering",
//! 2009 (the length of an edge from samples of it alone).

use glam::DVec3;

use crate::film::Film;
use crate::pencil::{Origin, Pencil};
use crate::triangles::widen;
use crate::{Aabb, Error, GridFilm};

/// Points at which a line is measured.
pub(crate) const SAMPLES: usize = 5;

/// The pixels of a film as seen from a point.
#[derive(Debug, Clone, Copy)]
struct FilmPixels {
    /// The unit normal of the film, away from the eye.
    axis: DVec3,
    /// The least cosine between it and a ray of the film.
    least_cosine: f64,
    /// Pixels per unit of angle on the axis.
    density: f64,
}

/// Rays that start all over a box and leave to all sides: how far apart they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    /// The box that they start in.
    pub bounds: Aabb,
    /// World units between neighbours at their start: positive.
    pub spacing: f64,
    /// The angle between neighbours, in radians: farther away they are as far apart as this times the distance from the box.
    pub angle: f64,
}

/// Where rays come from.
#[derive(Debug, Clone, Copy)]
enum Source {
    Point(DVec3),
    Infinity,
    Box(Around),
}

/// The density of a pencil's rays.
#[derive(Debug, Clone)]
pub(crate) struct Density {
    source: Source,
    films: Vec<FilmPixels>,
    /// The unit direction of parallel rays.
    direction: DVec3,
    /// Pixels per unit of angle or length where no film is.
    outside: f64,
    /// The least angle of a pixel, or its least side at infinity.
    least_pixel: f64,
}

impl Density {
    /// The density of the rays of grid films.
    ///
    /// # Errors
    /// When a film is scattered: its rays have no density.
    pub(crate) fn new(pencil: &Pencil) -> Result<Self, Error> {
        let grid = |film| match film {
            &Film::Grid(film) => Ok(film),
            Film::Scattered(_) => Err(Error::ScatteredDensity),
        };
        let grids: Vec<GridFilm> = pencil.films().iter().map(grid).collect::<Result<_, _>>()?;
        Ok(match pencil.origin() {
            Origin::Point(eye) => Self::from_point(eye, &grids),
            Origin::Infinity(direction) => Self::from_infinity(direction, &grids),
        })
    }

    /// The density of rays that start all over a box.
    pub(crate) fn around(around: &Around) -> Self {
        let least_pixel = around.spacing;
        let outside = 1.0 / least_pixel;
        Self { source: Source::Box(*around), films: Vec::new(), direction: DVec3::ZERO, outside, least_pixel }
    }

    fn from_point(eye: DVec3, grids: &[GridFilm]) -> Self {
        let films: Vec<FilmPixels> = grids.iter().map(FilmPixels::new).collect();
        let (mut outside, mut least_pixel) = (f64::INFINITY, f64::INFINITY);
        for film in &films {
            let angle = film.least_cosine * film.least_cosine / film.density;
            outside = if film.density < outside { film.density } else { outside };
            least_pixel = if angle < least_pixel { angle } else { least_pixel };
        }
        Self { source: Source::Point(eye), films, direction: DVec3::ZERO, outside, least_pixel }
    }

    fn from_infinity(direction: DVec3, grids: &[GridFilm]) -> Self {
        let direction = direction / direction.abs().max_element();
        let direction = direction / length(direction);
        let mut least_pixel = f64::INFINITY;
        for film in grids {
            let [_, right, up] = film.span();
            for side in [right, up] {
                let side = length(cross(side, direction)) * film.step();
                least_pixel = if side < least_pixel { side } else { least_pixel };
            }
        }
        let outside = 1.0 / least_pixel;
        Self { source: Source::Infinity, films: Vec::new(), direction, outside, least_pixel }
    }

    /// The length in pixels of a line through some points.
    pub(crate) fn length(&self, points: &[[f32; 3]; SAMPLES]) -> f64 {
        let mut steps = [0.0; SAMPLES - 1];
        let density = match self.source {
            Source::Point(eye) => {
                let points = points.map(|p| widen(p) - eye);
                let squares = points.map(|p| dot(p, p));
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = angle((points[k], squares[k]), (points[k + 1], squares[k + 1]));
                }
                self.towards(points[SAMPLES / 2])
            }
            Source::Box(around) => {
                let points = points.map(widen);
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = length(points[k + 1] - points[k]);
                }
                let middle = points[SAMPLES / 2];
                1.0 / around.pixel([middle; 2])
            }
            Source::Infinity => {
                let points = points.map(widen);
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = length(cross(points[k + 1] - points[k], self.direction));
                }
                self.outside
            }
        };
        // The same from either end.
        ((steps[0] + steps[3]) + (steps[1] + steps[2])) * density
    }

    /// Pixels per unit of angle in a direction.
    fn towards(&self, direction: DVec3) -> f64 {
        let size = length(direction);
        let mut densest = 0.0;
        for film in &self.films {
            let cosine = dot(direction, film.axis) / size;
            if cosine >= film.least_cosine {
                let density = film.density / (cosine * cosine.sqrt());
                densest = if density > densest { density } else { densest };
            }
        }
        if densest > 0.0 { densest } else { self.outside }
    }

    /// The least distance between neighbouring rays within a box, in world units.
    pub(crate) fn spacing(&self, bounds: &Aabb) -> f64 {
        let (lo, hi) = bounds.corners();
        match self.source {
            Source::Point(eye) => gap([lo, hi], [eye; 2]) * self.least_pixel,
            Source::Infinity => self.least_pixel,
            Source::Box(around) => around.pixel([lo, hi]),
        }
    }
}

impl Around {
    /// How far apart the rays are where they come to a box, at least.
    fn pixel(&self, ends: [DVec3; 2]) -> f64 {
        let (lo, hi) = self.bounds.corners();
        let wide = gap(ends, [lo, hi]) * self.angle;
        if wide > self.spacing { wide } else { self.spacing }
    }

    /// Whether pixels have a size.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let is_size = self.spacing > 0.0 && self.spacing.is_finite();
        if is_size && self.angle >= 0.0 && self.angle.is_finite() && !self.bounds.is_empty() {
            Ok(())
        } else {
            Err(Error::Spacing { spacing: self.spacing, angle: self.angle })
        }
    }
}

/// The distance between two boxes.
pub(crate) fn gap([lo, hi]: [DVec3; 2], [other_lo, other_hi]: [DVec3; 2]) -> f64 {
    let gap = |k: usize| {
        let (below, above) = (lo[k] - other_hi[k], other_lo[k] - hi[k]);
        let gap = if below > above { below } else { above };
        if gap > 0.0 { gap } else { 0.0 }
    };
    length(DVec3::new(gap(0), gap(1), gap(2)))
}

impl FilmPixels {
    fn new(film: &GridFilm) -> Self {
        let [forward, right, up] = film.span();
        let normal = cross(right, up);
        let normal = normal / length(normal);
        let distance = dot(forward, normal);
        let axis = if distance < 0.0 { -normal } else { normal };
        let (width, height) = (film.width() - 1, film.height() - 1);
        let mut least_cosine = 1.0;
        for (i, j) in [(0, 0), (width, 0), (0, height), (width, height)] {
            let ray = film.at(i, j);
            let cosine = dot(ray, axis) / length(ray);
            least_cosine = if cosine < least_cosine { cosine } else { least_cosine };
        }
        let (right, up) = (length(right), length(up));
        let side = if right < up { right } else { up } * film.step();
        Self { axis, least_cosine, density: distance.abs() / side }
    }
}

/// The sine of the angle between two vectors given with their squares; 2 less that where the angle is obtuse.
fn angle((a, a_square): (DVec3, f64), (b, b_square): (DVec3, f64)) -> f64 {
    let normal = cross(a, b);
    let sine = (dot(normal, normal) / (a_square * b_square)).sqrt();
    if sine.is_nan() {
        // One of them is zero: the line ends at the eye.
        0.0
    } else if dot(a, b) < 0.0 {
        2.0 - sine
    } else {
        sine
    }
}

/// a·b, summed in order.
fn dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// a×b.
fn cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// |a|.
fn length(a: DVec3) -> f64 {
    dot(a, a).sqrt()
}
