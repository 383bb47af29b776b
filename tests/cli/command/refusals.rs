//! What is refused: with the right exit code, with a message that names the culprit, and with nothing written.

use common::place;

use super::SQUARES;

/// Runs a line that must fail, and checks that it said why and left nothing.
fn refuse(line: &str, code: i32, named: &str) {
    let place = place!();
    place.put("squares.obj", SQUARES);
    place.put("broken.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n");
    place.put("nan.obj", "v 0 0 0\nv 1 0 0\n\nv nan 1 0\nf 1 2 3\n");
    place.put("number.obj", "v 0 0 0\nv 1 zero 0\n");
    place.put("thing.fbx", "solid thing\n");
    place.put("plain", "hello\n");
    place.put("binary.obj", [0_u8, 159, 146, 150]);
    std::fs::create_dir(place.path("folder.obj")).expect("a directory");
    std::fs::create_dir(place.path("folder.png")).expect("a directory");
    let before = place.names();
    let run = place.run(line);
    assert_eq!(run.code, Some(code), "umbel {line}\n{}", run.stderr);
    assert_eq!(run.stdout, "", "umbel {line}");
    assert!(run.stderr.starts_with("error: "), "umbel {line}\n{}", run.stderr);
    assert!(run.stderr.contains(named), "umbel {line}: {named}?\n{}", run.stderr);
    assert!(!run.stderr.contains("panicked"), "umbel {line}");
    assert_eq!(place.names(), before, "umbel {line}");
}

#[test]
fn cameras_that_see_nothing() {
    for (line, named) in [
        ("--size 0x10", "--size"),
        ("--size 10x0", "--size"),
        ("--size 10", "--size"),
        ("--size 10x10x10", "--size"),
        ("--size=-5x5", "--size"),
        ("--size 65537x1", "--size"),
        ("--size 4294967297x1", "--size"),
        ("--cube-size 0", "--cube-size"),
        ("--cube-size 40000", "--cube-size"),
        ("--eye 1,2", "--eye"),
        ("--eye 1,2,3,4", "--eye"),
        ("--eye 1,2,nan", "--eye"),
        ("--eye 1,2,inf", "--eye"),
        ("--eye 1e999,0,0", "--eye"),
        ("--target x", "--target"),
        ("--up 0,1,nan", "--up"),
        ("--up 0,0,0", "--up"),
        ("--eye 0,5,0 --target 0,0,0 --up 0,-2,0", "--up"),
        ("--eye 1,2,3 --target 1,2,3", "--target"),
        ("--eye 1,2,3 --target 1,2,3", "--eye"),
        ("--camera telescope", "--camera"),
    ] {
        refuse(&format!("render squares.obj {line}"), 2, named);
    }
}

#[test]
fn angles_and_heights_out_of_range() {
    for line in ["--fov=-5", "--fov 180", "--fov 360", "--fov nan", "--fov inf", "--fov x"] {
        refuse(&format!("render squares.obj {line}"), 2, "--fov");
    }
    for line in ["--fov 0", "--fov=-10", "--fov 361", "--fov nan"] {
        refuse(&format!("render squares.obj --camera fisheye {line}"), 2, "--fov");
        refuse(&format!("render builtin:cornell {line}"), 2, "--fov");
    }
    for line in ["--height 0", "--height=-1", "--height nan", "--height inf", "--height x"] {
        refuse(&format!("render squares.obj --camera ortho {line}"), 2, "--height");
    }
}

#[test]
fn options_that_the_lens_would_ignore() {
    for lens in ["ortho", "equirect", "cube"] {
        refuse(&format!("render squares.obj --camera {lens} --fov 40"), 2, "--fov");
    }
    for lens in ["pinhole", "equirect", "fisheye", "cube"] {
        refuse(&format!("render squares.obj --camera {lens} --height 2"), 2, "--height");
    }
}

