//! What `render` writes: formats, arrays, channels, misses.

use common::command::{Place, size_option};
use common::place;
use umbel::NO_TRIANGLE;
use umbel::files::{Samples, read_exr, read_png_rgb8};

use super::SQUARES;

/// Looks at the squares along −z: at z = 0 the picture is 8 x 4 world units, a pixel 0.5.
const CAMERA: &str = "--size 16x8 --eye 0,0,2 --target 0,0,0 --fov 90";
/// The quantities with their types and the numbers per pixel.
const AOVS: [(&str, &str, Option<usize>); 7] = [
    ("id", "<u4", None),
    ("object", "<u4", None),
    ("depth", "<f4", None),
    ("distance", "<f4", None),
    ("normal", "<f4", Some(3)),
    ("position", "<f4", Some(3)),
    ("bary", "<f4", Some(2)),
];

fn place() -> Place {
    let place = place!();
    place.put("squares.obj", SQUARES);
    place
}

/// `--aov NAME=NAME.npy` for each.
fn all_aovs() -> String {
    AOVS.map(|(name, ..)| format!("--aov {name}={name}.npy")).join(" ")
}

#[test]
fn without_options_there_is_umbel_png() {
    let place = place!();
    place.quiet_run("render");
    assert_eq!(place.names(), ["umbel.png"]);
    let (width, height, pixels) = read_png_rgb8(&place.path("umbel.png")).expect("a picture");
    assert_eq!((width, height), (1280, 720));
    let green = pixels.chunks(3).filter(|p| p[1] > p[0].saturating_add(20) && p[1] > p[2].saturating_add(20));
    assert!(green.count() > 5000, "the flower is green");
}

#[test]
fn a_picture_in_each_format() {
    let place = place();
    for format in ["png", "exr", "npy", "PNG"] {
        place.quiet_run(&format!("render squares.obj {CAMERA} -o a.{format}"));
    }
    assert_eq!(place.names(), ["a.PNG", "a.exr", "a.npy", "a.png", "squares.obj"]);
    assert_eq!(place.bytes("a.PNG"), place.bytes("a.png"));
    let (width, height, bytes) = read_png_rgb8(&place.path("a.png")).expect("a picture");
    assert_eq!((width, height), (16, 8));
    let linear = place.npy("a.npy");
    assert_eq!(linear.shape, [8, 16, 3]);
    let linear = linear.f32();
    let encoded: Vec<u8> = linear.iter().map(|&x| umbel::files::srgb_encode(x)).collect();
    assert_eq!(encoded, bytes, "the PNG is the linear preview in sRGB");
    let (_, _, channels) = read_exr(&place.path("a.exr")).expect("an image");
    for (k, name) in [(2, "B"), (1, "G"), (0, "R")] {
        let channel = channels.iter().find(|c| c.name == name).expect("a channel");
        let expected: Vec<f32> = linear.iter().skip(k).step_by(3).copied().collect();
        assert_eq!(channel.samples, Samples::F32(expected));
    }
}

#[test]
fn arrays_have_their_types_and_shapes() {
    let place = place();
    place.quiet_run(&format!("render squares.obj {CAMERA} {}", all_aovs()));
    assert!(!place.names().contains(&"umbel.png".to_owned()), "no picture was asked for");
    for (name, dtype, numbers) in AOVS {
        let array = place.npy(&format!("{name}.npy"));
        let shape: Vec<usize> = [8, 16].into_iter().chain(numbers).collect();
        assert_eq!((array.dtype.as_str(), array.shape), (dtype, shape), "{name}");
    }
}

