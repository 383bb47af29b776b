//! The Khronos glTF validator on what is written: no errors, and no warnings that the file read did not have.
//!
//! It runs under node and comes from npm, into the folder that cargo keeps for tests. Where either is missing, the test says so and
//! checks nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use umbel::formats::{GltfFile, VertexTarget};

use super::making::{Folder, Making, UNSIGNED_SHORT, png};

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
