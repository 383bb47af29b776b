//! Films: planes on which the rays of a pencil are points (x, y).
//!
//! A grid film holds the rays d = F + X·R + Y·U (origin at a point), or the start points p = F + X·R + Y·U (origin at
//! infinity), with X = 2i + 1 − W and Y = H − 1 − 2j for pixel (i, j). F, R and U are rounded once to multiples of q =
//! 2^(⌈log₂ M⌉ − 52), M = max_k(|F_k| + W|R_k| + H|U_k|) (W and H times the subpixels): then every partial result is a
//! multiple of q below 2⁵³q, so f64 is exact, with or without fused operations. That ray is the truth on every path.
//!
//! Based on: Marc Olano and Trey Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997 (the film as
//! the plane of homogeneous coordinates); Gregory Johnson et al., "The Irregular Z-Buffer", 2005 (scattered films).

use glam::DVec3;

use crate::error::Error;
use crate::exact::expansion::Expansion;
use crate::exact::filter::Sign;

/// The spacing of origins at infinity, 2⁻¹⁴⁹: start points are origins.
const START_GRID_EXPONENT: i32 = -149;

/// The most pixels along one side. Pixel numbers then fit any integer that the leaf uses.
const MAX_SIDE: u32 = 1 << 20;

/// Rays at the centres of a regular grid, row by row from the top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridFilm {
    width: u32,
    height: u32,
    /// Subpixels per pixel side: X = s(2i + 1 − W) + x₀.
    subpixels: u32,
    /// (x₀, y₀) in half subpixels.
    offset: [i32; 2],
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl GridFilm {
    /// A film of `width` x `height` rays. `forward` points at (or is) the centre of the film, `right` and `up` span
    /// half a pixel each. They are rounded to the film's own spacing q.
    ///
    /// # Errors
    /// When a side is zero or above 2²⁰, or a vector is not finite. Whether the vectors span space is seen by
    /// [`crate::rays::pencil::Pencil::new`].
    pub fn new(width: u32, height: u32, forward: DVec3, right: DVec3, up: DVec3) -> Result<Self, Error> {
        Self::with_subpixel(width, height, [forward, right, up], 1, [0, 0])
    }

    /// The same film with every ray moved by `offset`/(2·`subpixels`) of a pixel, to the right and up: one pass of a
    /// supersampled picture.
    ///
    /// `subpixels` is a power of two up to 256; `offset` lies within ±`subpixels`. The span is [forward, right, up].
    ///
    /// # Errors
    /// As [`GridFilm::new`], or when the subpixels are out of range.
    pub fn with_subpixel(
        width: u32,
        height: u32,
        span: [DVec3; 3],
        subpixels: u32,
        offset: [i32; 2],
    ) -> Result<Self, Error> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::Film { reason: "each side must have 1 to 2^20 pixels" });
        }
        if !span.iter().all(|v| v.is_finite()) {
            return Err(Error::Film { reason: "its vectors must be finite" });
        }
        let in_range = offset.iter().all(|o| o.unsigned_abs() <= subpixels);
        if !subpixels.is_power_of_two() || subpixels > 256 || !in_range {
            return Err(Error::Film {
                reason: "subpixels must be a power of two up to 256, offsets within them",
            });
        }
        let scale = f64::from(subpixels);
        let [forward, right, up] = [span[0], span[1] / scale, span[2] / scale];
        let film = Self { width, height, subpixels, offset, forward, right, up };
        Ok(film.rounded_to(i32::MIN))
    }

    /// The film with F, R, U rounded to multiples of q, and q at least 2^`least_exponent`.
    fn rounded_to(self, least_exponent: i32) -> Self {
        let exponent = (0..3).filter_map(|k| self.magnitude_exponent(k)).max();
        let Some(exponent) = exponent else {
            return self;
        };
        let q = power_of_two((exponent - 52).max(least_exponent));
        let round = |v: DVec3| DVec3::from_array(v.to_array().map(|x| (x / q).round_ties_even() * q));
        Self { forward: round(self.forward), right: round(self.right), up: round(self.up), ..self }
    }

    /// The film as a film of start points, which lie on the grid of origins.
    pub(crate) fn rounded_for_start_points(self) -> Self {
        self.rounded_to(START_GRID_EXPONENT)
    }

    /// ⌈log₂(|F_k| + W|R_k| + H|U_k|)⌉, exactly; `None` for zero.
    fn magnitude_exponent(&self, k: usize) -> Option<i32> {
        let x = f64::from(self.subpixels) * f64::from(self.width);
        let y = f64::from(self.subpixels) * f64::from(self.height);
        let sum = Expansion::of(self.forward[k].abs())
            .plus(&Expansion::of(self.right[k].abs()).scaled(x))
            .plus(&Expansion::of(self.up[k].abs()).scaled(y));
        let estimate = self.forward[k].abs() + x * self.right[k].abs() + y * self.up[k].abs();
        if estimate == 0.0 {
            return None;
        }
        // The estimate is within a few ulp, so its exponent is off by one at most.
        let floor = exponent_of(estimate) - 1;
        (floor..floor + 3).find(|&e| sum.minus(&Expansion::of(power_of_two(e))).sign() != Sign::Positive)
    }

    /// Rays per row.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// F, R, U after rounding, as the rays have them: those of half a subpixel.
    #[must_use]
    pub fn span(&self) -> [DVec3; 3] {
        [self.forward, self.right, self.up]
    }

    /// X of column i: a whole number.
    #[must_use]
    pub fn x(&self, i: u32) -> f64 {
        let s = f64::from(self.subpixels);
        s * (2.0 * f64::from(i) + 1.0 - f64::from(self.width)) + f64::from(self.offset[0])
    }

    /// Y of row j: a whole number.
    #[must_use]
    pub fn y(&self, j: u32) -> f64 {
        let s = f64::from(self.subpixels);
        s * (f64::from(self.height) - 1.0 - 2.0 * f64::from(j)) + f64::from(self.offset[1])
    }

    /// The step of X from column to column, and of −Y from row to row.
    pub(crate) fn step(&self) -> f64 {
        2.0 * f64::from(self.subpixels)
    }

    /// F + X·R + Y·U at pixel (i, j). Exact.
    pub(crate) fn at(&self, i: u32, j: u32) -> DVec3 {
        self.forward + self.right * self.x(i) + self.up * self.y(j)
    }
}

