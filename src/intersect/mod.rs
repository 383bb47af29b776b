//! The recursion: rays and objects are divided together, one folder for each kind of ray set.
//!
//! ```text
//! intersect(rays, objects):                                  Algorithm 1 of Keller and Wächter, 2011
//!     rays <- those of `rays` that may meet bounds(objects)
//!     if few rays or few objects: directly intersect all pairs
//!     else: for each part of partition(objects), near ones first:
//!               intersect(rays, part)
//! ```
//!
//! Nothing is stored but the rays and a permutation of the objects; what is known of the rays makes the paths differ:
//!
//! | path | rays | bound that stands for them | partition of the objects | ends at | leaf |
//! |---|---|---|---|---|---|
//! | [`general`] | any; the reference | each ray's slabs | in place: middle, given, spatial or sampled | few pairs, by cost | all pairs, exactly |
//! | [`pencil`] and [`grid`] | pixels of one origin, 64x64 a tile | frustum, and the farthest hit of the tile | eights of runs along a curve, boxes made in one pass | a run of 16 triangles | edge functions on rows of eight pixels |
//! | [`pencil`] and [`irregular`] | points that one light sees, 4096 on a film around them | the same | the same | the same | edge functions on packets of eight points |
//! | [`bundle`] | arbitrary rays, and those of one origin on no grid; one octant of a stream of 8192 | shaft, then eight boxes for each ray | eight parts by cost, made where rays enter, dropped with the query | eight triangles | filter in f32, then pairs in f64, eight at a time |
//! | [`beam`] | open rays of 256 neighbouring receivers along one direction | rectangle across the direction | by cost, in place, sixteen parts a level | a run of 16 triangles | affine functions for the beam, for packets, for sixteen rays |
//!
//! Which path answers is decided in [`crate::query::path`] alone. A path names no other, but [`general`] where its
//! numbers end.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011, Algorithm 1.

pub(crate) mod beam;
pub(crate) mod bundle;
pub(crate) mod context;
pub(crate) mod general;
pub(crate) mod grid;
pub(crate) mod irregular;
pub(crate) mod pencil;
pub(crate) mod ray_set;
