//! Points anywhere on a film, taken in packets.

pub(crate) mod bounds;
pub(crate) mod face_points;
pub(crate) mod order;
pub(crate) mod packets;
pub(crate) mod shadow;
pub(crate) mod tile;
