//! umbel: primary visibility on the CPU, exact and deterministic, with nothing to build.
//!
//! This package is what the engine is for: scenes from files, cameras, pictures, checks. The engine itself is
//! `umbel-core`; its public items are re-exported here, so that one dependency is enough.
//!
//! ```
//! use umbel::{Camera, Lens, Options, builtin, glam::DVec3, visibility};
//!
//! let scene = builtin("cornell")?;
//! let camera = Camera {
//!     eye: DVec3::new(278.0, 273.0, -800.0),
//!     target: DVec3::new(278.0, 273.0, 0.0),
//!     up: DVec3::Y,
//!     lens: Lens::Pinhole { fov: 39.3 },
//!     width: 64,
//!     height: 64,
//! };
//! let (buffer, _) = visibility(&scene, &camera, &Options::default())?;
//! assert!(buffer.hits.get(32 * 64 + 32).is_some());
//! # Ok::<(), umbel::Error>(())
//! ```

pub use umbel_core::{
    Aabb, Above, Accuracy, Around, Cone, Detail, DicedTriangles, Dicing, Domain, Film, Frame, Frustum,
    GridFilm, Grouping, Hemisphere, Hit, Hits, Isa, NO_TRIANGLE, Occlusion, OnDemand, OpenRays, Options,
    Origin, Partition, Path, Pencil, Ray, RaySample, RaySamples, Rays, Receiver, Segment, Side, Stats,
    SurfaceHits, TileStats, TriangleId, Triangles, any_hit, blocked, closest_hit, closest_hit_on_demand,
    dice_all, glam, open_rays, open_rays_on_demand, shadowed, shadowed_on_demand,
};

mod bake;
mod builtin;
mod error;
mod files;
mod formats;
mod measure;
mod render;
mod scene;
mod shadow;
mod surfaces;

pub use error::Error;

pub use builtin::{BuiltinView, builtin, builtin_view};
pub use files::budget::available_memory;
#[cfg(feature = "gltf")]
pub use formats::gltf::write::vertex::VertexTarget;
#[cfg(feature = "gltf")]
pub use formats::gltf::{GltfFile, GltfOptions, GltfOrigin, read_gltf};
pub use formats::load::{LoadOptions, load};
#[cfg(any(feature = "gltf", feature = "obj"))]
pub use formats::neighbours::Resolver;
#[cfg(feature = "obj")]
pub use formats::obj::{ObjOptions, read_obj, read_obj_bytes};
pub use scene::{Material, NO_INDEX, Object, Scene};

pub use formats::pattern::{Pattern, read_pattern};
pub use render::point_cloud::{SeenPoint, write_ply};
pub use render::{Aov, AovData, Look, VisibilityBuffer, preview, preview_lit, preview_with, visibility};
pub use scene::camera::{CUBE_FACES, Camera, Lens, Shot};
pub use scene::info::{Info, info};

pub use render::bounce::Followed;
pub use render::bounce::spawn::{Bounces, Spawned};
pub use scene::optics::Optics;

pub use shadow::casters::Casters;
pub use shadow::compare::{MapErrors, compare_maps};
pub use shadow::lookup::CubeMap;
pub use shadow::map::{cube_map, cube_pencil, distances, face_matrices, sun_pencil, surface_distances};
pub use shadow::samples::cube_answers;
pub use shadow::{MaskCounts, Receivers, point_light, receivers, shadow_masks, sun_light};

pub use formats::bpt::read_bpt;
pub use formats::load_surfaces::{SurfaceOptions, SurfaceScene, load_surfaces, names_surfaces, surface_view};
pub use render::surfaces::{SurfaceBuffer, SurfaceLook, surface_preview, surface_visibility};
pub use surfaces::bezier::BezierPatches;
pub use surfaces::builtin::field::{Field, FieldObject};
pub use surfaces::builtin::terrain::Terrain;
pub use surfaces::displaced::{DisplacedMesh, FaceObject};
pub use surfaces::displacement::{Displacement, Relief};
pub use surfaces::height_map::HeightMap;
pub use surfaces::noise::Noise;
pub use surfaces::patch_tree::Node;
pub use surfaces::subdivision::{Creases, SubdivisionSurface};
pub use surfaces::{SurfaceObject, Surfaces};

pub use bake::atlas::image::TexelImage;
pub use bake::atlas::uv_check::{UvCheck, check_uvs};
pub use bake::atlas::{Atlas, AtlasOptions, TexelReceiver};
pub use bake::depth_maps::DepthMaps;
pub use bake::occluder_scenes::Occluders;
pub use bake::occluders::{BakeOccluders, rays_around};
pub use bake::options::{BakeOptions, Polarity};
pub use bake::receivers::points::read_points;
pub use bake::receivers::vertices::VertexReceivers;
pub use bake::sample_sets::{Falloff, Reach, SampleSet, Weighting};
pub use bake::{Bake, BakeReceivers, Baked, TracedRay};

pub use measure::differences::Differences;
pub use measure::estimate::{ErrorEstimate, PowerLaw, sample_key};
pub use measure::pareto::pareto_front;

pub use render::verify::{Mark, Verification, verify, verify_buffer};
pub use render::visible::{Visible, visible};

pub use files::exr::{Channel, Samples, read_exr, write_exr};
pub use files::ktx2::write_ktx2_cube;
pub use files::npy::read::{read_npy, read_npy_ids};
pub use files::npy::{Array, write_npy};
pub use files::output::{WriteSeek, WritingPause, check_output, pause_writing, write_atomically};
pub use files::ply::write_ply_mesh;
pub use files::png::{
    GrayBits, encode_png_gray, encode_png_rgb8, read_png_rgb8, srgb_encode, write_png_gray, write_png_rgb8,
    write_png_rgba8,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
