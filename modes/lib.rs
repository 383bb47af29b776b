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

mod ambient;
mod atlas;
mod atlas_block;
mod bake;
mod bake_occluders;
mod bake_options;
mod bezier;
mod bezier_rows;
mod bicubic;
mod blades;
mod border_rulers;
mod bounce;
mod bpt;
mod builtin;
mod cage;
mod cage_builder;
mod camera;
mod casters;
mod charts;
#[cfg(feature = "obj")]
mod clip_ring;
mod cornell;
mod cube_lookup;
mod cube_samples;
mod depth_maps;
mod differences;
mod displaced;
mod displacement;
#[cfg(feature = "obj")]
mod ear_clip;
mod error;
mod estimate;
mod exr_file;
mod extent;
mod field;
mod flower;
mod foliage;
mod footprint;
#[cfg(feature = "gltf")]
mod gltf;
#[cfg(feature = "gltf")]
mod gltf_accessor;
#[cfg(feature = "gltf")]
mod gltf_buffers;
#[cfg(feature = "gltf")]
mod gltf_container;
#[cfg(feature = "gltf")]
mod gltf_extensions;
#[cfg(feature = "gltf")]
mod gltf_instances;
#[cfg(feature = "gltf")]
mod gltf_json;
#[cfg(feature = "gltf")]
mod gltf_nodes;
#[cfg(feature = "gltf")]
mod gltf_optics;
#[cfg(feature = "gltf")]
mod gltf_patch;
#[cfg(feature = "gltf")]
mod gltf_scene;
#[cfg(feature = "gltf")]
mod gltf_texture;
#[cfg(feature = "gltf")]
mod gltf_vertex;
mod hammersley;
mod height_map;
mod hills;
mod info;
mod ktx2_file;
mod lamps;
mod light_map;
mod light_paths;
mod limit_masks;
mod limit_surface;
mod load;
mod map_compare;
mod map_places;
mod mesh_ply;
mod mirror_planes;
#[cfg(feature = "obj")]
mod mtl;
mod neighbourhood;
mod noise;
mod noise_lanes;
mod npy;
mod npy_reader;
#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "obj")]
mod obj_source;
#[cfg(feature = "obj")]
mod obj_tags;
#[cfg(feature = "obj")]
mod obj_text;
mod occluders;
mod optics;
mod output;
mod pareto;
mod patch_tree;
mod pattern;
mod planar_mirror;
mod plane_noise;
mod png_file;
mod point_cloud;
mod point_lanes;
mod point_receivers;
mod polygons;
mod primary;
mod raster;
mod reyes;
mod sample_sets;
mod scene;
mod shade;
mod shading_normal;
mod shadow;
mod spawn;
mod subdivision;
mod surface_scene;
mod surfaces;
mod sweep;
mod teapot;
mod terrain;
mod texel_receivers;
mod texels;
mod uv_check;
mod verify;
mod vertex_receivers;
mod visible;
mod work;

pub use error::Error;

pub use builtin::{BuiltinView, builtin, builtin_view};
#[cfg(feature = "gltf")]
pub use gltf::{GltfFile, GltfOptions, GltfOrigin, read_gltf};
#[cfg(feature = "gltf")]
pub use gltf_vertex::VertexTarget;
pub use load::{LoadOptions, load};
#[cfg(feature = "obj")]
pub use obj::{ObjOptions, read_obj};
pub use scene::{Material, NO_INDEX, Object, Scene};

pub use camera::{CUBE_FACES, Camera, Lens, Shot};
pub use info::{Info, info};
pub use pattern::{Pattern, read_pattern};
pub use point_cloud::{SeenPoint, write_ply};
pub use primary::{Aov, AovData, Look, VisibilityBuffer, preview, preview_lit, preview_with, visibility};

pub use bounce::Followed;
pub use optics::Optics;
pub use spawn::{Bounces, Spawned};

pub use casters::Casters;
pub use cube_lookup::CubeMap;
pub use cube_samples::cube_answers;
pub use light_map::{cube_map, cube_pencil, distances, face_matrices, sun_pencil, surface_distances};
pub use map_compare::{MapErrors, compare_maps};
pub use shadow::{MaskCounts, Receivers, point_light, receivers, shadow_masks, sun_light};

pub use bezier::BezierPatches;
pub use bpt::read_bpt;
pub use displaced::{DisplacedMesh, FaceObject};
pub use displacement::{Displacement, Relief};
pub use field::{Field, FieldObject};
pub use height_map::HeightMap;
pub use noise::Noise;
pub use patch_tree::Node;
pub use reyes::{SurfaceBuffer, SurfaceLook, surface_preview, surface_visibility};
pub use subdivision::{Creases, SubdivisionSurface};
pub use surface_scene::{SurfaceOptions, SurfaceScene, load_surfaces, names_surfaces, surface_view};
pub use surfaces::{SurfaceObject, Surfaces};
pub use terrain::Terrain;

pub use atlas::{Atlas, AtlasOptions, TexelReceiver};
pub use bake::{Bake, BakeReceivers, Baked, TracedRay};
pub use bake_occluders::{BakeOccluders, rays_around};
pub use bake_options::{BakeOptions, Polarity};
pub use depth_maps::DepthMaps;
pub use occluders::Occluders;
pub use point_receivers::read_points;
pub use sample_sets::{Falloff, Reach, SampleSet, Weighting};
pub use texels::TexelImage;
pub use uv_check::{UvCheck, check_uvs};
pub use vertex_receivers::VertexReceivers;

pub use differences::Differences;
pub use estimate::{ErrorEstimate, PowerLaw, sample_key};
pub use pareto::pareto_front;

pub use verify::{Mark, Verification, verify, verify_buffer};
pub use visible::{Visible, visible};

pub use exr_file::{Channel, Samples, read_exr, write_exr};
pub use ktx2_file::write_ktx2_cube;
pub use mesh_ply::write_ply_mesh;
pub use npy::{Array, write_npy};
pub use npy_reader::{read_npy, read_npy_ids};
pub use output::{WriteSeek, WritingPause, check_output, pause_writing, write_atomically};
pub use png_file::{
    GrayBits, encode_png_gray, encode_png_rgb8, read_png_rgb8, srgb_encode, write_png_gray, write_png_rgb8,
    write_png_rgba8,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
