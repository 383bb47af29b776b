//! `umbel-bench shadow`: which of the points that a camera sees does a light not see? By all engines in turns.

use umbel::glam::DVec3;
use umbel::{Camera, Origin, Receiver, Scene, Triangles, closest_hit, receivers};

use crate::Result;
use crate::answer::Blocked;
use crate::cli::{Common, ShadowArgs};
use crate::comparison;
use crate::engine::Engine;
use crate::engines::Engines;
use crate::shadow_rays::ShadowRays;
use crate::subject::{Model, Shape, Subject};

/// Measures every scene at every size.
pub(crate) fn run(args: &ShadowArgs, common: &Common) -> Result<()> {
    comparison::run("shadow", &args.compared, common, &args.size, |view, size| {
        Shadow::new(&view.name, &view.scene, view.camera(size), view.light(args.light)?)
    })
}

/// One scene seen by a camera, and a light.
#[derive(Debug, Clone)]
pub(crate) struct Shadow {
    pub(crate) model: Model,
    shape: Shape,
    /// The light as umbel takes it.
    pub(crate) light: Origin,
    /// What the camera sees and may see the light, as umbel takes it.
    pub(crate) receivers: Vec<Receiver>,
    /// The same for the others.
    pub(crate) rays: ShadowRays,
}

impl Shadow {
    /// Finds the receivers of a light with f32 coordinates.
    fn new(name: &str, scene: &Scene, camera: Camera, light: [f32; 3]) -> Result<Self> {
        let model = Model::new(name, scene);
        let triangles = Triangles::new(&model.positions, &model.triangles)?;
        let pencil = camera.shot()?.pencil;
        let (hits, _) = closest_hit(&triangles, &pencil, &umbel::Options::default())?;
        let origin = Origin::Point(DVec3::from_array(light.map(f64::from)));
        let found = receivers(&triangles, &pencil, &hits, &[origin])?.pop().unwrap_or_default();
        let points: Vec<_> = found.points.iter().map(|receiver| receiver.point).collect();
        let rays = ShadowRays::new(light, &points, &found.rays, camera.width);
        let shape = Shape { films: 1, width: camera.width as usize, height: camera.height as usize };
        Ok(Self { model, shape, light: origin, receivers: found.points, rays })
    }
}

impl Subject for Shadow {
    type Answer = Blocked;

    const RASTERIZED: bool = false;

    fn model(&self) -> &Model {
        &self.model
    }

    fn shape(&self) -> Shape {
        self.shape
    }

    fn rays(&self) -> usize {
        self.rays.len()
    }

    fn origin(&self) -> [f32; 3] {
        self.rays.light
    }

    fn blank(&self) -> Blocked {
        Blocked(vec![false; self.rays.len()])
    }

    fn engines(
        &self,
        engines: &Engines,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Box<dyn Engine<Self>>>> {
        engines.for_shadows(self, wanted)
    }
}
