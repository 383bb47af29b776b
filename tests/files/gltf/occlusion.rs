//! Files written back with occlusion: what is new is there, what was there is kept.

use std::fs;

use serde_json::{Value, json};
use umbel::Error;
use umbel::formats::{GltfFile, GltfOptions, VertexTarget};

use super::making::{Folder, Making, UNSIGNED_BYTE, Written, png};

/// A square at two nodes, with things that umbel does not understand all over the file.
fn foreign() -> Making {
    let mut making = Making::square();
    making.push(
        "materials",
        json!({ "zebra": 1, "name": "red", "alpha": 2, "extras": { "b": 1, "a": [1.5, "x"] } }),
    );
    making.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    making.json["meshes"][0]["primitives"][0]["extras"] = json!({ "kept": true });
    making.node(json!({ "mesh": 0, "translation": [0.1, 0, 1e-7], "extras": "kept" }));
    making.json["extensionsUsed"] = json!(["VENDOR_unknown"]);
    making.json["extensions"] = json!({ "VENDOR_unknown": { "z": [0.30000000000000004, 1e300], "a": null } });
    making.json["animations"] = json!([{ "channels": [], "samplers": [], "extras": 7 }]);
    making
}

/// Reads a GLB, changes it and writes it.
fn patch(making: &Making, change: impl FnOnce(&mut GltfFile) -> Vec<String>) -> (Written, Vec<String>) {
    patch_with(making, &GltfOptions::default(), change)
}

fn patch_with(
    making: &Making,
    options: &GltfOptions,
    change: impl FnOnce(&mut GltfFile) -> Vec<String>,
) -> (Written, Vec<String>) {
    let folder = Folder::new(&[("in.glb", &making.glb())]);
    let (mut file, scene) = GltfFile::read(&folder.path("in.glb"), options).unwrap();
    let warnings = change(&mut file);
    file.write(&folder.path("out.glb")).unwrap();
    let written = Written::glb(&folder.path("out.glb"));
    let length = usize::try_from(written.json["buffers"][0]["byteLength"].as_u64().unwrap()).unwrap();
    assert_eq!(length.next_multiple_of(4), written.bin.len());
    assert_eq!(&written.bin[..making.bin.len()], making.bin);
    let again = GltfFile::read(&folder.path("out.glb"), options).unwrap().1;
    let without_materials =
        |scene: umbel::Scene| (scene.positions, scene.triangles, scene.uvs, scene.uv_indices);
    assert_eq!(without_materials(again), without_materials(scene));
    (written, warnings)
}

fn texture(file: &mut GltfFile) -> Vec<String> {
    file.add_occlusion_texture(&png()).unwrap()
}

#[test]
fn a_file_without_changes_is_written_as_it_was() {
    let folder = Folder::new(&[("in.glb", &foreign().glb()), ("in.gltf", &foreign().gltf())]);
    for name in ["in.glb", "in.gltf"] {
        let before = fs::read(folder.path(name)).unwrap();
        let (file, _) = folder.open(name);
        // Over itself as well.
        file.write(&folder.path(name)).unwrap();
        assert_eq!(fs::read(folder.path(name)).unwrap().trim_ascii_end(), before.trim_ascii_end(), "{name}");
    }
    // Chunks that are not known stay behind the others.
    let mut bytes = foreign().glb();
    bytes.extend_from_slice(b"\x04\0\0\0ABCDwxyz");
    let length = u32::try_from(bytes.len()).unwrap();
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    fs::write(folder.path("in.glb"), &bytes).unwrap();
    folder.open("in.glb").0.write(&folder.path("out.glb")).unwrap();
    assert_eq!(fs::read(folder.path("out.glb")).unwrap(), bytes);
}

#[test]
fn a_texture_is_added_and_all_else_is_kept() {
    let making = foreign();
    let (written, warnings) = patch(&making, texture);
    assert_eq!(warnings, [""; 0]);
    let mut json = written.json.clone();
    assert_eq!(json["materials"][0]["occlusionTexture"], json!({ "index": 0 }));
    assert_eq!(json["textures"], json!([{ "sampler": 0, "source": 0 }]));
    assert_eq!(json["images"][0]["mimeType"], "image/png");
    assert_eq!(json["images"][0]["bufferView"], 3);
    assert_eq!(written.view(3), png());
    // Taken away again, the document is that of the file, to the order of its keys.
    let root = json.as_object_mut().unwrap();
    ["textures", "images", "samplers"].iter().for_each(|&key| drop(root.shift_remove(key).unwrap()));
    json["materials"][0].as_object_mut().unwrap().shift_remove("occlusionTexture");
    json["bufferViews"].as_array_mut().unwrap().pop();
    json["buffers"][0]["byteLength"] = making.bin.len().into();
    assert_eq!(json.to_string(), making.json.to_string());
}

