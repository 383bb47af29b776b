//! The texels of an atlas as receivers.
//!
//! A texel's receiver lies on a triangle, at barycentric weights. Rays leave it as [`Triangles::leave`] has it, to the side
//! that the interpolated shading normal points to.
//!
//! Based on: Carsten Wächter and Nikolaus Binder, "A Fast and Robust Method for Avoiding Self-Intersection", 2019.

use rayon::prelude::*;
use umbel_core::{Above, Hemisphere, Receiver, Side, Triangles};

use crate::bake::atlas::{Atlas, TexelReceiver};
use crate::bake::receivers::BakeReceivers;

impl Atlas<'_> {
    /// Where rays leave the receivers of a band: their numbers are those of the texels. For [`crate::bake::options::BakeOptions::columns`] a row
    /// has as many as the atlas.
    ///
    /// `geometry` is that of the scene of this atlas.
    #[must_use]
    pub fn bake_receivers(&self, geometry: &Triangles<'_>, band: &[TexelReceiver]) -> BakeReceivers {
        let leave = |texel: &TexelReceiver| {
            let weights = texel.barycentrics();
            let normal = self.layout.scene.shading_normal(geometry, texel.triangle, weights);
            let side = geometry.side_toward(texel.triangle, normal).unwrap_or(Side::Front);
            let point = geometry.leave(texel.triangle, weights, side);
            let receiver = Receiver { point, triangle: texel.triangle };
            (Hemisphere { receiver, above: Above::Side(side) }, normal.to_array().map(|x| x as f32))
        };
        let (hemispheres, normals) = band.par_iter().map(leave).unzip();
        BakeReceivers {
            hemispheres,
            normals,
            indices: band.iter().map(|texel| texel.texel).collect(),
            ..BakeReceivers::default()
        }
    }
}
