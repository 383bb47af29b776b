//! Where ambient occlusion is asked for: vertices, texels and given points.

pub(crate) mod points;
pub(crate) mod texels;
pub(crate) mod vertices;