/// The binary exponent of a positive normal or subnormal number: 2^e ≤ x < 2^(e+1).
fn exponent_of(x: f64) -> i32 {
    // Scaling lifts subnormals into the normal range; the field then holds e + 1023.
    let (scaled, shift) = if x < f64::MIN_POSITIVE { (x * power_of_two(64), 64) } else { (x, 0) };
    let field = (scaled.to_bits() >> 52) & 0x7FF;
    i32::try_from(field).map_or(0, |e| e - 1023 - shift)
}

/// 2^e, also subnormal ones.
fn power_of_two(e: i32) -> f64 {
    let normal = |e: i32| f64::from_bits(u64::from((e + 1023).unsigned_abs()) << 52);
    match e {
        ..=-1023 => normal((e + 200).clamp(-1022, 1023)) * normal(-200),
        _ => normal(e.min(1023)),
    }
}

/// Where the rays of a film lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sampling {
    /// At the centres of its columns and rows.
    Grid,
    /// Anywhere.
    Scattered,
}

/// The rays of one film of a pencil.
#[derive(Debug, Clone, PartialEq)]
pub enum Film {
    /// Rays at pixel centres.
    Grid(GridFilm),
    /// Rays anywhere: directions from a point, or start points of parallel rays, f32 or f64, taken as they are.
    Scattered(Vec<DVec3>),
}

impl Film {
    /// The number of rays.
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Grid(film) => u64::from(film.width) * u64::from(film.height),
            Self::Scattered(samples) => samples.len() as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_exponents() {
        for e in [-1074, -1050, -1023, -1022, -149, 0, 1, 129, 1000] {
            assert_eq!(exponent_of(power_of_two(e)), e);
        }
        assert_eq!(exponent_of(1.5), 0);
    }

    /// Summing in any order, with or without a fused operation, gives the same ray.
    #[test]
    fn rays_are_exact() {
        let (f, r, u) =
            (DVec3::new(0.1, -7.3, 1e-9), DVec3::new(1e-3, 0.7e-3, 0.0), DVec3::new(0.3, 1e-7, 2e-5));
        let film = GridFilm::new(1921, 1079, f, r, u).expect("a valid film");
        for (i, j) in [(0, 0), (1920, 3), (17, 1078), (960, 539)] {
            let (x, y) = (film.x(i), film.y(j));
            for k in 0..3 {
                let (f, r, u) = (film.forward[k], film.right[k], film.up[k]);
                let exact =
                    Expansion::of(r).scaled(x).plus(&Expansion::of(u).scaled(y)).plus(&Expansion::of(f));
                assert_eq!(exact, Expansion::of(film.at(i, j)[k]));
                assert_eq!(film.at(i, j)[k], (x * r + y * u) + f);
            }
        }
    }
}
