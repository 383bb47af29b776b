//! What scenes become of files made by hand.

use common::place;
use serde_json::{Value, json};
use umbel::formats::GltfOptions;
use umbel::scene::NO_INDEX;
use umbel::{LoadOptions, Scene, load};

use super::making::{
    BYTE, Folder, Making, SHORT, SQUARE, SQUARE_UVS, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT,
};

fn assert_warned(scene: &Scene, words: &str) {
    assert!(scene.warnings.iter().any(|warning| warning.contains(words)), "{words} in {:?}", scene.warnings);
}

#[test]
fn the_square_is_read_as_it_is() {
    let scene = Making::square().read();
    assert_eq!(scene.name, "scene");
    assert_eq!(scene.positions, SQUARE);
    assert_eq!(scene.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(scene.uvs, SQUARE_UVS);
    assert_eq!(scene.uv_indices, scene.triangles);
    assert!(scene.uv_v_down && scene.normals.is_empty() && scene.normal_indices.is_empty());
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn indices_of_every_width_and_none() {
    let expected = Making::square().read();
    let bytes = [0_u8, 1, 2, 0, 2, 3];
    let longs: Vec<u8> = bytes.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect();
    for (bytes, component) in [(&bytes[..], UNSIGNED_BYTE), (&longs, UNSIGNED_INT)] {
        let making = Making::with_primitive(|making| {
            let mut primitive = making.square_primitive();
            primitive["indices"] = making.accessor(bytes, component, "SCALAR", 6).into();
            primitive
        });
        assert_eq!(making.read(), expected);
    }
    let corners = expected.triangles.as_flattened().iter().map(|&i| SQUARE[i as usize]).collect::<Vec<_>>();
    let making =
        Making::with_primitive(|making| json!({ "attributes": { "POSITION": making.floats(&corners) } }));
    let scene = making.read();
    assert_eq!((scene.positions, scene.triangles), (corners, vec![[0, 1, 2], [3, 4, 5]]));
}

/// The triangles of the first five of some points, under a mode.
fn triangles(mode: u32, count: usize) -> Scene {
    let points: Vec<[f32; 3]> = (0_u16..5).map(|i| [f32::from(i), f32::from(i * i), 0.0]).collect();
    let making = Making::with_primitive(
        |making| json!({ "attributes": { "POSITION": making.floats(&points[..count]) }, "mode": mode }),
    );
    making.read()
}

#[test]
fn strips_and_fans_keep_their_front() {
    assert_eq!(triangles(5, 5).triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(triangles(6, 5).triangles, [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    assert!(triangles(5, 2).triangles.is_empty() && triangles(6, 1).triangles.is_empty());
    let left_over = triangles(4, 5);
    assert_eq!(left_over.triangles, [[0, 1, 2]]);
    assert_warned(&left_over, "last whole triangle are left out: 2");
    for mode in [0, 1, 2, 3] {
        assert_warned(&triangles(mode, 5), "points, lines");
        assert_warned(&triangles(mode, 5), "no triangles");
    }
}

#[test]
fn instances_stand_where_their_nodes_are() {
    let mut making = Making::square();
    making.json["meshes"][0]["name"] = "wall".into();
    let child = making.push("nodes", json!({ "mesh": 0, "name": "near", "translation": [0.0, 0.0, -1e9] }));
    making.node(json!({ "children": [child], "translation": [2.0, 0.0, 1e9], "scale": [2, 2, 2] }));
    // A quarter turn about z as matrix, column by column, and as quaternion: (x, y) becomes (−y, x).
    making.node(json!({ "mesh": 0, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1] }));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    making.node(json!({ "mesh": 0, "rotation": [0.0, 0.0, half, half], "translation": [5, 0, 0] }));
    let folder = Folder::new(&[("a.glb", &making.glb())]);
    let (file, scene) = folder.open("a.glb");
    let moved = |f: fn([f32; 3]) -> [f32; 3]| SQUARE.map(f);
    assert_eq!(scene.positions[..4], SQUARE);
    // 2·(−1e9) + 1e9 in f64, rounded once.
    assert_eq!(scene.positions[4..8], moved(|[x, y, _]| [2.0 * x + 2.0, 2.0 * y, -1e9]));
    assert_eq!(scene.positions[8..12], moved(|[x, y, _]| [5.0 - y, x, 0.0]));
    for (turned, expected) in scene.positions[12..].iter().zip(&scene.positions[8..12]) {
        assert!(turned.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{turned:?} {expected:?}");
    }
    assert_eq!(scene.triangles[2..4], [[4, 5, 6], [4, 6, 7]]);
    let names: Vec<_> = scene.objects.iter().map(|o| (o.name.as_str(), o.triangles.clone())).collect();
    assert_eq!(names, [("wall", 0..2), ("near", 2..4), ("wall", 4..6), ("wall", 6..8)]);
    let origins: Vec<_> = file
        .origins()
        .iter()
        .map(|o| (o.node, o.mesh, o.primitive, o.triangles.clone(), o.vertices.clone()))
        .collect();
    assert_eq!(
        origins,
        [(0, 0, 0, 0..2, 0..4), (1, 0, 0, 2..4, 4..8), (3, 0, 0, 4..6, 8..12), (4, 0, 0, 6..8, 12..16)]
    );
}

#[test]
fn large_offsets_that_cancel_leave_the_position_exact() {
    let mut making = Making::new();
    let primitive = making.square_primitive();
    making.push("meshes", json!({ "primitives": [primitive] }));
    let child = making.push("nodes", json!({ "mesh": 0, "translation": [-1000000000.25, 0.5, 0.0] }));
    making.node(json!({ "children": [child], "translation": [1000000000.5, -0.5, 0.0] }));
    assert_eq!(making.read().positions, SQUARE.map(|[x, y, z]| [x + 0.25, y, z]));
}

#[test]
fn mirrors_keep_front_faces_in_front() {
    let mut making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive["attributes"]["NORMAL"] = making.floats(&[[0.6, 0.0, 0.8_f32]; 4]).into();
        primitive
    });
    making.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let mirrored = making.read();
    assert_eq!(mirrored.triangles, [[0, 2, 1], [0, 3, 2]]);
    assert_eq!(mirrored.uv_indices, mirrored.triangles);
    assert_eq!(mirrored.normal_indices, mirrored.triangles);
    let triangles = mirrored.geometry().unwrap();
    assert!(triangles.normal(umbel::TriangleId(0)).z > 0.0);
    let normal = |scale: Value| {
        let mut making = making.clone();
        making.json["nodes"][0]["scale"] = scale;
        making.read().normals[0]
    };
    let near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-6);
    assert!(near(normal(json!([-1, 1, 1])), [-0.6, 0.0, 0.8]));
    assert!(near(normal(json!([1, 1, -1])), [0.6, 0.0, -0.8]));
    // Inverse transpose: (0.6 / 3, 0, 0.8 / 4) of length 1.
    assert!(near(normal(json!([3, 1, 4])), [0.5_f32.sqrt(), 0.0, 0.5_f32.sqrt()]));
    // Flattened to a plane, the normal is the plane's.
    assert!(near(normal(json!([1, 1, 0])), [0.0, 0.0, 1.0]));
}

#[test]
fn quantized_attributes_are_decoded() {
    let mut making = Making::with_primitive(|making| {
        // Two bytes of padding behind each vertex: a stride of 8.
        let shorts = [[0_i16, 0, 0, 9], [32767, 0, -32768, 9], [0, 16384, -32767, 9]];
        let bytes: Vec<u8> = shorts.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let positions = making.accessor(&bytes, SHORT, "VEC3", 3);
        making.json["bufferViews"][0]["byteStride"] = 8.into();
        making.json["accessors"][positions]["normalized"] = true.into();
        let normals = [0_i8, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0].map(i8::cast_unsigned);
        let normals = making.accessor(&normals, BYTE, "VEC3", 3);
        making.json["bufferViews"][1]["byteStride"] = 4.into();
        making.json["accessors"][normals]["normalized"] = true.into();
        let uvs: Vec<u8> = [0_u16, 65535, 13107, 0, 1, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
        let uvs = making.accessor(&uvs, UNSIGNED_SHORT, "VEC2", 3);
        making.json["accessors"][uvs]["normalized"] = true.into();
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs } })
    });
    making.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    making.json["nodes"][0]["scale"] = json!([65534, 65534, 65534]);
    let scene = making.read();
    assert_eq!(scene.positions, [[0., 0., 0.], [65534., 0., -65534.], [0., 32768., -65534.]]);
    assert_eq!(scene.normals, [[0., 0., 1.]; 3]);
    assert_eq!(scene.uvs, [[0., 1.], [0.2, 0.], [(1.0 / 65535.0) as f32, 0.]]);
    // Integers that are not normalized stand for themselves.
    making.json["accessors"][0]["normalized"] = false.into();
    making.json["nodes"][0]["scale"] = json!([1, 1, 1]);
    assert_eq!(making.read().positions[1], [32767., 0., -32768.]);
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut making = Making::square();
    let indices = making.view(&[1, 3]);
    let values: Vec<u8> = [7_f32, 0., 0., 0., 9., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = making.view(&values);
    making.json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": indices, "componentType": UNSIGNED_BYTE },
        "values": { "bufferView": values },
    });
    assert_eq!(making.read().positions, [[0., 0., 0.], [7., 0., 0.], [1., 1., 0.], [0., 9., 0.]]);
    // Without a view the others are zero.
    making.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(making.read().positions, [[0., 0., 0.], [7., 0., 0.], [0., 0., 0.], [0., 9., 0.]]);
}

