//! Receivers that lie nearer to another surface than rounding can tell.
//!
//! Two layers in one plane are apart by what rounding to f32 did to them. Decisions are exact, so that the layer behind is dark wherever rounding
//! put it behind, in stripes and triangles. That is what the file says, and hardly what its author means. So these receivers are counted:
//! a ray from each along the normal of its triangle, as long as two units in the last place of the scene's largest coordinate.

use glam::DVec3;
use umbel_core::{Aabb, Above, Frame, Grouping, Hemisphere, Occlusion, Options, RaySample, RaySamples, Side};

use crate::bake::occluders::BakeOccluders;
use crate::bake::receivers::BakeReceivers;
use crate::error::Error;

/// Two units in the last place of f32, in the number itself, at most.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// How near is too near to tell, in a scene within a box: 2⁻²² of its largest coordinate.
#[must_use]
pub fn rounding_distance(bounds: &Aabb) -> f64 {
    let largest = bounds.lo.iter().chain(&bounds.hi).fold(0.0_f32, |most, x| most.max(x.abs()));
    f64::from(largest) * ROUNDING
}

impl BakeOccluders<'_> {
    /// How many receivers have a triangle of another plane nearer above them than a distance, such as [`rounding_distance`]. One short
    /// ray for each.
    ///
    /// # Errors
    /// When the engine refuses a receiver, or the options.
    pub fn receivers_near_triangles(
        &self,
        receivers: &BakeReceivers,
        distance: f64,
        frame: &mut Frame,
        options: &Options,
    ) -> Result<u64, Error> {
        let limit = (distance as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
        let of = |receiver: usize, _: usize| {
            let direction = self.outward(&receivers.hemispheres[receiver]);
            RaySample { t_max: limit, ..RaySample::unlimited(direction) }
        };
        let occlusion = Occlusion {
            hemispheres: &receivers.hemispheres,
            samples: RaySamples::Own { count: 1, of: &of },
            back_faces: true,
            grouping: Grouping::Auto,
        };
        let (open, _) = frame.open_rays(self.triangles, &occlusion, options)?;
        let is_near = |&receiver: &usize| {
            // What does not point above the surface is not open either.
            let hemisphere = &receivers.hemispheres[receiver];
            !open.is_open(receiver, 0) && hemisphere.is_above(self.triangles, self.outward(hemisphere))
        };
        Ok((0..receivers.len()).filter(is_near).count() as u64)
    }

    /// The unit direction straight away from a receiver's surface.
    fn outward(&self, hemisphere: &Hemisphere) -> DVec3 {
        let direction = match hemisphere.above {
            Above::Side(Side::Front) => self.triangles.normal(hemisphere.receiver.triangle),
            Above::Side(Side::Back) => -self.triangles.normal(hemisphere.receiver.triangle),
            Above::Normal(normal) => DVec3::from_array(normal.map(f64::from)).normalize_or_zero(),
        };
        // Any direction does for what has none: it is above nothing.
        if direction == DVec3::ZERO { DVec3::Y } else { direction }
    }
}
