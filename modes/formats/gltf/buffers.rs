//! The bytes behind a document's buffers: the chunk of a GLB, data URIs, files beside it.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.6 "Binary Data Storage"; Larry
//! Masinter, "The data URL scheme", RFC 2397, 1998.

use std::borrow::Cow;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig, STANDARD};
use base64::{alphabet, engine::DecodePaddingMode};
use percent_encoding::percent_decode_str;

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::gltf::document::{Buffer, broken};
use crate::formats::neighbours::{Missing, Neighbours};

/// Takes base64 with and without its padding.
const LENIENT: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);
/// How the data URI of a buffer begins.
const BUFFER_URI: &str = "data:application/octet-stream;base64,";

/// The bytes of all buffers. A buffer has none where an extension alone knows them; who needs it then says so.
///
/// `bin` is the chunk of the GLB, which is the first buffer if that has no URI.
pub(crate) fn load(
    buffers: &[Buffer],
    neighbours: &mut Neighbours<'_>,
    mut bin: Option<Vec<u8>>,
    budget: &Budget,
) -> Result<Vec<Option<Arc<Vec<u8>>>>, Problem> {
    let mut loaded = Vec::with_capacity(buffers.len());
    for (index, buffer) in buffers.iter().enumerate() {
        let bytes = match &buffer.uri {
            Some(uri) => Some(fetch(uri, neighbours, (index, budget))?),
            None if index == 0 => bin.take().map(Arc::new),
            None => None,
        };
        if let Some(bytes) = bytes.as_ref().filter(|bytes| bytes.len() < buffer.byte_length) {
            return Err(broken(format!(
                "buffers[{index}] states {} bytes, but has only {}",
                buffer.byte_length,
                bytes.len()
            )));
        }
        loaded.push(bytes);
    }
    Ok(loaded)
}

/// The bytes that a URI stands for.
fn fetch(
    uri: &str,
    neighbours: &mut Neighbours<'_>,
    (index, budget): (usize, &Budget),
) -> Result<Arc<Vec<u8>>, Problem> {
    if let Some(data) = data_in(uri) {
        budget.take(data.len() as u64, "the data URIs")?;
        let bytes = decode(data);
        return bytes
            .map(Arc::new)
            .map_err(|what| broken(format!("the data URI of buffers[{index}] {what}")));
    }
    let refused = |what: String, remedy: &'static str| Problem { line: None, what, remedy };
    let Some(name) = file_name(uri) else {
        return Err(refused(
            format!("buffers[{index}] lies at {uri}, which is not a file beside this one"),
            "Download it, and name the local file in the glTF file.",
        ));
    };
    neighbours.fetch(&name).map(|(_, bytes)| bytes).map_err(|missing| match missing {
        Missing::Outside => refused(
            format!("buffers[{index}] names {uri}, which lies outside of the file's folder"),
            "Copy it beside the glTF file and correct the name, or, if you trust the file, allow it: GltfOptions::allow_outside.",
        ),
        Missing::Unreadable(error) => refused(
            format!("buffers[{index}] is in {}, which cannot be read: {error}", neighbours.shown(&name)),
            "Put that file where the glTF file expects it; a .gltf is copied together with what it names.",
        ),
        Missing::TooLarge(problem) => problem,
    })
}

/// What follows `data:` in a data URI; the scheme may be in capitals.
fn data_in(uri: &str) -> Option<&str> {
    let (scheme, data) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(data)
}

/// The bytes of `[mediatype][;base64],data`: base64, or else text with percent-encoded bytes. Or what is wrong.
fn decode(data: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, data) = data.split_once(',').ok_or("has no comma before its data")?;
    let is_base64 = kind.rsplit_once(';').is_some_and(|(_, last)| last.trim().eq_ignore_ascii_case("base64"));
    match is_base64 {
        // Its `+`, `/` and `=` may be percent-encoded themselves.
        true => LENIENT.decode(Cow::from(percent_decode_str(data)).trim_ascii()).map_err(|_| "is not base64"),
        false => Ok(percent_decode_str(data).collect()),
    }
}

/// The relative path in a URI; `None` for data and for what has a scheme (`https:`).
pub(crate) fn file_name(uri: &str) -> Option<String> {
    let scheme = uri.split_once(':').map(|(scheme, _)| scheme);
    // A single letter is a drive.
    let has_scheme = scheme.is_some_and(|scheme| {
        scheme.len() > 1 && scheme.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))
    });
    if has_scheme { None } else { Some(percent_decode_str(uri).decode_utf8_lossy().into_owned()) }
}

/// A URI that holds the bytes of a buffer.
pub(crate) fn data_uri(bytes: &[u8]) -> String {
    let mut uri = BUFFER_URI.to_owned();
    STANDARD.encode_string(bytes, &mut uri);
    uri
}
