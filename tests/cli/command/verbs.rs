//! `verify`, `info`, help and version.

use common::place;

use super::SQUARES;

#[test]
fn verify_finds_nothing_on_built_in_scenes() {
    let place = place!();
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
    let run = place!().run("verify builtin:umbel:2000 --camera fisheye --size 60x60");
    assert_eq!(run.code, Some(0));
    assert!(run.stdout.contains("general path: 0 differences"), "{}", run.stdout);
}

#[test]
fn verify_draws_its_differences() {
    let place = place!();
    let run = place.run("verify builtin:cornell --size 50x40 --difference d.png");
    assert_eq!(run.code, Some(0));
    let (width, height, pixels) = umbel::files::read_png_rgb8(&place.path("d.png")).expect("a picture");
    assert_eq!((width, height), (50, 40));
    assert!(pixels.chunks(3).all(|p| p != [235, 30, 30]), "red is a real difference");
}

#[test]
fn info_as_text_and_json() {
    let place = place!();
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
    let place = place!();
    place.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 nan 0\nf 1 2 3\nf 2 4 3\n");
    let run = place.run("render a.obj --drop-non-finite --size 9x9 --aov id=id.npy");
    assert_eq!(run.code, Some(0));
    assert!(run.stderr.starts_with("warning: "), "{}", run.stderr);
    assert!(place.npy("id.npy").u32().contains(&0));
}

#[test]
fn help_and_version() {
    let place = place!();
    let version = place.run("--version");
    assert_eq!(version.code, Some(0));
    assert!(
        version.stdout.starts_with(&format!("umbel {}\n", env!("CARGO_PKG_VERSION"))),
        "{}",
        version.stdout
    );
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

/// Straight down, north is up as on a map, and straight up +X stays on the right. Nobody has to say so.
#[test]
fn views_along_y_need_no_up() {
    let place = place!();
    // Seen from +Y: a square at positive x and z.
    place.put("a.obj", "v 1 0 1\nv 2 0 1\nv 2 0 2\nv 1 0 2\nf 1 2 3 4\n");
    let ids = |line: &str| {
        place.quiet_run(&format!("{line} --aov id=i.npy"));
        place.npy("i.npy").u32()
    };
    for (eye, up) in [("0,9,0", "0,0,-1"), ("0,-9,0", "0,0,1")] {
        for camera in [
            "--size 20x20",
            "--size 20x20 --camera ortho --height 6",
            "--size 20x20 --camera fisheye --fov 60",
        ] {
            let line = format!("render a.obj --eye {eye} --target 0,0,0 {camera}");
            let seen = ids(&line);
            assert_eq!(seen, ids(&format!("{line} --up {up}")), "{line}");
            let hit = |quarter: [usize; 2]| {
                let at = |k: usize| seen[(quarter[1] * 10 + k / 10) * 20 + quarter[0] * 10 + k % 10];
                (0..100).any(|k| at(k) != umbel::NO_TRIANGLE)
            };
            // To the right; below the middle, since +Z is below looking down and above looking up.
            let row = usize::from(eye == "0,9,0");
            assert!(hit([1, row]) && !hit([0, row]) && !hit([1, 1 - row]), "{line}");
        }
    }
    ids("probe a.obj --center 0,5,0 --target 0,0,0 --camera fisheye --size 9x9");
    let run = place.run("render a.obj --eye 0,9,0 --target 0,0,0 --up 0,1,0 --size 9x9");
    assert_eq!(run.code, Some(2), "an up that is given is not replaced");
}

#[test]
fn more_threads_than_help_are_not_started() {
    let place = place!();
    place.put("a.obj", SQUARES);
    let run = place.run("render a.obj --size 9x9 --threads 5000 --report r.json");
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stderr.starts_with("warning: --threads 5000: "), "{}", run.stderr);
    let threads = place.json("r.json")["threads"].as_u64().expect("a number");
    assert!(run.stderr.contains(&format!("{threads} are started")), "{}", run.stderr);
    assert!(threads < 5000);
    place.quiet_run("render a.obj --size 9x9 --threads 16 --report r.json");
    assert_eq!(place.json("r.json")["threads"], 16);
}
