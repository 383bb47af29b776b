//! How dense the rays of a pencil are: lengths of lines of points in pixels, and the spacing of rays in a box.
//!
//! Lengths must be defined everywhere, behind the eye too, and must not depend on a sub-pencil: they decide how
//! surfaces are diced. So nothing is projected. From an origin at a point the step from A to B (both from the origin)
//! is the sine of their angle,
//!
//! |A×B|/(|A||B|), or 2 less that where the angle is obtuse,
//!
//! over the angle of a pixel there. That of a film at distance f with pixels of side h is (h/f)·cos θ across and
//! (h/f)·cos²θ along the direction away from its axis; the geometric mean stands for both, θ kept within the film. Of
//! several films that hold the direction the densest counts. From infinity the step is |(B − A)×D|/|D| over the least
//! side of a pixel. Every step has the same bits from A to B as from B to A, and so has their sum.
//!
//! Positions are rounded to f32. Far from the origin a step of that can be as long as many pixels, and no line gets
//! shorter than that however often it is halved. So a length is also known without what rounding may have added: each
//! coordinate of a step from A to B counts as shorter by 2⁻²² of the greater of its two magnitudes, two to four units
//! in the last place, while the middle of the step stays where it is.
//!
//! Rays that start all over a box and leave to all sides have no film. Around them a pixel is as wide as they are apart
//! at their start, or the angle between them times the distance from the box, whichever is more, across any direction.
//!
//! Based on: Matthew Fisher et al., "DiagSplit: Parallel, Crack-free, Adaptive Tessellation for Micropolygon
//! Rendering", 2009 (the length of an edge from samples of it alone).

use fearless_simd::{Level, dispatch, prelude::*};
use glam::DVec3;

use crate::error::Error;
use crate::rays::film::Film;
use crate::rays::film::GridFilm;
use crate::rays::origin::Origin;
use crate::rays::pencil::Pencil;
use crate::reyes::dice::detail::{Around, Detail};
use crate::reyes::dice::dicing::Dicing;
use crate::simd::isa::Isa;
use crate::simd::lanes::{LANES, Lanes, Points};

/// Points at which a line is measured.
pub(crate) const SAMPLES: usize = 5;
/// What rounding may add to a step of a coordinate: 2⁻²² of its magnitude, and two of the least numbers there are.
const ROUNDING: [f64; 2] = [1.0 / (1 << 22) as f64, f32::from_bits(2) as f64];

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
        dispatch!(self.level, simd => self.lengths_lanes::<_, false>(simd, lines))
    }

    /// Whether at least half of the length of a line may be due to rounding: its halves need not be shorter. The same
    /// from either end.
    pub(crate) fn is_mostly_rounding(&self, line: &[[f32; 3]; SAMPLES], length: f64) -> bool {
        if !length.is_finite() {
            // Nor does halving mend points that are not finite: they are an error when the part is diced.
            return true;
        }
        // Most lines are decided here: rounding is a small part of them.
        let (mut greatest, mut longest) = (0.0_f32, 0.0_f32);
        for (from, to) in line.iter().zip(&line[1..]) {
            for k in 0..3 {
                greatest = greatest.max(from[k].abs()).max(to[k].abs());
                longest = longest.max((to[k] - from[k]).abs());
            }
        }
        if f64::from(longest) > 16.0 * rounding(f64::from(greatest)) {
            return false;
        }
        let certain = dispatch!(self.level, simd => self.lengths_lanes::<_, true>(simd, &[*line]));
        certain[0] * 2.0 <= length
    }

    /// The lengths of up to eight lines, or with `CERTAIN` what is left of them without rounding.
    #[inline(always)]
    fn lengths_lanes<S: Simd, const CERTAIN: bool>(
        &self,
        simd: S,
        lines: &[[[f32; 3]; SAMPLES]],
    ) -> [f64; LANES] {
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
        let ends = |k: usize| {
            let ends = [points[k], points[k + 1]];
            if CERTAIN { drawn_together(ends) } else { ends }
        };
        let mut steps = [Lanes::simd_from(simd, 0.0); SAMPLES - 1];
        let density = match self.source {
            Source::Point(eye) => {
                let eye = Points::splat(simd, eye);
                for (k, step) in steps.iter_mut().enumerate() {
                    let [a, b] = ends(k);
                    *step = angles(simd, a.minus(eye), b.minus(eye));
                }
                self.towards(simd, points[SAMPLES / 2].minus(eye))
            }
            Source::Box => {
                for (k, step) in steps.iter_mut().enumerate() {
                    let [a, b] = ends(k);
                    *step = sizes(b.minus(a));
                }
                Lanes::simd_from(simd, 1.0) / self.detail.least(simd, [points[SAMPLES / 2]; 2])
            }
            Source::Infinity => {
                let direction = Points::splat(simd, self.direction);
                for (k, step) in steps.iter_mut().enumerate() {
                    let [a, b] = ends(k);
                    *step = sizes(b.minus(a).cross(direction));
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

impl Detail {
    /// What the rays of a pencil can tell apart, or micropolygons if these are larger than a pixel.
    ///
    /// # Errors
    /// When a film is scattered, the shading rate is out of range, or the machine has no such instructions.
    pub fn new(pencil: &Pencil, dicing: &Dicing, isa: Isa) -> Result<Self, Error> {
        dicing.check()?;
        Ok(Density::new(pencil, isa.level()?)?.detail.of_micropolygons(dicing))
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

/// What rounding may add to a step between coordinates of some magnitude: at least two units in the last place.
fn rounding(magnitude: f64) -> f64 {
    magnitude * ROUNDING[0] + ROUNDING[1]
}

/// The ends of steps that are shorter by what rounding may have added, around the same middles. The same from either
/// end.
#[inline(always)]
fn drawn_together<S: Simd>([a, b]: [Points<S>; 2]) -> [Points<S>; 2] {
    let axis = |a: Lanes<S>, b: Lanes<S>| {
        let rounding = a.abs().max(b.abs()) * ROUNDING[0] + ROUNDING[1];
        let step = b - a;
        let half = ((step - rounding).max(0.0) + (step + rounding).min(0.0)) * 0.5;
        let middle = (a + b) * 0.5;
        [middle - half, middle + half]
    };
    let [x, y, z] = [axis(a.x, b.x), axis(a.y, b.y), axis(a.z, b.z)];
    [0, 1].map(|end| Points { x: x[end], y: y[end], z: z[end] })
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
