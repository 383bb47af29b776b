//! The Khronos glTF validator on what is written: no errors, and no warnings that the file read did not have.
//!
//! It runs under node and comes from npm, into the folder that cargo keeps for tests. Where either is missing, the test says so and
//! checks nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use umbel::formats::{GltfFile, VertexTarget};

use super::making::{Folder, Making, SQUARE, UNSIGNED_SHORT, Written, png};
use super::posing::{FIRST, instanced, morphed, skinned};

/// The version that the test was written with.
const PACKAGE: &str = "gltf-validator@2.0.0-dev.3.10";
const SCRIPT: &str = "
const { validateBytes } = require('gltf-validator');
const fs = require('fs'), path = require('path');
const read = (name) => new Uint8Array(fs.readFileSync(name));
const check = (name) => validateBytes(read(name), {
  uri: name,
  externalResourceFunction: async (uri) => read(path.join(path.dirname(name), decodeURIComponent(uri))),
});
Promise.all(process.argv.slice(2).map(check)).then((reports) => console.log(JSON.stringify(reports)));
";

/// What is done to a file before it is written.
type Change = dyn Fn(&mut GltfFile) -> Vec<String>;

/// The folder with the validator, if it can be had.
fn validator() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf-validator");
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    fs::write(folder.join("check.js"), SCRIPT).map_err(|error| error.to_string())?;
    if !folder.join("node_modules/gltf-validator/package.json").exists() {
        let mut npm = Command::new("npm");
        npm.args(["install", "--no-audit", "--no-fund", "--prefix", "."]).arg(PACKAGE).current_dir(&folder);
        let output = npm.output().map_err(|error| format!("npm: {error}"))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
    }
    let node = Command::new("node").arg("--version").output().map_err(|error| format!("node: {error}"))?;
    if node.status.success() { Ok(folder) } else { Err("node does not run".into()) }
}

#[expect(clippy::print_stderr, reason = "a test that checks nothing says so")]
fn skip(reason: &str) {
    eprintln!("skipped, the glTF validator cannot be had: {reason}");
}

/// The issues of some files.
fn validate(folder: &Path, files: &[PathBuf]) -> Vec<Value> {
    let output = Command::new("node").arg("check.js").args(files).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let reports: Vec<Value> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(reports.len(), files.len());
    reports.into_iter().map(|report| report["issues"].clone()).collect()
}

/// A square at two nodes with colours of 16 bits, and a primitive without texture coordinates.
fn scene() -> Making {
    let mut making = Making::square();
    let colours: Vec<u8> =
        [65535_u16, 1000, 0, 65535].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    let colours = making.accessor(&colours, UNSIGNED_SHORT, "VEC4", 4);
    making.json["accessors"][colours]["normalized"] = true.into();
    making.push("materials", json!({ "name": "red" }));
    let primitives = making.json["meshes"][0]["primitives"].as_array_mut().unwrap();
    primitives[0]["attributes"]["COLOR_0"] = colours.into();
    primitives[0]["material"] = 0.into();
    primitives.push(json!({ "attributes": { "POSITION": 0 }, "indices": 2, "material": 0 }));
    making.node(json!({ "mesh": 0, "translation": [0, 0, 1] }));
    making
}

#[test]
fn what_is_written_is_valid() {
    let validator = match validator() {
        Ok(validator) => validator,
        Err(reason) => return skip(&reason),
    };
    let making = scene();
    let text = making.gltf_at("data.bin");
    let folder = Folder::new(&[("a.glb", &making.glb()), ("a.gltf", &text), ("data.bin", &making.bin)]);
    let vertices = |target| {
        move |file: &mut GltfFile| {
            let count = file.origins().iter().map(|origin| origin.vertices.end).max().unwrap_or(0);
            let openness: Vec<f32> = (0..count).map(|k| k as f32 / count as f32).collect();
            file.add_vertex_occlusion(&openness, target).unwrap()
        }
    };
    let changes: [(&str, &Change); 4] = [
        ("same", &|_| Vec::new()),
        ("texture", &|file| file.add_occlusion_texture(&png()).unwrap()),
        ("ao", &vertices(VertexTarget::Ao)),
        ("color", &vertices(VertexTarget::Color0)),
    ];
    let mut files = Vec::new();
    for format in ["glb", "gltf"] {
        for (name, change) in changes {
            let (mut file, _) = folder.open(&format!("a.{format}"));
            change(&mut file);
            files.push(folder.path(&format!("{name}.{format}")));
            file.write(files.last().unwrap()).unwrap();
        }
    }
    let whole = files.len();
    // It must be able to tell: a GLB without its last byte is invalid.
    let bytes = fs::read(&files[0]).unwrap();
    files.push(folder.path("broken.glb"));
    fs::write(&files[whole], &bytes[..bytes.len() - 1]).unwrap();
    let issues = validate(&validator, &files);
    for (file, issues) in files.iter().zip(&issues[..whole]) {
        let counts = (&issues["numErrors"], &issues["numWarnings"]);
        assert_eq!(counts, (&json!(0), &json!(0)), "{}: {issues:#}", file.display());
    }
    assert_ne!(issues[whole]["numErrors"], 0);
}

