//! Stores openness at the vertices: as an attribute of its own, or in the vertex colours.
//!
//! Each set of vertices gets a new accessor of f32, behind a new buffer view. Colours become openness · colour; both are
//! linear.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.7.2.1 "Meshes: Overview".

use std::collections::HashMap;
use std::ops::Range;

use serde_json::{Value, json};

use crate::error::Error;
use crate::error::Problem;
use crate::formats::gltf::GltfFile;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{Document, broken, whole};
use crate::formats::gltf::extensions::DRACO;
use crate::formats::gltf::options::GltfOrigin;
use crate::formats::gltf::write::{primitive_mut, push};

/// A buffer view of vertex attributes, `ARRAY_BUFFER` of OpenGL.
const ARRAY_BUFFER: u32 = 34962;
const FLOAT: u32 = 5126;

/// Where openness at the vertices is stored.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum VertexTarget {
    /// The attribute `_AO`, one float. Viewers ignore it; shaders and tools pick it up.
    #[default]
    Ao,
    /// `COLOR_0`, linear: openness times the colour that is there, alpha kept. Every viewer multiplies it with the base colour.
    Color0,
}

impl VertexTarget {
    /// The name of the attribute.
    #[must_use]
    pub fn attribute(self) -> &'static str {
        match self {
            Self::Ao => "_AO",
            Self::Color0 => "COLOR_0",
        }
    }
}

impl GltfFile {
    /// Stores openness at the vertices of all triangles of the scene.
    ///
    /// `openness` has one number for each of the scene's positions: 0 (occluded) to 1 (open), or NaN where nothing was
    /// computed, which is stored as 1. Instances of one mesh with different numbers get copies of the mesh, which share
    /// all data but these. Returns warnings, one sentence each.
    ///
    /// # Errors
    /// [`Error::Usage`] for a wrong count of numbers or one out of range; [`Error::Input`] for vertex colours that cannot be read.
    pub fn add_vertex_occlusion(
        &mut self,
        openness: &[f32],
        target: VertexTarget,
    ) -> Result<Vec<String>, Error> {
        let count = self.origins.iter().map(|origin| origin.vertices.end).max().unwrap_or(0) as usize;
        if openness.len() != count {
            let given = openness.len();
            return Err(Error::Usage(format!(
                "{given} numbers are given, but the scene has {count} vertices"
            )));
        }
        let in_range = |value: &f32| value.is_nan() || (0.0..=1.0).contains(value);
        if let Some(vertex) = openness.iter().position(|value| !in_range(value)) {
            let value = openness[vertex];
            return Err(Error::Usage(format!(
                "the openness of vertex {vertex} is {value}, not within 0 to 1"
            )));
        }
        let stored: Vec<f32> =
            openness.iter().map(|&value| if value.is_nan() { 1.0 } else { value }).collect();
        self.try_add_vertices(&stored, target).map_err(|problem| problem.at(&self.path))
    }

    fn try_add_vertices(&mut self, openness: &[f32], target: VertexTarget) -> Result<Vec<String>, Problem> {
        let document = Document::of(&self.json)?;
        let colors = match target {
            VertexTarget::Ao => HashMap::new(),
            VertexTarget::Color0 => self.read_colors(&document)?,
        };
        let (stored, copies) = self.separate_meshes(&document, openness)?;
        let (mut replaced, mut stripped) = (0_usize, 0_usize);
        // Primitives that share vertices and colours share the new accessor.
        let mut made: HashMap<(Range<u32>, Option<usize>), usize> = HashMap::new();
        for index in stored {
            let GltfOrigin { mesh, primitive, vertices, .. } = self.origins[index].clone();
            // An accessor without elements would be invalid, and nothing is lost without it.
            if vertices.is_empty() {
                continue;
            }
            let old = attribute(primitive_mut(&mut self.json, mesh, primitive)?, target);
            let accessor = match made.get(&(vertices.clone(), old)) {
                Some(&accessor) => accessor,
                None => {
                    let values = &openness[vertices.start as usize..vertices.end as usize];
                    let colors = old.and_then(|old| colors.get(&old));
                    self.append_values(values, colors, target)?
                }
            };
            made.insert((vertices, old), accessor);
            let primitive = primitive_mut(&mut self.json, mesh, primitive)?;
            primitive["attributes"][target.attribute()] = accessor.into();
            replaced += usize::from(old.is_some() && target == VertexTarget::Ao);
            stripped += usize::from(strip_draco(primitive));
        }
        if stripped > 0 {
            forget_draco(&mut self.json);
        }
        let draco = format!("primitives that keep their uncompressed data alone, without {DRACO}");
        let counts = [
            (copies, "copies of meshes, for instances with openness of their own"),
            (replaced, "primitives whose attribute _AO is replaced"),
            (stripped, &draco),
        ];
        let told = counts.into_iter().filter(|&(count, _)| count > 0);
        Ok(told.map(|(count, what)| format!("{what}: {count}")).collect())
    }

