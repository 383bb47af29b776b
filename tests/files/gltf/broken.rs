//! What is refused, with its name and a remedy.

use serde_json::{Value, json};
use umbel::formats::{GltfOptions, read_gltf};

use super::making::{FLOAT, Folder, Making, UNSIGNED_BYTE, UNSIGNED_INT, refusal};

/// The refusal of a text or GLB under a name.
fn refusal_of(name: &str, bytes: &[u8]) -> String {
    let folder = Folder::new(&[(name, bytes)]);
    refusal(read_gltf(&folder.path(name), &GltfOptions::default()))
}

/// The refusal of the square, changed at one place of its document.
fn spoilt(pointer: &str, value: Value) -> String {
    let mut making = Making::square();
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    making.json.pointer_mut(parent).unwrap()[key] = value;
    making.refusal()
}

#[test]
fn compressed_meshes_are_refused_by_name() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let problem = spoilt("/extensionsRequired", json!(["KHR_unknown", name]));
        assert!(problem.contains(name) && problem.contains("gltf-transform/cli copy"), "{problem}");
    }
    let problem = spoilt("/extensionsRequired", json!(["KHR_texture_transform", "VENDOR_strange_mesh"]));
    assert!(problem.contains("VENDOR_strange_mesh"), "{problem}");
    let mut harmless = Making::square();
    harmless.json["extensionsRequired"] = json!(["KHR_texture_basisu", "KHR_materials_anything"]);
    assert_eq!(harmless.read().triangles.len(), 2);
}

#[test]
fn data_that_only_an_extension_has_are_refused_by_name() {
    let mut draco = Making::square();
    draco.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
    // With the core's data beside it, these are read.
    assert_eq!(draco.read().triangles.len(), 2);
    draco.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(draco.refusal().contains("KHR_draco_mesh_compression"));
    let mut meshopt = Making::square();
    let fallback =
        json!({ "byteLength": 999, "extensions": { "EXT_meshopt_compression": { "fallback": true } } });
    let fallback = meshopt.push("buffers", fallback);
    meshopt.json["bufferViews"][0]["buffer"] = fallback.into();
    assert!(meshopt.refusal().contains("neither a URI nor a BIN chunk"));
    meshopt.json["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": {} });
    assert!(meshopt.refusal().contains("EXT_meshopt_compression"));
}

#[test]
fn missing_files_are_named() {
    let making = Making::square();
    let refused = |uri: &str| refusal_of("scene.gltf", &making.gltf_at(uri));
    assert!(refused("no%20such.bin").contains("no such.bin"));
    assert!(refused(".").contains("not a file"));
    assert!(refused("https://example.com/a.bin").contains("https://example.com/a.bin"));
    assert!(refused("data:application/octet-stream;base64,***").contains("base64"));
    assert!(refused("data:text/plain,hello").contains("only 5"));
    assert!(refused("data:text/plain").contains("comma"));
    assert!(refused("data:application/octet-stream;base64,AAAA").contains("only 3"));
}

