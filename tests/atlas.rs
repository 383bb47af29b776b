//! Receivers of texture atlases: what `modes/bake/atlas/mod.rs`, `charts.rs`, `uv_check.rs` and `texels.rs` promise.
//!
//! Coverage is compared with a polygon clipper in rational numbers, extension with a search through all texels; the rest are
//! properties and small scenes whose answer is known.

#[path = "atlas/charts.rs"]
mod charts;
#[path = "atlas/clipper.rs"]
mod clipper;
#[path = "atlas/coverage.rs"]
mod coverage;
#[path = "atlas/extension.rs"]
mod extension;
#[path = "atlas/normals.rs"]
mod normals;
#[path = "atlas/refusals.rs"]
mod refusals;
#[path = "atlas/scenes.rs"]
mod scenes;
#[path = "atlas/uv_warnings.rs"]
mod uv_warnings;
