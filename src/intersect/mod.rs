//! The recursion: rays and objects are divided together, one folder for each kind of ray set.

pub(crate) mod beam;
pub(crate) mod bundle;
pub(crate) mod general;
pub(crate) mod grid;
pub(crate) mod irregular;
pub(crate) mod pencil;
pub(crate) mod ray_set;
pub(crate) mod scattered;
