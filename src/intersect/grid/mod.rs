//! Pixels of a grid film, taken in tiles and blocks.

pub(crate) mod depth;
pub(crate) mod hierarchical_z;
pub(crate) mod relations;
pub(crate) mod resolve;
pub(crate) mod rows;
pub(crate) mod tile_keys;
pub(crate) mod tiles;
