//! How the triangles of a scene lie in a texture: their charts and footprints, and the lines and sub-positions of its texels.

use umbel_core::TriangleId;

use crate::bake::atlas::charts::Charts;
use crate::bake::atlas::texel_coverage::{Footprint, Point};
use crate::error::Error;
use crate::random::hammersley;
use crate::scene::{NO_INDEX, Scene};

/// The largest atlas: its texels have 32-bit indices.
const LARGEST_SIZE: u32 = 65_535;

/// As many sub-positions as a mask has bits.
const MOST_SAMPLES: u32 = 64;

/// Sub-positions are multiples of 1 / this, so that their places in the atlas are exact.
const SUB_POSITIONS: f64 = 65_536.0;

/// The size of an atlas and how finely its texels are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AtlasOptions {
    /// Texels along each side, 1 to 65,535.
    pub size: u32,
    /// Sub-positions per texel, 1 to 64. One is the centre.
    pub samples: u32,
}

impl Default for AtlasOptions {
    /// 1024 texels along each side, sampled at their centres.
    fn default() -> Self {
        Self { size: 1024, samples: 1 }
    }
}

/// A scene in a texture of some size.
#[derive(Debug)]
pub(crate) struct Layout<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) charts: Charts,
    size: u32,
    /// The sub-positions of texel (0, 0), in units of texels; y rises with v.
    samples: Vec<Point>,
}

impl<'a> Layout<'a> {
    /// Finds the charts and places the sub-positions.
    pub(crate) fn new(scene: &'a Scene, options: &AtlasOptions) -> Result<Self, Error> {
        check(options)?;
        let &AtlasOptions { size, samples } = options;
        // A sub-position's second coordinate counts down the image.
        let flip = |y: f64| if scene.uv_v_down { y } else { 1.0 - y };
        let sample = |k| {
            let [x, y] =
                hammersley(k, samples).map(|x| (x * SUB_POSITIONS).round_ties_even() / SUB_POSITIONS);
            Point { x, y: flip(y) }
        };
        let samples = (0..samples).map(sample).collect();
        Ok(Self { scene, charts: Charts::new(scene), size, samples })
    }

    /// Texels along each side.
    pub(crate) fn size(&self) -> u32 {
        self.size
    }

    /// The sub-positions of the texel (0, 0).
    pub(crate) fn samples(&self) -> &[Point] {
        &self.samples
    }

    /// The chart of a triangle; `None` for one without texture coordinates.
    pub(crate) fn chart(&self, triangle: TriangleId) -> Option<u32> {
        let chart = self.charts.of_triangle[triangle.0 as usize];
        (chart != NO_INDEX).then_some(chart)
    }

    /// The footprint of a triangle; `None` without texture coordinates.
    pub(crate) fn footprint(&self, triangle: TriangleId) -> Option<Footprint> {
        self.scene.uv_corners(triangle).map(|uv| Footprint::new(uv, self.size))
    }

    /// The line, which counts with v, of a row of the image; and the other way round.
    pub(crate) fn line(&self, row: u32) -> u32 {
        if self.scene.uv_v_down { row } else { self.size - 1 - row }
    }
}

/// Refuses options out of range.
fn check(options: &AtlasOptions) -> Result<(), Error> {
    let &AtlasOptions { size, samples } = options;
    if !(1..=LARGEST_SIZE).contains(&size) {
        return Err(Error::Usage(format!(
            "an atlas has 1 to {LARGEST_SIZE} texels along each side, not {size}"
        )));
    }
    if !(1..=MOST_SAMPLES).contains(&samples) {
        return Err(Error::Usage(format!("a texel has 1 to {MOST_SAMPLES} samples, not {samples}")));
    }
    Ok(())
}