#[test]
fn textures_name_their_set_and_replace_others() {
    let mut making = foreign();
    making.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = 1.into();
    making.json["materials"][0]["occlusionTexture"] = json!({ "index": 0, "strength": 0.5 });
    making.json["materials"][0]["extensions"] = json!({ "KHR_materials_unlit": {} });
    making.push("textures", json!({}));
    let options = GltfOptions { uv_set: 1, ..GltfOptions::default() };
    let (written, warnings) = patch_with(&making, &options, texture);
    assert_eq!(written.json["materials"][0]["occlusionTexture"], json!({ "index": 1, "texCoord": 1 }));
    assert!(warnings.iter().any(|warning| warning.contains("`red` had an occlusion texture")));
    assert!(warnings.iter().any(|warning| warning.contains("`red` is unlit")));
}

#[test]
fn materials_that_others_use_are_copied() {
    let mut making = foreign();
    let plain = json!({ "attributes": { "POSITION": 0 }, "material": 0 });
    let bare = making.square_primitive();
    let mut varied = making.square_primitive();
    varied["material"] = 0.into();
    varied["extensions"] = json!({ "KHR_materials_variants": { "mappings": [
        { "material": 1, "variants": [0] }, { "material": 0, "variants": [1] }
    ] } });
    making.push("materials", json!({ "name": "blue" }));
    let mesh = making.push("meshes", json!({ "primitives": [plain, bare, varied] }));
    making.node(json!({ "mesh": mesh }));
    let (written, _) = patch(&making, texture);
    let primitives = |mesh: usize| written.json["meshes"][mesh]["primitives"].as_array().unwrap().clone();
    let names: Vec<Value> = primitives(1).iter().map(|primitive| primitive["material"].clone()).collect();
    // The one without texture coordinates keeps `red`, the others share its copy; the default material is made.
    assert_eq!((&primitives(0)[0]["material"], names), (&json!(2), vec![json!(0), json!(3), json!(2)]));
    let mappings = &primitives(1)[2]["extensions"]["KHR_materials_variants"]["mappings"];
    assert_eq!((&mappings[0]["material"], &mappings[1]["material"]), (&json!(1), &json!(2)));
    let materials = &written.json["materials"];
    assert_eq!(materials[0], making.json["materials"][0]);
    assert_eq!((&materials[2]["name"], &materials[2]["extras"]), (&json!("red"), &materials[0]["extras"]));
    assert_eq!(materials[3], json!({ "occlusionTexture": { "index": 0 } }));
    let with_texture = |k: usize| materials[k].get("occlusionTexture").is_some();
    assert_eq!([0, 1, 2, 3].map(with_texture), [false, true, true, true]);
}

#[test]
fn vertices_get_an_attribute_of_their_own() {
    let mut making = Making::square();
    let mut second = making.json["meshes"][0]["primitives"][0].clone();
    second["mode"] = 5.into();
    making.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    let openness = [0.0, 0.25, f32::NAN, 1.0];
    let add = |file: &mut GltfFile| file.add_vertex_occlusion(&openness, VertexTarget::Ao).unwrap();
    let (written, warnings) = patch(&making, add);
    assert_eq!(warnings, [""; 0]);
    assert_eq!(written.floats(0, 0, "_AO"), [0.0, 0.25, 1.0, 1.0]);
    let accessor = &written.json["accessors"][3];
    assert_eq!((&accessor["type"], &accessor["count"]), (&json!("SCALAR"), &json!(4)));
    assert_eq!(written.json["bufferViews"][3]["target"], 34962);
    // Primitives that share their vertices share the accessor.
    assert_eq!(written.json["accessors"].as_array().unwrap().len(), 4);
    assert_eq!(written.json["meshes"][0]["primitives"][1]["attributes"]["_AO"], 3);
}