#[test]
fn primitives_that_share_accessors_share_vertices() {
    let mut making = Making::square();
    let second = making.indices(&[2, 3, 0]);
    let mut primitive = making.json["meshes"][0]["primitives"][0].clone();
    primitive["indices"] = second.into();
    making.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    making.push(
        "materials",
        json!({ "name": "red", "pbrMetallicRoughness": { "baseColorFactor": [1, 0.25, 0, 0.5] } }),
    );
    making.push("materials", json!({}));
    making.json["meshes"][0]["primitives"][1]["material"] = 0.into();
    let folder = Folder::new(&[("a.glb", &making.glb())]);
    let (file, scene) = folder.open("a.glb");
    assert_eq!(scene.positions, SQUARE);
    assert_eq!(scene.triangles, [[0, 1, 2], [0, 2, 3], [2, 3, 0]]);
    assert_eq!(file.origins()[1].vertices, 0..4);
    assert_eq!(scene.objects.iter().map(|o| o.material).collect::<Vec<_>>(), [None, Some(0)]);
    let colours: Vec<_> = scene.materials.iter().map(|m| (m.name.as_str(), m.diffuse)).collect();
    assert_eq!(colours, [("red", [1.0, 0.25, 0.0]), ("", [1.0; 3])]);
}

#[test]
fn texture_coordinates_of_the_chosen_set() {
    let mut making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive["attributes"]["TEXCOORD_1"] = making.floats(&[[0.5_f32, 0.25]; 4]).into();
        primitive
    });
    let other = json!({ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 2 }] });
    let other = making.push("meshes", other);
    making.node(json!({ "mesh": other }));
    let scene = making.try_read(&GltfOptions { uv_set: 1, ..GltfOptions::default() }).unwrap();
    assert_eq!(scene.uvs, [[0.5, 0.25]; 4]);
    assert_eq!(scene.uv_indices[1..3], [[0, 2, 3], [NO_INDEX; 3]]);
    let none = making.try_read(&GltfOptions { uv_set: 2, ..GltfOptions::default() }).unwrap();
    assert!(none.uvs.is_empty() && none.uv_indices.is_empty());
}

