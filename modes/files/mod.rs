//! File formats of arrays and images: NPY, EXR, PNG, KTX2, PLY, and writing that leaves nothing half done.

pub(crate) mod budget;
pub(crate) mod exr;
pub(crate) mod ktx2;
pub(crate) mod npy;
pub(crate) mod output;
pub(crate) mod ply;
pub(crate) mod png;
