//! What `umbel shadow` looks at, and what else casts shadows on it.

use umbel::bake::Occluders;
use umbel::builtin::builtin_view;
use umbel::engine::Aabb;
use umbel::formats::{SurfaceScene, load_surfaces, names_surfaces, surface_view};
use umbel::surfaces::Surfaces;
use umbel::{Camera, Error, Scene, load};

use crate::common::Common;
use crate::report::{Times, timed};
use crate::run::{load_scene, say};
use crate::shadow::args::ShadowArgs;

/// What is seen: triangles, or a surface on demand; and occluders, which are not.
pub(crate) struct ShadowScene {
    /// The triangles that are seen; of a surface on demand the name alone.
    pub(crate) mesh: Scene,
    /// The surface that is seen instead.
    pub(crate) surface: Option<SurfaceScene>,
    meshes: Vec<Scene>,
    surfaces: Vec<SurfaceScene>,
}

impl ShadowScene {
    /// Reads everything that was named.
    pub(crate) fn load(args: &ShadowArgs, common: &Common, times: &mut Times) -> Result<Self, Error> {
        let options = common.load_options();
        let of_mesh = args.surfaces.made.options(options, args.camera.height)?;
        let (mut mesh, mut surface) = (Scene::default(), None);
        if args.is_of_surface() {
            let found = timed(&mut times.load, || load_surfaces(&args.scene, of_mesh))?;
            say(&found.warnings, common);
            mesh.name.clone_from(&found.name);
            mesh.offset = found.offset;
            surface = Some(found);
        } else {
            mesh = load_scene(&args.scene, common, times)?;
        }
        let (mut meshes, mut surfaces) = (Vec::new(), Vec::new());
        for name in &args.occluders {
            if names_surfaces(name) {
                surfaces.push(timed(&mut times.load, || load_surfaces(name, Default::default()))?);
            } else {
                meshes.push(timed(&mut times.load, || load(name, options))?);
            }
        }
        Ok(Self { mesh, surface, meshes, surfaces })
    }

    /// All triangles that cast shadows; those that are seen come first.
    pub(crate) fn occluders(&self) -> Result<Occluders<'_>, Error> {
        let mut occluders = Occluders::new(&self.mesh);
        self.meshes.iter().try_for_each(|mesh| occluders.add(mesh))?;
        Ok(occluders)
    }

    /// How many triangles there are in all.
    pub(crate) fn triangles(&self) -> u64 {
        let meshes = self.meshes.iter().chain([&self.mesh]);
        meshes.map(|mesh| mesh.triangles.len() as u64).sum()
    }

    /// All surfaces on demand that cast shadows.
    pub(crate) fn casters(&self) -> Vec<&Surfaces> {
        self.surface.iter().chain(&self.surfaces).map(|scene| &scene.surfaces).collect()
    }

    /// The box of what is seen.
    fn seen_bounds(&self) -> Aabb {
        self.surface.as_ref().map_or_else(|| self.mesh.bounds(), SurfaceScene::bounds)
    }

    /// The box of everything.
    pub(crate) fn bounds(&self) -> Aabb {
        let boxes =
            self.meshes.iter().map(Scene::bounds).chain(self.surfaces.iter().map(SurfaceScene::bounds));
        boxes.fold(self.seen_bounds(), Aabb::union)
    }

    /// The camera that was asked for.
    pub(crate) fn camera(&self, args: &ShadowArgs) -> Result<Camera, Error> {
        let height = args.surfaces.film_height(&args.camera);
        let rule = self.mesh.name.strip_prefix("builtin:");
        let view = rule.and_then(if self.surface.is_some() { surface_view } else { builtin_view });
        args.camera.framing_beside_cube(&self.seen_bounds(), view, (height, self.mesh.offset))
    }
}
