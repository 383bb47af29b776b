//! The subject of shadows: which of the points that a camera sees does a light not see?

use serde_json::Value;
use umbel::engine::Receiver;
use umbel::glam::DVec3;
use umbel::shadow::receivers;
use umbel::{Camera, Origin, Scene, Triangles, closest_hit};

use crate::Result;
use crate::engines::Engines;
use crate::engines::engine::Engine;
use crate::subjects::answer::Blocked;
use crate::subjects::shadow_rays::ShadowRays;
use crate::subjects::{Model, Shape, Subject};

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
    pub(crate) fn new(name: &str, scene: &Scene, camera: Camera, light: [f32; 3]) -> Result<Self> {
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

    fn layout(&self) -> String {
        self.shape.to_string()
    }

    fn facts(&self) -> Vec<(&'static str, Value)> {
        self.shape.facts(self.rays.light)
    }

    fn rays(&self) -> usize {
        self.rays.len()
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

#[cfg(all(test, feature = "obvhs"))]
mod tests {
    use super::*;
    use crate::engines::umbel::Umbel;
    use crate::subjects::answer::Answer;
    use umbel::{Lens, builtin};

    /// A box in a room throws a shadow, and two engines see nearly the same one.
    #[test]
    fn engines_agree_about_a_room() {
        let scene = builtin("cornell").expect("a scene");
        let (eye, target) = (DVec3::new(278.0, 273.0, -800.0), DVec3::new(278.0, 273.0, 0.0));
        let lens = Lens::Pinhole { fov: 39.3 };
        let camera = Camera { eye, target, up: DVec3::Y, lens, width: 101, height: 67 };
        let shadow = Shadow::new("room", &scene, camera, [278.0, 540.0, 279.5]).expect("a subject");
        let mut umbel = shadow.blank();
        Umbel::from_scratch().run(&shadow, &mut umbel).expect("shadows");
        assert!(umbel.0.contains(&true) && umbel.0.contains(&false));
        for mut engine in crate::engines::obvhs::variants(&shadow, |_| true) {
            let mut other = shadow.blank();
            engine.run(&shadow, &mut other).expect("shadows");
            assert!(umbel.agreement(&other)[0].of_all > 0.999, "{}", engine.name());
        }
    }
}
