//! What all engines get: the same triangles and the same rays.

use umbel::glam::DVec3;
use umbel::{Camera, Film, Origin, Pencil, Scene};

use crate::Result;
use crate::view_rays::ViewRays;

/// One scene seen by one camera.
#[derive(Debug, Clone)]
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) positions: Vec<[f32; 3]>,
    /// Without those that have no area; the index is the id.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// How many triangles without area were left out.
    pub(crate) dropped: usize,
    /// The rays as umbel takes them.
    pub(crate) pencil: Pencil,
    /// The same rays for the others.
    pub(crate) rays: ViewRays,
}

impl Subject {
    /// Prepares a scene. The eye is moved to the nearest f32 point, because the other engines know no others.
    pub(crate) fn new(name: &str, scene: &Scene, mut camera: Camera) -> Result<Self> {
        camera.eye = camera.eye.as_vec3().as_dvec3();
        let pencil = camera.shot()?.pencil;
        let (Origin::Point(origin), [Film::Grid(film)]) = (pencil.origin(), pencil.films()) else {
            return Err("only pinhole cameras are compared".into());
        };
        let rays = ViewRays::new(origin, film);
        let positions = scene.positions.clone();
        let with_area = scene.triangles.iter().filter(|corners| has_area(&positions, corners));
        let triangles: Vec<_> = with_area.copied().collect();
        let dropped = scene.triangles.len() - triangles.len();
        Ok(Self { name: name.to_owned(), positions, triangles, dropped, pencil, rays })
    }

    /// Pixels as WxH.
    pub(crate) fn size(&self) -> String {
        format!("{}x{}", self.rays.width, self.rays.height)
    }
}

/// Whether a triangle has an area, as f64 sees it.
fn has_area(positions: &[[f32; 3]], corners: &[u32; 3]) -> bool {
    let [a, b, c] = corners.map(|v| DVec3::from_array(positions[v as usize].map(f64::from)));
    (b - a).cross(c - a) != DVec3::ZERO
}
