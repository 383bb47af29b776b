//! Which triangles are seen at all: the union over several cameras.
//!
//! A triangle is seen when it is the nearest hit of the ray through some pixel centre of some camera. What is smaller than
//! a pixel may lie between the rays; more pixels find more.
//!
//! Based on: John Airey, John Rohlf, Frederick Brooks, "Towards Image Realism with Interactive Update Rates in Complex
//! Virtual Building Environments", 1990 (potentially visible sets by point sampling).

use umbel_core::{Frame, Options, Stats};

use crate::error::Error;
use crate::scene::Scene;
use crate::scene::camera::Camera;

/// The triangles that some cameras see.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Visible {
    /// Their ids, ascending, each once.
    pub ids: Vec<u32>,
    /// How many rays were followed.
    pub rays: usize,
}

impl Visible {
    /// How many of the triangles of each object are among them, in the order of [`Scene::objects`].
    #[must_use]
    pub fn per_object(&self, scene: &Scene) -> Vec<usize> {
        let below = |id: u32| self.ids.partition_point(|&seen| seen < id);
        scene
            .objects
            .iter()
            .map(|object| below(object.triangles.end) - below(object.triangles.start))
            .collect()
    }
}

/// Finds the triangles that any of the cameras sees. `progress` is told how many cameras are done.
///
/// The order of the triangles is kept from one camera to the next.
///
/// # Errors
/// When the scene is refused, or a camera: the one after those that are done.
pub fn visible(
    scene: &Scene,
    cameras: &[Camera],
    options: &Options,
    mut progress: impl FnMut(usize),
) -> Result<(Visible, Stats), Error> {
    let triangles = scene.geometry()?;
    let mut frame = Frame::keeping_order();
    // A miss has the largest id: it falls behind the last triangle.
    let mut seen = vec![false; triangles.len()];
    let (mut rays, mut stats) = (0, Stats::default());
    for (done, camera) in cameras.iter().enumerate() {
        let shot = camera.shot()?;
        let found = frame.closest_hit(&triangles, &shot.pencil, options)?;
        for &id in frame.hits().ids() {
            if let Some(seen) = seen.get_mut(id as usize) {
                *seen = true;
            }
        }
        rays += shot.pencil.len();
        // One query follows the other: counters add up, memory does not.
        let engine_bytes = stats.engine_bytes.max(found.engine_bytes);
        stats = Stats { engine_bytes, ..stats.plus(found) };
        progress(done + 1);
    }
    let ids = (0..).zip(seen).filter_map(|(id, seen)| seen.then_some(id)).collect();
    Ok((Visible { ids, rays }, stats))
}
