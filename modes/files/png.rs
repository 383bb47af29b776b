//! PNG files for looking at, and the sRGB transfer function that their numbers are encoded with.
//!
//! The transfer function, s in 0 to 1: s = 12.92 x for x ≤ 0.0031308, else 1.055 x^(1/2.4) − 0.055; the code is 255 s,
//! rounded to nearest. It rises with x, so a table of the places where the code changes gives the same codes.
//!
//! Based on: IEC 61966-2-1:1999 (sRGB); "Portable Network Graphics (PNG) Specification", W3C, third edition.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::LazyLock;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::error::{LimitError, LimitErrorKind};
use image::{ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageFormat, ImageReader, Limits};

use crate::error::Error;
use crate::files::budget::Budget;
use crate::files::output::{refused, write_atomically};

/// Below this, 2^-13, the code is 0: 255 · 12.92 · 2^-13 < 0.5.
const DARK: f32 = 1.0 / 8192.0;

/// Bits of an f32 that a step of the table leaves free: 128 steps per power of two. No step holds two changes of the
/// code: they are closest to each other, for the width of a step, just above 0.5: 0.0059 apart, the step is 2^-8.
const STEP_BITS: u32 = 16;

/// A reader may always ask for this much memory, in bytes; for more only if the file is large enough to need it.
const PLAIN_BYTES: u64 = 512 << 20;

/// More than the bytes that one byte of a deflate stream can expand to (1032).
const GREATEST_EXPANSION: u64 = 1100;

/// The codes of the f32 that share their upper bits.
struct Step {
    /// The code of the first of them.
    code: u8,
    /// From here on the code is one higher. Infinite if it stays the same throughout.
    next_from: f32,
}

/// The steps from [`DARK`] to 1.
static STEPS: LazyLock<Vec<Step>> = LazyLock::new(|| {
    let bits = DARK.to_bits()..1_f32.to_bits();
    bits.step_by(1 << STEP_BITS).map(make_step).collect()
});

/// Encodes a linear value, 0 to 1, as an sRGB code. Values outside are clamped, NaN gives 0.
///
/// The result is that of the formula in f64 for every f32, on every machine.
#[must_use]
pub fn srgb_encode(linear: f32) -> u8 {
    if linear.is_nan() || linear < DARK {
        return 0;
    }
    if linear >= 1.0 {
        return u8::MAX;
    }
    let step = &STEPS[((linear.to_bits() - DARK.to_bits()) >> STEP_BITS) as usize];
    step.code + u8::from(linear >= step.next_from)
}

/// The definition, for a value in 0 to 1.
fn srgb_formula(linear: f32) -> u8 {
    let x = f64::from(linear);
    let s = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

/// Makes the step of the f32 from `first_bits` on. Positive f32 are in the order of their bits.
fn make_step(first_bits: u32) -> Step {
    let code = srgb_formula(f32::from_bits(first_bits));
    let (mut low, mut high) = (first_bits, first_bits + (1 << STEP_BITS));
    // The code changes behind `low` and not behind `high`, which is reached if it does not change at all.
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if srgb_formula(f32::from_bits(middle)) == code {
            low = middle;
        } else {
            high = middle;
        }
    }
    let changes = high < first_bits + (1 << STEP_BITS);
    Step { code, next_from: if changes { f32::from_bits(high) } else { f32::INFINITY } }
}

/// Writes an image of 3 bytes per pixel: red, green, blue. Row 0 is on top.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, if the image is empty or if `pixels` has not 3 · width · height bytes.
pub fn write_png_rgb8(path: &Path, width: u32, height: u32, pixels: &[u8]) -> Result<(), Error> {
    write_png(path, (width, height), pixels, ExtendedColorType::Rgb8)
}

/// The bytes of a file as [`write_png_rgb8`] makes it.
///
/// # Errors
///
/// What is wrong: the image is empty, or there are not 3 · width · height bytes.
pub fn encode_png_rgb8(width: u32, height: u32, pixels: &[u8]) -> Result<Vec<u8>, String> {
    encode((width, height), pixels, ExtendedColorType::Rgb8)
}

/// Writes an image of 4 bytes per pixel: red, green, blue, opacity (not premultiplied). Row 0 is on top.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, if the image is empty or if `pixels` has not 4 · width · height bytes.
pub fn write_png_rgba8(path: &Path, width: u32, height: u32, pixels: &[u8]) -> Result<(), Error> {
    write_png(path, (width, height), pixels, ExtendedColorType::Rgba8)
}

/// How many bits a gray pixel has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GrayBits {
    /// 256 levels.
    #[default]
    Eight,
    /// 65,536 levels.
    Sixteen,
}

/// Writes linear values from 0 to 1 as a gray image, without the transfer function of sRGB: data, such as openness. Row 0 is
/// on top; values outside are clamped, NaN is white.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, if the image is empty or if there are not width · height values.
pub fn write_png_gray(
    path: &Path,
    width: u32,
    height: u32,
    values: &[f32],
    bits: GrayBits,
) -> Result<(), Error> {
    let bytes = encode_png_gray(width, height, values, bits).map_err(|problem| refused(path, problem))?;
    write_atomically(path, |out| out.write_all(&bytes))
}

