//! Images of many channels as OpenEXR files: one layer, scan lines from the top, ZIP compression (lossless).
//!
//! Floating-point channels are FLOAT, ids are UINT: neither is rounded, NaN and infinity are kept. The file says
//! nothing of time, machine or program, and it is compressed by one thread: equal channels give equal bytes.
//!
//! Based on: Florian Kainz, Rod Bogart and Piotr Stanczyk, "Technical Introduction to OpenEXR"; "OpenEXR File Layout".

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, Text, WritableImage, read,
};

use crate::error::Error;
use crate::files::output::{refused, write_atomically};

/// The longest name of a channel, in bytes.
const LONGEST_NAME: usize = 255;

/// The format stores extents as signed 32-bit integers.
const GREATEST_EXTENT: usize = i32::MAX as usize;

/// A reader may always ask for this much memory, in bytes; for more only if the file is large enough to need it.
const PLAIN_BYTES: u64 = 512 << 20;

/// More than the bytes that one byte of a file can expand to, whatever its compression (PXR24: 4/3 · 1032).
const GREATEST_EXPANSION: u64 = 2000;

/// One number per pixel, under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// The name, such as `Z` or `N.X`: 1 to 255 printable ASCII characters.
    pub name: String,
    /// The numbers, row by row, row 0 on top.
    pub samples: Samples,
}

/// The numbers of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// 32-bit floating point.
    F32(Vec<f32>),
    /// Unsigned 32-bit integers.
    U32(Vec<u32>),
}

impl Samples {
    /// How many numbers there are.
    fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U32(values) => values.len(),
        }
    }
}

/// Writes channels of `width` · `height` numbers each. Their order does not matter: the file has them by name.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, if there is no channel or no pixel, if a channel has another number
/// of samples, and if a name is used twice or is not one.
pub fn write_exr(path: &Path, width: usize, height: usize, mut channels: Vec<Channel>) -> Result<(), Error> {
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    check(width, height, &channels).map_err(|problem| refused(path, problem))?;
    let list = channels.into_iter().map(into_any_channel).collect();
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((width, height), LayerAttributes::default(), encoding, AnyChannels { list });
    let image = Image::from_layer(layer);
    write_atomically(path, |out| image.write().non_parallel().to_buffered(out).map_err(into_io_error))
}

/// Checks channels in the order of their names for what the format does not allow.
fn check(width: usize, height: usize, channels: &[Channel]) -> Result<(), String> {
    if channels.is_empty() {
        return Err("an image needs a channel".into());
    }
    let extents = 1..=GREATEST_EXTENT;
    let pixels = width.checked_mul(height);
    let Some(pixels) = pixels.filter(|_| extents.contains(&width) && extents.contains(&height)) else {
        return Err(format!(
            "{width}x{height} pixels cannot be an image; each extent is 1 to {GREATEST_EXTENT}"
        ));
    };
    for Channel { name, samples } in channels {
        let printable = name.bytes().all(|byte| byte.is_ascii_graphic());
        if name.is_empty() || name.len() > LONGEST_NAME || !printable {
            return Err(format!(
                "{name:?} cannot be the name of a channel; take 1 to {LONGEST_NAME} printable ASCII characters"
            ));
        }
        if samples.len() != pixels {
            let count = samples.len();
            return Err(format!("channel {name} has {count} samples for {width}x{height} pixels"));
        }
    }
    let twice = channels.windows(2).find(|pair| pair[0].name == pair[1].name);
    match twice {
        Some(pair) => Err(format!("two channels have the name {}; rename one", pair[0].name)),
        None => Ok(()),
    }
}

/// Moves the numbers over; nothing is copied. The name has been checked.
fn into_any_channel(channel: Channel) -> AnyChannel<FlatSamples> {
    let samples = match channel.samples {
        Samples::F32(values) => FlatSamples::F32(values),
        Samples::U32(values) => FlatSamples::U32(values),
    };
    AnyChannel::new(Text::from(channel.name.as_str()), samples)
}

/// Keeps the system's errors as they are.
fn into_io_error(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// Reads an image: width, height and the channels in the order of their names. Half floats become `f32`, exactly.
///
/// Of several layers the first is read, of several resolutions the largest.
///
/// # Errors
///
/// [`Error::Input`] if there is no such file, or if it is not an OpenEXR image that can be decoded.
pub fn read_exr(path: &Path) -> Result<(usize, usize, Vec<Channel>), Error> {
    decode(path).map_err(|error| Error::Input {
        path: path.to_owned(),
        line: None,
        problem: format!("cannot read this as an OpenEXR image: {error}"),
        remedy: "check the name, or write the file again".into(),
    })
}

/// Reads and converts the first layer.
fn decode(path: &Path) -> exr::error::Result<(usize, usize, Vec<Channel>)> {
    check_size(path)?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)?;
    let size = image.layer_data.size;
    let (width, height) = (size.width(), size.height());
    let list = image.layer_data.channel_data.list;
    let channels: Vec<Channel> = list.into_iter().map(from_any_channel).collect();
    for Channel { name, samples } in &channels {
        if samples.len() != width * height {
            let problem = format!("channel {name} does not have a sample for each pixel");
            return Err(exr::error::Error::NotSupported(problem.into()));
        }
    }
    Ok((width, height, channels))
}

/// The bytes that the header of a file announces; 0 where there is none.
pub(crate) fn announced(path: &Path) -> u64 {
    let headers = File::open(path)
        .map_err(exr::error::Error::from)
        .and_then(|file| MetaData::read_from_buffered(BufReader::new(file), false));
    headers.map_or(0, |found| found.headers.iter().map(announced_bytes).fold(0, u64::saturating_add))
}

/// Refuses a header that announces more than the file can hold, before memory is asked for.
fn check_size(path: &Path) -> exr::error::Result<()> {
    let file = File::open(path)?;
    let file_bytes = file.metadata()?.len();
    let limit = PLAIN_BYTES.saturating_add(file_bytes.saturating_mul(GREATEST_EXPANSION));
    let headers = MetaData::read_from_buffered(BufReader::new(file), false)?.headers;
    let announced = headers.iter().map(announced_bytes).fold(0, u64::saturating_add);
    if announced > limit {
        let problem = format!("it announces {announced} bytes and has only {file_bytes}");
        return Err(exr::error::Error::Invalid(problem.into()));
    }
    Ok(())
}

/// The bytes of all samples of a layer.
fn announced_bytes(header: &Header) -> u64 {
    let size = header.layer_size;
    let bytes_per_pixel = header.channels.bytes_per_pixel as u64;
    (size.width() as u64).saturating_mul(size.height() as u64).saturating_mul(bytes_per_pixel)
}

/// Moves the numbers over, or widens them.
fn from_any_channel(channel: AnyChannel<FlatSamples>) -> Channel {
    let samples = match channel.sample_data {
        FlatSamples::F32(values) => Samples::F32(values),
        FlatSamples::U32(values) => Samples::U32(values),
        FlatSamples::F16(values) => Samples::F32(values.iter().map(|v| v.to_f32()).collect()),
    };
    Channel { name: channel.name.to_string(), samples }
}
