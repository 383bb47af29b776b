//! Raw arrays as NPY files: little-endian, C order, row 0 on top.
//!
//! Based on: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays", Robert Kern, 2007 (version 1.0 of
//! the format).

pub mod read;

use std::io::{self, Write};
use std::path::Path;

use npyz::{DType, TypeStr, WriteOptions, WriterBuilder};

use crate::error::Error;
use crate::files::output::{refused, write_atomically};

/// Numbers that are turned into bytes at a time.
const CHUNK: usize = 4096;

/// The numbers of an array, the last index running fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Array<'a> {
    /// 32-bit floating point: `<f4`.
    F32(&'a [f32]),
    /// Unsigned 32-bit integers: `<u4`.
    U32(&'a [u32]),
}

impl Array<'_> {
    /// How many numbers there are.
    fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U32(values) => values.len(),
        }
    }

    /// The type of the numbers, in NumPy's words.
    fn type_name(&self) -> &'static str {
        match self {
            Self::F32(_) => "<f4",
            Self::U32(_) => "<u4",
        }
    }
}

/// Writes an array whose extents are `shape`, the slowest first.
///
/// # Errors
///
/// [`Error::Write`] if the file cannot be written, or if `shape` asks for more or fewer numbers than `array` has.
pub fn write_npy(path: &Path, shape: &[usize], array: Array<'_>) -> Result<(), Error> {
    let expected = shape.iter().try_fold(1_usize, |n, &m| n.checked_mul(m));
    if expected != Some(array.len()) {
        let count = array.len();
        return Err(refused(path, format!("an array of shape {shape:?} cannot hold {count} numbers")));
    }
    write_atomically(path, |mut out| {
        write_header(&mut out, shape, array.type_name())?;
        match array {
            Array::F32(values) => write_bytes(&mut out, values, |v| v.to_le_bytes()),
            Array::U32(values) => write_bytes(&mut out, values, |v| v.to_le_bytes()),
        }
    })
}

/// Writes all that comes before the numbers.
fn write_header(out: &mut impl Write, shape: &[usize], type_name: &str) -> io::Result<()> {
    let shape: Vec<u64> = shape.iter().map(|&extent| extent as u64).collect();
    let number: TypeStr = type_name.parse().map_err(io::Error::other)?;
    WriteOptions::new_header_only()
        .dtype(DType::new_scalar(number))
        .shape(&shape)
        .writer(out)
        .write_header_only()?;
    Ok(())
}

/// Writes the numbers. The crate's own loop makes one call for each of them.
fn write_bytes<T: Copy>(
    out: &mut impl Write,
    values: &[T],
    to_le_bytes: impl Fn(T) -> [u8; 4],
) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(4 * CHUNK);
    for chunk in values.chunks(CHUNK) {
        bytes.clear();
        bytes.extend(chunk.iter().flat_map(|&value| to_le_bytes(value)));
        out.write_all(&bytes)?;
    }
    Ok(())
}