/// Files that are valid and not what one expects first.
fn odd_files() -> Vec<(&'static str, Making)> {
    let mut bare = Making::square();
    let positions = bare.floats(&SQUARE);
    // Beside what is baked: no texture coordinates, lines, points, a mesh without a node, one of another scene.
    for primitive in [
        json!({ "attributes": { "POSITION": positions }, "indices": 2 }),
        json!({ "attributes": { "POSITION": positions }, "mode": 1 }),
        json!({ "attributes": { "POSITION": positions }, "mode": 0 }),
    ] {
        let mesh = bare.push("meshes", json!({ "primitives": [primitive] }));
        bare.node(json!({ "mesh": mesh }));
    }
    let mut unused = bare.clone();
    unused
        .push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions }, "indices": 2 }] }));
    let other = unused.push("nodes", json!({ "mesh": 1 }));
    unused.push("scenes", json!({ "nodes": [other] }));
    let mut variants = scene();
    variants.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    variants.json["extensions"] = json!({ "KHR_materials_variants": { "variants": [{ "name": "a" }] } });
    variants.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_materials_variants": { "mappings": [{ "material": 0, "variants": [0] }] } });
    let mut bound = skinned(&[json!({ "translation": [0, 5, 0] })], [[0; 4]; 4], FIRST);
    bound.json["nodes"][0].as_object_mut().unwrap().remove("translation");
    let mut lifted = morphed(&[[0., 4., 0.]]);
    lifted.json["meshes"][0]["weights"] = json!([0.5]);
    lifted.node(json!({ "mesh": 0, "weights": [1] }));
    let places = [[0., 0., 0.]];
    let placed = instanced(&|making| json!({ "TRANSLATION": making.floats(&places) }));
    let mut decimals = scene();
    decimals.json["accessors"][0]["componentType"] = json!(5126.0);
    decimals.json["nodes"][0]["mesh"] = json!(0.0);
    vec![
        ("bare", bare),
        ("unused", unused),
        ("variants", variants),
        ("skinned", bound),
        ("morphed", lifted),
        ("instanced", placed),
        ("decimals", decimals),
        ("coloured", scene()),
    ]
}

/// Where nulls and empty lists are in a document.
fn holes(value: &Value, place: String, found: &mut Vec<String>) {
    match value {
        Value::Null => found.push(place),
        Value::Array(elements) if elements.is_empty() => found.push(place),
        Value::Array(elements) => {
            elements.iter().enumerate().for_each(|(k, part)| holes(part, format!("{place}/{k}"), found));
        }
        Value::Object(fields) => {
            fields.iter().for_each(|(key, part)| holes(part, format!("{place}/{key}"), found))
        }
        _ => {}
    }
}

#[test]
fn odd_files_stay_as_valid_as_they_were() {
    let validator = validator();
    let (mut files, mut names) = (Vec::new(), Vec::new());
    let files_of = odd_files();
    let folders: Vec<Folder> = files_of
        .iter()
        .map(|(_, making)| Folder::new(&[("in.glb", &making.glb()), ("in.gltf", &making.gltf())]))
        .collect();
    for ((name, making), folder) in files_of.iter().zip(&folders) {
        let mut before = Vec::new();
        holes(&making.json, String::new(), &mut before);
        for format in ["glb", "gltf"] {
            files.push(folder.path(&format!("in.{format}")));
            names.push(format!("{name}.{format}"));
            for what in ["texture", "ao", "color"] {
                let (mut file, scene) = folder.open(&format!("in.{format}"));
                let openness: Vec<f32> =
                    (0..scene.positions.len()).map(|k| 1.0 / (k % 9 + 1) as f32).collect();
                match what {
                    "texture" => file.add_occlusion_texture(&png()),
                    "ao" => file.add_vertex_occlusion(&openness, VertexTarget::Ao),
                    _ => file.add_vertex_occlusion(&openness, VertexTarget::Color0),
                }
                .unwrap_or_else(|error| panic!("{name} {what}: {error}"));
                let path = folder.path(&format!("{what}.{format}"));
                file.write(&path).unwrap();
                let json = if format == "glb" { Written::glb(&path).json } else { Written::gltf(&path).json };
                let mut after = Vec::new();
                holes(&json, String::new(), &mut after);
                after.retain(|hole| !before.contains(hole));
                assert!(after.is_empty(), "{name}.{format} {what}: {after:?}");
                assert_eq!(
                    folder.open(&format!("{what}.{format}")).1.positions,
                    scene.positions,
                    "{name} {what}"
                );
                files.push(path);
                names.push(format!("{name}.{format} {what}"));
            }
        }
    }
    let validator = match validator {
        Ok(validator) => validator,
        Err(reason) => return skip(&reason),
    };
    let issues = validate(&validator, &files);
    for (names, group) in names.chunks(4).zip(issues.chunks(4)) {
        for (name, issues) in names.iter().zip(group) {
            for count in ["numErrors", "numWarnings"] {
                let [before, after] = [&group[0][count], &issues[count]].map(|count| count.as_u64().unwrap());
                assert!(after <= before, "{name}: {count} {before} to {after}: {issues:#}");
            }
            assert_eq!(issues["numErrors"], 0, "{name}: {issues:#}");
        }
    }
}
