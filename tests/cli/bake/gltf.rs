//! Openness back into the glTF file that the scene was read from.

use common::command::Place;
use common::place;

use super::npy_points;

/// A low wall at z = −1 behind the floor.
const WALL: &str = "v -999 0 -1\nv 999 0 -1\nv 999 0.25 -1\nv -999 0.25 -1\nf 1 2 3 4\n";

/// A GLB file: the floor from (0, 0, −1) to (1, 0, 1), which faces up; u rises with x, and v with z: v = 0 is at the wall.
fn floor() -> Vec<u8> {
    let positions: [[f32; 3]; 4] = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [0.0, 0.0, -1.0]];
    let uvs: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bin: Vec<u8> = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend(uvs.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bin.extend(indices.iter().flat_map(|x| x.to_le_bytes()));
    let json = serde_json::json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, -1], "max": [1, 0, 1] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": bin.len() }],
    });
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| u32::try_from(bytes).expect("a small file").to_le_bytes();
    let chunk = |name: &[u8; 4], data: &[u8]| [&length(data.len())[..], name, data].concat();
    let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &bin)].concat();
    [b"glTF\x02\0\0\0", &length(12 + chunks.len())[..], &chunks].concat()
}

fn place() -> Place {
    let place = place!();
    place.put("floor.glb", floor());
    place.put("wall.obj", WALL);
    place
}

/// The document of a GLB file.
fn document(bytes: &[u8]) -> serde_json::Value {
    let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON")
}

fn holds(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

#[test]
fn a_texture_in_the_file() {
    let place = place();
    for bits in ["8", "16"] {
        let line = format!("bake floor.glb --texels 32 --occluders wall.obj --bits {bits}");
        place.quiet_run(&format!("{line} -o a.png --report png.json"));
        place.quiet_run(&format!("{line} -o a.glb --report glb.json"));
        let (png, glb) = (place.bytes("a.png"), place.bytes("a.glb"));
        let document = document(&glb);
        assert!(document["materials"][0]["occlusionTexture"]["index"].is_u64(), "{document}");
        assert!(holds(&glb, &png), "{bits}: the same image");
        assert_eq!(place.json("png.json")["hash"], place.json("glb.json")["hash"]);
    }
    // Row 0 is v = 0, which lies at the wall.
    place.quiet_run("bake floor.glb --texels 32 --occluders wall.obj -o a.npy");
    let values = place.npy("a.npy").f32();
    let row = |row: usize| values[32 * row..][..32].iter().sum::<f32>() / 32.0;
    assert!(row(0) < 0.7 && row(31) > 0.95, "{} {}", row(0), row(31));
    // What was written is a scene again; that its texture is replaced is told.
    let run = place.run("bake a.glb --texels 8 -o b.glb");
    assert_eq!((run.code, run.stderr.lines().count()), (Some(0), 1));
    assert!(run.stderr.starts_with("warning: ") && run.stderr.contains("replaced"), "{}", run.stderr);
    place.quiet_run("bake a.glb --texels 8 -o b.glb -q");
}

#[test]
fn vertices_in_the_file() {
    let place = place();
    let line = "bake floor.glb --vertices --occluders wall.obj";
    place.quiet_run(&format!("{line} -o a.npy"));
    place.quiet_run(&format!("{line} -o ao.glb"));
    place.quiet_run(&format!("{line} -o color.glb --into color0"));
    let attributes =
        |name: &str| document(&place.bytes(name))["meshes"][0]["primitives"][0]["attributes"].clone();
    assert!(attributes("ao.glb")["_AO"].is_u64() && attributes("ao.glb")["COLOR_0"].is_null());
    assert!(attributes("color.glb")["COLOR_0"].is_u64() && attributes("color.glb")["_AO"].is_null());
    assert!(holds(&place.bytes("ao.glb"), &place.npy("a.npy").data));
}

#[test]
fn what_no_file_can_take() {
    let place = place();
    place.put("points.npy", npy_points(&[[0.5, 0.0, 0.0, 0.0, 1.0, 0.0]]));
    let before = place.names();
    for (line, code, named) in [
        ("wall.obj --vertices -o a.glb", 2, "wall.obj"),
        ("builtin:cornell -o a.glb", 2, "builtin:cornell"),
        ("floor.glb -o a.gltf", 2, ".glb"),
        ("floor.glb -o a.glb --polarity occlusion", 2, "--polarity"),
        ("floor.glb -o a.glb --into color0", 2, "--into"),
        ("floor.glb --vertices -o a.glb --bits 16", 2, "--bits"),
        ("floor.glb --points points.npy -o a.glb", 2, "a.glb"),
        ("absent.glb -o a.glb", 3, "absent.glb"),
        ("floor.glb -o nowhere/a.glb", 1, "nowhere"),
    ] {
        let run = place.run(&format!("bake {line}"));
        assert_eq!(run.code, Some(code), "{line}\n{}", run.stderr);
        assert!(run.stderr.starts_with("error: ") && run.stderr.contains(named), "{line}\n{}", run.stderr);
        assert_eq!(place.names(), before, "{line}");
    }
}