#[test]
fn instances_with_values_of_their_own_get_meshes_of_their_own() {
    let mut making = foreign();
    making.node(json!({ "mesh": 0, "translation": [5, 0, 0] }));
    let openness = [[0.5; 4], [0.25; 4], [0.5; 4]].concat();
    let add = |file: &mut GltfFile| {
        let warnings = file.add_vertex_occlusion(&openness, VertexTarget::Ao).unwrap();
        assert_eq!(file.origins().iter().map(|origin| origin.mesh).collect::<Vec<_>>(), [0, 1, 0]);
        warnings
    };
    let (written, warnings) = patch(&making, add);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("copies of meshes") && warnings[0].ends_with(": 1"));
    let meshes: Vec<&Value> = (0..3).map(|k| &written.json["nodes"][k]["mesh"]).collect();
    assert_eq!(meshes, [&json!(0), &json!(1), &json!(0)]);
    assert_eq!((written.floats(0, 0, "_AO"), written.floats(1, 0, "_AO")), (vec![0.5; 4], vec![0.25; 4]));
    let copied = &written.json["meshes"][1]["primitives"][0];
    assert_eq!((&copied["attributes"]["POSITION"], &copied["extras"]), (&json!(0), &json!({ "kept": true })));
    // A node outside the scene keeps the mesh as it was.
    making.push("nodes", json!({ "mesh": 0 }));
    let add = |file: &mut GltfFile| file.add_vertex_occlusion(&openness, VertexTarget::Ao).unwrap();
    let (written, _) = patch(&making, add);
    assert_eq!(written.json["meshes"][0], making.json["meshes"][0]);
    let meshes: Vec<&Value> = (0..4).map(|k| &written.json["nodes"][k]["mesh"]).collect();
    assert_eq!(meshes, [&json!(1), &json!(2), &json!(1), &json!(0)]);
}

#[test]
fn vertex_colours_are_multiplied() {
    let openness = [0.0, 0.5, 1.0, 0.25];
    let add = |file: &mut GltfFile| file.add_vertex_occlusion(&openness, VertexTarget::Color0).unwrap();
    let (written, _) = patch(&Making::square(), add);
    let expected: Vec<f32> = openness.iter().flat_map(|&value| [value; 3]).collect();
    assert_eq!(written.floats(0, 0, "COLOR_0"), expected);
    let with_colours = |kind: &str, bytes: &[u8], stride: usize| {
        let mut making = Making::square();
        let colours = making.accessor(bytes, UNSIGNED_BYTE, kind, 4);
        making.json["accessors"][colours]["normalized"] = true.into();
        making.json["bufferViews"][3]["byteStride"] = stride.into();
        making.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours.into();
        patch(&making, add).0.floats(0, 0, "COLOR_0")
    };
    let rgba = with_colours("VEC4", &[255, 51, 0, 204].repeat(4), 4);
    assert_eq!(rgba, openness.map(|value| [value, value * 0.2, 0.0, 0.8]).concat());
    let rgb = with_colours("VEC3", &[255, 51, 0, 99].repeat(4), 4);
    assert_eq!(rgb, openness.map(|value| [value, value * 0.2, 0.0, 1.0]).concat());
    // The other attribute may be added to the same file, and a second time.
    let twice = |file: &mut GltfFile| {
        let first = file.add_vertex_occlusion(&openness, VertexTarget::Ao).unwrap();
        let second = file.add_vertex_occlusion(&[0.5; 4], VertexTarget::Ao).unwrap();
        file.add_vertex_occlusion(&openness, VertexTarget::Color0).unwrap();
        texture(file);
        [first, second].concat()
    };
    let (written, warnings) = patch(&Making::square(), twice);
    assert_eq!(warnings, ["primitives whose attribute _AO is replaced: 1"]);
    assert_eq!((written.floats(0, 0, "_AO"), written.floats(0, 0, "COLOR_0")), (vec![0.5; 4], expected));
}

#[test]
fn compressed_twins_of_patched_primitives_are_taken_away() {
    let mut making = Making::square();
    making.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": {}, "VENDOR_kept": {} });
    let add = |file: &mut GltfFile| file.add_vertex_occlusion(&[1.0; 4], VertexTarget::Ao).unwrap();
    let (written, warnings) = patch(&making, add);
    assert!(warnings[0].contains("KHR_draco_mesh_compression"));
    assert_eq!(written.json["meshes"][0]["primitives"][0]["extensions"], json!({ "VENDOR_kept": {} }));
}