#[test]
fn what_is_not_gltf_2_is_refused() {
    let text = |text: &str| refusal_of("scene.gltf", text.as_bytes());
    assert!(text("").contains("neither GLB nor JSON"));
    assert!(text("v 0 0 0").contains("neither GLB nor JSON"));
    assert!(text("[]").contains("asset.version"));
    assert!(text(r#"{ "asset": { "version": "1.0" } }"#).contains("glTF 1.0"));
    assert!(text(&"[".repeat(100_000)).contains("neither"));
    assert!(refusal_of("scene.glb", b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0").contains("version 1"));
    let folder = Folder::new(&[("scene.gltf", b"{\n\n oops }")]);
    let error = read_gltf(&folder.path("scene.gltf"), &GltfOptions::default()).unwrap_err();
    assert!(error.to_string().contains("scene.gltf:3: "), "{error}");
    let missing = read_gltf(&folder.path("absent.glb"), &GltfOptions::default()).unwrap_err();
    assert!(matches!(missing, umbel::Error::Input { .. }));
}

#[test]
fn every_cut_through_a_glb_is_noticed() {
    let bytes = Making::square().glb();
    for length in 4..bytes.len() {
        let problem = refusal_of("scene.glb", &bytes[..length]);
        assert!(problem.contains("ends in"), "{length}: {problem}");
    }
    // The stated length is believed; what follows it is not part of the file.
    let followed = [bytes.as_slice(), &[1, 2, 3]].concat();
    let folder = Folder::new(&[("scene.glb", &followed)]);
    assert_eq!(
        read_gltf(&folder.path("scene.glb"), &GltfOptions::default()).unwrap(),
        Making::square().read()
    );
    for short in [0_u8, 11, 12, 19] {
        let mut bytes = bytes.clone();
        bytes[8..12].copy_from_slice(&[short, 0, 0, 0]);
        let _ = refusal_of("scene.glb", &bytes);
    }
}

#[test]
fn accessors_that_leave_their_bytes_are_refused() {
    let huge = u64::MAX;
    for (pointer, value, said) in [
        ("/accessors/0/count", json!(5), "reach beyond"),
        ("/accessors/0/count", json!(huge), "reach beyond"),
        ("/accessors/0/byteOffset", json!(1), "reach beyond"),
        ("/accessors/0/byteOffset", json!(huge), "reach beyond"),
        ("/accessors/0/count", json!(-1), "accessors[0]"),
        ("/accessors/0/bufferView", json!(9), "bufferViews[9]"),
        ("/accessors/0/componentType", json!(1), "componentType 1"),
        ("/accessors/0/type", json!("VEC2"), "VEC3"),
        ("/bufferViews/0/byteLength", json!(47), "reach beyond"),
        ("/bufferViews/0/byteLength", json!(huge), "bufferViews[0] reaches beyond"),
        ("/bufferViews/0/byteOffset", json!(huge), "bufferViews[0] reaches beyond"),
        ("/bufferViews/0/byteStride", json!(8), "byteStride of 8"),
        ("/bufferViews/0/byteStride", json!(huge), "reach beyond"),
        ("/bufferViews/0/buffer", json!(1), "buffers[1]"),
        ("/buffers/0/byteLength", json!(93), "has only 92"),
        ("/buffers/0/byteLength", json!(40), "reaches beyond the 40 bytes"),
        ("/accessors/2/componentType", json!(FLOAT), "unsigned integers"),
        ("/accessors/2/normalized", json!(true), "unsigned integers"),
        ("/accessors/2/componentType", json!(UNSIGNED_INT), "reach beyond"),
        ("/accessors/1/count", json!(3), "3 elements of TEXCOORD"),
    ] {
        let problem = spoilt(pointer, value.clone());
        assert!(problem.contains(said), "{pointer} {value}: {problem}");
    }
    let zeros = || {
        let mut making = Making::square();
        making.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        making
    };
    let mut making = zeros();
    making.json["accessors"][0]["count"] = json!(1_u64 << 40);
    assert!(making.refusal().contains("elements without data"));
    for (count, at, said) in [(1, 4, "replaces element 4 of 4"), (9, 0, "reach beyond")] {
        let mut making = zeros();
        let indices = making.view(&[at]);
        let values = making.view(&[0; 12]);
        making.json["accessors"][0]["sparse"] = json!({
            "count": count,
            "indices": { "bufferView": indices, "componentType": UNSIGNED_BYTE },
            "values": { "bufferView": values },
        });
        assert!(making.refusal().contains(said), "{}", making.refusal());
        making.json["accessors"][0]["sparse"]["indices"]["componentType"] = FLOAT.into();
        assert!(making.refusal().contains("not unsigned"));
    }
}

#[test]
fn indices_that_name_nothing_are_refused() {
    for (pointer, value, said) in [
        ("/scene", json!(1), "scenes[1]"),
        ("/scene", json!("a"), "`scene`"),
        ("/scenes/0/nodes", json!([3]), "nodes[3]"),
        ("/nodes/0/mesh", json!(2), "nodes[0] names meshes[2]"),
        ("/nodes/0/matrix", json!([1, 2, 3]), "nodes[0]"),
        ("/nodes", json!({}), "`nodes` is not an array"),
        ("/meshes/0/primitives/0/indices", json!(7), "accessors[7]"),
        ("/meshes/0/primitives/0/material", json!(0), "materials[0]"),
        ("/meshes/0/primitives/0/attributes", json!({ "POSITION": 8 }), "accessors[8]"),
        ("/meshes/0/primitives/0/attributes", json!(1), "meshes[0]"),
    ] {
        let problem = spoilt(pointer, value.clone());
        assert!(problem.contains(said), "{pointer} {value}: {problem}");
    }
    let making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive["indices"] = making.indices(&[0, 1, 4]).into();
        primitive
    });
    assert!(making.refusal().contains("meshes[0].primitives[0] has the index 4"));
}

#[test]
fn nodes_that_are_no_tree_are_refused() {
    for children in [json!([0]), json!([1, 1])] {
        let mut making = Making::square();
        making.push("nodes", json!({}));
        making.json["nodes"][0]["children"] = children;
        assert!(making.refusal().contains("two parents or is its own ancestor"));
    }
    // A cycle that no root reaches is not in the scene.
    let mut making = Making::square();
    making.push("nodes", json!({ "children": [1] }));
    assert_eq!(making.read().triangles.len(), 2);
    // Depth costs no stack.
    let mut making = Making::new();
    let nodes: Vec<Value> = (1..200_000).map(|child| json!({ "children": [child] })).collect();
    making.json["nodes"] = nodes.into();
    making.push("nodes", json!({}));
    making.json["scenes"][0]["nodes"] = json!([0]);
    assert!(making.read().triangles.is_empty());
}
