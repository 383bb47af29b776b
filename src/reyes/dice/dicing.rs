//! How finely surfaces are diced, as those who ask choose it.

use crate::error::Error;

/// How finely surfaces are diced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dicing {
    /// The edge of a micropolygon in pixels: 0.5 unless told otherwise, between 2⁻⁶ and 2¹². Edges come out between
    /// 1/√2 and √2 times that, as far as they can be measured from a few points.
    pub shading_rate: f64,
    /// Whether hits keep the corners of their micropolygons, as shadows need them: 36 bytes a ray.
    pub keep_corners: bool,
}

impl Default for Dicing {
    fn default() -> Self {
        Self { shading_rate: 0.5, keep_corners: false }
    }
}

impl Dicing {
    /// The shading rates that are taken.
    const RATES: [f64; 2] = [1.0 / 64.0, 4096.0];

    pub(crate) fn check(&self) -> Result<(), Error> {
        let [least, greatest] = Self::RATES;
        if (least..=greatest).contains(&self.shading_rate) {
            Ok(())
        } else {
            Err(Error::ShadingRate { rate: self.shading_rate })
        }
    }
}
