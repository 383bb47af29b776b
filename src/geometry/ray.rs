//! One ray, as every path of the engine understands it.

use glam::DVec3;

use crate::error::Error;

/// Origins are multiples of 2⁻¹⁴⁹, the spacing of subnormal f32.
const ORIGIN_GRID: f64 = f64::from_bits(0x36A0_0000_0000_0000);
/// Every f64 of this size, 2⁻⁹⁷, is a multiple of that spacing.
const ON_ORIGIN_GRID: f64 = f64::from_bits((1023 - 97) << 52);
/// Origins lie below 2¹²⁹.
const ORIGIN_LIMIT: f64 = f64::from_bits(0x4800_0000_0000_0000);
/// The least non-zero direction component, 2⁻²⁴⁰.
const DIRECTION_MIN: f64 = f64::from_bits(0x30F0_0000_0000_0000);
/// The greatest direction component, 2¹⁹⁰.
const DIRECTION_MAX: f64 = f64::from_bits(0x4BD0_0000_0000_0000);
/// The least non-zero end of an interval, 2⁻¹⁶⁰.
const T_MIN: f64 = f64::from_bits(0x35F0_0000_0000_0000);
/// The greatest finite end of an interval, 2¹³⁰.
const T_MAX: f64 = f64::from_bits(0x4810_0000_0000_0000);

/// The open ray o + t·d, t_min < t < t_max. Hits need t > 0 as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The origin o: multiples of 2⁻¹⁴⁹ below 2¹²⁹. Every f32 is fine.
    pub origin: DVec3,
    /// The direction d, of any length: components 0 or of a size in \[2⁻²⁴⁰, 2¹⁹⁰\].
    pub direction: DVec3,
    /// Exclusive lower end, in units of |d|; 0 or in \[2⁻¹⁶⁰, 2¹³⁰\].
    pub t_min: f64,
    /// Exclusive upper end, in units of |d|; in \[2⁻¹⁶⁰, 2¹³⁰\] or infinite.
    pub t_max: f64,
}

impl Ray {
    /// The ray 0 < t < ∞.
    #[must_use]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// Checks the ranges within which every decision is exact.
    pub(crate) fn check(&self) -> Result<(), Error> {
        check_origin(self.origin)?;
        check_direction(self.direction)?;
        let (t_min, t_max) = (self.t_min, self.t_max);
        let min_fits = t_min == 0.0 || (T_MIN..=T_MAX).contains(&t_min);
        let max_fits = t_max == f64::INFINITY || (T_MIN..=T_MAX).contains(&t_max);
        if min_fits && max_fits && t_min < t_max { Ok(()) } else { Err(Error::Interval { t_min, t_max }) }
    }
}

/// How an edge function of exactly zero gets its sign: which part of the rays is thought to be shifted by (ε, ε², ε³).
///
/// Based on: Herbert Edelsbrunner and Ernst Mücke, "Simulation of Simplicity", 1990.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ties {
    /// The direction: rays through a common point (w = 1), and rays of any kind.
    Direction,
    /// The start point: parallel rays (w = 0), whose direction must stay common.
    Origin,
}

/// Refuses origins for which the exact stage could underflow or overflow.
pub(crate) fn check_origin(origin: DVec3) -> Result<(), Error> {
    // Scaling by a power of two is exact below the limit, so a whole number is a multiple of the grid.
    let is_on_grid = |x: f64| x.abs() >= ON_ORIGIN_GRID || (x / ORIGIN_GRID).fract() == 0.0;
    let fits = |x: f64| x.abs() < ORIGIN_LIMIT && is_on_grid(x);
    if origin.to_array().into_iter().all(fits) {
        Ok(())
    } else {
        Err(Error::Origin { origin: origin.to_array() })
    }
}

/// A direction that the exact stage can take, for one that nobody has checked; `None` for zero and what is not finite. It is scaled by a
/// power of two where it is too long or too short, and parts below 2⁻²⁴⁰ of the greatest then become zero.
pub(crate) fn in_range(direction: DVec3) -> Option<DVec3> {
    if check_direction(direction).is_ok() { Some(direction) } else { scaled_into_range(direction) }
}

#[cold]
fn scaled_into_range(mut direction: DVec3) -> Option<DVec3> {
    /// 2¹⁰⁰.
    const FAR: f64 = (1_u128 << 100) as f64;
    if !direction.is_finite() || direction == DVec3::ZERO {
        return None;
    }
    // At most eleven times: f64 ranges from 2⁻¹⁰⁷⁴ to 2¹⁰²⁴.
    while direction.abs().max_element() > DIRECTION_MAX {
        direction /= FAR;
    }
    while direction.abs().max_element() < 1.0 {
        direction *= FAR;
    }
    Some(DVec3::from_array(direction.to_array().map(|x| if x.abs() < DIRECTION_MIN { 0.0 } else { x })))
}

/// Refuses directions for which the exact stage could underflow or overflow.
pub(crate) fn check_direction(direction: DVec3) -> Result<(), Error> {
    let fits = |x: f64| x == 0.0 || (DIRECTION_MIN..=DIRECTION_MAX).contains(&x.abs());
    let d = direction.to_array();
    if d.into_iter().all(fits) && d != [0.0; 3] { Ok(()) } else { Err(Error::Direction { direction: d }) }
}
