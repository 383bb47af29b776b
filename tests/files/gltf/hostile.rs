//! Names that lead out of the file's folder, files that stand for more than they are, and scenes far away.

use std::fs;
use std::io;

use common::place;
use serde_json::{Value, json};
use umbel::formats::{GltfFile, GltfOptions, VertexTarget, read_gltf};
use umbel::{Error, Scene};

use super::making::{FLOAT, Folder, Making, SQUARE, UNSIGNED_SHORT};

const FEW: GltfOptions =
    GltfOptions { drop_non_finite: false, uv_set: 0, allow_outside: false, max_memory: Some(20_000_000) };

/// Asserts that a file is refused for the memory that it would need, and returns what is said.
fn too_large(read: Result<Scene, Error>) -> String {
    match read {
        Err(Error::Limit(text)) => {
            assert!(text.contains("would need at least") && text.contains("max_memory"), "{text}");
            text
        }
        other => panic!("{:?}", other.map(|scene| scene.triangles.len())),
    }
}

#[test]
fn buffers_outside_of_the_folder_are_refused_by_name() {
    let making = Making::square();
    let folder = Folder::new(&[("secret.bin", &making.bin)]);
    fs::create_dir_all(folder.path("scene/own")).unwrap();
    fs::write(folder.path("scene/own/a.bin"), &making.bin).unwrap();
    let secret = folder.path("secret.bin").display().to_string();
    let path = folder.path("scene/scene.gltf");
    let read = |uri: &str, allow_outside: bool| {
        fs::write(&path, making.gltf_at(uri)).unwrap();
        read_gltf(&path, &GltfOptions { allow_outside, ..GltfOptions::default() })
    };
    let up = ["../secret.bin", "%2e%2e/secret.bin", "..%2fsecret.bin", "own/../../secret.bin", &secret];
    for uri in up.into_iter().chain(["/proc/self/environ", "../nothing.bin"]) {
        match read(uri, false) {
            Err(Error::Input { problem, remedy, .. }) => {
                assert!(problem.contains(uri) && problem.contains("outside"), "{problem}");
                assert!(remedy.contains("GltfOptions::allow_outside"), "{remedy}");
            }
            other => panic!("{uri}: {other:?}"),
        }
    }
    for uri in up {
        assert_eq!(read(uri, true).unwrap(), making.read(), "{uri}");
    }
    for uri in ["own/a.bin", "./own/../own/a.bin", "own%2fa.bin"] {
        assert_eq!(read(uri, false).unwrap(), making.read(), "{uri}");
    }
    // Of nothing that is refused a byte is in an output.
    let place = place!();
    place.put("secret.txt", "the secret".repeat(100));
    fs::create_dir_all(place.path("scene")).unwrap();
    fs::write(place.path("scene/a.gltf"), making.gltf_at("../secret.txt")).unwrap();
    let run = place.run("bake scene/a.gltf --vertices -o scene/b.gltf");
    assert!(run.code == Some(3) && run.stderr.contains("../secret.txt"), "{}", run.stderr);
    assert!(!place.path("scene/b.gltf").exists());
}

#[test]
fn a_file_that_many_buffers_name_is_read_once() {
    let mut making = Making::square();
    let mut text = String::from_utf8(making.gltf_at("data.bin")).unwrap();
    // 20,000 buffers that name the file itself.
    for _ in 0..20_000 {
        making.push("buffers", json!({ "byteLength": 1, "uri": "scene.gltf" }));
    }
    let many = String::from_utf8(making.gltf_at("data.bin")).unwrap();
    assert!(many.len() > 20 * text.len());
    text.clear();
    let folder = Folder::new(&[("scene.gltf", many.as_bytes()), ("data.bin", &making.bin)]);
    let scene = read_gltf(&folder.path("scene.gltf"), &FEW).unwrap();
    assert_eq!(scene.positions, SQUARE);
}

/// A primitive without data: all of its positions are 0.
fn zeros(making: &mut Making, count: usize) -> Value {
    let positions =
        making.push("accessors", json!({ "componentType": FLOAT, "type": "VEC3", "count": count }));
    let indices = making
        .push("accessors", json!({ "componentType": UNSIGNED_SHORT, "type": "SCALAR", "count": count }));
    json!({ "attributes": { "POSITION": positions }, "indices": indices })
}

