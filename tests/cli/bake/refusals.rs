//! What `bake` refuses: with its exit code, with a message that names the culprit, and with nothing written.

use common::place;
use umbel::Scene;
use umbel::bake::{Bake, BakeOptions, Falloff, Occluders, Reach, SampleSet};
use umbel::engine::Grouping;
use umbel::glam::DVec3;

use super::{FLOOR, npy, npy_points};

/// A point on the floor.
const POINT: [f32; 6] = [0.0, 0.0, 6.0, 0.0, 1.0, 0.0];

/// Runs a line that must fail, and checks that it said why and left nothing.
fn refuse(line: &str, code: i32, named: &str) {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("p.npy", npy_points(&[POINT, POINT]));
    for (name, column, value) in
        [("nan", 1, f32::NAN), ("inf", 0, f32::INFINITY), ("zero", 4, 0.0), ("dark", 4, f32::NAN)]
    {
        let mut bad = POINT;
        bad[column] = value;
        place.put(&format!("{name}.npy"), npy_points(&[POINT, bad]));
    }
    place.put("five.npy", npy("<f4", "2, 5", &[0; 40]));
    place.put("flat.npy", npy("<f4", "12,", &[0; 48]));
    place.put("whole.npy", npy("<i8", "1, 6", &[0; 48]));
    let ids = |ids: [u32; 2]| ids.map(u32::to_le_bytes).concat();
    place.put("ids.npy", npy("<u4", "2,", &ids([0, 1])));
    place.put("range.npy", npy("<u4", "2,", &ids([3, 4])));
    place.put("below.npy", npy("<i4", "2,", &ids([0, u32::MAX - 1])));
    place.put("one.npy", npy("<u4", "1,", &[0; 4]));
    place.put("pairs.npy", npy("<u4", "2, 1", &ids([0, 1])));
    let before = place.names();
    let run = place.run(line);
    assert_eq!(run.code, Some(code), "umbel {line}\n{}", run.stderr);
    assert_eq!(run.stdout, "", "umbel {line}");
    assert!(run.stderr.starts_with("error: "), "umbel {line}\n{}", run.stderr);
    assert!(run.stderr.contains(named), "umbel {line}: {named}?\n{}", run.stderr);
    assert_eq!(place.names(), before, "umbel {line}");
}

#[test]
fn options_that_cannot_be_meant() {
    for (line, named) in [
        ("--texels 8", "-o FILE"),
        ("--texels 8 -o a.ply", ".exr"),
        ("--texels 8 --vertices -o a.npy", "--texels"),
        ("--texels 8 --points p.npy -o a.npy", "--texels"),
        ("--vertices -o a.npy --texel-samples 4", "--texel-samples"),
        ("--vertices -o a.npy --margin 4", "--margin"),
        ("--vertices -o a.npy --coverage c.npy", "--coverage"),
        ("--texels 8 -o a.npy --coverage c.ply", "--coverage"),
        ("--texels 8 -o a.npy --bits 16", "--bits"),
        ("--texels 8 -o a.png --bits 12", "--bits"),
        ("--vertices", "-o FILE"),
        ("--vertices -o a.jpg", "a.jpg"),
        ("--vertices -o a", ".ply"),
        ("--vertices --bent a.exr", "--bent"),
        ("--vertices --dump-rays a.txt", "--dump-rays"),
        ("--vertices -o a.npy --bent a.npy", "a.npy"),
        ("--vertices --points p.npy -o a.npy", "--points"),
        ("--vertices --point-ids ids.npy -o a.npy", "--points"),
        ("--vertices --bias 1 -o a.npy", "--points"),
        ("--points p.npy --bias nan -o a.npy", "--bias"),
        ("--vertices -o a.npy --up 0,1,0", "--ground-plane"),
        ("--vertices -o a.npy --ground-plane --up 0,0,0", "--up"),
        ("--vertices -o a.npy --ground-plane --up 0,1", "--up"),
        ("--vertices -o a.npy --falloff linear", "--max-distance"),
        ("--vertices -o a.npy --falloff linear --max-distance 0%", "--max-distance"),
        ("--vertices -o a.npy --set independent --group direction", "--group"),
        ("--vertices -o a.npy --depth-maps 64 --set independent", "--set shared"),
        ("--vertices -o a.npy --depth-maps 64 --max-distance 5%", "--max-distance"),
        ("--vertices -o a.npy --depth-maps 64 --ignore-back-faces", "--ignore-back-faces"),
        ("--vertices -o a.npy --depth-maps 64 --group origin", "--group"),
        ("--vertices -o a.npy --depth-maps 64 --max-error 0.1", "--depth-maps"),
        ("--vertices -o a.npy --depth-maps 64 --occluders builtin:teapot", "surfaces on demand"),
    ] {
        refuse(&format!("bake floor.obj {line}"), 2, named);
    }
}

