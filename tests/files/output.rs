//! Output files from outside: whole or not at all; and raw arrays, byte by byte.

use std::fs;
use std::io::{self, SeekFrom};
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use umbel::Error;
use umbel::files::{Array, write_atomically, write_npy};

/// A directory of its own for each test.
fn directory() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// The names in a directory, sorted.
fn names(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory).expect("a directory");
    let mut names: Vec<PathBuf> =
        entries.map(|entry| PathBuf::from(entry.expect("an entry").file_name())).collect();
    names.sort();
    names
}

/// What [`Error::Write`] says.
fn problem(outcome: Result<(), Error>) -> String {
    match outcome {
        Err(Error::Write { problem, .. }) => problem,
        other => panic!("expected a write error, got {other:?}"),
    }
}

/// Writes `bytes` whole.
fn put(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_atomically(path, |out| out.write_all(bytes))
}

#[test]
fn a_file_is_made_and_replaced() {
    let home = directory();
    let path = home.path().join("a.bin");
    put(&path, b"a longer first text").expect("made");
    put(&path, b"second").expect("replaced");
    assert_eq!(fs::read(&path).expect("the file"), b"second");
    assert_eq!(names(home.path()), [Path::new("a.bin")]);
}

#[test]
fn a_writer_may_seek() {
    let home = directory();
    let path = home.path().join("a.bin");
    write_atomically(&path, |out| {
        out.write_all(b"....text")?;
        out.seek(SeekFrom::Start(0))?;
        out.write_all(b"head")
    })
    .expect("written");
    assert_eq!(fs::read(&path).expect("the file"), b"headtext");
}

#[test]
fn a_failure_leaves_the_old_file_and_no_other() {
    let home = directory();
    let path = home.path().join("a.bin");
    put(&path, b"old").expect("made");
    let large = vec![1_u8; 1 << 20];
    let outcome = write_atomically(&path, |out| {
        out.write_all(&large)?;
        Err(io::ErrorKind::StorageFull.into())
    });
    assert!(problem(outcome).contains("no space is left"));
    assert_eq!(fs::read(&path).expect("the file"), b"old");
    assert_eq!(names(home.path()), [Path::new("a.bin")]);

    let fresh = home.path().join("b.bin");
    let outcome = write_atomically(&fresh, |_| Err(io::Error::other("the encoder's words")));
    assert_eq!(problem(outcome), "the encoder's words");
    assert_eq!(names(home.path()), [Path::new("a.bin")]);
}

