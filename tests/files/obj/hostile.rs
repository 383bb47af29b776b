//! Names that lead out of the scene's folder, and files that stand for more than they are.

use std::fs;
use std::io;

use umbel::formats::{ObjOptions, read_obj, read_obj_bytes};
use umbel::{Error, Scene};

use super::{assert_warned, folder};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
const RED: &[u8] = b"newmtl red\nKd 1 0 0\n";

fn load(root: &tempfile::TempDir, name: &str, allow_outside: bool) -> Scene {
    read_obj(&root.path().join(name), &ObjOptions { allow_outside, ..ObjOptions::default() }).unwrap()
}

#[test]
fn libraries_outside_of_the_folder_are_not_read() {
    let root = folder(&[("secret.mtl", RED)]);
    fs::create_dir_all(root.path().join("scene/own")).unwrap();
    fs::write(root.path().join("scene/own/a.mtl"), RED).unwrap();
    let secret = root.path().join("secret.mtl");
    for name in
        ["../secret.mtl", "..\\secret.mtl", "own/../../secret.mtl", "../nothing", secret.to_str().unwrap()]
    {
        fs::write(root.path().join("scene/a.obj"), format!("mtllib {name}\n{TRIANGLE}")).unwrap();
        let scene = load(&root, "scene/a.obj", false);
        assert!(scene.materials.is_empty(), "{name}");
        assert_warned(&scene, &["outside", "ObjOptions::allow_outside", &name.replace('\\', "/")]);
        let scene = load(&root, "scene/a.obj", true);
        assert_eq!(scene.materials.len(), usize::from(!name.contains("nothing")), "{name}");
    }
    // What stays inside is read, by whatever way.
    let inside = fs::canonicalize(root.path().join("scene/own/a.mtl")).unwrap();
    for name in ["own/a.mtl", "./own/../own/a.mtl", inside.to_str().unwrap()] {
        fs::write(root.path().join("scene/a.obj"), format!("mtllib {name}\n{TRIANGLE}")).unwrap();
        assert_eq!(load(&root, "scene/a.obj", false).materials.len(), 1, "{name}");
    }
}

#[cfg(unix)]
#[test]
fn links_are_followed_before_names_are_judged() {
    let root = folder(&[("secret.mtl", RED)]);
    fs::create_dir_all(root.path().join("scene")).unwrap();
    std::os::unix::fs::symlink(root.path().join("secret.mtl"), root.path().join("scene/b.mtl")).unwrap();
    std::os::unix::fs::symlink(root.path(), root.path().join("scene/up")).unwrap();
    for name in ["b.mtl", "up/secret.mtl"] {
        fs::write(root.path().join("scene/a.obj"), format!("mtllib {name}\n{TRIANGLE}")).unwrap();
        assert!(load(&root, "scene/a.obj", false).materials.is_empty(), "{name}");
        assert_eq!(load(&root, "scene/a.obj", true).materials.len(), 1, "{name}");
    }
}

#[test]
fn a_library_is_read_once_however_often_it_is_named() {
    let large = [RED, &b"# padding\n".repeat(100_000)].concat();
    let lines = "mtllib a.mtl\nmtllib ./a.mtl\n".repeat(10_000);
    let root = folder(&[("scene.obj", format!("{lines}{TRIANGLE}").as_bytes()), ("a.mtl", &large)]);
    let options = ObjOptions { max_memory: Some(20_000_000), ..ObjOptions::default() };
    let scene = read_obj(&root.path().join("scene.obj"), &options).unwrap();
    assert_eq!((scene.materials.len(), scene.warnings.len()), (1, 0));
    // Of equal names the last counts, where a library was named last.
    let blue = b"newmtl red\nKd 0 0 1\n";
    let text = format!("mtllib a.mtl\nmtllib b.mtl\nmtllib a.mtl\n{TRIANGLE}");
    let root = folder(&[("scene.obj", text.as_bytes()), ("a.mtl", RED), ("b.mtl", blue)]);
    assert_eq!(load(&root, "scene.obj", false).materials[0].diffuse, [1.0, 0.0, 0.0]);
}

#[test]
fn a_budget_is_kept_and_a_refusal_says_what_is_needed() {
    let text = format!("{TRIANGLE}{}", "f 1 2 3\n".repeat(100_000));
    let root = folder(&[("scene.obj", text.as_bytes())]);
    let read = |max_memory| {
        read_obj(&root.path().join("scene.obj"), &ObjOptions { max_memory, ..ObjOptions::default() })
    };
    assert_eq!(read(None).unwrap().triangles.len(), 100_001);
    for limit in [1000, 1_000_000, 4_000_000] {
        match read(Some(limit)) {
            Err(Error::Limit(text)) => assert!(text.contains("would need") && text.contains("MB"), "{text}"),
            other => panic!("{:?}", other.map(|scene| scene.triangles.len())),
        }
    }
    assert_eq!(read(Some(6_000_000)).unwrap().triangles.len(), 100_001);
}

#[test]
fn bytes_are_read_with_what_a_closure_gives() {
    let text = format!("mtllib lib/a.mtl\nmtllib none.mtl\n{TRIANGLE}");
    let mut asked = Vec::new();
    let mut resolver = |name: &str| {
        asked.push(name.to_owned());
        if name == "lib/a.mtl" { Ok(RED.to_vec()) } else { Err(io::ErrorKind::NotFound.into()) }
    };
    let scene = read_obj_bytes("stdin.obj", text.as_bytes(), &ObjOptions::default(), &mut resolver).unwrap();
    assert_eq!((scene.name.as_str(), scene.materials.len()), ("stdin", 1));
    assert_warned(&scene, &["none.mtl", "cannot be read"]);
    asked.sort();
    assert_eq!(asked, ["lib/a.mtl", "none.mtl"]);
    let error =
        read_obj_bytes("stdin.obj", b"f 1 2 3", &ObjOptions::default(), &mut |_| Ok(Vec::new())).unwrap_err();
    assert!(error.to_string().starts_with("stdin.obj:1: "), "{error}");
}
