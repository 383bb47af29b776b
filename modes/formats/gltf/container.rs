//! The two containers of glTF: JSON text (.gltf), and GLB (.glb), whose chunks hold the JSON and one buffer.
//!
//! GLB: "glTF", version, length of the file; then chunks of length, type, bytes, each padded to multiples of 4. The first is
//! the JSON, the second may be the buffer BIN; others are kept as they are.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 4 "GLB File Format".

use std::io::{self, Write};

use serde_json::Value;

use crate::error::Problem;
use crate::formats::gltf::document::{EXPORT_AGAIN, broken};

/// Bytes of a value of JSON with its key, in maps that keep the order of the file.
const VALUE_BYTES: u64 = 120;
const MAGIC: &[u8] = b"glTF";
const JSON: [u8; 4] = *b"JSON";
const BIN: [u8; 4] = *b"BIN\0";
/// What to do about glTF 1.0.
const UPGRADE: &str = "Convert it to glTF 2.0, for example with `gltf-pipeline -i in.gltf -o out.gltf`.";
/// What to do about half a file.
const COPY_AGAIN: &str = "Copy, download or export the file again.";

/// A file taken apart.
#[derive(Debug)]
pub(crate) struct Container {
    pub(crate) is_glb: bool,
    pub(crate) json: Value,
    pub(crate) bin: Option<Vec<u8>>,
    /// Further chunks of a GLB, headers included.
    pub(crate) tail: Vec<u8>,
}

/// The most memory that the parts of a file take: itself, and its JSON as values. Each value but the last of a list or an
/// object is followed by a comma, outside of strings and in them.
pub(crate) fn forecast(bytes: &[u8]) -> u64 {
    let text = match take_json(bytes) {
        Some(text) => text,
        None => bytes,
    };
    let values = text.iter().filter(|&&byte| matches!(byte, b',' | b'{' | b'[')).count() as u64;
    (bytes.len() as u64).saturating_add(values.saturating_mul(VALUE_BYTES))
}

/// The JSON of a GLB, as far as it is there.
fn take_json(bytes: &[u8]) -> Option<&[u8]> {
    let length = u32_at(bytes.strip_prefix(MAGIC)?, 8)? as usize;
    let text = bytes.get(20..)?;
    Some(&text[..length.min(text.len())])
}

/// Takes the bytes of a file apart. They themselves tell which of the two containers they are.
pub(crate) fn open(bytes: &[u8]) -> Result<Container, Problem> {
    let container = if bytes.starts_with(MAGIC) { open_glb(bytes)? } else { open_text(bytes)? };
    let version = container.json.pointer("/asset/version").and_then(Value::as_str);
    match version {
        Some(version) if version.starts_with("2.") => Ok(container),
        Some(other) => Err(Problem {
            line: None,
            what: format!("this is glTF {other}; glTF 2.0 is read"),
            remedy: UPGRADE,
        }),
        None => Err(broken("`asset.version` is missing: this is JSON, but not glTF 2.0")),
    }
}

fn open_text(bytes: &[u8]) -> Result<Container, Problem> {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let json = serde_json::from_slice(text).map_err(|error| Problem {
        line: u64::try_from(error.line()).ok().filter(|&line| line > 0),
        what: format!("this is neither GLB nor JSON: {error}"),
        remedy: EXPORT_AGAIN,
    })?;
    Ok(Container { is_glb: false, json, bin: None, tail: Vec::new() })
}

fn open_glb(bytes: &[u8]) -> Result<Container, Problem> {
    let version = u32_at(bytes, 4).ok_or_else(|| cut_off("its header"))?;
    if version != 2 {
        let what = format!("this is GLB version {version}; version 2 is read");
        return Err(Problem { line: None, what, remedy: UPGRADE });
    }
    // What lies behind the stated length is no part of the file.
    let length = u32_at(bytes, 8).ok_or_else(|| cut_off("its header"))? as usize;
    let bytes = bytes
        .get(..length)
        .ok_or_else(|| cut_off(&format!("byte {} of {length}, as its header states", bytes.len())))?;
    let mut rest = bytes.get(12..).ok_or_else(|| broken("the stated length of the GLB is under 12 bytes"))?;
    let (kind, text) = take_chunk(&mut rest)?;
    if kind != JSON {
        return Err(broken("the first chunk of the GLB is not JSON"));
    }
    let json = serde_json::from_slice(text)
        .map_err(|error| broken(format!("the JSON chunk cannot be read: {error}")))?;
    let tail = rest;
    let bin = if rest.is_empty() { None } else { Some(take_chunk(&mut rest)?) };
    let (bin, tail) = match bin {
        Some((BIN, bytes)) => (Some(bytes.to_vec()), rest),
        _ => (None, tail),
    };
    Ok(Container { is_glb: true, json, bin, tail: tail.to_vec() })
}

/// Takes a chunk, with its type, from the front of `rest`.
fn take_chunk<'a>(rest: &mut &'a [u8]) -> Result<([u8; 4], &'a [u8]), Problem> {
    let header = rest.split_first_chunk::<8>().ok_or_else(|| cut_off("the header of a chunk"))?;
    let &[a, b, c, d, kind @ ..] = header.0;
    let length = u32::from_le_bytes([a, b, c, d]) as usize;
    let (chunk, behind) =
        header.1.split_at_checked(length).ok_or_else(|| cut_off(&format!("a chunk of {length} bytes")))?;
    *rest = behind;
    Ok((kind, chunk))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|&word| u32::from_le_bytes(word))
}

fn cut_off(place: &str) -> Problem {
    Problem { line: None, what: format!("the file ends in {place}"), remedy: COPY_AGAIN }
}

/// Writes JSON text, indented by two spaces.
pub(crate) fn write_text(out: &mut dyn Write, json: &Value) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, json)?;
    out.write_all(b"\n")
}

/// Writes a GLB: JSON, the buffer if there is one, and further chunks.
pub(crate) fn write_glb(
    out: &mut dyn Write,
    json: &Value,
    bin: Option<&[u8]>,
    tail: &[u8],
) -> io::Result<()> {
    let json = serde_json::to_vec(json)?;
    let padded = |bytes: &[u8]| bytes.len().next_multiple_of(4);
    let length = 12 + 8 + padded(&json) + bin.map_or(0, |bin| 8 + padded(bin)) + tail.len();
    let too_long = "a GLB holds at most 4 GiB; give the file as .gltf";
    let length = u32::try_from(length).map_err(|_| io::Error::other(too_long))?;
    out.write_all(MAGIC)?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    // The lengths of the chunks are less than the file's.
    let mut chunk = |kind: [u8; 4], bytes: &[u8], padding: u8| {
        let padded = padded(bytes);
        out.write_all(&(padded as u32).to_le_bytes())?;
        out.write_all(&kind)?;
        out.write_all(bytes)?;
        out.write_all(&vec![padding; padded - bytes.len()])
    };
    chunk(JSON, &json, b' ')?;
    if let Some(bin) = bin {
        chunk(BIN, bin, 0)?;
    }
    out.write_all(tail)
}