#[test]
fn outputs_that_cannot_be_meant() {
    for (line, named) in [
        ("--aov colour=a.npy", "colour"),
        ("--aov depth", "--aov depth"),
        ("--aov depth -o a.png", "--aov"),
        ("--aov depth -o a.npy", "--aov"),
        ("--aov depth=a.txt", "a.txt"),
        ("--aov depth=", "--aov"),
        ("-o a.jpg", "a.jpg"),
        ("-o a", "-o"),
        ("-o", "--output"),
        ("--report", "--report"),
    ] {
        refuse(&format!("render squares.obj {line}"), 2, named);
    }
}

#[test]
fn options_out_of_range() {
    for (line, named) in [
        ("--samples 0", "--samples"),
        ("--samples 5000", "--samples"),
        ("--repeat 0", "--repeat"),
        ("--threads x", "--threads"),
        ("--threads=-1", "--threads"),
        ("--path straight", "--path"),
        ("--accuracy high", "--accuracy"),
        ("--max-memory lots", "--max-memory"),
        ("--max-memory 5Q", "--max-memory"),
        ("--max-memory nan", "--max-memory"),
        ("--color blue", "--color"),
        ("-q -v", "--quiet"),
        ("--nothing", "--nothing"),
        ("more.obj", "more.obj"),
    ] {
        refuse(&format!("render squares.obj {line}"), 2, named);
    }
    refuse("paint", 2, "paint");
    refuse("render builtin:nothing", 2, "builtin:nothing");
    refuse("render builtin:umbel:5", 2, "builtin:umbel:5");
    refuse("render builtin:umbel:many", 2, "builtin:umbel:many");
}

#[test]
fn input_that_cannot_be_read() {
    for verb in ["render", "probe --center 0,0,0", "visible", "verify", "info"] {
        for (file, named) in [
            ("absent.obj", "absent.obj"),
            ("absent.xyz", "absent.xyz"),
            ("broken.obj", "broken.obj:3"),
            ("nan.obj", "nan.obj:4"),
            ("number.obj", "number.obj:2"),
            ("thing.fbx", ".fbx"),
            ("thing.fbx", ".obj"),
            ("plain", "plain"),
            ("binary.obj", "binary.obj"),
            ("folder.obj", "folder.obj"),
        ] {
            refuse(&format!("{verb} {file}"), 3, named);
        }
    }
}

#[test]
fn a_limit_stops_before_the_start() {
    refuse("render squares.obj --max-memory 1", 4, "--max-memory");
    refuse("render squares.obj --max-memory 10k", 4, "--max-memory");
    refuse("render --size 65536x65535 --max-memory 1G", 4, "--size");
    refuse("verify squares.obj --max-memory 1k", 4, "--max-memory");
    place!().quiet_run("render builtin:cornell --size 64x64 --max-memory 16M -o a.png");
}

#[test]
fn places_that_cannot_be_written() {
    refuse("render squares.obj --size 8x8 -o no/such/a.png", 1, "no/such");
    refuse("render squares.obj --size 8x8 -o folder.png", 1, "folder.png");
    refuse("render squares.obj --size 8x8 -o plain/a.png", 1, "plain");
    refuse("render squares.obj --size 8x8 --aov id=no/a.npy", 1, "no/a.npy");
    refuse("render squares.obj --size 8x8 --aov id=no/a.npy -o a.png", 1, "no/a.npy");
}

#[test]
fn verify_says_where_it_cannot_draw() {
    let place = place!();
    let run = place.run("verify builtin:cornell --size 8x8 --difference no/a.png");
    assert_eq!(run.code, Some(1));
    assert!(run.stdout.contains("0 really differ"), "the counts are there");
    assert!(run.stderr.contains("no/a.png"), "{}", run.stderr);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    let place = place!();
    std::os::unix::fs::symlink("/dev/full", place.path("full.png")).expect("a link");
    let run = place.run("render builtin:cornell --size 8x8 -o full.png");
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
    assert!(run.stderr.contains("no space"), "{}", run.stderr);
    assert_eq!(place.names(), ["full.png"]);
}
