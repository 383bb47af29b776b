//! Sets an occlusion texture in all materials that the baked triangles use.
//!
//! A material that other primitives use as well, such as ones without texture coordinates, is copied first: they keep what
//! they had. One image serves the whole file, since its triangles share one atlas.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.9.3 "Additional Textures"; extension
//! KHR_materials_variants, 2020.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use crate::error::Error;
use crate::error::Problem;
use crate::formats::gltf::GltfFile;
use crate::formats::gltf::document::whole;
use crate::formats::gltf::write::{array, primitive_mut, push};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Where the materials of a primitive's variants are.
const MAPPINGS: &str = "/extensions/KHR_materials_variants/mappings";

impl GltfFile {
    /// Sets a PNG as `occlusionTexture` of every material that triangles with texture coordinates use.
    ///
    /// Its red channel is openness, linear, 1 = open; row 0 is v = 0; it is laid out for the set of texture coordinates with
    /// which the file was read. Materials that are missing are made, materials that other primitives use are copied. The
    /// strength stays 1. Returns warnings, one sentence each: what was replaced, and what viewers will not show.
    ///
    /// Instances of one mesh share their material and their texture coordinates, and so their texels.
    ///
    /// # Errors
    /// [`Error::Usage`] for bytes that are no PNG; [`Error::Input`] for a file whose triangles have no such texture
    /// coordinates, or whose `images`, `samplers` or `textures` are no arrays.
    pub fn add_occlusion_texture(&mut self, png: &[u8]) -> Result<Vec<String>, Error> {
        if !png.starts_with(PNG) {
            return Err(Error::Usage("the occlusion texture is not a PNG".to_owned()));
        }
        self.try_add_texture(png).map_err(|problem| problem.at(&self.path))
    }

    fn try_add_texture(&mut self, png: &[u8]) -> Result<Vec<String>, Problem> {
        let baked = self.origins.iter().filter(|origin| origin.has_uvs && !origin.triangles.is_empty());
        let baked: BTreeSet<(usize, usize)> = baked.map(|origin| (origin.mesh, origin.primitive)).collect();
        if baked.is_empty() {
            return Err(Problem {
                line: None,
                what: format!("no triangle of the scene has texture coordinates TEXCOORD_{}", self.uv_set),
                remedy: "Unwrap the meshes first, choose another set, or store occlusion at the vertices.",
            });
        }
        // Refused before anything is changed. Each of these gets an element below, so none is left empty.
        for key in ["images", "materials", "samplers", "textures"] {
            array(&mut self.json, key)?;
        }
        let materials = self.separate_materials(&baked)?;
        let view = self.append(png, None)?;
        let json = &mut self.json;
        let image = json!({ "name": "occlusion", "mimeType": "image/png", "bufferView": view });
        let image = push(json, "images", image)?;
        // Linear, with mipmaps; the edge is repeated, as the texels beyond it belong to another chart.
        let sampler = json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071 });
        let sampler = push(json, "samplers", sampler)?;
        let texture = push(json, "textures", json!({ "sampler": sampler, "source": image }))?;
        let mut slot = json!({ "index": texture });
        if self.uv_set > 0 {
            slot["texCoord"] = self.uv_set.into();
        }
        set_in_materials(array(json, "materials")?, &materials, &slot)
    }

    /// Gives the baked primitives materials that nothing else uses. Returns these.
    fn separate_materials(&mut self, baked: &BTreeSet<(usize, usize)>) -> Result<BTreeSet<usize>, Problem> {
        let mut others = BTreeSet::new();
        let meshes = array(&mut self.json, "meshes")?;
        for (mesh, value) in meshes.iter_mut().enumerate() {
            let primitives = value.get_mut("primitives").and_then(Value::as_array_mut);
            for (index, primitive) in primitives.into_iter().flatten().enumerate() {
                if !baked.contains(&(mesh, index)) {
                    others.extend(named_slots(primitive).into_iter().filter_map(|slot| index_in(slot)));
                }
            }
        }
        // From the material of the file, or none, to the one that takes the texture.
        let mut chosen: BTreeMap<Option<usize>, usize> = BTreeMap::new();
        for &(mesh, index) in baked {
            let primitive = primitive_mut(&mut self.json, mesh, index)?;
            let old: Vec<Option<usize>> = slots(primitive).iter().map(|slot| index_in(slot)).collect();
            let mut new = Vec::with_capacity(old.len());
            for old in old {
                new.push(match chosen.get(&old) {
                    Some(&known) => known,
                    None => choose(array(&mut self.json, "materials")?, old, &others),
                });
                chosen.extend(new.last().map(|&new| (old, new)));
            }
            let primitive = primitive_mut(&mut self.json, mesh, index)?;
            for (slot, new) in slots(primitive).into_iter().zip(new) {
                *slot = new.into();
            }
        }
        Ok(chosen.into_values().collect())
    }
}