#[test]
fn what_stands_for_many_triangles_is_counted_before_it_is_made() {
    // Accessors without data that many primitives share.
    let mut making = Making::with_primitive(|making| zeros(making, 60_000));
    let primitive = making.json["meshes"][0]["primitives"][0].clone();
    making.json["meshes"][0]["primitives"] = vec![primitive; 20_000].into();
    let text = too_large(making.try_read(&FEW));
    // 20,000 times 20,000 triangles of 12 bytes.
    assert!(text.contains("400000000 triangles") && text.contains(" 48"), "{text}");
    // Many nodes of one mesh, and many instances at a node.
    let mut making = Making::square();
    for _ in 0..100_000 {
        making.node(json!({ "mesh": 0 }));
    }
    too_large(making.try_read(&GltfOptions { max_memory: Some(60_000_000), ..FEW }));
    assert_eq!(making.read().triangles.len(), 200_002);
    let mut making = Making::square();
    let places = making.push("accessors", json!({ "componentType": FLOAT, "type": "VEC3", "count": 65_000 }));
    let extensions = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    for _ in 0..100 {
        making.node(json!({ "mesh": 0, "extensions": extensions }));
    }
    assert!(too_large(making.try_read(&FEW)).contains("13000002 triangles"));
    // Long names that many instances repeat.
    making.json["nodes"].as_array_mut().unwrap().truncate(2);
    making.json["scenes"][0]["nodes"] = json!([1]);
    making.json["nodes"][1]["name"] = "n".repeat(10_000).into();
    too_large(making.try_read(&FEW));
    // The command keeps to --max-memory, and its exit code tells.
    let place = place!();
    place.put("a.glb", making.glb());
    let run = place.run("info a.glb --max-memory 20M");
    assert!(run.code == Some(4) && run.stderr.contains("would need"), "{}", run.stderr);
}

#[test]
fn bytes_are_read_with_what_a_closure_gives() {
    let making = Making::square();
    let mut asked = Vec::new();
    let mut resolver = |name: &str| {
        asked.push(name.to_owned());
        if name == "my data.bin" { Ok(making.bin.clone()) } else { Err(io::ErrorKind::NotFound.into()) }
    };
    let text = making.gltf_at("my%20data.bin");
    let (mut file, scene) =
        GltfFile::from_bytes("stdin.gltf", &text, &GltfOptions::default(), &mut resolver).unwrap();
    assert_eq!(scene, Scene { name: "stdin".into(), ..making.read() });
    file.add_vertex_occlusion(&[0.5; 4], VertexTarget::Ao).unwrap();
    let text = making.gltf_at("other.bin");
    let refused =
        GltfFile::from_bytes("stdin.gltf", &text, &GltfOptions::default(), &mut resolver).unwrap_err();
    assert!(refused.to_string().contains("other.bin"), "{refused}");
    assert_eq!(asked, ["my data.bin", "other.bin"]);
    let glb = GltfFile::from_bytes("a", &making.glb(), &GltfOptions::default(), &mut |_| Ok(Vec::new()));
    assert_eq!(glb.unwrap().1.triangles, scene.triangles);
}

#[test]
fn a_place_far_away_comes_from_a_node() {
    let mut making = Making::square();
    making.json["nodes"][0]["translation"] = json!([532811.3, 4649776.7, 112.1]);
    let scene = making.read();
    assert!((scene.offset.y - 4649777.0).abs() < 2.0, "{}", scene.offset);
    for (far, near) in scene.positions.iter().zip(SQUARE) {
        for k in 0..3 {
            let place = f64::from(far[k]) + scene.offset.to_array()[k] - [532811.3, 4649776.7, 112.1][k];
            assert!((place - f64::from(near[k])).abs() < 1e-6, "{far:?}");
        }
    }
    assert!(scene.warnings.iter().any(|warning| warning.contains("far from the origin")));
    // By whole steps of f32 it stays where it is.
    making.json["nodes"][0]["translation"] = json!([1e6, 0, 0]);
    let scene = making.read();
    assert_eq!((scene.offset.x, scene.positions[1][0], scene.warnings.len()), (0.0, 1000001.0, 0));
    // A baked file keeps its nodes.
    let folder = Folder::new(&[("in.glb", &making.glb())]);
    let (mut file, _) = folder.open("in.glb");
    file.add_vertex_occlusion(&[0.5; 4], VertexTarget::Ao).unwrap();
    file.write(&folder.path("out.glb")).unwrap();
    assert_eq!(folder.open("out.glb").1.positions, scene.positions);
}
