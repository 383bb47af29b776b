//! Receivers of texture atlases: what `modes/bake/atlas/mod.rs`, `charts.rs`, `uv_check.rs` and `texels.rs` promise.
//!
//! Coverage is compared with a polygon clipper in rational numbers, extension with a search through all texels; the rest are
//! properties and small scenes whose answer is known.

mod charts;
mod clipper;
mod coverage;
mod extension;
mod normals;
mod refusals;
mod scenes;
mod uv_warnings;
