//! umbel-core: exact visibility for coherent rays, with nothing to build.
//!
//! Rays and triangles are divided together, recursively, and no hierarchy outlives a query. Rays that share an origin
//! form a [`Pencil`]; one frustum stands for many of them, and beside the triangles there is an order of them with
//! boxes of runs: 6 bytes a triangle. Other rays go in bundles, with one shaft for many; for them a tree of eight-wide
//! nodes is built lazily, where rays enter, and dropped with the query: up to 63 bytes a triangle. The triangle
//! reported for a ray is the one that exact arithmetic gives, on every path, thread count and machine.
//!
//! The way through: [`Triangles`] and a [`Pencil`] (or [`Ray`]s) go in; [`closest_hit`] or [`any_hit`] runs the
//! recursion; [`Hits`] and [`Stats`] come out; a [`Frame`] keeps what the next query can use. There are no files and no
//! images here; the package `umbel` has them.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011.

mod error;
mod exact;
mod geometry;
mod intersect;
mod objects;
mod options;
mod query;
mod rays;
mod reyes;
mod simd;
mod stats;

pub use glam;

pub use error::Error;
pub use geometry::triangles::{TriangleId, Triangles};
pub use reyes::dice::rule::{Domain, OnDemand};

pub use geometry::ray::Ray;
pub use objects::offset::Side;
pub use rays::film::{Film, GridFilm};
pub use rays::hemisphere::{Above, Grouping, Hemisphere, Occlusion, OpenRays, RaySample, RaySamples};
pub use rays::origin::Origin;
pub use rays::pencil::{Pencil, Rays};
pub use rays::receiver::Receiver;
pub use rays::segment::Segment;

pub use geometry::aabb::Aabb;
pub use rays::cone::Cone;
pub use rays::frustum::Frustum;

pub use reyes::closest::closest_hit_on_demand;
pub use reyes::dice::detail::{Around, Detail};
pub use reyes::dice::dicing::Dicing;
pub use reyes::occlusion::open_rays_on_demand;
pub use reyes::reference::{DicedTriangles, dice_all};
pub use reyes::sample::hits::SurfaceHits;
pub use reyes::shadow::shadowed_on_demand;

pub use options::{Accuracy, Options, Partition, Path};
pub use query::frame::Frame;
pub use query::{any_hit, blocked, closest_hit, open_rays, shadowed};
pub use rays::hits::{Hit, Hits, NO_TRIANGLE};
pub use simd::isa::Isa;
pub use stats::{Stats, TileStats};
