//! Built-in surfaces on demand.

pub mod field;
pub(crate) mod teapot;
pub mod terrain;
