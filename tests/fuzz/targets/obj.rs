//! Any bytes as an OBJ file and its material library: a scene that keeps its promises, or an error with a remedy.
//!
//! The library, if there is one, follows a line `%`. `read_obj` takes a path, so both are files in the temporary directory;
//! point TMPDIR at memory (/dev/shm) to spare the disk.

#![no_main]

use std::path::Path;
use std::sync::LazyLock;
use std::{env, fs, process};

use libfuzzer_sys::fuzz_target;
use umbel::formats::{ObjOptions, read_obj};
use umbel::{Error, Scene};

#[path = "../promises.rs"]
mod promises;

/// A directory of this process, so that several may run.
static FOLDER: LazyLock<std::path::PathBuf> = LazyLock::new(|| {
    let folder = env::temp_dir().join(format!("umbel-fuzz-{}", process::id()));
    fs::create_dir_all(&folder).expect("a temporary directory");
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let split = bytes.windows(3).position(|w| w == b"\n%\n");
    let (obj, mtl) = split.map_or((bytes, &[][..]), |at| (&bytes[..=at], &bytes[at + 3..]));
    let path = FOLDER.join("a.obj");
    fs::write(&path, obj).expect("room for a file");
    fs::write(FOLDER.join("a.mtl"), mtl).expect("room for a file");
    let strict = read(&path, false);
    let lenient = read(&path, true);
    match (strict, lenient) {
        // The option changes nothing where there is nothing to drop. Debug text: NaN would differ from itself.
        (Some(strict), lenient) => assert_eq!(Some(format!("{strict:?}")), lenient.map(|s| format!("{s:?}"))),
        (None, _) => {}
    }
});

fn read(path: &Path, drop_non_finite: bool) -> Option<Scene> {
    match read_obj(path, &ObjOptions { drop_non_finite, ..ObjOptions::default() }) {
        Ok(scene) => {
            promises::check(&scene);
            Some(scene)
        }
        Err(Error::Input { problem, remedy, line, .. }) => {
            assert!(!problem.is_empty() && remedy.ends_with('.') && line != Some(0));
            None
        }
        // A few bytes can stand for more than there is.
        Err(Error::Limit(_)) => None,
        Err(other) => panic!("not an error of a file: {other:?}"),
    }
}
