//! Files of directions that are none, and options that cannot be meant: a message that says where and what to do.

use common::command::Place;
use common::place;
use umbel::glam::DVec3;

use super::{BOX, directions, f8, npy, npy_with_header};

/// Runs `probe` with more words; it must fail, say why, and write nothing.
fn refuse(place: &Place, more: &str, code: i32, named: &[&str]) {
    let before = place.names();
    let run = place.run(&format!("probe box.obj {more}"));
    assert_eq!(run.code, Some(code), "{more}\n{}", run.stderr);
    assert_eq!(run.stdout, "", "{more}");
    assert!(run.stderr.starts_with("error: "), "{more}\n{}", run.stderr);
    for word in named {
        assert!(run.stderr.contains(word), "{more}: {word}?\n{}", run.stderr);
    }
    assert_eq!(place.names(), before, "{more}");
}

fn place() -> Place {
    let place = place!();
    place.put("box.obj", BOX);
    place
}

/// Checks that a file is refused as a pattern.
fn refuse_file(bytes: &[u8], named: &[&str]) {
    let place = place();
    place.put("bad.npy", bytes);
    let line = "--center 0,0,0 --pattern bad.npy --aov distance=range.npy";
    refuse(&place, line, 3, &[&["bad.npy", "\n  "], named].concat());
}

