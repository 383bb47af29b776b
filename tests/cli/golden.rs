//! Pictures of the built-in scenes, compared byte for byte with those in `tests/golden/`.
//!
//! Output bytes depend on neither the machine nor the number of threads, so nothing is tolerated. On a difference the new
//! picture and a difference image stand in the directory that the message names. After a change that is meant to change
//! pictures: `UMBEL_BLESS=1 cargo test --release --test cli golden`, then look at each.

use std::fs;
use std::path::{Path, PathBuf};

use common::place;
use umbel::files::{read_png_rgb8, write_png_rgb8};

/// The name of each picture, and the command that makes it: with `-o picture.png` where it names no file.
const PICTURES: [(&str, &str); 19] = [
    ("umbel", "render builtin:umbel --size 320x180"),
    ("umbel-samples", "render builtin:umbel --size 320x180 --samples 16"),
    (
        "umbel-close",
        "render builtin:umbel --size 320x180 --samples 16 --eye 0.9,1.4,1 --target 0.3,2.1,0.2 --fov 60",
    ),
    ("umbel-ortho", "render builtin:umbel --size 320x180 --camera ortho --samples 4"),
    ("cornell", "render builtin:cornell --size 180x180 --samples 4"),
    (
        "cornell-equirect",
        "render builtin:cornell --camera equirect --size 320x160 --eye 278,273,150 --target 278,273,500 --samples 4",
    ),
    (
        "cornell-fisheye",
        "render builtin:cornell --camera fisheye --size 180x180 --eye 278,273,100 --target 278,200,500 --samples 4",
    ),
    ("cornell-cube", "render builtin:cornell --camera cube --cube-size 64 --eye 278,273,150"),
    ("cornell-outside", "render builtin:cornell --size 320x180"),
    ("umbel-probe", "probe builtin:umbel --center 0,1,0.6 --size 320x160 --samples 4"),
    ("umbel-rings", "probe builtin:umbel --center 0,1,0.6 --pattern rings=64,columns=360,fov=-30..30"),
    ("umbel-light", "render builtin:umbel --light=-1.5,7,3.5 --size 320x180 --samples 4"),
    ("umbel-sun", "render builtin:umbel --sun=-1.5,2,2.5 --size 320x180 --samples 4"),
    (
        "cornell-mask",
        "shadow builtin:cornell --light 278,540,279.5 --size 180x180 --samples 4 --mask picture.png",
    ),
    ("cornell-distances", "shadow builtin:cornell --light 278,400,279.5 --cube-size 64 -o picture.png"),
    ("teapot", "reyes builtin:teapot --size 240x150 --samples 4"),
    ("field", "reyes builtin:field --size 240x135"),
    (
        "cornell-reyes",
        "reyes builtin:cornell --subdivide --displace noise:0.02,3 --height 30 --size 180x180 --samples 4",
    ),
    ("umbel-sun-map", "shadow builtin:umbel --sun=-1.5,2,2.5 --map-size 180 -o picture.png"),
];

type Picture = (u32, u32, Vec<u8>);

fn read(path: &Path) -> Picture {
    read_png_rgb8(path).unwrap_or_else(|error| panic!("{error}"))
}

/// How far each number of two pictures of the same size is apart, four times over so that it can be seen.
fn difference(got: &Picture, golden: &Picture) -> Vec<u8> {
    let apart = got.2.iter().zip(&golden.2).map(|(a, b)| a.abs_diff(*b));
    apart.map(|d| d.saturating_mul(4)).collect()
}

/// What is wrong with a picture, if anything; leaves the evidence in `evidence`.
fn compare(name: &str, got: &Picture, golden: &Path, evidence: &Path) -> Option<String> {
    fs::create_dir_all(evidence).expect("a directory");
    let new = evidence.join(format!("{name}.png"));
    let problem = if !golden.exists() {
        "there is no golden picture".to_owned()
    } else {
        let expected = read(golden);
        if (got.0, got.1) != (expected.0, expected.1) {
            format!("{}x{} pixels instead of {}x{}", got.0, got.1, expected.0, expected.1)
        } else if got.2 == expected.2 {
            return None;
        } else {
            let apart = difference(got, &expected);
            let image = evidence.join(format!("{name}-difference.png"));
            write_png_rgb8(&image, got.0, got.1, &apart).expect("written");
            let pixels = apart.chunks(3).filter(|p| *p != [0; 3]).count();
            let most = got.2.iter().zip(&expected.2).map(|(a, b)| a.abs_diff(*b)).max();
            let most = most.unwrap_or(0);
            format!("{pixels} pixels differ, by up to {most}: {}", image.display())
        }
    };
    write_png_rgb8(&new, got.0, got.1, &got.2).expect("written");
    Some(format!("{name}: {problem}\n    new: {}\n    old: {}\n", new.display(), golden.display()))
}

#[test]
fn pictures_are_the_golden_ones() {
    let place = place!();
    let goldens = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/golden");
    let evidence = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("golden");
    let bless = std::env::var_os("UMBEL_BLESS").is_some_and(|value| value == "1");
    let mut problems = String::new();
    for (name, line) in PICTURES {
        let output = if line.contains("picture.png") { "" } else { "-o picture.png" };
        place.quiet_run(&format!("{line} {output}"));
        let got = read(&place.path("picture.png"));
        let golden = goldens.join(format!("{name}.png"));
        if bless {
            write_png_rgb8(&golden, got.0, got.1, &got.2).expect("written");
        } else if let Some(problem) = compare(name, &got, &golden, &evidence) {
            problems += &problem;
        }
    }
    assert!(problems.is_empty(), "\n{problems}UMBEL_BLESS=1 takes the new ones");
}

#[test]
fn a_changed_pixel_is_noticed() {
    let place = place!();
    place.quiet_run("render builtin:cornell --size 20x10 -o old.png");
    let golden = place.path("old.png");
    let mut got = read(&golden);
    let evidence = place.path("evidence");
    assert_eq!(compare("a", &got, &golden, &evidence), None);
    got.2[301] ^= 3;
    let told = compare("a", &got, &golden, &evidence).expect("a difference");
    assert!(told.contains("1 pixels differ, by up to 3") || told.contains("by up to 1"), "{told}");
    let (_, _, apart) = read(&evidence.join("a-difference.png"));
    assert_eq!(apart.iter().filter(|&&d| d > 0).count(), 1);
    assert_eq!(read(&evidence.join("a.png")), got);
}
