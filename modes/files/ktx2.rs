//! Cube maps of one number per texel as KTX 2.0 files: VK_FORMAT_R32_SFLOAT, six faces, one level, no compression.
//!
//! The file is a header, an index of one level, a data format descriptor, keys with their values, and the faces +X −X +Y
//! −Y +Z −Z, each row by row from the top (`KTXorientation` rd). Numbers are little-endian; NaN and infinity are kept.
//! The crate `ktx2` reads the format; the tests have it check what is written here.
//!
//! Based on: Khronos Group, "KTX File Format Specification", version 2.0; "Khronos Data Format Specification", version
//! 1.3, section 5 (basic descriptor block) and section 3.12 of the former.

use std::path::Path;

use crate::error::Error;
use crate::files::output::{refused, write_atomically};

/// What every KTX 2 file begins with.
const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// VK_FORMAT_R32_SFLOAT.
const R32_SFLOAT: u32 = 100;
/// Bytes of the identifier, nine numbers, and where the other parts stand.
const HEADER_BYTES: u32 = 80;
/// Bytes of the index of one level.
const INDEX_BYTES: u32 = 24;
/// Texels are written this many at a time.
const CHUNK: usize = 4096;

/// The data format descriptor of one 32-bit floating-point channel.
const DESCRIPTOR: [u32; 11] = [
    44,                             // the bytes of this table
    0,                              // Khronos, basic format
    2 | 40 << 16,                   // version 1.3, the bytes of the block that starts above
    1 | 1 << 8 | 1 << 16,           // RGBSDA, BT.709, linear, straight alpha
    0,                              // a texel block of 1x1x1x1
    4,                              // bytes of plane 0
    0,                              // and of the others
    31 << 16 | (0x80 | 0x40) << 24, // bits 0 to 31: float, signed; channel 0, red
    0,                              // at the texel's corner
    0xBF80_0000,                    // lower: −1
    0x3F80_0000,                    // upper: 1
];

/// Writes the six faces of a cube map, of `size` x `size` numbers each.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, or if there are not 6 · size · size numbers, or none.
pub fn write_ktx2_cube(path: &Path, size: u32, faces: &[f32]) -> Result<(), Error> {
    let expected = 6 * u64::from(size) * u64::from(size);
    if expected == 0 || expected != faces.len() as u64 {
        let count = faces.len();
        let problem = format!("a cube map of {size}x{size} texels cannot be made of {count} numbers");
        return Err(refused(path, problem));
    }
    write_atomically(path, |out| {
        out.write_all(&head(size))?;
        let mut bytes = Vec::with_capacity(4 * CHUNK);
        for chunk in faces.chunks(CHUNK) {
            bytes.clear();
            bytes.extend(chunk.iter().flat_map(|value| value.to_le_bytes()));
            out.write_all(&bytes)?;
        }
        Ok(())
    })
}

/// All that comes before the texels.
fn head(size: u32) -> Vec<u8> {
    let keys = key_values();
    let descriptor_offset = HEADER_BYTES + INDEX_BYTES;
    let descriptor_bytes = DESCRIPTOR[0];
    let keys_offset = descriptor_offset + descriptor_bytes;
    let texels_offset = u64::from(keys_offset) + keys.len() as u64;
    let level_bytes = 24 * u64::from(size) * u64::from(size);

    let mut head = IDENTIFIER.to_vec();
    let mut put = |number: u32| head.extend(number.to_le_bytes());
    // vkFormat, typeSize, pixelWidth, pixelHeight, pixelDepth, layerCount, faceCount, levelCount, supercompressionScheme.
    [R32_SFLOAT, 4, size, size, 0, 0, 6, 1, 0].into_iter().for_each(&mut put);
    // Where the descriptor and the keys stand. The keys are a few dozen bytes.
    [descriptor_offset, descriptor_bytes, keys_offset, keys.len() as u32].into_iter().for_each(&mut put);
    // No data of a supercompression; the level and its bytes, twice because they are not compressed.
    for number in [0, 0, texels_offset, level_bytes, level_bytes] {
        head.extend(number.to_le_bytes());
    }
    head.extend(DESCRIPTOR.iter().flat_map(|word| word.to_le_bytes()));
    head.extend(keys);
    head
}

/// Keys in the order of their bytes, with values that end in a zero byte; each pair is filled up to a multiple of 4 bytes,
/// as texels of 4 bytes want it as well.
fn key_values() -> Vec<u8> {
    let writer = concat!("umbel ", env!("CARGO_PKG_VERSION"));
    let mut bytes = Vec::new();
    for (key, value) in [("KTXorientation", "rd"), ("KTXwriter", writer)] {
        let pair = [key.as_bytes(), b"\0", value.as_bytes(), b"\0"].concat();
        // Two short words.
        bytes.extend((pair.len() as u32).to_le_bytes());
        bytes.extend(pair);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}
