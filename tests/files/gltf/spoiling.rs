//! Spoilt files: whatever the bytes, a scene that keeps its promises or an error with a remedy, and what is read can be written.

use proptest::prelude::*;
use serde_json::json;
use umbel::Error;
use umbel::formats::{GltfFile, GltfOptions, VertexTarget};

use super::making::{Folder, Making, png};

/// A small file with a bit of everything.
fn rich() -> Making {
    let mut making = Making::square();
    let colors = making.floats(&[[1.0_f32, 0.5, 0.25, 1.0]; 4]);
    let mut primitive = making.square_primitive();
    primitive["attributes"]["COLOR_0"] = colors.into();
    primitive["attributes"]["NORMAL"] = making.floats(&[[0.0_f32, 0.0, 1.0]; 4]).into();
    primitive["material"] = 0.into();
    making.push("materials", json!({ "name": "red" }));
    let mesh = making.push("meshes", json!({ "primitives": [primitive], "name": "other" }));
    let child = making.push("nodes", json!({ "mesh": mesh, "translation": [0, 0, 1] }));
    making.node(json!({ "mesh": 0, "children": [child], "rotation": [0, 1, 0, 0] }));
    let indices = making.view(&[1, 3]);
    let values = making.view(&[0; 24]);
    making.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": indices, "componentType": 5121 },
        "values": { "bufferView": values },
    });
    making
}

/// Reads bytes, patches and writes what was read, and reads that again.
fn survive(bytes: &[u8], name: &str) {
    let folder = Folder::new(&[(name, bytes)]);
    for drop_non_finite in [false, true] {
        let options = GltfOptions { drop_non_finite, ..GltfOptions::default() };
        let (mut file, scene) = match GltfFile::read(&folder.path(name), &options) {
            Ok(read) => read,
            Err(Error::Input { problem, remedy, .. }) => {
                assert!(!problem.is_empty() && remedy.ends_with('.'));
                continue;
            }
            Err(other) => panic!("not an error of a file: {other:?}"),
        };
        scene.geometry().expect("finite positions, indices in range");
        let end = file.origins().iter().fold(0, |end, origin| {
            assert_eq!(origin.triangles.start, end);
            origin.triangles.end
        });
        assert_eq!(end as usize, scene.triangles.len());
        let openness = vec![0.5; scene.positions.len()];
        for target in [VertexTarget::Color0, VertexTarget::Ao] {
            let _ = file.add_vertex_occlusion(&openness, target);
        }
        let _ = file.add_occlusion_texture(&png());
        let out = folder.path(&format!("out_{name}"));
        // Refused where buffers or images lie elsewhere by a spoilt name, say.
        if file.write(&out).is_ok() {
            let (_, again) = GltfFile::read(&out, &options).expect("what is written can be read");
            assert_eq!((again.positions.len(), &again.triangles), (scene.positions.len(), &scene.triangles));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn no_byte_makes_it_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = rich().glb();
        for (at, byte) in changes {
            let length = bytes.len();
            bytes[at.index(length)] = byte;
        }
        survive(&bytes, "a.glb");
    }

    /// Digits and punctuation of the document, so that most files are still JSON.
    #[test]
    fn no_number_makes_it_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), 0..14_usize), 1..4)) {
        let mut text = String::from_utf8(rich().gltf()).unwrap();
        let body = text.find("\"buffers\"").unwrap();
        for (at, choice) in changes {
            let digits: Vec<usize> =
                text[..body].match_indices(|c: char| c.is_ascii_digit()).map(|(at, _)| at).collect();
            let at = digits[at.index(digits.len())];
            let new = ["0", "1", "2", "3", "4", "5", "7", "9", "-1", "1e9", "99999999999", "null", "\"\"", "[]"];
            text.replace_range(at..=at, new[choice]);
        }
        survive(text.as_bytes(), "a.gltf");
    }

    #[test]
    fn no_cut_makes_it_panic(length in any::<prop::sample::Index>()) {
        let text = rich().gltf();
        survive(&text[..length.index(text.len())], "a.gltf");
    }
}

#[test]
fn the_unspoilt_file_survives() {
    survive(&rich().glb(), "a.glb");
    survive(&rich().gltf(), "a.gltf");
    assert_eq!(rich().read().triangles.len(), 6);
}