#[test]
fn buffers_in_data_uris_and_beside_the_file() {
    let making = Making::square();
    let unpadded = String::from_utf8(making.gltf()).unwrap().replace("=\"", "\"");
    let with_mark = [b"\xEF\xBB\xBF".as_slice(), &making.gltf()].concat();
    let files: [(&str, &[u8]); 5] = [
        ("scene.glb", &making.glb()),
        ("scene.GLTF", &making.gltf()),
        ("scene.gltf", unpadded.as_bytes()),
        ("scene.gltf", &with_mark),
        // The bytes tell the container, not the name.
        ("scene.glb", &making.gltf_at("my%20data.bin")),
    ];
    for (name, bytes) in files {
        let folder = Folder::new(&[(name, bytes), ("my data.bin", &making.bin)]);
        let scene = load(folder.path(name).to_str().unwrap(), LoadOptions::default()).unwrap();
        assert_eq!(scene, making.read(), "{name}");
    }
}

#[test]
fn the_default_scene_is_read() {
    let mut making = Making::square();
    making.node(json!({ "mesh": 0 }));
    making.push("nodes", json!({ "mesh": 0, "translation": [7, 0, 0] }));
    making.push("scenes", json!({ "nodes": [2] }));
    assert_eq!(making.read().triangles.len(), 4);
    making.json["scene"] = 1.into();
    assert_eq!(making.read().positions[0], [7., 0., 0.]);
    making.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(making.read().triangles.len(), 4);
    // Without scenes, all nodes.
    making.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(making.read().triangles.len(), 6);
}

