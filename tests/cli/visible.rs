//! `umbel visible` from outside: the union of what `render` sees, counted, and files that hold no views.

use std::collections::BTreeSet;

use common::command::Place;
use common::place;
use serde_json::json;
use umbel::glam::DVec3;
use umbel::render::visible;
use umbel::{Camera, Lens, NO_TRIANGLE, Options, Path, builtin};

const SCENE: &str = "builtin:umbel:5000";

/// Four views as `render` takes them and as a file has them.
fn views() -> [(&'static str, serde_json::Value); 4] {
    [
        (
            "--eye 3,2,3 --target 0,1,0 --fov 50 --size 90x60",
            json!({"eye": [3, 2, 3], "target": [0, 1, 0], "fov": 50, "size": [90, 60]}),
        ),
        (
            "--eye -2,4,1 --target 0,0.5,0 --up 1,0,0 --size 40x40 --camera ortho --height 2.5",
            json!({"eye": [-2, 4, 1], "target": [0, 0.5, 0], "up": [1, 0, 0], "size": [40, 40], "camera": "ortho", "height": 2.5}),
        ),
        (
            "--eye 0.2,1.5,0.3 --camera cube --cube-size 24",
            json!({"eye": [0.2, 1.5, 0.3], "camera": "cube", "cube_size": 24}),
        ),
        (
            "--eye 0,0.4,0.9 --target 0,1,0 --camera fisheye --size 50x50",
            json!({"eye": [0, 0.4, 0.9], "target": [0, 1, 0], "camera": "fisheye", "size": [50, 50]}),
        ),
    ]
}

/// The ids that `render` sees through some camera options, each once.
fn rendered(place: &Place, scene: &str, camera: &str) -> BTreeSet<u32> {
    place.quiet_run(&format!("render {scene} {camera} --aov id=id.npy"));
    place.npy("id.npy").u32().into_iter().filter(|&id| id != NO_TRIANGLE).collect()
}

/// The ids that stand on lines.
fn ids(text: &str) -> Vec<u32> {
    text.lines().map(|line| line.parse().expect("an id")).collect()
}

#[test]
fn the_union_of_what_render_sees() {
    let place = place!();
    let mut all = BTreeSet::new();
    for (options, view) in views() {
        let seen = rendered(&place, SCENE, options);
        place.put("one.json", json!([view]).to_string());
        for line in [options.to_owned(), "--views one.json".to_owned()] {
            let run = place.run(&format!("visible {SCENE} {line}"));
            assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{line}");
            assert!(ids(&run.stdout).iter().eq(&seen), "{line}");
        }
        all.extend(seen);
    }
    place.put("list.json", json!(views().map(|(_, view)| view)).to_string());
    let table: serde_json::Map<_, _> =
        ["z", "a b", "", "ü"].map(String::from).into_iter().zip(views().map(|(_, view)| view)).collect();
    place.put("table.json", json!(table).to_string());
    for file in ["list.json", "table.json"] {
        let run = place.run(&format!("visible {SCENE} --views {file}"));
        assert!(ids(&run.stdout).iter().eq(&all), "{file}");
        place.quiet_run(&format!("visible {SCENE} --views {file} -o ids.npy"));
        place.quiet_run(&format!("visible {SCENE} --views {file} -o ids.txt"));
        let array = place.npy("ids.npy");
        assert_eq!(array.shape, [all.len()]);
        assert!(array.u32().iter().eq(&all));
        assert_eq!(place.bytes("ids.txt"), run.stdout.as_bytes());
    }
}

/// Neither order nor number of the views, nor threads, path and instructions, change a byte.
#[test]
fn the_same_bytes() {
    let place = place!();
    let list = views().map(|(_, view)| view);
    let [a, b, c, d] = list.clone();
    place.put("list.json", json!(list).to_string());
    place.put("again.json", json!([d, c, a, b, a, a, d]).to_string());
    let bytes = |more: &str| {
        place.quiet_run(&format!("visible {SCENE} -o ids.npy --report r.json {more}"));
        (place.bytes("ids.npy"), place.json("r.json")["hash"].clone())
    };
    let first = bytes("--views list.json");
    for more in [
        "--views list.json --threads 1",
        "--views list.json --threads 3 --repeat 2",
        "--views list.json --path general",
        "--views again.json --threads 2",
        "--views again.json --keep-order",
    ] {
        assert!(bytes(more) == first, "{more}");
    }
    let hash = blake3::hash(&place.npy("ids.npy").data).to_hex();
    assert_eq!(first.1, hash.as_str());
    let report = place.json("r.json");
    assert_eq!(report["command"], "visible");
    let fisheye = place.json("r.json")["rays"].as_u64().expect("a count");
    let others = 3 * 90 * 60 + 40 * 40 + 24 * 24 * 6;
    assert!((others..others + 2 * 50 * 50).contains(&fisheye), "{fisheye}");
}

#[test]
fn objects_are_counted() {
    let place = place!();
    place.quiet_run(&format!("visible {SCENE} -o ids.npy --size 160x90"));
    let seen = place.npy("ids.npy").u32();
    let run = place.run(&format!("visible {SCENE} --objects --size 160x90"));
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    let scene = builtin("umbel:5000").expect("a scene");
    let mut lines = run.stdout.lines();
    let head: Vec<&str> = lines.next().expect("a head").split_whitespace().collect();
    assert_eq!(head, ["visible", "triangles", "share", "object"]);
    let whole = 0..u32::try_from(scene.triangles.len()).expect("few");
    let objects = scene.objects.iter().map(|object| (object.name.as_str(), object.triangles.clone()));
    for (name, range) in objects.chain([("total", whole)]) {
        let visible = seen.iter().filter(|id| range.contains(id)).count();
        let line = lines.next().expect("a line");
        let mut words = line.split_whitespace();
        let numbers: [usize; 2] =
            [words.next(), words.next()].map(|word| word.expect("a number").parse().expect("a number"));
        assert_eq!(numbers, [visible, range.len()], "{line}");
        let share: f64 = words.next().expect("a share").parse().expect("a share");
        assert!((share - visible as f64 / range.len() as f64).abs() <= 5.1e-5, "{line}");
        assert!(line.ends_with(&format!("  {name}")), "{line}");
    }
    assert_eq!(lines.next(), None);
    // With a file, the ids go there.
    let run = place.run(&format!("visible {SCENE} --objects --size 160x90 -o same.npy"));
    assert!(run.stdout.contains("total"));
    assert_eq!(place.bytes("same.npy"), place.bytes("ids.npy"));
}

/// A box in a closed box is seen from between them, and only there; what has no area is never seen.
#[test]
fn what_is_hidden() {
    let place = place!();
    let corners = |size: i32| {
        let corner = |k: i32| [0, 1, 2].map(|bit| if k >> bit & 1 == 0 { -size } else { size });
        (0..8).map(|k| format!("v {} {} {}\n", corner(k)[0], corner(k)[1], corner(k)[2])).collect::<String>()
    };
    let faces = "f -8 -6 -2 -4\nf -7 -5 -1 -3\nf -8 -7 -3 -4\nf -6 -5 -1 -2\nf -8 -7 -5 -6\nf -4 -3 -1 -2\n";
    let boxes = format!("o inner\n{}{faces}f -8 -7 -7\no outer\n{}{faces}", corners(1), corners(5));
    place.put("a.obj", boxes);
    let run = |camera: &str| {
        ids(&place.run(&format!("visible a.obj --camera cube --cube-size 16 {camera}")).stdout)
    };
    assert_eq!(run("--eye 0,0.1,0.2"), (0..12).collect::<Vec<u32>>(), "from inside");
    assert!(run("--eye 40,9,3").iter().all(|&id| id > 12), "from outside");
    let between = run("--eye 0,0,3");
    assert!(between.contains(&10) && between.contains(&11), "the nearest side of the inner box");
    assert!(!between.contains(&12) && between.iter().filter(|&&id| id < 12).count() == 2);
    assert!((13..25).filter(|id| between.contains(id)).count() > 9);
}

#[test]
fn an_empty_scene() {
    let place = place!();
    place.put("empty.obj", "");
    let run = place.run("visible empty.obj -q");
    assert_eq!((run.code, run.stdout.as_str(), run.stderr.as_str()), (Some(0), "", ""));
    place.quiet_run("visible empty.obj -q -o ids.npy");
    assert_eq!(place.npy("ids.npy").shape, [0]);
    let run = place.run("visible empty.obj -q --objects");
    assert_eq!(run.stdout.lines().count(), 2, "{}", run.stdout);
}

/// Runs `visible` on a file of views; it must be refused with the file's name, and with nothing written.
fn refuse(views: &str, code: i32, named: &[&str]) {
    let place = place!();
    place.put("views.json", views);
    let run = place.run("visible builtin:cornell --views views.json -o ids.npy");
    assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{views}\n{}", run.stderr);
    assert!(run.stderr.starts_with("error: views.json"), "{views}\n{}", run.stderr);
    for word in named {
        assert!(run.stderr.contains(word), "{views}: {word}?\n{}", run.stderr);
    }
    assert_eq!(place.names(), ["views.json"], "{views}");
}

#[test]
fn files_that_hold_no_views() {
    for (text, named) in [
        ("", "EOF"),
        ("[\n\n{\"eye\": [1,2,3],}]", "views.json:3"),
        ("eye: [1,2,3]", "views.json:1"),
        ("[{\"eye\": [1e999,0,0]}]", "out of range"),
        ("[{\"eye\": [NaN,0,0]}]", "views.json:1"),
        ("3", "expected a list or a table of views"),
        ("null", "expected a list or a table of views"),
        ("[]", "no view"),
        ("{}", "no view"),
        ("[3]", "view 0"),
        ("[{\"eye\": [0,0,0], \"target\": [0,0,1], \"eye\": [1,0,0]}]", "duplicate field `eye`"),
        ("[{\"eye\": [0,0,0], \"camera\": \"cube\"}] 3", "trailing"),
        (
            "{\"a\": {\"eye\": [0,0,0], \"camera\": \"cube\"}, \"a\": {\"eye\": [1,0,0], \"camera\": \"cube\"}}",
            "view \"a\": two views have this name",
        ),
        ("{\"eye\": [0,0,0], \"target\": [0,0,1]}", "view \"eye\""),
    ] {
        refuse(text, 3, &[named, "views are a list"]);
    }
}

#[test]
fn views_that_see_nothing() {
    let good = json!({"eye": [0, 0, 0], "target": [0, 0, -1]});
    for (change, named) in [
        (json!({"fovy": 40}), "unknown field `fovy`"),
        (json!({"fov": 190}), "fov must lie between 0 and 180"),
        (json!({"fov": "wide"}), "wide"),
        (json!({"target": [0, 0, 0]}), "same point"),
        (json!({"target": [0, 0]}), "length 2"),
        (json!({"target": null}), "target"),
        (json!({"up": [0, 0, 3]}), "up is parallel"),
        (json!({"up": [0, 0, 0]}), "up is parallel"),
        (json!({"size": [0, 9]}), "size is [0, 9]"),
        (json!({"size": [9, 65537]}), "size is [9, 65537]"),
        (json!({"size": [-9, 9]}), "-9"),
        (json!({"size": 9}), "9"),
        (json!({"height": 3}), "height goes with camera ortho"),
        (json!({"cube_size": 3}), "cube_size goes with camera cube"),
        (json!({"camera": "cube"}), "takes no target"),
        (json!({"camera": "telescope"}), "telescope"),
        (json!({"camera": "fisheye", "fov": 361}), "360"),
        (json!({"eye": [1e39, 0, 0]}), "origin"),
    ] {
        let mut bad = good.clone();
        let fields = bad.as_object_mut().expect("a table");
        fields.extend(change.as_object().expect("a table").clone());
        refuse(&json!([good, bad, good]).to_string(), 3, &["view 1", named]);
        refuse(&json!({"good": good, "bad one": bad}).to_string(), 3, &["view \"bad one\"", named]);
    }
    let cube = json!({"eye": [0, 0, 0], "camera": "cube", "cube_size": 40000});
    refuse(&json!([good, cube]).to_string(), 3, &["view 1", "cube_size is 40000"]);
    refuse(&json!([{"target": [0, 0, 0]}]).to_string(), 3, &["view 0", "`eye`"]);
}

#[test]
fn options_that_cannot_be_meant() {
    let place = place!();
    place.put("views.json", json!([{"eye": [0, 0, 0], "camera": "cube"}]).to_string());
    for (line, code, named) in [
        ("-o ids.csv", 2, "ids.csv"),
        ("-o ids", 2, ".npy or .txt"),
        ("--views none.json", 3, "none.json"),
        ("--views views.json --fov 40", 2, "--fov"),
        ("--views views.json --eye 0,0,0", 2, "--eye"),
        ("--views views.json --camera cube", 2, "--camera"),
        ("--views views.json --cube-size 4", 2, "--cube-size"),
        ("--eye 0,nan,0", 2, "--eye"),
        ("--eye 0,5,0 --target 0,0,0 --up 0,1,0", 2, "--up"),
        ("--max-memory 1k", 4, "--max-memory"),
        ("--views views.json --max-memory 1M", 4, "--max-memory"),
        ("-o no/such/ids.npy", 1, "no/such"),
    ] {
        let run = place.run(&format!("visible builtin:cornell {line}"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{line}\n{}", run.stderr);
        assert!(run.stderr.starts_with("error: ") && run.stderr.contains(named), "{line}\n{}", run.stderr);
    }
    assert_eq!(place.names(), ["views.json"]);
}

/// The library's verb: no camera sees nothing, and both paths agree.
#[test]
fn from_the_library() {
    let scene = builtin("cornell").expect("a scene");
    let camera = |lens| Camera {
        eye: DVec3::new(278.0, 273.0, 150.0),
        target: DVec3::new(278.0, 273.0, 500.0),
        up: DVec3::Y,
        lens,
        width: 40,
        height: 20,
    };
    let cameras = [Lens::Equirect, Lens::Pinhole { fov: 60.0 }, Lens::Cube].map(camera);
    let mut told = Vec::new();
    let (seen, stats) = visible(&scene, &cameras, &Options::default(), |done| told.push(done)).expect("seen");
    assert_eq!(told, [1, 2, 3]);
    assert_eq!(seen.rays, 40 * 20 * 2 + 40 * 40 * 6);
    assert!(stats.samples_tested > 0);
    let general = Options { path: Path::General, ..Options::default() };
    assert_eq!(visible(&scene, &cameras, &general, |_| ()).expect("seen").0, seen);
    assert_eq!(seen.per_object(&scene).iter().sum::<usize>(), seen.ids.len());
    let (none, _) = visible(&scene, &[], &Options::default(), |_| ()).expect("nothing");
    assert_eq!((none.ids.len(), none.rays), (0, 0));
}