/// The bytes of a file as [`write_png_gray`] makes it.
///
/// # Errors
///
/// What is wrong: the image is empty, or there are not width · height values.
pub fn encode_png_gray(width: u32, height: u32, values: &[f32], bits: GrayBits) -> Result<Vec<u8>, String> {
    match bits {
        GrayBits::Eight => {
            let pixels: Vec<u8> = values.iter().map(|&value| gray8(value)).collect();
            encode((width, height), &pixels, ExtendedColorType::L8)
        }
        GrayBits::Sixteen => {
            // The encoder takes numbers as the machine has them.
            let pixels: Vec<u8> =
                values.iter().flat_map(|&value| (level(value, 65_535.0) as u16).to_ne_bytes()).collect();
            encode((width, height), &pixels, ExtendedColorType::L16)
        }
    }
}

/// The gray level of a value: 0 to 255, NaN is white.
pub(crate) fn gray8(value: f32) -> u8 {
    level(value, 255.0) as u8
}

/// The level of a value from 0 to 1, rounded to nearest; NaN is the greatest.
fn level(value: f32, greatest: f32) -> f32 {
    if value < 1.0 { (value.max(0.0) * greatest).round() } else { greatest }
}

/// Writes a file of pixels.
fn write_png(path: &Path, size: (u32, u32), pixels: &[u8], color: ExtendedColorType) -> Result<(), Error> {
    let bytes = encode(size, pixels, color).map_err(|problem| refused(path, problem))?;
    write_atomically(path, |out| out.write_all(&bytes))
}

/// Encodes in memory, because the encoder does not report an error in the last bytes of a file. The error says what is wrong.
fn encode((width, height): (u32, u32), pixels: &[u8], color: ExtendedColorType) -> Result<Vec<u8>, String> {
    let pixel_bytes = u64::from(color.bits_per_pixel() / 8);
    let expected = (u64::from(width) * u64::from(height)).saturating_mul(pixel_bytes);
    if expected == 0 || expected != pixels.len() as u64 {
        let bytes = pixels.len();
        return Err(format!("an image of {width}x{height} pixels cannot be made of {bytes} bytes"));
    }
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(pixels, width, height, color)
        .map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// Reads an image as 3 bytes per pixel: width, height and pixels. Opacity is dropped, other depths are converted.
///
/// # Errors
///
/// [`Error::Input`] if there is no such file, or if it is not a PNG that can be decoded.
pub fn read_png_rgb8(path: &Path) -> Result<(u32, u32, Vec<u8>), Error> {
    let image = read_png(path)?.into_rgb8();
    Ok((image.width(), image.height(), image.into_raw()))
}

/// Reads an image as one number from 0 to 65535 per pixel: width, height and pixels. Colours become their luminance, opacity is
/// dropped. What the pixels take, and `beside` bytes more for each of them, is counted before they are decoded.
pub(crate) fn read_png_gray16(
    path: &Path,
    beside: u64,
    budget: &Budget,
) -> Result<(u32, u32, Vec<u16>), Error> {
    let counted = |(width, height): (u32, u32), decoded: u64| {
        let pixels = u64::from(width) * u64::from(height);
        let bytes = decoded.saturating_add(pixels.saturating_mul(2 + beside));
        budget.check(bytes, &format!("{width}x{height} pixels"))
    };
    let mut too_large = None;
    let image = decode(path, |size, decoded| match counted(size, decoded) {
        Ok(()) => true,
        Err(problem) => {
            too_large = Some(budget.error(problem, path));
            false
        }
    });
    match too_large {
        Some(error) => Err(error),
        None => {
            let image = image.map_err(|error| not_png(path, &error))?.into_luma16();
            Ok((image.width(), image.height(), image.into_raw()))
        }
    }
}

/// Decodes a file, or says why not.
fn read_png(path: &Path) -> Result<image::DynamicImage, Error> {
    decode(path, |_, _| true).map_err(|error| not_png(path, &error))
}

/// The error for a file that cannot be decoded.
fn not_png(path: &Path, error: &ImageError) -> Error {
    Error::Input {
        path: path.to_owned(),
        line: None,
        problem: format!("cannot read this as a PNG image: {error}"),
        remedy: "check the name, or write the file again".into(),
    }
}

/// Decodes a file whose header cannot make the reader ask for more memory than the file may need. `may_go_on` is asked with
/// the size in pixels and in bytes before pixels are decoded.
fn decode(
    path: &Path,
    may_go_on: impl FnOnce((u32, u32), u64) -> bool,
) -> Result<image::DynamicImage, ImageError> {
    let file = File::open(path)?;
    let file_bytes = file.metadata()?.len();
    let mut limits = Limits::default();
    limits.max_alloc = Some(PLAIN_BYTES.saturating_add(file_bytes.saturating_mul(GREATEST_EXPANSION)));
    let mut reader = ImageReader::with_format(BufReader::new(file), ImageFormat::Png);
    reader.limits(limits);
    let decoder = reader.into_decoder()?;
    if !may_go_on(decoder.dimensions(), decoder.total_bytes()) {
        return Err(ImageError::Limits(LimitError::from_kind(LimitErrorKind::InsufficientMemory)));
    }
    image::DynamicImage::from_decoder(decoder)
}