#[test]
fn an_error_says_what_to_do() {
    let home = directory();
    let file = home.path().join("file");
    put(&file, b"x").expect("made");

    let missing = problem(put(&home.path().join("no/a.bin"), b""));
    assert!(missing.starts_with("there is no directory") && missing.contains("create it"));
    let inside_a_file = problem(put(&file.join("a.bin"), b""));
    assert!(inside_a_file.contains("not a directory"), "{inside_a_file}");
    let is_directory = problem(put(home.path(), b""));
    assert_eq!(is_directory, "this is a directory; add the name of a file");
    for no_name in [PathBuf::new(), home.path().join("new/")] {
        assert!(problem(put(&no_name, b"")).contains("cannot be the name of a file"));
    }
    let error = put(&home.path().join("no/a.bin"), b"").expect_err("no directory");
    assert!(matches!(error, Error::Write { .. }));
    assert!(error.to_string().contains("a.bin: cannot write: there is"));
    assert_eq!(names(home.path()), [Path::new("file")]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("a file").permissions().mode() & 0o7777
    }

    #[test]
    fn permissions_are_the_ordinary_ones_or_those_of_the_old_file() {
        let home = directory();
        let (ordinary, path) = (home.path().join("ordinary"), home.path().join("a.bin"));
        fs::write(&ordinary, b"").expect("made");
        put(&path, b"1").expect("made");
        assert_eq!(mode(&path), mode(&ordinary));
        for kept in [0o600, 0o640, 0o666, 0o755] {
            fs::set_permissions(&path, fs::Permissions::from_mode(kept)).expect("set");
            put(&path, b"2").expect("replaced");
            assert_eq!(mode(&path), kept);
        }
    }

    #[test]
    fn what_must_not_be_written_is_not() {
        let home = directory();
        let path = home.path().join("a.bin");
        put(&path, b"old").expect("made");
        for (protected, mode, back) in [(&*path, 0o444, 0o644), (home.path(), 0o555, 0o755)] {
            fs::set_permissions(protected, fs::Permissions::from_mode(mode)).expect("set");
            // The superuser may write everywhere.
            let outcome = put(&path, b"new");
            let is_superuser = outcome.is_ok();
            if !is_superuser {
                assert!(problem(outcome).starts_with("permission denied; choose another"));
                assert_eq!(fs::read(&path).expect("the file"), b"old");
            }
            fs::set_permissions(protected, fs::Permissions::from_mode(back)).expect("set");
            assert_eq!(names(home.path()), [Path::new("a.bin")]);
        }
    }

    #[test]
    fn a_link_stays_a_link() {
        let home = directory();
        fs::create_dir(home.path().join("far")).expect("made");
        let (far, link) = (home.path().join("far/a.bin"), home.path().join("link"));
        put(&far, b"old").expect("made");
        symlink("far/a.bin", &link).expect("linked");
        put(&link, b"new").expect("written");
        assert!(link.is_symlink());
        assert_eq!(fs::read(&far).expect("the file"), b"new");
        assert_eq!(names(&home.path().join("far")), [Path::new("a.bin")]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_are_written_and_not_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let null = Path::new("/dev/null");
        write_npy(null, &[2], Array::F32(&[1.0, 2.0])).expect("swallowed");
        assert!(problem(put(Path::new("/dev/full"), b"x")).contains("no space is left"));
        put(Path::new("/dev/full"), b"").expect("nothing needs no space");
        for device in ["/dev/null", "/dev/full"] {
            let kind = fs::metadata(device).expect("a device").file_type();
            assert!(kind.is_char_device());
        }
    }
}

/// The header of an NPY file as a text, and the bytes behind it.
fn split_npy(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).expect("the file");
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!(end % 16, 0, "numbers are aligned");
    let header = String::from_utf8(bytes[10..end].to_vec()).expect("a text");
    (header.replace(' ', ""), bytes[end..].to_vec())
}

#[test]
fn npy_is_little_endian_in_c_order() {
    let home = directory();
    let path = home.path().join("a.npy");
    let floats = [1.0, -0.0, f32::INFINITY, f32::from_bits(0x7fc0_1234), 1e-45, 2.5];
    write_npy(&path, &[2, 1, 3], Array::F32(&floats)).expect("written");
    let (header, data) = split_npy(&path);
    assert!(header.contains("'descr':'<f4'"), "{header}");
    assert!(header.contains("'fortran_order':False"), "{header}");
    assert!(header.contains("'shape':(2,1,3"), "{header}");
    let expected: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(data, expected);

    let ids: Vec<u32> = (0..10_000).map(|i| u32::MAX - i).collect();
    write_npy(&path, &[10_000], Array::U32(&ids)).expect("written");
    let (header, data) = split_npy(&path);
    assert!(header.contains("'descr':'<u4'"), "{header}");
    assert!(header.contains("'shape':(10000,)"), "{header}");
    let expected: Vec<u8> = ids.iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(data, expected);
}

#[test]
fn npy_of_a_wrong_shape_is_refused() {
    let home = directory();
    let path = home.path().join("a.npy");
    for shape in [&[3][..], &[2, 2, 2], &[usize::MAX, 3], &[0], &[]] {
        let said = problem(write_npy(&path, shape, Array::U32(&[1, 2, 3, 4])));
        assert!(said.contains("cannot hold 4 numbers"), "{said}");
    }
    assert!(names(home.path()).is_empty());
    write_npy(&path, &[0, 3], Array::F32(&[])).expect("an empty array");
    write_npy(&path, &[], Array::F32(&[1.0])).expect("a single number");
    assert!(split_npy(&path).0.contains("'shape':()"));
}
