//! From a name on the command line to surfaces on demand: a mesh, Bézier patches, or a rule.

use std::ffi::OsStr;
use std::path::Path;

use umbel_core::Aabb;
use umbel_core::glam::DVec3;

use crate::builtin::{BuiltinView, builtin_view};
use crate::error::{Argument, Error};
use crate::formats::bpt::read_bpt;
use crate::formats::load::{LoadOptions, builtin_name, load};
use crate::random::{mix, uniform};
use crate::scene::Scene;
use crate::surfaces::Surfaces;
use crate::surfaces::builtin::field::Field;
use crate::surfaces::builtin::field::FieldKind;
use crate::surfaces::builtin::teapot::teapot;
use crate::surfaces::builtin::terrain::Terrain;
use crate::surfaces::displaced::DisplacedMesh;
use crate::surfaces::displacement::Displacement;
use crate::surfaces::subdivision::SubdivisionSurface;

/// What is made of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceOptions {
    /// How its file is read.
    pub load: LoadOptions,
    /// Whether it is the cage of a Catmull-Clark surface.
    pub subdivide: bool,
    /// How it is displaced.
    pub displacement: Displacement,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { load: LoadOptions::default(), subdivide: false, displacement: Displacement::NONE }
    }
}

/// Surfaces on demand and what a preview needs to know of them.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceScene {
    /// A short name: the file's, or `builtin:NAME`.
    pub name: String,
    /// What was taken from the positions of the file, as [`Scene::offset`] is.
    pub offset: DVec3,
    /// The surfaces.
    pub surfaces: Surfaces,
    /// What the reader noticed and mended or left out, one sentence each.
    pub warnings: Vec<String>,
    /// The diffuse colour of ids from one on, ascending; `None` where the scene gives none.
    colours: Vec<(u32, Option<[f32; 3]>)>,
}

/// The scenes that only surfaces on demand can be.
const RULES: [&str; 3] = ["teapot", "terrain", "field"];

/// Whether a name is that of surfaces on demand: a `.bpt` file, or `builtin:` with teapot, terrain or field.
#[must_use]
pub fn names_surfaces(name: impl AsRef<OsStr>) -> bool {
    let name = name.as_ref();
    builtin_name(name).is_some_and(|rule| RULES.contains(&rule)) || is_bpt(name)
}

fn is_bpt(name: &OsStr) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bpt"))
}

/// Reads a mesh or a `.bpt` file, or makes `builtin:NAME`: teapot, terrain and field, or any built-in mesh.
///
/// # Errors
/// When there is no such file or scene, its content cannot be taken, or the options do not suit it.
pub fn load_surfaces(name: impl AsRef<OsStr>, options: SurfaceOptions) -> Result<SurfaceScene, Error> {
    let name = name.as_ref();
    let rule = builtin_name(name).filter(|rule| RULES.contains(rule));
    if !names_surfaces(name) {
        return SurfaceScene::of_mesh(load(name, options.load)?, options);
    }
    if options.subdivide || !options.displacement.is_none() {
        return Err(Argument::NoMesh { name: name.to_string_lossy().into_owned() }.into());
    }
    let surfaces = match rule {
        Some("terrain") => Surfaces::Terrain(Terrain),
        Some("field") => Surfaces::Field(Field),
        Some(_) => Surfaces::Patches(teapot()),
        None => Surfaces::Patches(read_bpt(Path::new(name))?),
    };
    let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = if is_bpt(name) { stem } else { name.to_string_lossy().into_owned() };
    Ok(SurfaceScene { name, offset: DVec3::ZERO, surfaces, warnings: Vec::new(), colours: Vec::new() })
}

/// A curated view of a built-in scene, of surfaces or of triangles.
#[must_use]
pub fn surface_view(rule: &str) -> Option<BuiltinView> {
    let view = |eye, target, fov_degrees| BuiltinView {
        eye,
        target,
        up: [0.0, 1.0, 0.0],
        fov_degrees,
        light: [-400.0, 900.0, 500.0],
    };
    match rule {
        "teapot" => Some(view([4.2, 4.4, 7.2], [0.2, 1.3, 0.0], 36.0)),
        "terrain" => Some(view([0.0, 1000.0, 3200.0], [0.0, 420.0, -300.0], 45.0)),
        "field" => {
            let ground = |x: f64, z: f64| Field.ground(x, z);
            let (x, z) = (400.0, 300.0);
            Some(view([x, ground(x, z) + 1.7, z], [x - 30.0, ground(x, z) - 0.2, z - 40.0], 50.0))
        }
        _ => builtin_view(rule),
    }
}

impl SurfaceScene {
    /// The faces of a mesh as surfaces.
    ///
    /// # Errors
    /// When the mesh is refused, or a height map shall displace a mesh without texture coordinates.
    pub fn of_mesh(scene: Scene, options: SurfaceOptions) -> Result<Self, Error> {
        scene.geometry()?;
        if options.displacement.needs_uvs() && scene.uv_indices.is_empty() {
            return Err(Argument::NoTextureCoordinates { name: scene.name }.into());
        }
        let first_triangles;
        let surfaces = if options.subdivide {
            let surface = SubdivisionSurface::new(&scene, &scene.creases, options.displacement);
            first_triangles = surface.first_triangles().to_vec();
            Surfaces::Subdivided(Box::new(surface))
        } else {
            let surface = DisplacedMesh::new(&scene, options.displacement);
            first_triangles = surface.first_triangles().to_vec();
            Surfaces::Displaced(Box::new(surface))
        };
        let colours = scene.objects.iter().map(|object| {
            // In range: faces have 32-bit ids.
            let face = first_triangles.partition_point(|&first| first < object.triangles.start) as u32;
            let material = object.material.and_then(|index| scene.materials.get(index as usize));
            (face, material.map(|material| material.diffuse))
        });
        let colours = colours.collect();
        Ok(Self { name: scene.name, offset: scene.offset, surfaces, warnings: scene.warnings, colours })
    }

    /// The box of everything.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.surfaces.all_bounds()
    }

    /// The diffuse colour of what has an id, linear; `None` where the scene gives none.
    #[must_use]
    pub fn colour(&self, id: u32) -> Option<[f32; 3]> {
        match self.surfaces {
            Surfaces::Field(_) => Some(field_colour(id)),
            Surfaces::Terrain(_) => Some([0.42, 0.39, 0.34]),
            _ => {
                let after = self.colours.partition_point(|&(first, _)| first <= id);
                self.colours.get(after.checked_sub(1)?)?.1
            }
        }
    }
}

/// Greens for blades, white for umbels, earth.
fn field_colour(id: u32) -> [f32; 3] {
    match Field::kind(id) {
        FieldKind::Ground => [0.10, 0.13, 0.05],
        FieldKind::Umbel => [0.86, 0.84, 0.78],
        FieldKind::Blade => {
            let dry = uniform(mix(u64::from(id))) as f32;
            [0.16 + 0.22 * dry * dry, 0.34 + 0.10 * dry, 0.08 + 0.05 * dry]
        }
    }
}