#[test]
fn what_is_no_array() {
    let good = directions(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    for (cut, named) in [(0, "no NPY file"), (7, "no NPY file"), (9, "header"), (60, "header")] {
        refuse_file(&good[..cut], &[named]);
    }
    refuse_file(&good[..good.len() - 1], &["ends after 5 of 6"]);
    refuse_file(&good[..128], &["ends after 0 of 6"]);
    refuse_file(&[good.as_slice(), &[0]].concat(), &["bytes follow", "6 numbers"]);
    refuse_file(b"1 0 0\n0 1 0\n", &["no NPY file"]);
    refuse_file(b"PK\x03\x04 an archive", &["no NPY file"]);
    let version = |major: u8| [b"\x93NUMPY".as_slice(), &[major, 0], &good[8..]].concat();
    refuse_file(&version(9), &["version 9.0"]);
    refuse_file(&version(2), &["header"]);
}

#[test]
fn what_is_another_array() {
    let data = f8(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    for descr in [">f8", "<f2", "<i8", "<u4", "|b1", "<c8", "|O", "<f16"] {
        refuse_file(&npy(descr, false, "(2, 3)", &data), &[descr, "<f4", "astype"]);
    }
    refuse_file(&npy("<f8", true, "(2, 3)", &data), &["Fortran", "ascontiguousarray"]);
    for (shape, named) in [
        ("(6,)", "[6]"),
        ("(3,)", "[3]"),
        ("(3, 2)", "[3, 2]"),
        ("(2, 3, 1)", "[2, 3, 1]"),
        ("(6, 1)", "[6, 1]"),
        ("()", "ends after|follow"),
        ("(3, 3)", "ends after 6 of 9"),
        ("(1, 3)", "bytes follow"),
        ("(4611686018427387904, 3)", "fits no memory"),
        ("(288230376151711744, 3)", "ends after 6"),
        ("(99999999999999999999, 3)", "header cannot be read"),
        ("(-2, 3)", "header cannot be read"),
    ] {
        let words: Vec<&str> = if named.contains('|') { vec![] } else { vec![named] };
        refuse_file(&npy("<f8", false, shape, &data), &words);
    }
}

#[test]
fn what_is_no_header() {
    let data = f8(&[1.0, 0.0, 0.0]);
    for header in [
        "",
        "{}",
        "{",
        "not a dictionary",
        "{'descr': '<f8', 'fortran_order': False}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3), 'more': 1}",
        "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (1, 3)}",
        "{'descr': '<f8', 'fortran_order': Maybe, 'shape': (1, 3)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': 3}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1, x)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3}",
        "{'descr': '<f8' 'fortran_order': False, 'shape': (1, 3)}",
        "{'descr: '<f8', 'fortran_order': False, 'shape': (1, 3)}",
        "{descr: '<f8', 'fortran_order': False, 'shape': (1, 3)}",
    ] {
        refuse_file(&npy_with_header(header, &data), &["header cannot be read"]);
    }
    let fields = "{'descr': [('x', '<f8'), ('y', '<f8')], 'fortran_order': False, 'shape': (1,)}";
    refuse_file(&npy_with_header(fields, &data), &["'x'", "<f8"]);
    let deep = format!("{{'descr': {}, ", "[".repeat(60000));
    let long = u32::try_from(deep.len()).expect("short").to_le_bytes();
    let deep = [b"\x93NUMPY\x02\x00".as_slice(), &long, deep.as_bytes()].concat();
    refuse_file(&deep, &["header"]);
}

/// Each byte of a header changed, each length of a file: the same rays, or an error about the file.
#[test]
fn changed_bytes() {
    let place = place();
    let (good, path) = (directions(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), place.path("changed.npy"));
    let try_bytes = |bytes: &[u8]| {
        place.put("changed.npy", bytes);
        match umbel::formats::read_pattern(&path, DVec3::ZERO) {
            Ok(pattern) => assert!(pattern.shot.pencil.len() <= 3, "{:?}", pattern.shape),
            Err(error) => assert!(matches!(error, umbel::Error::Input { .. }), "{error}"),
        }
    };
    for (at, &byte) in good[..128].iter().enumerate() {
        for change in [0, b' ', b'\'', b'(', b')', b'[', b',', b'9', b':', byte ^ 1, byte ^ 4, 0x80, 255] {
            let mut bytes = good.clone();
            bytes[at] = change;
            try_bytes(&bytes);
        }
    }
    (0..good.len()).for_each(|length| try_bytes(&good[..length]));
}

/// What other writers do: Python 2 wrote long integers, some leave out the last comma or turn the fields round, some pad to
/// 16 bytes, versions 2 and 3 have longer lengths.
#[test]
fn headers_of_other_writers() {
    let place = place();
    let data = f8(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let read = |bytes: &[u8]| {
        place.put("good.npy", bytes);
        place.quiet_run("probe box.obj --center 0,0,0 --pattern good.npy --aov distance=range.npy");
        assert_eq!(place.npy("range.npy").f32(), [5.0, 4.0]);
    };
    for header in [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2L, 3L), }",
        "{'shape':(2,3),'fortran_order':False,'descr':'<f8'}",
        "{\"descr\": \"<f8\", \"fortran_order\": False, \"shape\": (2, 3,)}",
        "{ 'descr' : '<f8' , 'fortran_order' : False , 'shape' : ( 2 , 3 ) , }",
    ] {
        read(&npy_with_header(header, &data));
    }
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";
    let length = u32::try_from(header.len()).expect("short").to_le_bytes();
    for major in [2, 3] {
        read(&[b"\x93NUMPY".as_slice(), &[major, 0], &length, header.as_bytes(), &data].concat());
    }
}

#[test]
fn directions_that_are_none() {
    let place = place();
    for (bad, named) in [
        ([0.0; 3], "must not be zero"),
        ([0.0, -0.0, 0.0], "must not be zero"),
        ([1.0, f64::NAN, 0.0], "NaN"),
        ([f64::INFINITY, 0.0, 0.0], "inf"),
        ([1.0, 1e-80, 0.0], "2^-240"),
        ([1e60, 0.0, 0.0], "2^190"),
    ] {
        let mut list = vec![[0.0, 0.5, 1.0]; 20];
        list[13] = bad;
        list[17] = [0.0; 3];
        place.put("bad.npy", directions(&list));
        let line = "--center 0,0,0 --pattern bad.npy --aov distance=range.npy";
        refuse(&place, line, 3, &["bad.npy", "row 13", named]);
    }
}

#[test]
fn centres_that_are_none() {
    let place = place();
    place.put("good.npy", directions(&[[1.0, 0.0, 0.0]]));
    for center in ["nan,0,0", "0,inf,0", "1,2", "1,2,3,4", "x", "1e999,0,0"] {
        refuse(&place, &format!("--center {center}"), 2, &["--center"]);
    }
    refuse(&place, "", 2, &["--center"]);
    for more in ["", "--camera cube", "--pattern rings=2,columns=2", "--pattern good.npy --aov id=i.npy"] {
        refuse(&place, &format!("--center 0,0,1e39 {more}"), 2, &["origin"]);
    }
    refuse(&place, "--center 1,2,3 --target 1,2,3", 2, &["--center", "--target"]);
    refuse(&place, "--center 1,2,3 --up 0,0,0", 2, &["--up"]);
    refuse(&place, "--center 1,2,3 --target 1,3,3 --up 0,2,0", 2, &["--up"]);
}

#[test]
fn patterns_that_are_none() {
    let place = place();
    for (pattern, named) in [
        ("", "rings="),
        ("rings=4", "columns="),
        ("rings=4,columns=", "columns="),
        ("rings=0,columns=4", "rings=0"),
        ("rings=4,columns=70000", "columns=70000"),
        ("rings=4,columns=4,rings=5", "twice"),
        ("rings=4,columns=4,speed=5", "rings="),
        ("rings=4,columns=4,fov=10", "fov=10"),
        ("rings=4,columns=4,fov=a..b", "fov=a..b"),
        ("list.csv", "FILE.npy"),
    ] {
        refuse(&place, &format!("--center 0,0,0 --pattern={pattern}"), 2, &["--pattern", named]);
    }
    for fov in ["20..10", "10..10", "-91..10", "10..91", "nan..3", "-10..inf"] {
        refuse(&place, &format!("--center 0,0,0 --pattern rings=4,columns=4,fov={fov}"), 2, &["fov="]);
    }
}

#[test]
fn options_that_a_pattern_would_ignore() {
    let place = place();
    place.put("good.npy", directions(&[[1.0, 0.0, 0.0]]));
    let line = "--center 0,0,0 --pattern good.npy";
    for more in ["", "-o a.png", "-o a.npy", "-o a.exr --aov id=i.npy"] {
        refuse(&place, &format!("{line} {more}"), 2, &["-o FILE.ply", "--aov"]);
    }
    for more in ["--target 1,0,0", "--up 0,0,1", "--fov 9", "--size 9x9", "--cube-size 9", "--samples 2"] {
        let option = more.split(' ').next().expect("an option");
        refuse(&place, &format!("{line} --aov id=i.npy {more}"), 2, &[option]);
    }
    refuse(&place, &format!("{line} -o a.ply --samples 2"), 2, &["--samples"]);
    refuse(&place, &format!("{line} -o a.ply --aov id"), 2, &["--aov NAME=FILE.npy"]);
    refuse(&place, &format!("{line} --aov id"), 2, &["--aov NAME=FILE.npy"]);
    refuse(&place, "--center 0,0,0 -o a.ply --samples 2", 2, &["--samples"]);
    refuse(&place, &format!("{line} --aov id=i.npy --camera cube"), 2, &["--camera", "--pattern"]);
    refuse(&place, "--center 0,0,0 --eye 0,0,0", 2, &["--eye"]);
    for more in ["--size 9x9", "--cube-size 9", "--fov 40"] {
        let option = more.split(' ').next().expect("an option");
        refuse(&place, &format!("--center 0,0,0 --pattern rings=2,columns=2 {more}"), 2, &[option]);
    }
}

#[test]
fn a_limit_stops_before_the_start() {
    let place = place();
    place.put("list.npy", directions(&[[1.0, 0.0, 0.0]; 100]));
    let pattern = "--pattern list.npy --aov id=i.npy --max-memory 1k";
    refuse(&place, &format!("--center 0,0,0 {pattern}"), 4, &["--max-memory", "--pattern"]);
    let pattern = "--pattern rings=9,columns=99 --max-memory 1k";
    refuse(&place, &format!("--center 0,0,0 {pattern}"), 4, &["--max-memory", "--pattern"]);
    refuse(&place, "--center 0,0,0 --max-memory 1k", 4, &["--max-memory", "--size"]);
}
