//! Forecasts of memory: every verb tells before it begins what the whole process takes at its peak, within 15 % of what the system counts, or
//! within 2 MB where the program itself is most of it: how much of its own code is loaded depends on how it was built.

use common::command::{Place, Run};
use common::place;

/// The most by which a forecast is off.
const TOLERANCE: f64 = 0.15;
/// Bytes of the program itself that no forecast knows.
const PROGRAM: f64 = 2e6;

/// A number that stands before some words on standard error.
fn number(run: &Run, before: &str) -> f64 {
    let line = run.stderr.lines().rev().find(|line| line.contains(before));
    let line = line.unwrap_or_else(|| panic!("no line with `{before}`: {}", run.stderr));
    let number = line.trim_start_matches("about ").split(' ').next().expect("a word");
    number.parse().unwrap_or_else(|_| panic!("no number in `{line}`"))
}

/// Runs a line and compares its forecast with its peak. Returns the peak.
fn check(place: &Place, line: &str) -> f64 {
    // Behind `--` are options of another verb.
    let (own, others) =
        line.split_once(" -- ").map_or((line, String::new()), |(own, others)| (own, format!("-- {others}")));
    let run = place.run(&format!("{own} --verbose --threads 2 {others}"));
    assert_eq!(run.code, Some(0), "umbel {line}: {}", run.stderr);
    let (forecast, peak) = (number(&run, " bytes of memory, "), number(&run, " bytes of memory at most"));
    let error = (forecast - peak).abs();
    assert!(
        error <= (TOLERANCE * peak).max(PROGRAM),
        "umbel {line}: {forecast} bytes were foreseen, {peak} were taken"
    );
    peak
}

