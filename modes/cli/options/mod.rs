//! Options that several verbs share.

pub(crate) mod bounces;
pub(crate) mod camera;
pub(crate) mod dial;
pub(crate) mod lights;
pub(crate) mod parse;
pub(crate) mod picture;
pub(crate) mod views;
