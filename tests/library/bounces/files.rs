//! Mirrors and glass in files and on the command line.

use common::command::Place;
use common::place;
use umbel::scene::Optics;
use umbel::{LoadOptions, load};

/// A level square, and one above it.
const SCENE: &str = "\
mtllib a.mtl
v -2 0 2
v 2 0 2
v 2 0 -2
v -2 0 -2
v -1 1 1
v 1 1 1
v 1 1 -1
o floor
usemtl steel
f 1 2 3 4
o sheet
usemtl clay
f 5 6 7
";

const LIBRARY: &str = "newmtl clay\nKd 0.8 0.4 0.2\nnewmtl steel\nKd 0.1\nKs 0.5 0.6 0.7\nillum 3\n";

const CAMERA: &str = "--size 32x24 --eye 3,2.5,3 --target 0,0.3,0 --light 1,5,1";

fn place() -> Place {
    let place = place!();
    place.put("a.obj", SCENE);
    place.put("a.mtl", LIBRARY);
    place
}

/// The optics of a material whose library says this of it.
fn optics(lines: &str) -> Optics {
    let place = place!();
    place.put("a.obj", SCENE.replace("usemtl clay\n", ""));
    place.put("a.mtl", format!("newmtl steel\n{lines}"));
    let scene = load(place.path("a.obj"), LoadOptions::default()).expect("a scene");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene.materials[0].optics
}

#[test]
fn material_libraries_tell_optics() {
    let mirror = [0.5, 0.25, 0.125];
    let passes = [0.5, 0.75, 1.0];
    for (lines, expected) in [
        ("Ks 0.5 0.25 0.125", Optics::OPAQUE),
        ("Ks 0.5 0.25 0.125\nillum 2\nNi 1.5\nTf 1 1 1\nd 1", Optics::OPAQUE),
        ("Ks 0.5 0.25 0.125\nillum 3\nNi 1.5", Optics { mirror, ..Optics::OPAQUE }),
        ("Ks 0.5 0.25 0.125\nillum 5", Optics { mirror, ..Optics::OPAQUE }),
        ("illum 7\nNi 1.25", Optics::glass(1.25)),
        ("illum 6\nNi 1.25\nTf 0.5 0.75 1", Optics { transmission: passes, ..Optics::glass(1.25) }),
        ("illum 6\nd 0.25\nNi 1.25", Optics { transmission: [0.75; 3], ..Optics::glass(1.25) }),
        ("illum 6\nTr 0.25\nNi 1.25", Optics { transmission: [0.25; 3], ..Optics::glass(1.25) }),
        ("illum 4\nTf 0.5\nNi 1.25", Optics { transmission: [0.5; 3], ..Optics::OPAQUE }),
        ("illum 4\nKs 0.5 0.25 0.125\nd 1", Optics { mirror, ..Optics::OPAQUE }),
        ("d 0.75", Optics { transmission: [0.25; 3], ..Optics::OPAQUE }),
    ] {
        assert_eq!(optics(lines), expected, "{lines}");
    }
}

#[test]
fn odd_optics_are_warnings() {
    let place = place();
    for line in ["Ni 0", "Ni -1", "Ni x", "d -halo 0.5", "illum 1000", "Tf spectral a.rfl", "Ks 1 2"] {
        place.put("a.mtl", format!("newmtl steel\nKs 0.5\nillum 3\n{line}\nnewmtl clay\n"));
        let scene = load(place.path("a.obj"), LoadOptions::default()).expect("a scene");
        assert_eq!(scene.warnings.len(), 1, "{line}: {:?}", scene.warnings);
        assert!(scene.warnings[0].contains(line), "{line}: {:?}", scene.warnings);
        assert_eq!(scene.materials[0].optics, Optics { mirror: [0.5; 3], ..Optics::OPAQUE }, "{line}");
    }
}

