//! Reads accessors: typed views of buffers, with strides, normalized integers and sparse replacements.
//!
//! Element i of an accessor starts at `view.byteOffset + accessor.byteOffset + i·stride`. A normalized integer c of b bits
//! stands for c/(2^b − 1), or max(c/(2^(b−1) − 1), −1) if it is signed. Bounds are checked before anything is read, so that no file can
//! make the reader leave its buffer. What is allocated is at most in proportion to the bytes of the file.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.6.2 "Accessors"; extension
//! KHR_mesh_quantization, 2019.

use std::collections::HashSet;
use std::sync::Arc;

use crate::error::Problem;
use crate::formats::gltf::document::{Accessor, Document, Sparse, broken, named};
use crate::formats::gltf::extensions::compressed;

/// An accessor without data is all zeros. It may have this many elements, or as many as the buffers have bytes.
const MOST_ZEROS: usize = 1 << 16;

/// The name of the accessor type with so many components, among those that are read.
fn kind_of(components: usize) -> &'static str {
    match components {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        _ => "MAT4",
    }
}

/// A document together with the bytes of its buffers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Data<'a> {
    pub(crate) document: &'a Document,
    buffers: &'a [Option<Arc<Vec<u8>>>],
    /// The bytes of all of them, those that are shared counted once.
    bytes: usize,
}

/// How a component is stored.
struct Component {
    size: usize,
    read: fn(&[u8]) -> f64,
    /// What stands for 1, or 0 where numbers stand for themselves.
    one: f64,
}

impl Component {
    fn of(code: u32, normalized: bool, place: &str) -> Result<Self, Problem> {
        let (size, read, one): (_, fn(&[u8]) -> f64, _) = match code {
            5120 => (1, |b| f64::from(i8::from_le_bytes(word(b))), 127.0),
            5121 => (1, |b| f64::from(u8::from_le_bytes(word(b))), 255.0),
            5122 => (2, |b| f64::from(i16::from_le_bytes(word(b))), 32767.0),
            5123 => (2, |b| f64::from(u16::from_le_bytes(word(b))), 65535.0),
            5125 => (4, |b| f64::from(u32::from_le_bytes(word(b))), f64::from(u32::MAX)),
            5126 => (4, |b| f64::from(f32::from_le_bytes(word(b))), 0.0),
            other => return Err(broken(format!("{place} has the unknown componentType {other}"))),
        };
        Ok(Self { size, read, one: if normalized { one } else { 0.0 } })
    }

    fn value(&self, bytes: &[u8]) -> f64 {
        let value = (self.read)(bytes);
        if self.one == 0.0 { value } else { (value / self.one).max(-1.0) }
    }
}

/// The first bytes of a component. Callers hand over at least its size.
fn word<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}

impl<'a> Data<'a> {
    pub(crate) fn new(document: &'a Document, buffers: &'a [Option<Arc<Vec<u8>>>]) -> Self {
        let mut seen = HashSet::new();
        let distinct = buffers.iter().flatten().filter(|bytes| seen.insert(Arc::as_ptr(bytes)));
        Self { document, buffers, bytes: distinct.map(|bytes| bytes.len()).sum() }
    }

    /// How many elements an accessor has, checked against its bytes without reading them.
    pub(crate) fn count(&self, index: usize, of: &str) -> Result<usize, Problem> {
        let accessor = named(&self.document.accessors, index, "accessors", of)?;
        let place = format!("accessors[{index}]");
        match accessor.buffer_view {
            Some(view) => {
                let component = Component::of(accessor.component_type, accessor.normalized, &place)?;
                let components = [1, 2, 3, 4, 16].into_iter().find(|&n| kind_of(n) == accessor.kind);
                let layout = (accessor.byte_offset, accessor.count, components.unwrap_or(1) * component.size);
                drop(self.strided(view, layout, &place)?);
            }
            None => self.check_zeros(accessor.count, &place)?,
        }
        Ok(accessor.count)
    }

    /// The elements of an accessor with N components, in f64: exact but for the division of normalized integers.
    pub(crate) fn vectors<const N: usize>(&self, index: usize, of: &str) -> Result<Vec<[f64; N]>, Problem> {
        let accessor = self.accessor::<N>(index, of)?;
        let place = format!("accessors[{index}]");
        let component = Component::of(accessor.component_type, accessor.normalized, &place)?;
        let mut elements = match accessor.buffer_view {
            Some(view) => {
                let layout = (accessor.byte_offset, accessor.count, N * component.size);
                self.strided(view, layout, &place)?.map(|bytes| element(bytes, &component)).collect()
            }
            None => {
                self.check_zeros(accessor.count, &place)?;
                vec![[0.0; N]; accessor.count]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut elements, sparse, &component, &place)?;
        }
        Ok(elements)
    }

    /// How many indices an accessor has, checked like [`count`](Self::count).
    pub(crate) fn index_count(&self, index: usize, of: &str) -> Result<usize, Problem> {
        self.check_indices(index, of)?;
        self.count(index, of)
    }