#[test]
fn positions_that_are_not_finite_are_refused_or_dropped() {
    let making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        let positions = [[0., 0., 0.], [f32::NAN, 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        primitive["attributes"]["POSITION"] = making.floats(&positions).into();
        primitive
    });
    let problem = making.refusal();
    assert!(problem.contains("vertex 1 of meshes[0].primitives[0]") && problem.contains("drop_non_finite"));
    let options = GltfOptions { drop_non_finite: true, ..GltfOptions::default() };
    let scene = making.try_read(&options).unwrap();
    assert_eq!((scene.positions.len(), scene.positions[1]), (4, [0.0; 3]));
    assert_eq!(scene.triangles, [[0, 2, 3]]);
    assert_warned(&scene, "not finite: 1; triangles left out with them: 1");
    // Finite in the file, but not in the world.
    let mut making = Making::square();
    making.json["nodes"][0]["scale"] = json!([1e300, 1, 1]);
    assert!(making.refusal().contains("infinite in the world"));
    // Normals and texture coordinates are mended.
    let making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive["attributes"]["NORMAL"] = making.floats(&[[f32::NAN, 0., 1.]; 4]).into();
        primitive["attributes"]["TEXCOORD_0"] = making.floats(&[[f32::INFINITY, 1.]; 4]).into();
        primitive
    });
    let scene = making.read();
    assert_eq!((scene.normals[0], scene.uvs[0]), ([0.0; 3], [0.0; 2]));
    assert_warned(&scene, "normals that are not finite become 0: 4");
    assert_warned(&scene, "texture coordinates that are not finite become 0: 4");
}

#[test]
fn every_verb_takes_glb() {
    let place = place!();
    place.put("a.glb", Making::square().glb());
    let run = place.run("info a.glb --json");
    let value: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!((run.code, &value["triangles"], &value["with_uvs"]), (Some(0), &json!(2), &json!(2)));
    place.quiet_run("render a.glb --size 9x9 --aov id=id.npy");
    assert!(place.npy("id.npy").u32().contains(&1));
    place.put("b.gltf", b"{}");
    let run = place.run("info b.gltf");
    assert!(run.code == Some(3) && run.stderr.contains("asset.version"), "{}", run.stderr);
    let run = place.run("info c.fbx");
    assert!(
        run.stderr.contains(".obj") && run.stderr.contains(".glb") && run.stderr.contains(".stl"),
        "{}",
        run.stderr
    );
}