    /// The vertex colours that the scene's primitives have, by accessor.
    fn read_colors(&self, document: &Document) -> Result<HashMap<usize, Vec<[f64; 4]>>, Problem> {
        let data = Data::new(document, &self.buffers);
        let mut colors: HashMap<usize, Vec<[f64; 4]>> = HashMap::new();
        for origin in &self.origins {
            let place = format!("meshes[{}].primitives[{}]", origin.mesh, origin.primitive);
            let primitive = &document.meshes[origin.mesh].primitives[origin.primitive];
            let Some(&accessor) = primitive.attributes.get(VertexTarget::Color0.attribute()) else {
                continue;
            };
            let count = match colors.get(&accessor) {
                Some(known) => known.len(),
                None => {
                    let read = read_color(data, accessor, &place)?;
                    colors.entry(accessor).or_insert(read).len()
                }
            };
            let vertices = origin.vertices.len();
            if count != vertices {
                return Err(broken(format!("{place} has {vertices} positions, but {count} colours")));
            }
        }
        Ok(colors)
    }

    /// Appends an accessor with the values of some vertices, times their colours where they have any.
    fn append_values(
        &mut self,
        values: &[f32],
        colors: Option<&Vec<[f64; 4]>>,
        target: VertexTarget,
    ) -> Result<usize, Problem> {
        let times = |value: f32, color: f64| (f64::from(value) * color) as f32;
        let (kind, floats): (_, Vec<f32>) = match (target, colors) {
            (VertexTarget::Ao, _) => ("SCALAR", values.to_vec()),
            (VertexTarget::Color0, None) => ("VEC3", values.iter().flat_map(|&value| [value; 3]).collect()),
            (VertexTarget::Color0, Some(colors)) => {
                let product = |(&value, &[r, g, b, alpha]): (&f32, &[f64; 4])| {
                    [times(value, r), times(value, g), times(value, b), alpha as f32]
                };
                ("VEC4", values.iter().zip(colors).flat_map(product).collect())
            }
        };
        let bytes: Vec<u8> = floats.iter().flat_map(|float| float.to_le_bytes()).collect();
        let view = self.append(&bytes, Some(ARRAY_BUFFER))?;
        let accessor =
            json!({ "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind });
        push(&mut self.json, "accessors", accessor)
    }
}

/// Colours of three or four components; alpha is 1 where there are three.
fn read_color(data: Data<'_>, accessor: usize, place: &str) -> Result<Vec<[f64; 4]>, Problem> {
    let has_alpha = data.document.accessors.get(accessor).is_none_or(|accessor| accessor.kind != "VEC3");
    if has_alpha {
        return data.vectors(accessor, place);
    }
    let opaque: Vec<[f64; 3]> = data.vectors(accessor, place)?;
    Ok(opaque.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
}

/// The accessor of a primitive's attribute.
fn attribute(primitive: &Value, target: VertexTarget) -> Option<usize> {
    let accessor = whole(primitive.get("attributes")?.get(target.attribute())?)?;
    usize::try_from(accessor).ok()
}

/// Takes the compressed copy of a primitive's data away, which lacks the new attribute and may order vertices otherwise.
fn strip_draco(primitive: &mut Value) -> bool {
    let Some(extensions) = primitive.get_mut("extensions").and_then(Value::as_object_mut) else {
        return false;
    };
    let had_it = extensions.shift_remove(DRACO).is_some();
    let is_bare = had_it && extensions.is_empty();
    if let Some(fields) = primitive.as_object_mut().filter(|_| is_bare) {
        fields.shift_remove("extensions");
    }
    had_it
}

/// Takes an extension off the list of those in use, if no primitive has it any more.
fn forget_draco(json: &mut Value) {
    let meshes = json.get("meshes").and_then(Value::as_array).into_iter().flatten();
    let mut primitives = meshes.filter_map(|mesh| mesh.get("primitives")?.as_array()).flatten();
    let pointer = format!("/extensions/{DRACO}");
    if primitives.any(|primitive| primitive.pointer(&pointer).is_some()) {
        return;
    }
    let Some(root) = json.as_object_mut() else { return };
    for key in ["extensionsUsed", "extensionsRequired"] {
        let Some(names) = root.get_mut(key).and_then(Value::as_array_mut) else { continue };
        let count = names.len();
        names.retain(|name| name != DRACO);
        if names.is_empty() && count > 0 {
            root.shift_remove(key);
        }
    }
}