    /// The elements of an accessor of indices.
    pub(crate) fn indices(&self, index: usize, of: &str) -> Result<Vec<u32>, Problem> {
        self.check_indices(index, of)?;
        // Exact: they were u32 or less.
        Ok(self.vectors::<1>(index, of)?.into_iter().map(|[value]| value as u32).collect())
    }

    /// Refuses an accessor that holds anything but indices.
    fn check_indices(&self, index: usize, of: &str) -> Result<(), Problem> {
        let accessor = self.accessor::<1>(index, of)?;
        if !is_unsigned(accessor.component_type) || accessor.normalized {
            return Err(broken(format!(
                "accessors[{index}] holds the indices of {of}, but not unsigned integers"
            )));
        }
        Ok(())
    }

    /// Whether an accessor has bytes of its own.
    pub(crate) fn has_data(&self, index: usize) -> bool {
        let accessor = self.document.accessors.get(index);
        accessor.is_some_and(|accessor| accessor.buffer_view.is_some() || accessor.sparse.is_some())
    }

    fn accessor<const N: usize>(&self, index: usize, of: &str) -> Result<&'a Accessor, Problem> {
        let accessor = named(&self.document.accessors, index, "accessors", of)?;
        let expected = kind_of(N);
        if accessor.kind != expected {
            let kind = &accessor.kind;
            return Err(broken(format!("accessors[{index}] is {kind}, but {of} needs {expected}")));
        }
        Ok(accessor)
    }

    /// Refuses an accessor without data that has too many elements.
    fn check_zeros(&self, count: usize, place: &str) -> Result<(), Problem> {
        if count > self.bytes.max(MOST_ZEROS) {
            return Err(broken(format!("{place} has {count} elements without data")));
        }
        Ok(())
    }

    fn replace<const N: usize>(
        &self,
        elements: &mut [[f64; N]],
        sparse: &Sparse,
        component: &Component,
        place: &str,
    ) -> Result<(), Problem> {
        let place = format!("the sparse part of {place}");
        if !is_unsigned(sparse.indices.component_type) {
            return Err(broken(format!("{place} has indices that are not unsigned integers")));
        }
        let index = Component::of(sparse.indices.component_type, false, &place)?;
        let layout = (sparse.indices.byte_offset, sparse.count, index.size);
        let indices = self.strided(sparse.indices.buffer_view, layout, &place)?;
        let layout = (sparse.values.byte_offset, sparse.count, N * component.size);
        let values = self.strided(sparse.values.buffer_view, layout, &place)?;
        for (at, bytes) in indices.zip(values) {
            let at = index.value(at) as usize;
            let count = elements.len();
            let replaced = elements.get_mut(at);
            *replaced.ok_or_else(|| broken(format!("{place} replaces element {at} of {count}")))? =
                element(bytes, component);
        }
        Ok(())
    }

    /// The bytes of the elements at (offset, count, size of one) in a buffer view.
    fn strided(
        &self,
        view: usize,
        (offset, count, size): (usize, usize, usize),
        place: &str,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, Problem> {
        let (bytes, stride) = self.view(view, place)?;
        // A stride of 0 is invalid, and written by some for "none".
        let stride = stride.filter(|&stride| stride > 0).unwrap_or(size);
        if stride < size {
            return Err(broken(format!(
                "bufferViews[{view}] has a byteStride of {stride}, but {place} needs {size}"
            )));
        }
        let length =
            count.checked_sub(1).map_or(Some(0), |steps| steps.checked_mul(stride)?.checked_add(size));
        let end = length.and_then(|length| length.checked_add(offset));
        let range = end.and_then(|end| bytes.get(offset.min(end)..end)).ok_or_else(|| {
            let length = bytes.len();
            broken(format!(
                "{place}: {count} elements reach beyond the {length} bytes of bufferViews[{view}]"
            ))
        })?;
        Ok(range.chunks(stride))
    }

    /// The bytes of a buffer view, and its stride.
    fn view(&self, index: usize, of: &str) -> Result<(&'a [u8], Option<usize>), Problem> {
        let view = named(&self.document.views, index, "bufferViews", of)?;
        let place = format!("bufferViews[{index}]");
        let buffer = named(&self.document.buffers, view.buffer, "buffers", &place)?;
        let Some(Some(bytes)) = self.buffers.get(view.buffer) else {
            return Err(match view.extensions.keys().next() {
                Some(extension) => compressed(&format!("{place} is"), extension),
                None => broken(format!("buffers[{}] has neither a URI nor a BIN chunk", view.buffer)),
            });
        };
        // Behind the stated length there is padding at most.
        let bytes = &bytes[..buffer.byte_length.min(bytes.len())];
        let end = view.byte_offset.checked_add(view.byte_length);
        let range = end.and_then(|end| bytes.get(view.byte_offset..end)).ok_or_else(|| {
            broken(format!("{place} reaches beyond the {} bytes of buffers[{}]", bytes.len(), view.buffer))
        })?;
        Ok((range, view.byte_stride))
    }
}

fn is_unsigned(code: u32) -> bool {
    matches!(code, 5121 | 5123 | 5125)
}

fn element<const N: usize>(bytes: &[u8], component: &Component) -> [f64; N] {
    std::array::from_fn(|k| component.value(&bytes[k * component.size..]))
}
