//! Built-in surfaces on demand.

pub(crate) mod field;
pub(crate) mod teapot;
pub(crate) mod terrain;
