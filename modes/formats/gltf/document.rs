//! The parts of a glTF document that a scene is made of, typed.
//!
//! The document itself stays a [`serde_json::Value`], in the order of the file, so that writing it back keeps what is not
//! understood. Only the parts that matter here are looked at: an odd animation or camera spoils no scene.
//!
//! The crate `gltf` 1.4.1 is not used: it refuses `KHR_mesh_quantization` (gltf-rs/gltf#400), panics on accessors without
//! elements, and drops unknown extensions; what it would add is the types below, for 90 s of building.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::error::Problem;

/// What to do about a file that breaks the specification.
pub(crate) const EXPORT_AGAIN: &str =
    "Export the file again; the Khronos glTF validator lists all that is wrong with it.";

/// Triangles, one for each three indices: the mode of a primitive that names none.
pub(crate) const TRIANGLES: u32 = 4;
pub(crate) const TRIANGLE_STRIP: u32 = 5;
pub(crate) const TRIANGLE_FAN: u32 = 6;

/// How many triangles some indices make.
pub(crate) fn triangle_count(mode: u32, indices: usize) -> usize {
    if mode == TRIANGLES { indices / 3 } else { indices.saturating_sub(2) }
}

/// A problem in the file itself.
pub(crate) fn broken(what: impl Into<String>) -> Problem {
    Problem { line: None, what: what.into(), remedy: EXPORT_AGAIN }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<usize>,
    #[serde(default)]
    pub(crate) byte_offset: usize,
    pub(crate) component_type: u32,
    #[serde(default)]
    pub(crate) normalized: bool,
    pub(crate) count: usize,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) sparse: Option<Sparse>,
}

/// Elements that replace some of an accessor's.
#[derive(Debug, Deserialize)]
pub(crate) struct Sparse {
    pub(crate) count: usize,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: usize,
    pub(crate) component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: usize,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: usize,
    pub(crate) byte_length: usize,
    pub(crate) byte_stride: Option<usize>,
    #[serde(default)]
    pub(crate) extensions: Map<String, Value>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: usize,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Node {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) mesh: Option<usize>,
    pub(crate) skin: Option<usize>,
    #[serde(default)]
    pub(crate) children: Vec<usize>,
    /// Column by column.
    pub(crate) matrix: Option<[f64; 16]>,
    pub(crate) translation: Option<[f64; 3]>,
    /// x, y, z, w.
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
    /// Of the morph targets, instead of the mesh's.
    pub(crate) weights: Option<Vec<f64>>,
    #[serde(default)]
    pub(crate) extensions: Map<String, Value>,
}

/// What moves the vertices of a mesh.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Skin {
    pub(crate) joints: Vec<usize>,
    pub(crate) inverse_bind_matrices: Option<usize>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Mesh {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) primitives: Vec<Primitive>,
    /// Of the morph targets.
    #[serde(default)]
    pub(crate) weights: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Primitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    #[serde(default = "triangles")]
    pub(crate) mode: u32,
    #[serde(default)]
    pub(crate) targets: Vec<BTreeMap<String, usize>>,
    #[serde(default)]
    pub(crate) extensions: Map<String, Value>,
}

