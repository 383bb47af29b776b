//! A pencil: rays through one common origin.
//!
//! The origin is homogeneous. A point (w = 1) is an eye, a point light, the centre of an environment map, an
//! ambient-occlusion receiver; a direction (w = 0), an origin at infinity, is an orthographic camera or the sun.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (rays with inherent structure).

use glam::DVec3;

use crate::error::Error;
use crate::geometry::ray::{Ray, Ties, check_direction, check_origin};
use crate::rays::film::{Film, GridFilm};
use crate::rays::frustum::Projection;
use crate::rays::origin::Origin;

/// Rays through a common origin, on one or more films. Ray indices run through the films in order, row by row in a
/// grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Pencil {
    origin: Origin,
    films: Vec<Film>,
    /// The index of each film's first ray.
    first_rays: Vec<u32>,
    rays: u32,
}

impl Pencil {
    /// Checks and keeps the rays. O(scattered rays).
    ///
    /// # Errors
    /// When the origin, a direction or a start point is out of the range of [`Ray`], a grid film spans no volume, or
    /// there are more than 2³² − 1 rays.
    pub fn new(origin: Origin, films: Vec<Film>) -> Result<Self, Error> {
        match origin {
            Origin::Point(point) => check_origin(point)?,
            Origin::Infinity(direction) => check_direction(direction)?,
        }
        let films: Vec<Film> =
            films.into_iter().map(|film| checked(origin, film)).collect::<Result<_, _>>()?;
        let total: u64 = films.iter().map(Film::len).sum();
        let rays = u32::try_from(total).map_err(|_| Error::TooManyRays { rays: total })?;
        let mut next = 0;
        let first_rays = films.iter().map(|film| {
            let first = next;
            // In range: the total is.
            next += film.len() as u32;
            first
        });
        Ok(Self { origin, first_rays: first_rays.collect(), films, rays })
    }

    /// The common origin.
    #[must_use]
    pub fn origin(&self) -> Origin {
        self.origin
    }

    /// The films, in the order of their rays.
    #[must_use]
    pub fn films(&self) -> &[Film] {
        &self.films
    }

    /// The number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rays as usize
    }

    /// Whether there is no ray.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rays == 0
    }

    /// A ray, exactly as every path sees it. O(log films).
    ///
    /// # Panics
    /// When there is no such ray.
    #[must_use]
    pub fn ray(&self, index: usize) -> Ray {
        assert!(index < self.len(), "ray {index} of {}", self.len());
        let film = self.first_rays.partition_point(|&first| first as usize <= index) - 1;
        let local = index - self.first_rays[film] as usize;
        let sample = match &self.films[film] {
            Film::Grid(grid) => {
                let width = grid.width() as usize;
                // In range: a film has fewer than 2³² rays.
                grid.at((local % width) as u32, (local / width) as u32)
            }
            Film::Scattered(samples) => samples[local],
        };
        self.origin.ray(sample)
    }
}

/// The film, if all of its rays are in range.
fn checked(origin: Origin, film: Film) -> Result<Film, Error> {
    match film {
        Film::Grid(grid) => {
            let grid =
                if matches!(origin, Origin::Infinity(_)) { grid.rounded_for_start_points() } else { grid };
            check_grid(origin, &grid)?;
            Ok(Film::Grid(grid))
        }
        Film::Scattered(samples) => {
            for &sample in &samples {
                match origin {
                    Origin::Point(_) => check_direction(sample)?,
                    Origin::Infinity(_) => check_origin(sample)?,
                }
            }
            Ok(Film::Scattered(samples))
        }
    }
}

/// Refuses grids whose rays could leave the exact range, or that a frustum cannot bound.
fn check_grid(origin: Origin, grid: &GridFilm) -> Result<(), Error> {
    let corners =
        [(0, 0), (grid.width() - 1, 0), (0, grid.height() - 1), (grid.width() - 1, grid.height() - 1)];
    let corners = corners.map(|(i, j)| grid.at(i, j));
    match origin {
        // M is the largest component at some corner. From 2⁻¹⁸⁷ on, the spacing q is at least 2⁻²⁴⁰.
        Origin::Point(_) => {
            let largest = corners.iter().map(|d| d.abs().max_element()).fold(0.0, f64::max);
            let least = f64::from_bits((1023 - 187) << 52);
            check_direction(DVec3::splat(if largest < least { 0.0 } else { largest }))?;
        }
        Origin::Infinity(_) => corners.into_iter().try_for_each(check_origin)?,
    }
    match Projection::new(origin, grid.span()) {
        Some(_) => Ok(()),
        None => Err(Error::Film { reason: "forward, right and up must point in independent directions" }),
    }
}

/// What a query takes: a pencil, or rays of any kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rays<'a> {
    /// Rays through a common origin.
    Pencil(&'a Pencil),
    /// Arbitrary rays, each with an origin and an interval of its own.
    General(&'a [Ray]),
}

impl Rays<'_> {
    /// The number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Pencil(pencil) => pencil.len(),
            Self::General(rays) => rays.len(),
        }
    }

    /// Whether there is no ray.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A ray by index.
    pub(crate) fn ray(&self, index: u32) -> Ray {
        match self {
            Self::Pencil(pencil) => pencil.ray(index as usize),
            Self::General(rays) => rays[index as usize],
        }
    }

    /// How edge functions of zero get their sign.
    pub(crate) fn ties(&self) -> Ties {
        match self {
            Self::Pencil(pencil) => pencil.origin.ties(),
            Self::General(_) => Ties::Direction,
        }
    }
}

impl<'a> From<&'a Pencil> for Rays<'a> {
    fn from(pencil: &'a Pencil) -> Self {
        Self::Pencil(pencil)
    }
}

impl<'a> From<&'a [Ray]> for Rays<'a> {
    fn from(rays: &'a [Ray]) -> Self {
        Self::General(rays)
    }
}
