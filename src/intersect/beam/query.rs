//! What all beams of a query share.

use crate::geometry::triangles::Triangles;
use crate::intersect::beam::objects::Objects;
use crate::rays::hemisphere::Occlusion;

/// Places of boxes and of rays err by less than this part of the scene's size, 1 at most: twice six roundings of two
/// coordinates each.
const SLACK: f32 = 32.0 / (1 << 24) as f32;

/// What all beams share.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a> {
    pub(crate) triangles: &'a Triangles<'a>,
    pub(crate) occlusion: &'a Occlusion<'a>,
    pub(crate) objects: &'a Objects,
    /// What is added around boxes.
    pub(crate) slack: f32,
}

impl<'a> Query<'a> {
    /// Of receivers among objects.
    pub(crate) fn new(
        triangles: &'a Triangles<'a>,
        occlusion: &'a Occlusion<'a>,
        objects: &'a Objects,
    ) -> Self {
        Self { triangles, occlusion, objects, slack: SLACK }
    }

    /// The scaled point of a receiver.
    #[inline(always)]
    pub(crate) fn scaled(&self, id: u32) -> [f32; 3] {
        let scale = self.objects.scale;
        self.occlusion.hemispheres[id as usize].receiver.point.map(|x| scale.of_length(x))
    }
}