#[test]
fn misses_have_their_values() {
    let place = place();
    place.quiet_run(&format!("render squares.obj {CAMERA} {}", all_aovs()));
    let ids = place.npy("id.npy").u32();
    assert_eq!(ids[0], NO_TRIANGLE);
    assert!(ids.contains(&0) && ids.contains(&1) && ids.contains(&2));
    for (name, dtype, numbers) in AOVS {
        let array = place.npy(&format!("{name}.npy"));
        let numbers = numbers.unwrap_or(1);
        if dtype == "<u4" {
            let values = array.u32();
            assert!((0..ids.len()).all(|k| (values[k] == u32::MAX) == (ids[k] == NO_TRIANGLE)));
            continue;
        }
        for (&id, values) in ids.iter().zip(array.f32().chunks(numbers)) {
            let missed = match name {
                "depth" | "distance" => values == [f32::INFINITY],
                _ => values.iter().all(|x| x.is_nan()),
            };
            assert_eq!(missed, id == NO_TRIANGLE, "{name}: {values:?}");
            assert!(missed || values.iter().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn hits_have_their_values() {
    let place = place();
    place.quiet_run(&format!("render squares.obj {CAMERA} {}", all_aovs()));
    let (ids, objects) = (place.npy("id.npy").u32(), place.npy("object.npy").u32());
    let (depths, positions) = (place.npy("depth.npy").f32(), place.npy("position.npy").f32());
    let normals = place.npy("normal.npy").f32();
    for pixel in (0..ids.len()).filter(|&pixel| ids[pixel] != NO_TRIANGLE) {
        let (depth, object) = if ids[pixel] < 2 { (2.0, 0) } else { (3.0, 1) };
        assert_eq!((depths[pixel], objects[pixel]), (depth, object));
        assert_eq!(normals[3 * pixel..][..3], [0.0, 0.0, 1.0]);
        // A pixel is half a unit at depth 2; pixel (8, 3) is the first right of and above the middle.
        let (i, j) = ((pixel % 16) as f32, (pixel / 16) as f32);
        let expected = [(i - 7.5) * 0.25 * depth, (3.5 - j) * 0.25 * depth, 2.0 - depth];
        for (got, expected) in positions[3 * pixel..].iter().zip(expected) {
            assert!((got - expected).abs() < 1e-6, "{got} for {expected}");
        }
    }
}

#[test]
fn channels_of_an_exr_by_name() {
    let place = place();
    let aovs = AOVS.map(|(name, ..)| format!("--aov {name}")).join(" ");
    place.quiet_run(&format!("render squares.obj {CAMERA} {aovs} -o a.exr"));
    place.quiet_run(&format!("render squares.obj {CAMERA} {}", all_aovs()));
    let (width, height, channels) = read_exr(&place.path("a.exr")).expect("an image");
    assert_eq!((width, height), (16, 8));
    let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
    let expected = [
        "B", "G", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "R", "Z", "bary.u", "bary.v", "distance", "id",
        "object",
    ];
    assert_eq!(names, expected);
    let channel = |name: &str| &channels.iter().find(|c| c.name == name).expect("it").samples;
    assert_eq!(*channel("id"), Samples::U32(place.npy("id.npy").u32()));
    assert_eq!(*channel("object"), Samples::U32(place.npy("object.npy").u32()));
    assert_eq!(*channel("Z"), Samples::F32(place.npy("depth.npy").f32()));
    assert_eq!(*channel("distance"), Samples::F32(place.npy("distance.npy").f32()));
    for (file, number, of, name) in
        [("normal", 2, 3, "N.Z"), ("position", 1, 3, "P.Y"), ("bary", 1, 2, "bary.v")]
    {
        let array = place.npy(&format!("{file}.npy")).f32();
        let expected = array.iter().skip(number).step_by(of).map(|x| x.to_bits());
        let Samples::F32(got) = channel(name) else { panic!("{name} is floating point") };
        assert!(got.iter().map(|x| x.to_bits()).eq(expected), "{name}");
    }
}

#[test]
fn a_cube_prepends_six() {
    let place = place();
    let camera = "--camera cube --cube-size 4 --eye 0,0,0.9";
    place.quiet_run(&format!("render squares.obj {camera} {} -o a.npy", all_aovs()));
    for (name, dtype, numbers) in AOVS {
        let array = place.npy(&format!("{name}.npy"));
        let shape: Vec<usize> = [6, 4, 4].into_iter().chain(numbers).collect();
        assert_eq!((array.dtype.as_str(), array.shape), (dtype, shape), "{name}");
    }
    assert_eq!(place.npy("a.npy").shape, [6, 4, 4, 3]);
    // The square fills the face −Z, the last.
    let ids = place.npy("id.npy").u32();
    assert!(ids[80..].iter().all(|&id| id < 2));
    assert_eq!(ids[32..64], [NO_TRIANGLE; 32], "nothing above and below");
    place.quiet_run(&format!("render squares.obj {camera} -o a.exr --aov id"));
    let (width, height, _) = read_exr(&place.path("a.exr")).expect("an image");
    assert_eq!((width, height), (4, 24));
}

#[test]
fn samples_change_the_preview_only() {
    let place = place();
    for samples in [1, 5] {
        let files = format!("--aov id=id{samples}.npy --aov depth=t{samples}.npy -o {samples}.npy");
        place.quiet_run(&format!("render squares.obj {CAMERA} --samples {samples} {files}"));
    }
    assert_eq!(place.bytes("id1.npy"), place.bytes("id5.npy"));
    assert_eq!(place.bytes("t1.npy"), place.bytes("t5.npy"));
    assert_ne!(place.bytes("1.npy"), place.bytes("5.npy"));
}

#[test]
fn each_lens_renders_each_scene() {
    let place = place();
    for lens in ["pinhole", "ortho", "equirect", "fisheye", "cube"] {
        for scene in ["squares.obj", "builtin:cornell", "builtin:umbel:1000"] {
            place.quiet_run(&format!(
                "render {scene} --camera {lens} {} -o a.npy",
                size_option(lens, "12x10", 5)
            ));
            let shape = if lens == "cube" { vec![6, 5, 5, 3] } else { vec![10, 12, 3] };
            let picture = place.npy("a.npy");
            assert_eq!(picture.shape, shape, "{lens}");
            assert!(picture.f32().iter().all(|x| (0.0..=1.1).contains(x)), "{lens} {scene}");
        }
    }
}

/// Where nothing is seen, less is to be done; on the general path, and of lenses that bend lines, ray by ray.
#[test]
fn work_is_where_the_scene_is() {
    let place = place!();
    let general =
        ["middle", "given", "spatial", "sampled"].map(|p| format!("--path general --partition {p}"));
    for (lens, size) in [("pinhole", (160, 90)), ("fisheye", (90, 90)), ("cube", (32, 192))] {
        let size_of = size_option(lens, &format!("{}x{}", size.0, size.1), 32);
        let line = format!("render builtin:umbel:5000 --camera {lens} {size_of} --report r.json");
        place.quiet_run(&format!("{line} --aov id=plain.npy"));
        for path in general.iter().map(String::as_str).chain(["--path pencil"]) {
            place.quiet_run(&format!("{line} {path} --aov id=id.npy --aov work=work.npy"));
            assert_eq!(place.bytes("id.npy"), place.bytes("plain.npy"), "{lens} {path}");
            let (ids, work) = (place.npy("id.npy").u32(), place.npy("work.npy").f32());
            assert_eq!(work.len(), ids.len());
            let mean = |hit: bool| {
                let of_pixels = || {
                    ids.iter().zip(&work).filter(|(id, work)| (**id != NO_TRIANGLE) == hit && !work.is_nan())
                };
                of_pixels().map(|(_, work)| f64::from(*work)).sum::<f64>() / of_pixels().count() as f64
            };
            assert!(mean(true) > 1.2 * mean(false), "{lens} {path}: {} {}", mean(true), mean(false));
            let sum: f64 = work.iter().filter(|work| !work.is_nan()).map(|work| f64::from(*work)).sum();
            let tested = place.json("r.json")["stats"]["samples_tested"].as_f64().expect("a count");
            // Means of tiles are rounded.
            let allowed = if path == "--path pencil" && lens != "fisheye" { 1e-6 * tested } else { 0.0 };
            assert!((sum - tested).abs() <= allowed, "{lens} {path}: {sum} of {tested}");
        }
    }
}
