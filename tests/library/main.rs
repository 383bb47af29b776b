//! What the library makes of the answers: pictures, shadows, bounces, receivers of atlases, and their checks.

mod atlas;
#[cfg(all(feature = "gltf", feature = "obj"))]
mod bounces;
mod docs;
mod heat;
mod pictures;
mod public_api;
#[cfg(feature = "obj")]
mod shadow;
mod verify;
