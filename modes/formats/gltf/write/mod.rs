//! Appends data to a glTF file that is kept as JSON, and writes it.
//!
//! New bytes go behind the BIN chunk of a GLB. A .gltf gets a buffer of its own as a data URI: the file stays one file,
//! written as a whole or not at all, and what lies beside it is not touched.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.6 "Binary Data Storage".

pub(crate) mod instances;
pub(crate) mod texture;
pub mod vertex;

use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use crate::error::Error;
use crate::error::Problem;
use crate::files::output::write_atomically;
use crate::formats::gltf::GltfFile;
use crate::formats::gltf::buffers;
use crate::formats::gltf::container::{write_glb, write_text};
use crate::formats::gltf::document::broken;

impl GltfFile {
    /// Writes the file, with all that was added, in the format in which it was read.
    ///
    /// The name may be that of the file read. What the file names beside it (buffers, images) is not copied. JSON text comes out
    /// indented by two spaces, however it was read.
    ///
    /// # Errors
    /// [`Error::Usage`] when the extension is not that of the format read, or when the file names others beside it and
    /// `path` is in another directory. [`Error::Write`] when it cannot be written; then nothing has changed.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        self.check_output(path)?;
        let with_uri = self.own_buffer.and_then(|index| {
            let bytes = self.buffers.get(index)?.as_ref()?;
            let mut json = self.json.clone();
            let uri = json.pointer_mut(&format!("/buffers/{index}"))?.as_object_mut()?;
            uri.insert("uri".to_owned(), buffers::data_uri(bytes).into());
            Some(json)
        });
        let json = with_uri.as_ref().unwrap_or(&self.json);
        let first = self.buffers.first().and_then(|first| first.as_ref().map(|bytes| bytes.as_slice()));
        let bin = if self.bin_is_first { first } else { self.spare_bin.as_deref() };
        write_atomically(path, |mut out| {
            let out: &mut dyn Write = &mut out;
            if self.is_glb { write_glb(out, json, bin, &self.tail) } else { write_text(out, json) }
        })
    }

    /// Whether the file can be written under a name, as far as that depends on what it holds. Formats are not converted:
    /// that would have to move every buffer.
    ///
    /// # Errors
    /// [`Error::Usage`], as [`GltfFile::write`].
    pub fn check_output(&self, path: &Path) -> Result<(), Error> {
        self.check_name(path)?;
        self.check_neighbours(path)
    }

    fn check_name(&self, path: &Path) -> Result<(), Error> {
        let expected = if self.is_glb { "glb" } else { "gltf" };
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case(expected) {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "{}: {} is written back in its own format: end the name with .{expected} (`npx @gltf-transform/cli copy` converts \
             between .gltf and .glb)",
            path.display(),
            self.path.display()
        )))
    }

    /// Names relative to the file mean the same only in its own directory.
    fn check_neighbours(&self, path: &Path) -> Result<(), Error> {
        let parts = ["buffers", "images"].into_iter().filter_map(|key| self.json.get(key)?.as_array());
        let uris = parts.flatten().filter_map(|part| part.get("uri")?.as_str());
        let Some(neighbour) = uris.filter_map(buffers::file_name).next() else {
            return Ok(());
        };
        let folder = |path: &Path| {
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            fs::canonicalize(parent.unwrap_or(Path::new(".")))
        };
        match (folder(&self.path), folder(path)) {
            (Ok(from), Ok(to)) if from != to => Err(Error::Usage(format!(
                "{}: {} names {neighbour} beside it, so write it to the same directory, {}",
                path.display(),
                self.path.display(),
                from.display()
            ))),
            // A directory that is not there is the writer's to tell.
            _ => Ok(()),
        }
    }

    /// Appends bytes as a buffer view, aligned to 4 bytes, and returns its index. `target` is what GPUs use it for.
    pub(crate) fn append(&mut self, bytes: &[u8], target: Option<u32>) -> Result<usize, Problem> {
        let buffer = self.growing_buffer()?;
        let stored = Arc::make_mut(self.buffers[buffer].get_or_insert_default());
        stored.resize(stored.len().next_multiple_of(4), 0);
        let offset = stored.len();
        stored.extend_from_slice(bytes);
        let length = stored.len();
        let known = array(&mut self.json, "buffers")?.get_mut(buffer).and_then(Value::as_object_mut);
        let known = known.ok_or_else(|| broken(format!("buffers[{buffer}] is not an object")))?;
        known.insert("byteLength".to_owned(), length.into());
        let mut view = json!({ "buffer": buffer, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        push(&mut self.json, "bufferViews", view)
    }

    /// The buffer that takes new bytes.
    fn growing_buffer(&mut self) -> Result<usize, Problem> {
        if self.bin_is_first {
            return Ok(0);
        }
        if let Some(own) = self.own_buffer {
            return Ok(own);
        }
        let index = push(&mut self.json, "buffers", json!({ "byteLength": 0 }))?;
        self.buffers.push(Some(Arc::default()));
        // The BIN chunk can only be the first buffer.
        if self.is_glb && index == 0 && self.spare_bin.is_none() {
            self.bin_is_first = true;
        } else {
            self.own_buffer = Some(index);
        }
        Ok(index)
    }
}

/// One of the arrays of the document, made if it is missing.
pub(crate) fn array<'a>(json: &'a mut Value, key: &str) -> Result<&'a mut Vec<Value>, Problem> {
    let root = json.as_object_mut().ok_or_else(|| broken("the JSON is not an object"))?;
    let value = root.entry(key).or_insert_with(|| json!([]));
    // As if it were missing, which is how it is read.
    if value.is_null() {
        *value = json!([]);
    }
    value.as_array_mut().ok_or_else(|| broken(format!("`{key}` is not an array")))
}

/// Adds an element to one of them and returns its index.
pub(crate) fn push(json: &mut Value, key: &str, element: Value) -> Result<usize, Problem> {
    let elements = array(json, key)?;
    elements.push(element);
    Ok(elements.len() - 1)
}

/// A primitive of the document.
pub(crate) fn primitive_mut(json: &mut Value, mesh: usize, primitive: usize) -> Result<&mut Value, Problem> {
    let pointer = format!("/meshes/{mesh}/primitives/{primitive}");
    json.pointer_mut(&pointer).ok_or_else(|| broken(format!("there is no {pointer}")))
}
