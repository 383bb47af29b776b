//! A square with waves of height, and many of them behind each other: a surface on demand that is cheap to ask.
//!
//! Its eye is a point before the middle; the first sheet just covers the film, those behind it are larger, so that each would
//! fill the picture alone.

use umbel::engine::{Aabb, Detail, Domain, Film, GridFilm, OnDemand};
use umbel::glam::DVec3;
use umbel::{Origin, Pencil};

use crate::Result;

/// The distance of the first sheet.
const NEAR: f64 = 4.0;
/// From one sheet to the next.
const GAP: f64 = 0.25;
/// The height of the waves, and waves along a side.
const HEIGHT: f64 = 0.02;
const WAVES: f64 = 40.0;
/// Half of the angle of the film, as a slope; sheets reach a little farther.
const SLOPE: f64 = 0.5;
const MARGIN: f64 = 1.02;

/// Displaced squares behind each other, seen from the origin along −z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheets {
    pub(crate) count: u32,
    /// Width over height.
    pub(crate) aspect: f64,
}

/// A wave from 0 to 1: parabolas.
fn wave(x: f64) -> f64 {
    let part = x * WAVES - (x * WAVES).floor();
    4.0 * part * (1.0 - part)
}

impl Sheets {
    /// Sheets for a picture of some pixels.
    pub(crate) fn new(count: u32, (width, height): (u32, u32)) -> Self {
        Self { count, aspect: f64::from(width) / f64::from(height) }
    }

    /// The eye and the film in front of them.
    pub(crate) fn pencil(&self, (width, height): (u32, u32)) -> Result<Pencil> {
        let half = SLOPE / f64::from(height);
        let film = GridFilm::new(width, height, DVec3::NEG_Z, DVec3::X * half, DVec3::Y * half)?;
        Ok(Pencil::new(Origin::Point(DVec3::ZERO), vec![Film::Grid(film)])?)
    }

    /// The distance of a sheet, and half of its sides.
    fn place(&self, sheet: u32) -> (f64, [f64; 2]) {
        let distance = NEAR + GAP * f64::from(sheet);
        let half = distance * SLOPE * MARGIN;
        (distance, [half * self.aspect, half])
    }
}

impl OnDemand for Sheets {
    type Object = u32;

    fn roots(&self) -> Vec<u32> {
        (0..self.count).collect()
    }

    fn bounds(&self, sheet: &u32, Domain { u, v }: Domain, _: &Detail) -> Aabb {
        let (distance, half) = self.place(*sheet);
        let [x, y] = [(u, half[0]), (v, half[1])].map(|(t, half)| t.map(|t| ((2.0 * t - 1.0) * half) as f32));
        Aabb { lo: [x[0], y[0], (-distance) as f32], hi: [x[1], y[1], (HEIGHT - distance) as f32] }
    }

    fn expand(&self, _: &u32, _: f64, _: &Detail, _: &mut Vec<u32>) -> bool {
        false
    }

    fn evaluate(&self, sheet: &u32, parameters: &[[f64; 2]], _: &Detail, points: &mut Vec<[f32; 3]>) {
        let (distance, half) = self.place(*sheet);
        points.extend(parameters.iter().map(|&[u, v]| {
            let height = (wave(u) + wave(v)) * (0.5 * HEIGHT);
            [(2.0 * u - 1.0) * half[0], (2.0 * v - 1.0) * half[1], height - distance].map(|x| x as f32)
        }));
    }

    fn id(&self, sheet: &u32) -> u32 {
        *sheet
    }
}

#[cfg(test)]
mod tests {
    use umbel::Options;
    use umbel::engine::{Dicing, closest_hit_on_demand};

    use super::*;

    #[test]
    fn the_first_sheet_fills_the_picture() -> Result<()> {
        let size = (64, 36);
        let sheets = Sheets::new(3, size);
        let pencil = sheets.pencil(size)?;
        let (seen, _) = closest_hit_on_demand(
            &sheets,
            &pencil,
            &Dicing { shading_rate: 2.0, ..Dicing::default() },
            &Options::default(),
        )?;
        assert!(seen.ids().iter().all(|&id| id == 0));
        Ok(())
    }
}