/// A wavy sheet of n x n squares, with an unwrapping that fills a part of a texture.
fn sheet(n: usize) -> String {
    let mut text = String::new();
    for k in 0..(n + 1) * (n + 1) {
        let (i, j) = (k % (n + 1), k / (n + 1));
        let (x, z) = (i as f64 / n as f64, j as f64 / n as f64);
        let y = 0.1 * (7.0 * x).sin() * (5.0 * z).cos();
        text += &format!("v {x} {y} {z}\nvt {} {}\n", 0.8 * x, 0.1 + 0.7 * z);
    }
    for k in 0..n * n {
        let first = k / n * (n + 1) + k % n + 1;
        let corners = [first, first + n + 1, first + n + 2, first + 1];
        let corners: Vec<String> = corners.iter().map(|corner| format!("{corner}/{corner}")).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

/// The scenes: a handful of triangles, some thousand, and two hundred thousand.
fn scenes() -> Place {
    let place = place!();
    place.put("sheet.obj", sheet(40));
    place.put("large.obj", sheet(320));
    place
}

#[test]
fn pictures() {
    let place = scenes();
    for scene in ["builtin:cornell", "builtin:umbel", "large.obj"] {
        for size in ["16x16", "640x480", "1600x1200"] {
            check(&place, &format!("render {scene} --size {size} -o a.png"));
        }
    }
    for files in [
        "-o a.npy",
        "-o a.exr",
        "-o a.ply",
        "--aov id=a.npy",
        "--aov normal=a.npy --aov bary=b.npy",
        "-o a.exr --aov normal --aov position --aov depth --aov id",
        "-o a.png --aov position=p.npy",
        "-o a.png --samples 3",
        "-o a.png --camera equirect",
        "-o a.png --camera fisheye",
        "-o a.png --path general",
    ] {
        check(&place, &format!("render builtin:umbel --size 1200x900 {files}"));
    }
    check(&place, "render builtin:umbel -o a.png --camera cube --cube-size 500");
}

#[test]
fn pictures_with_lights_and_bounces() {
    let place = scenes();
    for size in ["64x64", "1200x1200"] {
        check(&place, &format!("render builtin:cornell --light 278,400,279 --size {size} -o a.png"));
        check(&place, &format!("render builtin:umbel --light 1,5,2 --sun 1,3,1 --size {size} -o a.png"));
    }
    check(&place, "render builtin:cornell --light 278,400,279 --samples 2 --size 1200x900 -o a.png");
    let glass = "--glass all --refract --bounces 4";
    check(&place, &format!("render large.obj {glass} --size 1200x900 -o a.png"));
}

#[test]
fn probes_views_and_verification() {
    let place = scenes();
    for size in ["256x128", "1600x800"] {
        for file in ["a.png", "a.ply"] {
            check(&place, &format!("probe builtin:cornell --center 278,273,279 --size {size} -o {file}"));
        }
        check(&place, &format!("visible large.obj --size {size} -o v.npy"));
        check(&place, &format!("verify builtin:umbel --size {size}"));
    }
}

#[test]
fn shadows() {
    let place = scenes();
    for size in ["64", "256", "700"] {
        for file in ["a.npy", "a.exr", "a.png"] {
            check(&place, &format!("shadow builtin:umbel --light 1,5,2 --cube-size {size} -o {file}"));
        }
    }
    check(&place, "shadow builtin:umbel --light 1,5,2 --light 2,5,1 --cube-size 512 -o a.npy");
    check(&place, "shadow large.obj --sun 1,5,2 --map-size 1500 -o a.npy");
    for size in ["64x64", "1200x900"] {
        check(&place, &format!("shadow builtin:umbel --light 1,5,2 --mask a.npy --size {size}"));
        check(&place, &format!("shadow large.obj --sun 1,5,2 --mask a.png --size {size}"));
        let two = "--light 278,400,279 --light 100,300,279";
        check(&place, &format!("shadow builtin:cornell {two} --mask a.npy --size {size}"));
    }
    check(&place, "shadow builtin:cornell --light 278,400,279 --compare=64,512 --size 640x480");
}

#[test]
fn bakes() {
    let place = scenes();
    for size in ["64", "512", "1500"] {
        check(&place, &format!("bake sheet.obj --texels {size} --rays 8 -o a.npy"));
    }
    for more in [
        "-o a.png --set independent",
        "-o a.exr --set interleaved",
        "-o a.npy --bent b.npy",
        "-o a.npy --coverage b.png",
    ] {
        check(&place, &format!("bake sheet.obj --texels 700 --rays 16 {more}"));
    }
    check(&place, "bake sheet.obj --texels 100 --rays 64 -o a.npy --dump-rays r.npy");
    check(&place, "bake large.obj --vertices --rays 16 -o a.ply");
    check(&place, "bake sheet.obj --vertices --rays 64 -o a.npy");
}

#[test]
fn surfaces_on_demand() {
    let place = scenes();
    for size in ["64x64", "1000x800"] {
        for more in ["-o a.png", "-o a.ply", "-o a.png --light 3,5,2", "-o a.png --samples 2"] {
            check(&place, &format!("reyes builtin:teapot --size {size} {more}"));
        }
    }
}

#[test]
fn trades() {
    let place = scenes();
    for size in ["160x100", "640x400"] {
        check(&place, &format!("trade --mode render builtin:umbel -o t.html --rounds 1 -- --size {size}"));
    }
}

/// A limit is kept, or refused before the work: nothing is written then.
#[test]
fn a_limit_is_kept_or_refused() {
    let place = scenes();
    let lines = [
        "render builtin:umbel --size 1600x1200 -o a.png",
        "render builtin:umbel --size 1600x1200 -o a.exr --aov normal",
        "shadow builtin:cornell --light 278,400,279 --mask a.npy --size 1600x1200",
        "bake sheet.obj --texels 1500 --rays 64 -o a.npy",
        "bake large.obj --vertices --rays 64 -o a.npy",
        "reyes builtin:teapot --size 1600x1200 -o a.png",
    ];
    for line in lines {
        for limit in [1, 15, 30, 45, 60, 80, 120] {
            let run = place.run(&format!("{line} --threads 2 --verbose --max-memory {limit}M"));
            if run.code == Some(0) {
                let (peak, most) = (number(&run, " bytes of memory at most"), f64::from(limit << 20));
                assert!(peak <= most * (1.0 + TOLERANCE), "umbel {line}: {peak} of {most}");
                std::fs::remove_file(place.path("a.npy"))
                    .or_else(|_| {
                        let other = if line.contains("exr") { "a.exr" } else { "a.png" };
                        std::fs::remove_file(place.path(other))
                    })
                    .expect("an output");
            } else {
                assert_eq!(run.code, Some(4), "umbel {line}: {}", run.stderr);
                assert!(run.stderr.contains("--max-memory"), "{}", run.stderr);
                assert_eq!(place.names(), ["large.obj", "sheet.obj"], "umbel {line}");
            }
        }
    }
}
