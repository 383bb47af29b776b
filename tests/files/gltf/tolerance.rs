//! What the specification lets a file write in more than one way, and what other readers forgive.

use serde_json::{Value, json};
use umbel::formats::{GltfOptions, VertexTarget, read_gltf};

use super::making::{Folder, Making, Written, png};

/// Replaces every integer of a document, wherever it stands, but for those in `asset`.
fn rewrite(value: &mut Value, write: &dyn Fn(u64) -> Value) {
    match value {
        Value::Number(number) => {
            if let Some(integer) = number.as_u64() {
                *value = write(integer);
            }
        }
        Value::Array(elements) => elements.iter_mut().for_each(|element| rewrite(element, write)),
        Value::Object(fields) => fields.values_mut().for_each(|field| rewrite(field, write)),
        _ => {}
    }
}

fn with_materials() -> Making {
    let mut making = Making::square();
    making.push("materials", json!({ "name": "red" }));
    making.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    making.json["meshes"][0]["primitives"][0]["mode"] = 4.into();
    making.json["bufferViews"][0]["byteStride"] = 12.into();
    making.json["nodes"][0]["children"] = json!([1]);
    making.push("nodes", json!({ "mesh": 0, "translation": [3, 0, 0] }));
    making
}

#[test]
fn integers_may_be_decimals_or_powers() {
    let plain = with_materials();
    let mut decimal = plain.clone();
    rewrite(&mut decimal.json, &|integer| json!(integer as f64));
    assert_eq!(decimal.read(), plain.read());
    // In exponents, which the JSON writer here does not write.
    let text = String::from_utf8(plain.gltf()).unwrap();
    let text = text.replace("\"mesh\": 0", "\"mesh\": 0e5").replace("\"count\": 6", "\"count\": 60e-1");
    let text = text.replace("\"componentType\": 5126", "\"componentType\": 5.126E3");
    assert!(text.contains("0e5") && text.contains("60e-1") && text.contains("5.126E3"));
    let folder = Folder::new(&[("scene.gltf", text.as_bytes())]);
    let scene = read_gltf(&folder.path("scene.gltf"), &GltfOptions::default()).unwrap();
    assert_eq!(scene, plain.read());
    // A fraction, a sign and what no integer reaches stay errors.
    for number in [json!(0.5), json!(-1.0), json!(1e300)] {
        let mut broken = plain.clone();
        broken.json["nodes"][0]["mesh"] = number;
        assert!(broken.refusal().contains("nodes[0]"), "{}", broken.refusal());
    }
}

#[test]
fn decimal_indices_are_followed_when_writing() {
    let mut making = with_materials();
    rewrite(&mut making.json, &|integer| json!(integer as f64));
    let folder = Folder::new(&[("in.glb", &making.glb())]);
    let (mut file, scene) = folder.open("in.glb");
    file.add_occlusion_texture(&png()).unwrap();
    file.add_vertex_occlusion(&vec![0.5; scene.positions.len()], VertexTarget::Ao).unwrap();
    file.write(&folder.path("out.glb")).unwrap();
    let written = Written::glb(&folder.path("out.glb"));
    assert_eq!(written.json["materials"].as_array().unwrap().len(), 1, "none was copied");
    assert_eq!(folder.open("out.glb").1.triangles, scene.triangles);
}

#[test]
fn optional_properties_that_are_null_are_missing() {
    let plain = with_materials();
    let mut nulls = plain.clone();
    for (pointer, keys) in [
        ("", &["animations", "skins", "extensionsRequired", "images", "textures"][..]),
        ("/nodes/0", &["name", "skin", "matrix", "rotation", "extensions"]),
        ("/meshes/0", &["name", "weights", "extras"]),
        ("/meshes/0/primitives/0", &["targets", "extensions"]),
        ("/accessors/0", &["sparse", "byteOffset", "normalized"]),
        ("/bufferViews/1", &["byteStride", "byteOffset", "target", "extensions"]),
        ("/buffers/0", &["name", "uri"]),
        ("/materials/0", &["pbrMetallicRoughness", "extensions"]),
    ] {
        let fields = nulls.json.pointer_mut(pointer).unwrap().as_object_mut().unwrap();
        keys.iter().filter(|key| **key != "byteOffset").for_each(|key| {
            fields.insert((*key).into(), Value::Null);
        });
    }
    assert_eq!(nulls.read(), plain.read());
    // A byteStride of 0 says no more.
    nulls.json["bufferViews"][1]["byteStride"] = 0.into();
    assert_eq!(nulls.read(), plain.read());
    let folder = Folder::new(&[("in.glb", &nulls.glb())]);
    let (mut file, _) = folder.open("in.glb");
    file.add_occlusion_texture(&png()).unwrap();
    // What must be there is still missed.
    nulls.json["accessors"][0]["componentType"] = Value::Null;
    assert!(nulls.refusal().contains("componentType"));
}

#[test]
fn data_uris_with_and_without_base64() {
    let making = Making::square();
    let text: String = making.bin.iter().map(|byte| format!("%{byte:02x}")).collect();
    let base64 = String::from_utf8(making.gltf()).unwrap();
    let base64 = base64.split_once(";base64,").unwrap().1.split_once('"').unwrap().0.to_owned();
    for uri in [
        format!("data:application/octet-stream,{text}"),
        format!("data:,{text}"),
        format!("DATA:application/gltf-buffer;charset=x,{text}"),
        format!("data:application/gltf-buffer;BASE64,{base64}"),
        format!("data:;base64,{}", base64.replace('=', "%3D").replace('+', "%2B")),
    ] {
        let folder = Folder::new(&[("scene.gltf", &making.gltf_at(&uri))]);
        let scene = read_gltf(&folder.path("scene.gltf"), &GltfOptions::default()).unwrap();
        assert_eq!(scene, making.read(), "{uri}");
    }
    // Characters that stand for themselves.
    let mut letters = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive.as_object_mut().unwrap().remove("indices");
        primitive["attributes"] = json!({ "POSITION": 0 });
        primitive
    });
    letters.json["buffers"][0]["byteLength"] = 48.into();
    letters.json["bufferViews"].as_array_mut().unwrap().truncate(1);
    letters.json["accessors"].as_array_mut().unwrap().truncate(1);
    let folder = Folder::new(&[("scene.gltf", &letters.gltf_at(&format!("data:,{}", "ABCD".repeat(12))))]);
    let scene = read_gltf(&folder.path("scene.gltf"), &GltfOptions::default()).unwrap();
    assert_eq!(scene.positions[0], [f32::from_le_bytes(*b"ABCD"); 3]);
}
