//! Any bytes as a glTF or GLB file: a scene that keeps its promises, or an error with a remedy; and what is read is patched, written
//! and read again as the same triangles.
//!
//! `GltfFile` takes a path, so all are files in the temporary directory; point TMPDIR at memory (/dev/shm) to spare the disk.

#![no_main]

use std::path::Path;
use std::sync::LazyLock;
use std::{env, fs, process};

use libfuzzer_sys::fuzz_target;
use umbel::{Error, Scene};
use umbel::formats::{GltfFile, GltfOptions, VertexTarget};

#[path = "../promises.rs"]
mod promises;

/// A directory of this process, so that several may run.
static FOLDER: LazyLock<std::path::PathBuf> = LazyLock::new(|| {
    let folder = env::temp_dir().join(format!("umbel-fuzz-{}", process::id()));
    fs::create_dir_all(&folder).expect("a temporary directory");
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let path = FOLDER.join("a.glb");
    fs::write(&path, bytes).expect("room for a file");
    let strict = read(&path, false);
    let lenient = read(&path, true);
    if let Some((_, strict)) = &strict {
        // The option changes nothing where there is nothing to drop. Debug text: NaN would differ from itself.
        assert_eq!(format!("{strict:?}"), format!("{:?}", lenient.as_ref().expect("as lenient").1));
    }
    for (mut file, scene) in [strict, lenient].into_iter().flatten() {
        let openness = vec![0.5; scene.positions.len()];
        for target in [VertexTarget::Ao, VertexTarget::Color0] {
            tolerate(file.add_vertex_occlusion(&openness, target));
        }
        tolerate(file.add_occlusion_texture(b"\x89PNG\r\n\x1a\n"));
        for name in ["b.glb", "b.gltf"] {
            let written = FOLDER.join(name);
            if file.write(&written).is_ok() {
                let (_, again) = read(&written, true).expect("what is written can be read");
                assert_eq!((again.triangles, again.positions.len()), (scene.triangles.clone(), scene.positions.len()));
            }
        }
    }
});

fn read(path: &Path, drop_non_finite: bool) -> Option<(GltfFile, Scene)> {
    match GltfFile::read(path, &GltfOptions { drop_non_finite, ..GltfOptions::default() }) {
        Ok((file, scene)) => {
            promises::check(&scene);
            let end = file.origins().iter().fold(0, |end, origin| {
                assert!(origin.triangles.start == end && origin.triangles.end >= end);
                origin.triangles.end
            });
            assert_eq!(end as usize, scene.triangles.len());
            Some((file, scene))
        }
        Err(error) => {
            tolerate::<()>(Err(error));
            None
        }
    }
}

/// Errors are about the file.
fn tolerate<T>(result: Result<T, Error>) {
    match result {
        Ok(_) => {}
        Err(Error::Input { problem, remedy, line, .. }) => {
            assert!(!problem.is_empty() && remedy.ends_with('.') && line != Some(0));
        }
        // A few bytes can stand for more than there is.
        Err(Error::Limit(_)) => {}
        Err(other) => panic!("not an error of a file: {other:?}"),
    }
}
