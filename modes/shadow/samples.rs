//! What a cube map would say about a few points, without making the map: only the texels that hold them are traced.
//!
//! A map of N x N texels per face has 6 N² rays, of which a sample of points looks up at most one each. Their directions are
//! those of the map's own rays, through the middles of its texels, as a scattered film.

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Film, Frame, Options, Origin, Pencil, Receiver, Triangles};

use crate::error::{Argument, Error};
use crate::scene::camera::on_origin_grid;
use crate::shadow::lookup::{is_lit_at, texel_middle};
use crate::shadow::map::distances;

/// Whether each receiver is lit, as a cube map of `size` x `size` texels around a light would have it: as
/// [`crate::shadow::lookup::CubeMap::is_lit`] says, up to the last bit of a distance.
///
/// # Errors
/// When the light is out of the range of origins, `size` is 0, or the scene is refused.
pub fn cube_answers(
    triangles: &Triangles<'_>,
    light: DVec3,
    size: u32,
    receivers: &[Receiver],
    frame: &mut Frame,
    options: &Options,
) -> Result<Vec<bool>, Error> {
    if size == 0 {
        return Err(Argument::CubeSize.into());
    }
    let light = on_origin_grid(light);
    let way = |receiver: &Receiver| DVec3::from_array(receiver.point.map(f64::from)) - light;
    let middles = receivers.par_iter().map(|receiver| texel_middle(way(receiver), size)).collect();
    let pencil = Pencil::new(Origin::Point(light), vec![Film::Scattered(middles)])?;
    frame.closest_hit(triangles, &pencil, options)?;
    let stored = distances(triangles, &pencil, frame.hits());
    let answer = |(receiver, &stored): (&Receiver, &f32)| {
        is_lit_at(stored, way(receiver), triangles.normal(receiver.triangle), size)
    };
    Ok(receivers.par_iter().zip(&stored).map(answer).collect())
}
