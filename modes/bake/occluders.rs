//! What occludes the receivers of a bake: triangles, and surfaces on demand.
//!
//! Surfaces are diced as finely as receivers are apart on average, √(A/n) for n of them in a box with half the surface A, within
//! 2⁻¹⁴ and 2⁻⁹ of its diagonal: few receivers shall not see coarse shapes. What is farther away is diced more coarsely, see
//! [`umbel_core::open_rays_on_demand`].

use umbel_core::{
    Aabb, Around, Dicing, Frame, Occlusion, OpenRays, Options, Stats, Triangles, open_rays_on_demand,
};

use crate::error::Error;
use crate::formats::load_surfaces::SurfaceScene;

/// The angle between neighbouring rays, in radians: what is farther from the receivers is diced that much more coarsely.
const ANGLE: f64 = 1.0 / 256.0;
/// The least and the greatest distance between receivers over the diagonal of their box.
const SPACINGS: [f64; 2] = [1.0 / (1 << 14) as f64, 1.0 / (1 << 9) as f64];

/// What stands around receivers.
#[derive(Debug, Clone, Copy)]
pub struct BakeOccluders<'a> {
    /// Triangles: those that receivers lie on, and others.
    pub triangles: &'a Triangles<'a>,
    /// Surfaces on demand,
    pub surfaces: &'a [SurfaceScene],
    /// as finely as rays from these receivers ask, see [`rays_around`],
    pub around: Around,
    /// times this.
    pub dicing: Dicing,
}

impl<'a> From<&'a Triangles<'a>> for BakeOccluders<'a> {
    fn from(triangles: &'a Triangles<'a>) -> Self {
        let around = rays_around(Aabb { lo: [0.0; 3], hi: [1.0; 3] }, 1);
        Self { triangles, surfaces: &[], around, dicing: Dicing::default() }
    }
}

impl BakeOccluders<'_> {
    /// Which rays are open.
    pub(crate) fn open_rays(
        &self,
        occlusion: &Occlusion<'_>,
        frame: &mut Frame,
        options: &Options,
    ) -> Result<(OpenRays, Stats), Error> {
        let Self { triangles, surfaces, around, dicing } = self;
        let Some((first, others)) = surfaces.split_first() else {
            return Ok(frame.open_rays(triangles, occlusion, options)?);
        };
        let ask = |scene: &SurfaceScene| {
            open_rays_on_demand(&scene.surfaces, triangles, occlusion, (around, dicing), options)
        };
        let (mut open, mut stats) = ask(first)?;
        for scene in others {
            let (more, of_scene) = ask(scene)?;
            open.retain(&more);
            stats = stats.then(of_scene);
        }
        Ok((open, stats))
    }
}

/// The rays of so many receivers that lie within a box.
#[must_use]
pub fn rays_around(bounds: Aabb, receivers: usize) -> Around {
    let [x, y, z] = bounds.extent();
    let mean = ((x * y + y * z + z * x) / receivers.max(1) as f64).sqrt();
    let diagonal = (x * x + y * y + z * z).sqrt();
    let size = if diagonal > 0.0 { diagonal } else { 1.0 };
    Around { bounds, spacing: mean.clamp(size * SPACINGS[0], size * SPACINGS[1]), angle: ANGLE }
}
