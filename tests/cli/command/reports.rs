//! `--report`: the fields, and a hash that depends on nothing but the scene and the camera.

use common::command::Place;
use common::place;
use serde_json::Value;

use super::SQUARES;

const RENDER: &str = "render builtin:umbel:2000 --size 64x36 --report r.json";

/// The report of a run.
fn report(place: &Place, more: &str) -> Value {
    place.quiet_run(&format!("{RENDER} {more}"));
    place.json("r.json")
}

#[test]
fn a_report_has_its_fields() {
    let report = report(&place!(), "--repeat 3 --threads 2 -o a.png");
    assert_eq!(report["schema"], 1);
    assert_eq!(report["command"], "render");
    assert_eq!(report["scene"]["name"], "builtin:umbel:2000");
    assert!(report["scene"]["triangles"].as_u64().expect("a count") > 1000);
    assert!(report["scene"]["vertices"].as_u64().expect("a count") > 1000);
    assert_eq!(report["rays"], 64 * 36);
    assert_eq!(report["threads"], 2);
    assert_eq!(report["accuracy"], "exact");
    let engine = report["ms"]["engine"].as_array().expect("a list");
    assert_eq!(engine.len(), 3, "one time per repeat");
    let time = |stage: &str| report["ms"][stage].as_f64().expect("milliseconds");
    let stages = ["load", "camera", "receivers", "check", "shade", "write", "other"].map(time);
    assert!(stages.iter().all(|&time| time >= 0.0), "{stages:?}");
    // All of the command's time is accounted for.
    let engine: f64 = engine.iter().map(|time| time.as_f64().expect("milliseconds")).sum();
    let sum = engine + stages.iter().sum::<f64>();
    assert!((sum - time("total")).abs() < 1e-6 * sum, "{sum} {}", time("total"));
    assert!(report["engine_bytes"].as_u64().expect("bytes") > 0);
    if cfg!(target_os = "linux") {
        assert!(report["peak_rss_bytes"].as_u64().expect("bytes") > 1 << 20);
    }
    let stats = report["stats"].as_object().expect("counters");
    assert!(stats["triangles_set_up"].as_u64().expect("a count") > 0);
    let hash = report["hash"].as_str().expect("a hash");
    assert!(hash.len() == 64 && hash.bytes().all(|c| c.is_ascii_hexdigit()));
}

/// What further samples see is asked of the engine: it is no shading.
#[test]
fn samples_are_the_engines_time() {
    let place = place!();
    // The general path takes far longer than shading.
    let engine = |samples: u32| {
        let report = report(&place, &format!("--path general --samples {samples} -o a.png"));
        report["ms"]["engine"][0].as_f64().expect("milliseconds")
    };
    let (one, many) = (engine(1), engine(32));
    assert!(many > 4.0 * one, "{many} ms for 32 samples, {one} ms for one");
}

#[test]
fn the_hash_depends_on_the_output_alone() {
    let place = place!();
    let files = "--aov id=i.npy --aov depth=t.npy --aov position=p.npy --samples 2 -o a.png";
    let mut first: Option<(Value, [Vec<u8>; 4])> = None;
    for more in [
        "--threads 1",
        "--threads 2",
        "--threads 3",
        "--path general --threads 1",
        "--path general --threads 3",
        "--repeat 4 --threads 2",
    ] {
        let hash = report(&place, &format!("{files} {more}"))["hash"].clone();
        let bytes = ["i.npy", "t.npy", "p.npy", "a.png"].map(|name| place.bytes(name));
        let (expected, files) = first.get_or_insert_with(|| (hash.clone(), bytes.clone()));
        assert_eq!(hash, *expected, "{more}");
        assert!(bytes == *files, "{more}: the files differ");
    }
    let other = report(&place, &format!("{files} --fov 33"))["hash"].clone();
    assert_ne!(Some(other), first.map(|(hash, _)| hash));
}

#[test]
fn the_hash_is_blake3_of_the_arrays() {
    let place = place!();
    let hash = report(&place, "--aov id=i.npy --aov bary=b.npy")["hash"].clone();
    let mut hasher = blake3::Hasher::new();
    hasher.update(&place.npy("i.npy").data);
    hasher.update(&place.npy("b.npy").data);
    assert_eq!(hash, hasher.finalize().to_hex().as_str());
}

#[test]
fn pencils_test_far_fewer_boxes() {
    let place = place!();
    let boxes = |path: &str| {
        let line = format!("render builtin:umbel:20000 --size 320x180 --path {path} --aov id=i.npy");
        place.quiet_run(&format!("{line} --report r.json"));
        let stats = place.json("r.json")["stats"].clone();
        ["box_tests", "frustum_tests"].map(|name| stats[name].as_u64().expect("it"))
    };
    let [general, ..] = boxes("general");
    let pencil: u64 = boxes("pencil").iter().sum();
    assert!(pencil * 100 < general, "{pencil} of {general} are 1 % or more");
}

#[test]
fn warnings_and_times_go_to_stderr() {
    let place = place!();
    place.put("a.obj", format!("mtllib none.mtl\n{SQUARES}"));
    let line = "render a.obj --size 8x8";
    let run = place.run(line);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), ""));
    let about = run.stderr.strip_prefix("warning: ").expect("a warning");
    assert!(about.contains("none.mtl"), "{about}");
    place.quiet_run(&format!("{line} -q"));
    let run = place.run(&format!("{line} --verbose"));
    assert_eq!(run.stdout, "");
    assert!(run.stderr.contains(" ms") && run.stderr.contains("triangles_set_up"));
    assert!(!run.stderr.contains('\u{1b}'), "no colours into a pipe");
}
