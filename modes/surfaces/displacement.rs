//! Displacement: points moved along their normals by a height, and bounds of that.
//!
//! p' = p + h·n/|n| with a normal n of any length; a normal of length 0 moves nothing. Over a box of points p, a box of normals
//! \[a, b\] and a range of heights, p' lies in the sum of the first box and of the products of heights and unit normals. With l and L
//! the least and the greatest length of a vector in \[a, b\], a component of the unit normal lies in \[a/L, b/l\] where it is positive,
//! \[a/l, b/L\] where it is negative, and always in \[−1, 1\].
//!
//! Based on: Robert Cook, "Shade Trees", 1984 (displacement); Ramon Moore, "Interval Analysis", 1966.

use fearless_simd::{Level, prelude::*};
use glam::{DVec2, DVec3};
use umbel_core::Detail;

use crate::surfaces::extent::Extent;
use crate::surfaces::height_map::HeightMap;
use crate::surfaces::lanes::{LANES, Lanes, PointLanes, dot};
use crate::surfaces::noise::{Cells, Noise};

/// Room for the rounding of a unit vector and of its product with a height: a dozen operations.
const UNIT_SLACK: f64 = 1e-14;

/// Where heights come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Relief {
    /// Nothing is displaced.
    Flat,
    /// An image, by texture coordinates.
    Map(HeightMap),
    /// Noise, by position.
    Noise(Noise),
}

/// A displacement along normals: from 0 to `height` world units.
#[derive(Debug, Clone, PartialEq)]
pub struct Displacement {
    /// Heights from 0 to 1.
    pub relief: Relief,
    /// World units of height 1; negative ones lead inwards. Finite.
    pub height: f64,
}

/// A rectangle of texture coordinates, v running down from the top of the image: the least and the greatest.
pub(crate) type UvBox = [[f64; 2]; 2];

/// Room for the rounding of bilinear interpolation: two roundings of each of three sums and six products.
const UV_SLACK: f64 = 16.0 * f64::EPSILON;

/// The rectangle around texture coordinates and all that is interpolated between them.
pub(crate) fn uv_box(corners: impl IntoIterator<Item = DVec2>) -> UvBox {
    let all = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (lo, hi) = corners.into_iter().fold(all, |(lo, hi), uv| (lo.min(uv), hi.max(uv)));
    let slack = DVec2::splat(lo.abs().max(hi.abs()).max_element() * UV_SLACK);
    [(lo - slack).to_array(), (hi + slack).to_array()]
}

impl Displacement {
    /// No displacement.
    pub const NONE: Self = Self { relief: Relief::Flat, height: 0.0 };

    /// Whether every point stays where it is.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.height == 0.0 || self.relief == Relief::Flat
    }

    /// Whether heights are found by texture coordinates.
    #[must_use]
    pub fn needs_uvs(&self) -> bool {
        matches!(self.relief, Relief::Map(_))
    }

    /// Eight points moved along normals; `uvs` are their texture coordinates, where heights go by them.
    #[inline(always)]
    pub(crate) fn displaced_lanes<S: Simd>(
        &self,
        simd: S,
        (point, normal): (PointLanes<S>, PointLanes<S>),
        uvs: &[[f64; 2]; LANES],
        (detail, cells): (&Detail, &mut Cells),
    ) -> PointLanes<S> {
        if self.is_none() {
            return point;
        }
        let length = dot(normal, normal).sqrt();
        let height = match &self.relief {
            Relief::Flat => Lanes::splat(simd, 0.0),
            Relief::Map(map) => {
                let mut heights = [0.0; LANES];
                for (height, &uv) in heights.iter_mut().zip(uvs) {
                    *height = map.at(uv);
                }
                Lanes::load_array(simd, heights)
            }
            Relief::Noise(noise) => {
                let spacing = self.spacings(simd, detail, point);
                noise.lanes(simd, (point, spacing), cells)
            }
        };
        let (height, moves) = (height * self.height, length.simd_gt(0.0));
        let mut moved = point;
        for k in 0..3 {
            moved[k] = moves.select(point[k] + normal[k] / length * height, point[k]);
        }
        moved
    }

    /// How far apart rays are, at least, wherever eight points may be moved to.
    #[inline(always)]
    fn spacings<S: Simd>(&self, simd: S, detail: &Detail, point: PointLanes<S>) -> Lanes<S> {
        let mut ends = [[[0.0; LANES]; 3]; 2];
        for k in 0..3 {
            ends[0][k] = *(point[k] - self.height.abs()).as_array();
            ends[1][k] = *(point[k] + self.height.abs()).as_array();
        }
        Lanes::load_array(simd, detail.spacings([&ends[0], &ends[1]]))
    }

    /// A box around all points moved along all unit normals, of [`unit_normals`], for some detail or any. The box of points has room
    /// for their rounding.
    pub(crate) fn extent(
        &self,
        (points, units): (Extent, Extent),
        uvs: impl FnOnce() -> UvBox,
        detail: Option<&Detail>,
    ) -> Extent {
        if self.is_none() {
            return points;
        }
        let [least, greatest] = match &self.relief {
            Relief::Flat => [0.0; 2],
            Relief::Map(map) => {
                let [lo, hi] = uvs();
                map.range(lo, hi)
            }
            Relief::Noise(noise) => {
                let Extent { lo, hi } = points.grown(self.height.abs());
                let spacing = detail.map_or([0.0, f64::INFINITY], |detail| detail.spacing([lo, hi]));
                noise.range(&points, spacing, detail.map_or_else(Level::new, Detail::level))
            }
        };
        let heights = [least * self.height, greatest * self.height];
        // A normal of length 0, which moves nothing, lies only in boxes whose units reach from −1 to 1.
        let ends = heights.map(|height| [units.lo * height, units.hi * height]);
        let moves = Extent::of(ends.into_iter().flatten());
        let reach = heights[0].abs().max(heights[1].abs());
        let sum = points.plus(moves.grown(reach * UNIT_SLACK));
        sum.with_slack(sum.reach())
    }
}

/// A box around the unit vectors along the vectors of a box.
pub(crate) fn unit_normals(normals: Extent) -> Extent {
    let Extent { lo, hi } = normals;
    let (least, greatest) = (lo.max(-hi).max(DVec3::ZERO).length(), lo.abs().max(hi.abs()).length());
    // NaN and an overflow keep everything.
    if !(least > 0.0 && greatest < f64::MAX) {
        return Extent { lo: DVec3::NEG_ONE, hi: DVec3::ONE };
    }
    let end = |x: f64, near: f64, far: f64| if x >= 0.0 { x / near } else { x / far };
    let lows = lo.to_array().map(|x| end(x, greatest, least) - UNIT_SLACK);
    let highs = hi.to_array().map(|x| end(x, least, greatest) + UNIT_SLACK);
    Extent { lo: DVec3::from_array(lows).max(DVec3::NEG_ONE), hi: DVec3::from_array(highs).min(DVec3::ONE) }
}
