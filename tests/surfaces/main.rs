//! Surfaces on demand: their geometry, what rays see of them, and `umbel reyes`.

#[cfg(feature = "obj")]
mod command;
#[cfg(feature = "obj")]
mod geometry;
mod reyes;
