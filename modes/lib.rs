//! umbel: primary visibility on the CPU, exact and deterministic, with nothing to build.
//!
//! This package is what the engine is for: scenes from files, cameras, pictures, checks. The engine itself is
//! `umbel-core`; it is here as [`engine`], so that one dependency is enough. What most programs need stands at the root,
//! the rest in the module of its subject:
//!
//! - [`scene`] and [`formats`]: triangles in memory, and files that they come from; [`builtin`](mod@builtin) makes some by rules;
//! - [`render`]: what a camera sees, ids and distances first, and pictures of it;
//! - [`shadow`]: exact shadows, and shadow maps; [`bake`]: ambient occlusion for vertices, texels and points;
//! - [`surfaces`]: shapes that are made where rays need them;
//! - [`files`]: arrays and images; [`measure`]: differences and estimates of errors.
//!
//! The command `umbel` is behind the default feature `cli`; a library does without: `default-features = false`. Features `obj`
//! and `gltf` read these formats.
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

pub use umbel_core as engine;
pub use umbel_core::{
    Frame, Hit, Hits, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Stats, TriangleId, Triangles, any_hit,
    closest_hit, glam,
};

pub mod bake;
pub mod builtin;
mod error;
pub mod files;
pub mod formats;
pub mod measure;
mod random;
pub mod render;
pub mod scene;
pub mod shadow;
pub mod surfaces;

pub use builtin::builtin;
pub use error::{Argument, Error};
pub use formats::load::{LoadOptions, load};
pub use render::{Aov, AovData, VisibilityBuffer, visibility};
pub use scene::Scene;
pub use scene::camera::{Camera, Lens};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
struct LibraryPage;
