//! Compressed files: gzip and Zstandard, recognised by their first bytes.
//!
//! Based on: RFC 1952 (gzip), 1996; RFC 8878 (Zstandard), 2021.

use std::io::{self, Read};

/// How bytes are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packing {
    Gzip,
    Zstandard,
}

impl Packing {
    /// The compression that bytes begin with.
    pub(crate) fn of(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x1f, 0x8b, 8, ..] => Some(Self::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] => Some(Self::Zstandard),
            _ => None,
        }
    }

    /// Whether an extension in lower case is that of a compressed file.
    pub(crate) fn has_extension(extension: &str) -> bool {
        matches!(extension, "gz" | "zst")
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstandard => "Zstandard",
        }
    }
}

/// What gives the unpacked bytes, of all members or frames one after the other.
pub(crate) fn reader<'a>(packing: Packing, bytes: &'a [u8]) -> io::Result<Box<dyn Read + 'a>> {
    match packing {
        #[cfg(feature = "gz")]
        Packing::Gzip => Ok(Box::new(flate2::bufread::MultiGzDecoder::new(bytes))),
        #[cfg(feature = "zst")]
        Packing::Zstandard => Ok(Box::new(Frames { rest: bytes, frame: None })),
        #[cfg(not(all(feature = "gz", feature = "zst")))]
        _ => {
            let _ = bytes;
            Err(io::Error::other("this build does not unpack it"))
        }
    }
}

/// Zstandard frames, one after the other.
#[cfg(feature = "zst")]
struct Frames<'a> {
    /// What stands behind the frames that were begun.
    rest: &'a [u8],
    frame: Option<ruzstd::decoding::StreamingDecoder<&'a [u8], ruzstd::decoding::FrameDecoder>>,
}

#[cfg(feature = "zst")]
impl Read for Frames<'_> {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        use ruzstd::decoding::StreamingDecoder;
        loop {
            if let Some(frame) = &mut self.frame {
                let count = frame.read(target)?;
                if count > 0 || target.is_empty() {
                    return Ok(count);
                }
                self.rest = *frame.get_ref();
                self.frame = None;
            }
            if self.rest.is_empty() {
                return Ok(0);
            }
            self.frame = Some(StreamingDecoder::new(self.rest).map_err(io::Error::other)?);
        }
    }
}