#[test]
fn numbers_out_of_range() {
    for (line, named) in [
        ("--rays 0", "--rays"),
        ("--texels 0", "--texels"),
        ("--texels 65536", "--texels"),
        ("--texel-samples 65", "--texel-samples"),
        ("--margin=-1", "--margin"),
        ("--rays 65537", "--rays"),
        ("--rays x", "--rays"),
        ("--depth-maps 0", "--depth-maps"),
        ("--depth-maps 8193", "--depth-maps"),
        ("--max-distance=-1", "--max-distance"),
        ("--max-distance nan", "--max-distance"),
        ("--max-distance inf", "--max-distance"),
        ("--max-distance 10%%", "--max-distance"),
        ("--max-distance %", "--max-distance"),
        ("--seed=-1", "--seed"),
        ("--set all", "--set"),
        ("--weighting flat", "--weighting"),
        ("--falloff square", "--falloff"),
        ("--polarity black", "--polarity"),
        ("--group both", "--group"),
    ] {
        refuse(&format!("bake floor.obj --vertices -o a.npy {line}"), 2, named);
    }
}

#[test]
fn points_that_are_none() {
    for (file, named) in [
        ("nan.npy", "row 1"),
        ("inf.npy", "row 1"),
        ("zero.npy", "normal"),
        ("dark.npy", "normal"),
        ("five.npy", "[2, 5]"),
        ("flat.npy", "[12]"),
        ("whole.npy", "<i8"),
        ("absent.npy", "absent.npy"),
        ("floor.obj", "NPY"),
    ] {
        refuse(&format!("bake floor.obj --points {file} -o a.npy"), 3, named);
    }
    refuse("bake floor.obj --points p.npy --bias 1e39 -o a.npy", 3, "row 0");
    for (file, named) in [
        ("range.npy", "triangle 4"),
        ("range.npy", "row 1"),
        ("below.npy", "triangle -2"),
        ("one.npy", "[1] for 2 points"),
        ("pairs.npy", "[2, 1]"),
        ("p.npy", "<u4"),
        ("absent.npy", "absent.npy"),
    ] {
        refuse(&format!("bake floor.obj --points p.npy --point-ids {file} -o a.npy"), 3, named);
    }
}

#[test]
fn scenes_and_places() {
    refuse("bake absent.obj --vertices -o a.npy", 3, "absent.obj");
    refuse("bake floor.obj --vertices --occluders absent.obj -o a.npy", 3, "absent.obj");
    refuse("bake floor.obj -o a.png", 3, "texture coordinates");
    refuse("bake floor.obj --vertices -o nowhere/a.npy", 1, "nowhere");
    refuse("bake floor.obj --vertices -o nowhere/a.ply", 1, "nowhere");
    // All places are looked at before the first file is written, and before the work begins.
    refuse("bake floor.obj --vertices -o a.npy --bent nowhere/b.npy", 1, "nowhere");
    refuse("bake floor.obj --vertices -o a.npy --report nowhere/r.json", 1, "nowhere");
    refuse("bake builtin:umbel:100000 --vertices -o floor.obj/a.npy --rays 65536", 1, "floor.obj");
}

#[test]
fn limits_stop_before_the_start() {
    for (line, named) in [
        ("--vertices -o a.npy --max-memory 500", "--max-memory"),
        ("--points p.npy -o a.npy --max-memory 300", "--points"),
        ("--vertices --dump-rays d.npy --rays 60000 --max-memory 20M", "--max-memory"),
    ] {
        refuse(&format!("bake floor.obj {line}"), 4, named);
    }
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.quiet_run("bake floor.obj --vertices -o a.npy --max-memory 16M");
    place.put("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    let run = place.run("bake one.obj --texels 2000 -o b.png --max-memory 16M");
    assert!(run.code == Some(4) && run.stderr.contains("--texels"), "{}", run.stderr);
    assert_eq!(place.names(), ["a.npy", "floor.obj", "one.obj"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    let place = place!();
    std::os::unix::fs::symlink("/dev/full", place.path("full.npy")).expect("a link");
    std::os::unix::fs::symlink("/dev/full", place.path("full.ply")).expect("a link");
    for name in ["full.npy", "full.ply"] {
        let run = place.run(&format!("bake builtin:cornell --vertices -o {name}"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
        assert!(run.stderr.contains("no space"), "{}", run.stderr);
    }
    assert_eq!(place.names(), ["full.npy", "full.ply"]);
}

#[test]
fn the_library_refuses_too() {
    let fine = BakeOptions::default();
    let reach = |max_distance, falloff| Reach { max_distance, falloff, min_distance: 0.0 };
    for (options, named) in [
        (BakeOptions { rays: 0, ..fine }, "0 rays"),
        (BakeOptions { rays: 65_537, ..fine }, "65537 rays"),
        (BakeOptions { reach: reach(f64::NAN, Falloff::None), ..fine }, "NaN"),
        (BakeOptions { reach: reach(-1.0, Falloff::None), ..fine }, "-1"),
        (BakeOptions { reach: reach(0.0, Falloff::Linear), ..fine }, "linear"),
        (BakeOptions { set: SampleSet::Independent, grouping: Grouping::Direction, ..fine }, "origin"),
    ] {
        let error = Bake::new(options).expect_err("out of range");
        assert!(
            matches!(error, umbel::Error::Usage(_)) && error.to_string().contains(named),
            "{named}: {error}"
        );
    }
    let huge = Scene {
        positions: vec![[3e38, 0.0, 0.0], [0.0, 3e38, 0.0], [0.0, 0.0, 3e38]],
        triangles: vec![[0, 1, 2]],
        ..Scene::default()
    };
    let error = Occluders::new(&huge).add_ground(DVec3::Y).expect_err("too large");
    assert!(error.to_string().contains("too large"), "{error}");
}
