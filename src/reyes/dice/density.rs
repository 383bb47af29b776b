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

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::rays::film::Film;
use crate::rays::film::GridFilm;
use crate::rays::origin::Origin;
use crate::rays::pencil::Pencil;
use crate::reyes::dice::detail::Detail;
use crate::simd::lanes::{LANES, Lanes, Points};

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
    Box,
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
    /// How far apart the rays are, at least.
    pub(crate) detail: Detail,
    level: Level,
}

impl Density {
    /// The density of the rays of grid films.
    ///
    /// # Errors
    /// When a film is scattered: its rays have no density.
    pub(crate) fn new(pencil: &Pencil, level: Level) -> Result<Self, Error> {
        let grid = |film| match film {
            &Film::Grid(film) => Ok(film),
            Film::Scattered(_) => Err(Error::ScatteredDensity),
        };
        let grids: Vec<GridFilm> = pencil.films().iter().map(grid).collect::<Result<_, _>>()?;
        Ok(match pencil.origin() {
            Origin::Point(eye) => Self::from_point(eye, &grids, level),
            Origin::Infinity(direction) => Self::from_infinity(direction, &grids, level),
        })
    }

    /// The density of rays that start all over a box.
    pub(crate) fn around(around: &Around, level: Level) -> Self {
        Self {
            source: Source::Box,
            films: Vec::new(),
            direction: DVec3::ZERO,
            outside: 1.0 / around.spacing,
            detail: Detail::around(around, level),
            level,
        }
    }

    fn from_point(eye: DVec3, grids: &[GridFilm], level: Level) -> Self {
        let films: Vec<FilmPixels> = grids.iter().map(FilmPixels::new).collect();
        let (mut outside, mut least_pixel) = (f64::INFINITY, f64::INFINITY);
        for film in &films {
            let angle = film.least_cosine * film.least_cosine / film.density;
            outside = if film.density < outside { film.density } else { outside };
            least_pixel = if angle < least_pixel { angle } else { least_pixel };
        }
        let detail = Detail::from_point(eye, least_pixel, level);
        Self { source: Source::Point(eye), films, direction: DVec3::ZERO, outside, detail, level }
    }

    fn from_infinity(direction: DVec3, grids: &[GridFilm], level: Level) -> Self {
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
        let (outside, detail) = (1.0 / least_pixel, Detail::from_infinity(least_pixel, level));
        Self { source: Source::Infinity, films: Vec::new(), direction, outside, detail, level }
    }

    /// The lengths in pixels of up to eight lines through some points each.
    pub(crate) fn lengths(&self, lines: &[[[f32; 3]; SAMPLES]]) -> [f64; LANES] {
        dispatch!(self.level, simd => self.lengths_lanes(simd, lines))
    }

    #[inline(always)]
    fn lengths_lanes<S: Simd>(&self, simd: S, lines: &[[[f32; 3]; SAMPLES]]) -> [f64; LANES] {
        let mut read = [[[0.0; LANES]; 3]; SAMPLES];
        for (lane, line) in lines.iter().enumerate().take(LANES) {
            for (read, point) in read.iter_mut().zip(line) {
                (0..3).for_each(|k| read[k][lane] = point[k]);
            }
        }
        let mut points = [Points::splat(simd, DVec3::ZERO); SAMPLES];
        for (point, read) in points.iter_mut().zip(&read) {
            *point = Points::widen(simd, read);
        }
        let mut steps = [Lanes::simd_from(simd, 0.0); SAMPLES - 1];
        let density = match self.source {
            Source::Point(eye) => {
                let eye = Points::splat(simd, eye);
                for point in &mut points {
                    *point = point.minus(eye);
                }
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = angles(simd, points[k], points[k + 1]);
                }
                self.towards(simd, points[SAMPLES / 2])
            }
            Source::Box => {
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = sizes(points[k + 1].minus(points[k]));
                }
                Lanes::simd_from(simd, 1.0) / self.detail.least(simd, [points[SAMPLES / 2]; 2])
            }
            Source::Infinity => {
                let direction = Points::splat(simd, self.direction);
                for (k, step) in steps.iter_mut().enumerate() {
                    *step = sizes(points[k + 1].minus(points[k]).cross(direction));
                }
                Lanes::simd_from(simd, self.outside)
            }
        };
        // The same from either end.
        (((steps[0] + steps[3]) + (steps[1] + steps[2])) * density).to_array()
    }

    /// Pixels per unit of angle in eight directions.
    #[inline(always)]
    fn towards<S: Simd>(&self, simd: S, direction: Points<S>) -> Lanes<S> {
        let (size, zero) = (sizes(direction), Lanes::simd_from(simd, 0.0));
        let mut densest = zero;
        for film in &self.films {
            let cosine = direction.dot(film.axis) / size;
            let density = Lanes::simd_from(simd, film.density) / (cosine * cosine.sqrt());
            let counts = cosine.simd_ge(film.least_cosine) & density.simd_gt(densest);
            densest = counts.select(density, densest);
        }
        densest.simd_gt(zero).select(densest, Lanes::simd_from(simd, self.outside))
    }
}

impl Around {
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

/// The sines of the angles between vectors; 2 less that where the angle is obtuse.
#[inline(always)]
fn angles<S: Simd>(simd: S, a: Points<S>, b: Points<S>) -> Lanes<S> {
    let normal = a.cross(b);
    let sine = (normal.dot_lanes(normal) / (a.dot_lanes(a) * b.dot_lanes(b))).sqrt();
    let obtuse = a.dot_lanes(b).simd_lt(0.0);
    // NaN where one of them is zero: the line ends at the eye.
    sine.simd_eq(sine).select(obtuse.select(2.0 - sine, sine), Lanes::simd_from(simd, 0.0))
}

/// The lengths of vectors.
#[inline(always)]
fn sizes<S: Simd>(a: Points<S>) -> Lanes<S> {
    a.dot_lanes(a).sqrt()
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