/// The places in a primitive that shall name a material: its own, which is made if it is missing, and those of its
/// variants. Whoever asks for these must fill them: a null would be no valid index.
fn slots(primitive: &mut Value) -> Vec<&mut Value> {
    if let Some(fields) = primitive.as_object_mut() {
        fields.entry("material").or_insert(Value::Null);
    }
    named_slots(primitive)
}

/// The places in a primitive that are there to name a material.
fn named_slots(primitive: &mut Value) -> Vec<&mut Value> {
    let has_variants = primitive.pointer(MAPPINGS).is_some_and(Value::is_array);
    let Some(fields) = primitive.as_object_mut() else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (key, value) in fields {
        if key == "material" {
            found.push(value);
        } else if key == "extensions" && has_variants {
            let mappings = value.pointer_mut(&MAPPINGS["/extensions".len()..]);
            let mappings = mappings.and_then(Value::as_array_mut).into_iter().flatten();
            found.extend(mappings.filter_map(|mapping| mapping.get_mut("material")));
        }
    }
    found
}

fn index_in(slot: &Value) -> Option<usize> {
    whole(slot).and_then(|index| usize::try_from(index).ok())
}

/// The material itself, a copy where others use it, or a new one where there is none.
fn choose(materials: &mut Vec<Value>, old: Option<usize>, others: &BTreeSet<usize>) -> usize {
    let known = old.and_then(|index| materials.get(index)).cloned();
    match (old, known) {
        (Some(index), Some(_)) if !others.contains(&index) => return index,
        (_, Some(copy)) => materials.push(copy),
        // What no material describes has the default one, which is the empty one.
        (_, None) => materials.push(json!({})),
    }
    materials.len() - 1
}

/// Sets the texture, and tells what it replaces and where it will not be seen.
fn set_in_materials(
    materials: &mut [Value],
    chosen: &BTreeSet<usize>,
    slot: &Value,
) -> Result<Vec<String>, Problem> {
    let mut warnings = Vec::new();
    for &index in chosen {
        let Some(material) = materials.get_mut(index).and_then(Value::as_object_mut) else {
            return Err(crate::formats::gltf::document::broken(format!(
                "materials[{index}] is not an object"
            )));
        };
        let name = material.get("name").and_then(Value::as_str);
        let name = name.map_or(format!("materials[{index}]"), |name| format!("material `{name}`"));
        if material.contains_key("occlusionTexture") {
            warnings.push(format!("{name} had an occlusion texture, which is replaced"));
        }
        let extensions = material.get("extensions");
        if extensions.is_some_and(|extensions| extensions.get("KHR_materials_unlit").is_some()) {
            warnings.push(format!("{name} is unlit (KHR_materials_unlit): viewers ignore its occlusion"));
        }
        material.insert("occlusionTexture".to_owned(), slot.clone());
    }
    Ok(warnings)
}
