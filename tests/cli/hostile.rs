//! Odd and hostile files of every kind that is read: a clear refusal that names the file, or an answer; never a panic, a long wait, much
//! memory, or a file half written. Formats have hostile files of their own in `tests/files`; these go through the command.

use std::time::{Duration, Instant};

use common::command::Place;
use common::place;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A file as every run here has it: the name, the bytes, the exit code, and what standard error says.
type Case = (&'static str, Vec<u8>, i32, &'static [&'static str]);

fn text(name: &'static str, text: String, code: i32, said: &'static [&'static str]) -> Case {
    (name, text.into_bytes(), code, said)
}

fn obj_files() -> Vec<Case> {
    vec![
        text(
            "nan.obj",
            "v nan 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n".into(),
            3,
            &["nan.obj:1", "--drop-non-finite"],
        ),
        text(
            "index.obj",
            format!("{TRIANGLE}f 1 2 99999999999999999999\n"),
            3,
            &["index.obj:4", "position index"],
        ),
        text("negative.obj", format!("{TRIANGLE}f -1 -2 -9\n"), 3, &["negative.obj:4", "out of range"]),
        ("binary.obj", (0..=255).cycle().take(9000).collect(), 3, &["binary.obj", "binary data"]),
        text(
            "number.obj",
            format!("v {} 0 0\n{TRIANGLE}f 1 2 3\n", "1".repeat(1_000_000)),
            3,
            &["number.obj:1"],
        ),
        text("continued.obj", format!("{TRIANGLE}{}", "f 1 2 \\\n".repeat(50_000)), 3, &["continued.obj:4"]),
        text("library.obj", format!("mtllib library.obj .\n{TRIANGLE}f 1 2 3\n"), 0, &["material library ."]),
        text("wide.obj", format!("{TRIANGLE}g {}\nf 1 2 3\n", "a ".repeat(200_000)), 0, &[]),
        text("polygon.obj", format!("{TRIANGLE}f {}\n", "1 2 3 ".repeat(30_000)), 0, &[]),
        text("utf16.obj", "\u{fffe}v".into(), 0, &["no triangles"]),
        text("empty.obj", String::new(), 0, &["empty"]),
    ]
}

fn gltf_files() -> Vec<Case> {
    let one = |changed: [&str; 2]| {
        let data = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
        let whole = format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"componentType":5126,"type":"VEC3","count":3,"bufferView":0,"min":[0,0,0],"max":[1,1,0]}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{data}"}}]}}"#
        );
        assert!(changed[0].is_empty() || whole.contains(changed[0]));
        whole.replacen(changed[0], changed[1], usize::from(!changed[0].is_empty()))
    };
    let chain: String = (1..=50_000).map(|k| format!(r#"{{"children":[{k}]}},"#)).collect();
    vec![
        text("plain.gltf", one(["", ""]), 0, &[]),
        text(
            "count.gltf",
            one([r#""count":3"#, r#""count":4294967295"#]),
            3,
            &["count.gltf", "beyond the 36 bytes"],
        ),
        text("cycle.gltf", one([r#"{"mesh":0}"#, r#"{"children":[0]}"#]), 3, &["cycle.gltf", "own ancestor"]),
        text("chain.gltf", one([r#"{"mesh":0}"#, &format!(r#"{chain}{{"mesh":0}}"#)]), 0, &[]),
        text(
            "offset.gltf",
            one([r#""buffer":0,"#, r#""buffer":0,"byteOffset":9223372036854775807,"#]),
            3,
            &["offset.gltf"],
        ),
        text(
            "stride.gltf",
            one([r#""buffer":0,"#, r#""buffer":0,"byteStride":4294967295,"#]),
            3,
            &["stride.gltf"],
        ),
        text("base64.gltf", one(["AAAAAAAA", "@@@@@@@@"]), 3, &["base64.gltf", "not base64"]),
        text("mode.gltf", one([r#""attributes""#, r#""mode":9,"attributes""#]), 0, &["left out: 1"]),
        text("mesh.gltf", one([r#""mesh":0"#, r#""mesh":-1"#]), 3, &["mesh.gltf", "nodes[0]"]),
        text("nested.gltf", "[".repeat(1_000_000), 3, &["nested.gltf:1", "recursion limit"]),
        text("cut.gltf", one(["", ""])[..300].to_owned(), 3, &["cut.gltf", "EOF"]),
        text(
            "name.gltf",
            one(["data:", "no\\n\\u001b[31m\\u202e:"]),
            3,
            &["name.gltf", "\\u{1b}[31m\\u{202e}"],
        ),
        ("short.glb", b"glTF".to_vec(), 3, &["short.glb", "header"]),
        ("long.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff".to_vec(), 3, &["long.glb"]),
        (
            "chunk.glb",
            b"glTF\x02\0\0\0\x18\0\0\0\xff\xff\xff\xffJSON{}  ".to_vec(),
            3,
            &["chunk.glb", "4294967295 bytes"],
        ),
    ]
}

/// An NPY file with a header.
fn npy(header: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{header:117}\n");
    // In range: headers here are short.
    let length = (header.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

fn array_files() -> Vec<Case> {
    let of = |dtype: &str, shape: &str, data: &[u8]| {
        npy(&format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}"), data)
    };
    vec![
        ("huge.npy", of("<f4", "4611686018427387904, 6", &[]), 3, &["huge.npy", "fits no memory"]),
        ("nan.npy", of("<f4", "1, 6", &[0xff; 24]), 3, &["nan.npy", "row 0"]),
        ("short.npy", of("<f4", "10, 6", &[0; 20]), 3, &["short.npy", "5 of 60"]),
        ("object.npy", of("|O", "1, 6", b"x"), 3, &["object.npy", "<f4"]),
        ("header.npy", b"\x93NUMPY\x01\x00\xff\xff{".to_vec(), 3, &["header.npy"]),
        ("flat.npy", of("<f4", "6,", &[0; 24]), 3, &["flat.npy"]),
    ]
}

/// A PNG file that says it has so many columns and rows; its checksums are not right, its data end.
fn png(width: u32, height: u32) -> Vec<u8> {
    let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    [b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", &head[..], &[0; 4], b"\0\0\0\x01IDAT\0"].concat()
}

fn surface_files() -> Vec<Case> {
    vec![
        text("empty.bpt", String::new(), 3, &["empty.bpt:1"]),
        text("nan.bpt", format!("1\n3 3\n{}", "nan nan nan\n".repeat(16)), 3, &["nan.bpt:3"]),
        text("many.bpt", "99999999999\n3 3\n".into(), 3, &["many.bpt:1"]),
        text("degree.bpt", "1\n4000000000 4000000000\n0 0 0\n".into(), 3, &["degree.bpt:2", "degrees"]),
        ("huge.png", png(u32::MAX >> 1, u32::MAX >> 1), 3, &["huge.png"]),
        ("cut.png", png(100, 100), 3, &["cut.png"]),
        ("text.png", b"hello".to_vec(), 3, &["text.png"]),
    ]
}

fn view_files() -> Vec<Case> {
    vec![
        text("nested.json", r#"{"views":"#.repeat(50_000), 3, &["nested.json:1", "eye"]),
        text("empty.json", "[]".into(), 3, &["empty.json", "no view"]),
        text("word.json", r#"{"a":1}"#.into(), 3, &["word.json", "eye"]),
    ]
}

/// Runs a line in which `@` stands for the file, and looks at what is left.
fn check(place: &Place, line: &str, (name, bytes, code, said): &Case) {
    place.put(name, bytes);
    let before = place.names();
    let (line, start) = (line.replace('@', name), Instant::now());
    let run = place.run(&format!("{line} --max-memory 400M"));
    assert_eq!(run.code, Some(*code), "umbel {line}: {}", run.stderr);
    for said in *said {
        assert!(run.stderr.contains(said), "umbel {line}: `{said}` is not in {}", run.stderr);
    }
    let remedies = run.stderr.lines().count() > 1 || run.stderr.contains(';');
    assert!(*code == 0 || remedies, "umbel {line}: no remedy in {}", run.stderr);
    assert!(run.stderr.len() < 2000, "umbel {line}: {} bytes are said", run.stderr.len());
    assert!(
        !run.stderr.contains('\u{1b}') && !run.stderr.contains("panicked"),
        "umbel {line}: {}",
        run.stderr
    );
    assert!(start.elapsed() < Duration::from_secs(60), "umbel {line} takes {:?}", start.elapsed());
    if *code == 0 {
        std::fs::remove_file(place.path("out.npy")).expect("an output");
    }
    assert_eq!(place.names(), before, "umbel {line} leaves a file");
}

#[test]
fn odd_files_are_answered_or_refused_clearly() {
    let place = place!();
    for case in obj_files().into_iter().chain(gltf_files()) {
        check(&place, "render @ --size 16x16 --aov id=out.npy", &case);
    }
    for case in array_files() {
        check(&place, "bake builtin:cornell --points @ -o out.npy", &case);
    }
    for case in surface_files() {
        let line = match case.0.ends_with(".png") {
            true => "reyes builtin:teapot --displace @ --height 0.1 --size 16x16 --aov id=out.npy",
            false => "reyes @ --size 16x16 --aov id=out.npy",
        };
        check(&place, line, &case);
    }
    for case in view_files() {
        check(&place, "visible builtin:cornell --views @ -o out.npy", &case);
    }
}
