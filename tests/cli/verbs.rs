//! `verify`, `info`, help and version.

use crate::SQUARES;
use crate::support::Place;

#[test]
fn verify_finds_nothing_on_built_in_scenes() {
    let place = Place::new();
    for line in [
        "verify builtin:cornell --size 160x120",
        "verify builtin:umbel:5000 --size 160x90",
        "verify builtin:umbel:3000 --camera ortho --size 90x70 --accuracy exact",
        "verify builtin:cornell --camera cube --cube-size 40 --eye 278,273,200",
    ] {
        let run = place.run(line);
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{line}");
        assert!(run.stdout.contains(" rays, "), "{}", run.stdout);
        assert!(run.stdout.contains("general path: 0 differences"), "{}", run.stdout);
        assert!(run.stdout.contains("0 really differ"), "{}", run.stdout);
    }
}

/// tiny-skia draws straight lines only; the paths are compared all the same.
#[test]
fn verify_takes_curved_lenses() {
    let run = Place::new().run("verify builtin:umbel:2000 --camera fisheye --size 60x60");
    assert_eq!(run.code, Some(0));
    assert!(run.stdout.contains("general path: 0 differences"), "{}", run.stdout);
}

#[test]
fn verify_draws_its_differences() {
    let place = Place::new();
    let run = place.run("verify builtin:cornell --size 50x40 --difference d.png");
    assert_eq!(run.code, Some(0));
    let (width, height, pixels) = umbel::files::read_png_rgb8(&place.path("d.png")).expect("a picture");
    assert_eq!((width, height), (50, 40));
    assert!(pixels.chunks(3).all(|p| p != [235, 30, 30]), "red is a real difference");
}

#[test]
fn info_as_text_and_json() {
    let place = Place::new();
    place.put("a.obj", format!("{SQUARES}v 9 9 9\nf 1 1 2\nf 7 5 6\n"));
    let run = place.run("info a.obj");
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    for line in ["triangles        5", "vertices         8", "unused vertices  1", "degenerate       1"] {
        assert!(run.stdout.contains(line), "{line}\n{}", run.stdout);
    }
    let run = place.run("info a.obj --json");
    let value: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(value["triangles"], 5);
    assert_eq!(value["duplicates"], 1);
    assert_eq!(value["objects"], 2);
    assert_eq!(value["non_finite"], 0);
    assert_eq!(value["bounds"]["lo"], serde_json::json!([-3.0, -1.0, -1.0]));
    assert_eq!(value["bounds"]["hi"], serde_json::json!([3.0, 3.0, 0.0]));
    assert_eq!(place.names(), ["a.obj"]);
}

#[test]
fn what_is_not_finite_can_be_dropped() {
    let place = Place::new();
    place.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 nan 0\nf 1 2 3\nf 2 4 3\n");
    let run = place.run("render a.obj --drop-non-finite --size 9x9 --aov id=id.npy");
    assert_eq!(run.code, Some(0));
    assert!(run.stderr.starts_with("warning: "), "{}", run.stderr);
    assert!(place.npy("id.npy").u32().contains(&0));
}

#[test]
fn help_and_version() {
    let place = Place::new();
    let version = place.run("--version");
    assert_eq!(version.code, Some(0));
    assert_eq!(version.stdout, format!("umbel {}\n", env!("CARGO_PKG_VERSION")));
    let help = place.run("--help");
    assert_eq!((help.code, help.stderr.as_str()), (Some(0), ""));
    for word in [
        "render",
        "probe",
        "visible",
        "verify",
        "info",
        "Exit codes",
        "--threads",
        "--report",
        "--max-memory",
    ] {
        assert!(help.stdout.contains(word), "{word}");
    }
    for (verb, words) in [
        ("render", ["--aov", "--samples", "--eye", "--cube-size", "builtin:umbel"]),
        ("probe", ["--center", "--pattern", "--camera", "--aov", "equirect"]),
        ("visible", ["--views", "--objects", "--output", "--eye", "--cube-size"]),
        ("bake", ["--vertices", "--points", "--max-distance", "--falloff", "--occluders"]),
        ("verify", ["--difference", "--fov", "--up", "--height", "builtin:cornell"]),
        ("info", ["--json", "--quiet", "--verbose", "--color", "builtin:umbel"]),
    ] {
        let help = place.run(&format!("{verb} --help"));
        assert_eq!(help.code, Some(0));
        for word in words {
            assert!(help.stdout.contains(word), "{verb}: {word}");
        }
    }
    let nothing = place.run("");
    assert_eq!(nothing.code, Some(2), "without a verb the help is shown");
    assert!(nothing.stderr.contains("Usage"));
    assert!(place.names().is_empty());
}