fn triangles() -> u32 {
    TRIANGLES
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Surface {
    #[serde(default)]
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) pbr_metallic_roughness: Reflectance,
    #[serde(default)]
    pub(crate) extensions: SurfaceExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Reflectance {
    /// Red, green, blue, alpha; white where the file names none.
    pub(crate) base_color_factor: Option<[f32; 4]>,
    /// 1 where the file names none.
    pub(crate) metallic_factor: Option<f32>,
    /// 1 where the file names none.
    pub(crate) roughness_factor: Option<f32>,
    pub(crate) metallic_roughness_texture: Option<Value>,
}

/// The extensions of materials that are followed by mirrors and glass.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct SurfaceExtensions {
    #[serde(rename = "KHR_materials_ior")]
    pub(crate) ior: Option<RefractiveIndex>,
    #[serde(rename = "KHR_materials_transmission")]
    pub(crate) transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_volume")]
    pub(crate) volume: Option<Volume>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct RefractiveIndex {
    /// 1.5 where the file names none.
    pub(crate) ior: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Transmission {
    #[serde(default)]
    pub(crate) transmission_factor: f32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Volume {
    /// 0 is a thin wall.
    #[serde(default)]
    pub(crate) thickness_factor: f32,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Roots {
    #[serde(default)]
    pub(crate) nodes: Vec<usize>,
}

/// The typed parts of a document. Indices between them are checked where they are followed.
#[derive(Debug)]
pub(crate) struct Document {
    pub(crate) scene: Option<usize>,
    pub(crate) scenes: Vec<Roots>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) skins: Vec<Skin>,
    pub(crate) materials: Vec<Surface>,
    pub(crate) accessors: Vec<Accessor>,
    pub(crate) views: Vec<BufferView>,
    pub(crate) buffers: Vec<Buffer>,
}

impl Document {
    pub(crate) fn of(json: &Value) -> Result<Self, Problem> {
        let scene = json.get("scene").unwrap_or(&Value::Null);
        let scene =
            Option::deserialize(&*plain(scene)).map_err(|error| broken(format!("`scene`: {error}")))?;
        Ok(Self {
            scene,
            scenes: list(json, "scenes")?,
            nodes: list(json, "nodes")?,
            meshes: list(json, "meshes")?,
            skins: list(json, "skins")?,
            materials: list(json, "materials")?,
            accessors: list(json, "accessors")?,
            views: list(json, "bufferViews")?,
            buffers: list(json, "buffers")?,
        })
    }
}

/// One of the arrays of a document; a missing one is empty. Errors name the element.
fn list<T: DeserializeOwned>(json: &Value, key: &str) -> Result<Vec<T>, Problem> {
    let Some(value) = json.get(key).filter(|value| !value.is_null()) else {
        return Ok(Vec::new());
    };
    let Some(elements) = value.as_array() else {
        return Err(broken(format!("`{key}` is not an array")));
    };
    let typed = |(index, element)| {
        T::deserialize(&*plain(element)).map_err(|error| broken(format!("{key}[{index}]: {error}")))
    };
    elements.iter().enumerate().map(typed).collect()
}

/// An integer, however it is written: `3`, `3.0` and `3e0` are the same (section 2.7 of the specification).
pub(crate) fn whole(value: &Value) -> Option<u64> {
    /// Up to here f64 holds every integer.
    const GREATEST: f64 = 9007199254740992.0;
    value.as_u64().or_else(|| {
        let number =
            value.as_f64().filter(|number| (0.0..=GREATEST).contains(number) && number.fract() == 0.0);
        number.map(|number| number as u64)
    })
}

/// A value as it is read: integers written as decimals are integers, and properties that are null are missing, as other
/// readers have it. What is like that already is not copied.
fn plain(value: &Value) -> Cow<'_, Value> {
    if is_plain(value) { Cow::Borrowed(value) } else { Cow::Owned(made_plain(value)) }
}

fn is_plain(value: &Value) -> bool {
    match value {
        Value::Number(_) => !is_whole_decimal(value),
        Value::Array(elements) => elements.iter().all(is_plain),
        Value::Object(fields) => fields.values().all(|field| !field.is_null() && is_plain(field)),
        _ => true,
    }
}

/// Whether a number is an integer that is written as a decimal. −0 is none: as a coordinate it has its sign.
fn is_whole_decimal(value: &Value) -> bool {
    value.is_f64() && whole(value).is_some() && value.as_f64().is_some_and(f64::is_sign_positive)
}

fn made_plain(value: &Value) -> Value {
    match value {
        Value::Number(_) if is_whole_decimal(value) => whole(value).map_or(Value::Null, Value::from),
        Value::Array(elements) => elements.iter().map(made_plain).collect(),
        Value::Object(fields) => {
            let present = fields.iter().filter(|(_, field)| !field.is_null());
            Value::Object(present.map(|(key, field)| (key.clone(), made_plain(field))).collect())
        }
        other => other.clone(),
    }
}

/// The element that an index of the file names. `of` says whose index it is.
pub(crate) fn named<'a, T>(elements: &'a [T], index: usize, key: &str, of: &str) -> Result<&'a T, Problem> {
    elements.get(index).ok_or_else(|| {
        broken(format!("{of} names {key}[{index}], but there are only {} in the file", elements.len()))
    })
}