#[test]
fn text_files_keep_their_neighbours() {
    let making = foreign();
    let text = making.gltf_at("my%20data.bin");
    let folder = Folder::new(&[("in.gltf", &text), ("my data.bin", &making.bin)]);
    let (mut file, _) = folder.open("in.gltf");
    texture(&mut file);
    file.add_vertex_occlusion(&[0.5; 8], VertexTarget::Ao).unwrap();
    file.write(&folder.path("out.gltf")).unwrap();
    assert_eq!(fs::read(folder.path("my data.bin")).unwrap(), making.bin);
    let written = Written::gltf(&folder.path("out.gltf"));
    assert_eq!(written.json["buffers"][0], json!({ "byteLength": making.bin.len(), "uri": "my%20data.bin" }));
    assert_eq!(written.json["buffers"].as_array().unwrap().len(), 2);
    assert_eq!((written.view(3), written.floats(0, 0, "_AO")), (png(), vec![0.5; 4]));
    assert_eq!(folder.open("out.gltf").1.triangles.len(), 4);
    // Elsewhere its neighbours would be missing.
    let elsewhere = Folder::new(&[]);
    let error = file.write(&elsewhere.path("out.gltf")).unwrap_err();
    assert!(matches!(&error, Error::Usage(text) if text.contains("my data.bin")), "{error}");
    assert!(!elsewhere.path("out.gltf").exists());
    let error = file.write(&folder.path("no/such/out.gltf")).unwrap_err();
    assert!(matches!(error, Error::Write { .. }), "{error}");
    // Formats are not converted.
    let error = file.write(&folder.path("out.glb")).unwrap_err();
    assert!(matches!(&error, Error::Usage(text) if text.contains(".gltf")), "{error}");
}

#[test]
fn files_without_a_chunk_of_their_own_get_a_buffer() {
    // A GLB whose buffer is a data URI, and whose BIN chunk nobody names.
    let making = foreign();
    let mut odd = Making { json: serde_json::from_slice(&making.gltf()).unwrap(), bin: vec![1, 2, 3, 4] };
    odd.json["scenes"][0]["name"] = "odd".into();
    let folder = Folder::new(&[("in.glb", &odd.glb())]);
    let (mut file, _) = folder.open("in.glb");
    texture(&mut file);
    file.write(&folder.path("out.glb")).unwrap();
    let written = Written::glb(&folder.path("out.glb"));
    assert_eq!((&written.bin, written.view(3)), (&odd.bin, png()));
    assert_eq!(written.json["buffers"][0], odd.json["buffers"][0]);
}

#[test]
fn what_cannot_be_added_is_refused() {
    let folder = Folder::new(&[("in.glb", &foreign().glb())]);
    let (mut file, _) = folder.open("in.glb");
    let usage = |result: Result<Vec<String>, Error>, said: &str| match result {
        Err(Error::Usage(text)) => assert!(text.contains(said), "{text}"),
        other => panic!("{other:?}"),
    };
    usage(file.add_occlusion_texture(b"GIF89a"), "not a PNG");
    usage(file.add_vertex_occlusion(&[1.0; 4], VertexTarget::Ao), "8 vertices");
    let mut openness = [1.0; 8];
    openness[5] = 1.5;
    usage(file.add_vertex_occlusion(&openness, VertexTarget::Ao), "vertex 5 is 1.5");
    let options = GltfOptions { uv_set: 3, ..GltfOptions::default() };
    let (mut file, _) = GltfFile::read(&folder.path("in.glb"), &options).unwrap();
    let error = file.add_occlusion_texture(&png()).unwrap_err();
    assert!(error.to_string().contains("TEXCOORD_3"), "{error}");
    // Colours for four vertices serve no primitive of three.
    let mut shared = Making::square();
    let colours = shared.floats(&[[1.0_f32; 4]; 4]);
    let positions = shared.floats(&[[0.0_f32; 3]; 3]);
    let primitives = shared.json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives[0]["attributes"]["COLOR_0"] = colours.into();
    primitives.push(json!({ "attributes": { "POSITION": positions, "COLOR_0": colours } }));
    let folder = Folder::new(&[("in.glb", &shared.glb())]);
    let error = folder.open("in.glb").0.add_vertex_occlusion(&[1.0; 7], VertexTarget::Color0).unwrap_err();
    assert!(error.to_string().contains("3 positions, but 4 colours"), "{error}");
    let mut wrong = foreign();
    wrong.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 2.into();
    wrong.json["textures"] = json!({});
    let folder = Folder::new(&[("in.glb", &wrong.glb())]);
    let (mut file, _) = folder.open("in.glb");
    let error = file.add_vertex_occlusion(&[1.0; 8], VertexTarget::Color0).unwrap_err();
    assert!(error.to_string().contains("VEC4"), "{error}");
    assert!(
        file.add_occlusion_texture(&png()).unwrap_err().to_string().contains("`textures` is not an array")
    );
}
