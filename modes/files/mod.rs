//! File formats of arrays and images: NPY, EXR, PNG, KTX2, PLY, and writing that leaves nothing half done.

pub mod budget;
pub mod exr;
pub mod ktx2;
pub mod npy;
pub mod output;
pub mod ply;
pub mod png;

pub use budget::available_memory;
pub use exr::{Channel, Samples, read_exr, write_exr};
pub use ktx2::write_ktx2_cube;
pub use npy::read::{read_npy, read_npy_ids};
pub use npy::{Array, write_npy};
pub use output::{WriteSeek, WritingPause, check_output, pause_writing, write_atomically};
pub use ply::write_ply_mesh;
pub use png::{
    GrayBits, encode_png_gray, encode_png_rgb8, read_png_rgb8, srgb_encode, write_png_gray, write_png_rgb8,
    write_png_rgba8,
};
