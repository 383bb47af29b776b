//! The subject of closest hits: what is seen from one point through one film, or through the six of a cube.

use serde_json::Value;
use umbel::engine::Film;
use umbel::glam::DVec3;
use umbel::shadow::cube_pencil;
use umbel::{Camera, Origin, Pencil, Scene};

use crate::Result;
use crate::engines::Engines;
use crate::engines::engine::Engine;
use crate::subjects::answer::Hits;
use crate::subjects::view_rays::ViewRays;
use crate::subjects::{Model, Shape, Subject};

/// One scene seen from one point.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    pub(crate) model: Model,
    /// The rays as umbel takes them.
    pub(crate) pencil: Pencil,
    /// The same rays for the others.
    pub(crate) rays: ViewRays,
}

impl Picture {
    /// What a camera sees. The eye is moved to the nearest f32 point, because the other engines know no others.
    pub(crate) fn of_camera(name: &str, scene: &Scene, mut camera: Camera) -> Result<Self> {
        camera.eye = camera.eye.as_vec3().as_dvec3();
        Self::new(Model::new(name, scene), camera.shot()?.pencil)
    }

    /// What a point light with f32 coordinates sees: six faces of `size` x `size`.
    pub(crate) fn of_cube(name: &str, scene: &Scene, light: [f32; 3], size: u32) -> Result<Self> {
        let light = DVec3::from_array(light.map(f64::from));
        Self::new(Model::new(name, scene), cube_pencil(light, size)?)
    }

    /// What a pencil sees whose origin has f32 coordinates.
    pub(crate) fn new(model: Model, pencil: Pencil) -> Result<Self> {
        let Origin::Point(origin) = pencil.origin() else {
            return Err("only rays from one point are compared".into());
        };
        let grid = |film: &Film| match film {
            Film::Grid(grid) => Some(*grid),
            Film::Scattered(_) => None,
        };
        let films: Option<Vec<_>> = pencil.films().iter().map(grid).collect();
        let rays = ViewRays::new(origin, &films.ok_or("only films with straight rows are compared")?);
        Ok(Self { model, pencil, rays })
    }

    /// Films of one size.
    fn shape(&self) -> Shape {
        let (width, height) = self.rays.films.first().map_or((0, 0), |film| (film.width, film.height));
        Shape { films: self.rays.films.len(), width, height }
    }
}

impl Subject for Picture {
    type Answer = Hits;

    const RASTERIZED: bool = true;

    fn model(&self) -> &Model {
        &self.model
    }

    fn layout(&self) -> String {
        self.shape().to_string()
    }

    fn facts(&self) -> Vec<(&'static str, Value)> {
        self.shape().facts(self.rays.origin)
    }

    fn rays(&self) -> usize {
        self.rays.len()
    }

    fn blank(&self) -> Hits {
        Hits::missed(self.rays.len())
    }

    fn engines(
        &self,
        engines: &Engines,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Self>>>> {
        engines.for_pictures(self, wanted)
    }
}
