//! Boxes, rays and triangles: what a scene is made of, as f32 and f64 numbers, and nothing about how it is intersected.

pub(crate) mod aabb;
pub(crate) mod ray;
pub(crate) mod triangles;