#[test]
fn gltf_materials_tell_optics() {
    let optics = |material: &str| {
        let place = place!();
        place.put("a.gltf", format!(r#"{{"asset":{{"version":"2.0"}},"materials":[{material}]}}"#));
        let scene = load(place.path("a.gltf"), LoadOptions::default()).expect("a scene");
        scene.materials[0].optics
    };
    let base = r#""baseColorFactor":[0.5,0.25,1,1]"#;
    let extended = |more: &str| {
        format!(
            r#"{{"pbrMetallicRoughness":{{{base}}},"extensions":{{"KHR_materials_transmission":{{"transmissionFactor":0.5}}{more}}}}}"#
        )
    };
    assert_eq!(optics("{}"), Optics::OPAQUE);
    assert_eq!(optics(&format!(r#"{{"pbrMetallicRoughness":{{{base}}}}}"#)), Optics::OPAQUE);
    let metal = format!(r#"{{"pbrMetallicRoughness":{{{base},"roughnessFactor":0.1}}}}"#);
    assert_eq!(optics(&metal), Optics { mirror: [0.5, 0.25, 1.0], ..Optics::OPAQUE });
    let passes = [0.25, 0.125, 0.5];
    let thick = r#","KHR_materials_volume":{"thicknessFactor":1},"KHR_materials_ior":{"ior":1.25}"#;
    assert_eq!(optics(&extended(thick)), Optics { transmission: passes, ..Optics::glass(1.25) });
    let thin = optics(&extended(""));
    assert_eq!((thin.transmission, thin.ior), (passes, 1.0));
    assert!((thin.mirror[0] - 0.04).abs() < 1e-6);
}

#[test]
fn the_file_or_the_command_line_makes_mirrors() {
    let place = place();
    let render = |options: &str| {
        place.quiet_run(&format!("render a.obj {CAMERA} {options} -o a.npy --report a.json"));
        (place.npy("a.npy").f32(), place.json("a.json")["bounces"].clone())
    };
    let (plain, none) = render("");
    assert!(none.is_null());
    let (mirrored, rays) = render("--reflect");
    assert!(mirrored != plain && rays[0].as_u64() > Some(100), "{rays}");
    // The library's mirror is not silver.
    assert_ne!(render("--mirror floor").0, mirrored);
    assert_eq!(render("--mirror floor"), render("--mirror steel"));
    assert_eq!(render("--mirror floor --mirror sheet"), render("--mirror all"));
    assert_eq!(render("--mirror all --bounces 0").0, plain);
    assert!(render("--mirror all --bounces 3").1.as_array().expect("counts").len() <= 3);
    assert_eq!(render("--glass sheet --bounces 2"), render("--glass sheet=1.5 --bounces 2 --threads 1"));
    assert_ne!(render("--glass sheet=1.2").0, render("--glass sheet").0);
    assert_ne!(render("--reflect --samples 3").0, mirrored);
}

#[test]
fn other_lenses_have_mirrors() {
    let place = place();
    let aimed = "--target 0,0,0 --up 0,0,1 --size 24x16";
    for (lens, view) in [("ortho", aimed), ("equirect", aimed), ("fisheye", aimed), ("cube", "--cube-size 8")]
    {
        let render = |options: &str| {
            place.quiet_run(&format!(
                "render a.obj --eye 0.3,3,0.2 --camera {lens} {view} {options} -o a.npy"
            ));
            place.npy("a.npy").f32()
        };
        let (plain, mirrored) = (render(""), render("--reflect"));
        let changed = plain.chunks(3).zip(mirrored.chunks(3)).filter(|(one, other)| one != other).count();
        assert!(changed > 0 && changed < plain.len() / 3, "{lens}: {changed}");
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    for (line, code, named) in [
        ("--mirror nothing -o a.png", 2, "clay, floor, sheet, steel, and all"),
        ("--glass nothing -o a.png", 2, "--glass nothing"),
        ("--glass sheet=0 -o a.png", 2, "--glass"),
        ("--glass sheet=x -o a.png", 2, "refractive index"),
        ("--bounces 3 -o a.png", 2, "--reflect"),
        ("--reflect --bounces 65 -o a.png", 2, "64"),
        ("--reflect --bounces=-1 -o a.png", 2, "--bounces"),
        ("--reflect -o a.ply", 2, "-o FILE.png"),
        ("--mirror all --aov id=a.npy", 2, "-o FILE.png"),
        ("--reflect --size 1280x960 -o a.png --max-memory 40M", 4, "--size"),
    ] {
        let place = place();
        let run = place.run(&format!("render a.obj {line}"));
        assert_eq!(run.code, Some(code), "{line}\n{}", run.stderr);
        assert!(run.stderr.contains(named) && run.stdout.is_empty(), "{line}\n{}", run.stderr);
        assert_eq!(place.names(), ["a.mtl", "a.obj"], "{line}");
    }
    let place = place();
    place.quiet_run("render a.obj --size 1280x960 --max-memory 50M -o a.png");
    let run = place.run("render a.obj --size 8x8 --refract -o a.png");
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), ""));
    assert!(run.stderr.contains("--glass NAME"), "{}", run.stderr);
}
