//! umbel-core: exact visibility for coherent rays, with nothing to build.
//!
//! Rays and triangles are divided together, recursively, and no hierarchy is stored. Rays that share an origin form a
//! [`Pencil`]; one frustum stands for many of them. Other rays go in bundles, with one shaft for many. The triangle
//! reported for a ray is the one that exact arithmetic gives, on every path, thread count and machine.
//!
//! The way through: [`Triangles`] and a [`Pencil`] (or [`Ray`]s) go in; [`closest_hit`] or [`any_hit`] runs the recursion;
//! [`Hits`] and [`Stats`] come out; a [`Frame`] keeps what the next query can use. There are no files and no images here; the package `umbel` has them.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011.

mod ambient;
mod approx;
mod batch;
mod blocks;
mod bounds;
mod bundle_leaf;
mod bundle_recursion;
mod bundles;
mod cell_grid;
mod cell_leaf;
mod clusters;
mod cone;
mod cost_division;
mod cost_groups;
mod culling_space;
mod density;
mod departure;
mod depth;
mod detail;
mod diced;
mod dicer;
mod direction_cells;
mod direction_masks;
mod error;
mod expansion;
mod film;
mod footprints;
mod frame;
mod frustum;
mod gather;
mod general;
mod given;
mod grid_samples;
mod grid_tile;
mod hemisphere;
mod hemispheres;
mod hierarchical_z;
mod hits;
mod horizon_planes;
mod isa;
mod lanes;
mod leaf;
mod light_order;
mod micropolygon;
mod occlusion_on_demand;
mod on_demand;
mod options;
mod order;
mod packet_bounds;
mod packet_edges;
mod packet_pencils;
mod packet_set;
mod packets;
mod pairs;
mod partition;
mod pencil;
mod piercings;
mod placed_grid;
mod point_order;
mod predicates;
mod probes;
mod query;
mod ray;
mod ray_order;
mod receiver_cluster;
mod recursion;
mod resolve;
mod reyes;
mod reyes_tile;
mod runs;
mod sample_directions;
mod sampled_split;
mod scattered;
mod segment;
mod setup;
mod shadow;
mod shadow_on_demand;
mod shaft;
mod sightings;
mod sights;
mod slabs;
mod space_setup;
mod stats;
mod sub_patch;
mod surface;
mod surface_hits;
mod tile_depth;
mod tile_keys;
mod triangles;
mod voxels;
mod window;

pub use glam;

pub use error::Error;
pub use on_demand::{Domain, OnDemand};
pub use triangles::{TriangleId, Triangles};

pub use departure::Side;
pub use film::{Film, GridFilm};
pub use hemisphere::{Above, Grouping, Hemisphere, Occlusion, OpenRays, RaySample, RaySamples};
pub use pencil::{Origin, Pencil, Rays};
pub use ray::Ray;
pub use segment::Segment;
pub use shadow::Receiver;

pub use bounds::Aabb;
pub use cone::Cone;
pub use frustum::Frustum;

pub use density::Around;
pub use detail::Detail;
pub use diced::{DicedTriangles, dice_all};
pub use dicer::Dicing;
pub use occlusion_on_demand::open_rays_on_demand;
pub use reyes::closest_hit_on_demand;
pub use shadow_on_demand::shadowed_on_demand;
pub use surface_hits::SurfaceHits;

pub use frame::Frame;
pub use hits::{Hit, Hits, NO_TRIANGLE};
pub use isa::Isa;
pub use options::{Accuracy, Options, Path};
pub use partition::Partition;
pub use query::{any_hit, blocked, closest_hit, open_rays, shadowed};
pub use stats::{Stats, TileStats};
