//! What `shadow` refuses: with exit code 2 (or 4, 1), with a message that names the culprit, and with nothing written.

use common::place;

use super::FLOOR;

/// Runs a line that must fail, and checks that it said why and left nothing.
fn refuse(line: &str, code: i32, named: &str) {
    let place = place!();
    place.put("floor.obj", FLOOR);
    let run = place.run(line);
    assert_eq!(run.code, Some(code), "umbel {line}\n{}", run.stderr);
    assert_eq!(run.stdout, "", "umbel {line}");
    assert!(run.stderr.starts_with("error: "), "umbel {line}\n{}", run.stderr);
    assert!(run.stderr.contains(named), "umbel {line}: {named}?\n{}", run.stderr);
    assert_eq!(place.names(), ["floor.obj"], "umbel {line}");
}

#[test]
fn lights_that_are_none() {
    for (light, named) in [
        ("", "--light"),
        ("--light 1,2", "--light"),
        ("--light 1,2,nan", "--light"),
        ("--light 1,inf,3", "--light"),
        ("--light 1e999,0,0", "--light"),
        ("--light 1e39,0,0", "--light 1000000000000000"),
        ("--sun 0,0,0", "--sun 0,0,0"),
        ("--sun 0,nan,0", "--sun"),
        ("--sun 1,2", "--sun"),
        ("--sun 1e-99,0,0", "--sun"),
        ("--sun 1e99,0,0", "--sun"),
        ("--light 1,2,3 --sun 0,1,0", "--sun"),
    ] {
        refuse(&format!("shadow floor.obj {light} -o a.npy"), 2, named);
        // Masks take lights of both kinds, and so do pictures.
        if light.contains("3 --sun") {
            continue;
        }
        refuse(&format!("shadow floor.obj {light} --mask a.npy"), 2, named);
        if !light.is_empty() {
            refuse(&format!("render floor.obj {light} -o a.png"), 2, named);
        }
    }
    refuse("render floor.obj --light 1,2,3 --aov id=a.npy", 2, "-o FILE");
    refuse("render floor.obj --sun 1,2,3 --aov id=a.npy", 2, "-o FILE");
    refuse("render floor.obj --sun 1,2,3 -o a.ply", 2, "-o FILE.png");
}

#[test]
fn outputs_that_cannot_be_meant() {
    for (line, named) in [
        ("--light 1,2,3", "--mask"),
        ("--light 1,2,3", "-o FILE"),
        ("--light 1,2,3 -o a.jpg", "a.jpg"),
        ("--light 1,2,3 -o a", ".ktx2"),
        ("--light 1,2,3 --mask a.exr", "a.exr"),
        ("--light 1,2,3 --mask a.ktx2", "--mask"),
        ("--sun 1,2,3 -o a.ktx2", "a.ktx2"),
        ("--light 1,2,3 -o a.npy --mask a.npy", "a.npy"),
        ("--light 1,2,3 --light 4,5,6 -o a.exr", "{light}"),
        ("--light 1,2,3 --light 4,5,6 -o a.ktx2", "2 lights"),
        ("--light 1,2,3 --light 4,5,6 --mask a.png", "{light}"),
        ("--sun 1,2,3 --sun 4,5,6 -o a.png", "{light}"),
        ("--light 1,2,3 --light 4,5,6 -o {light}.npy --mask 1.npy", "1.npy"),
    ] {
        refuse(&format!("shadow floor.obj {line}"), 2, named);
    }
    // Nothing is written before all that can be refused has been looked at.
    refuse("shadow floor.obj --light 1,2,3 -o a.npy --mask b.npy --fov 0", 2, "--fov");
    refuse("shadow floor.obj --light 1,2,3 -o a.npy --mask b.npy --eye 1,1,1 --target 1,1,1", 2, "--eye");
    refuse("shadow floor.obj --light 1,2,3 -o nowhere/a.npy", 1, "nowhere");
}

#[test]
fn options_that_would_be_ignored() {
    for (line, named) in [
        ("--light 1,2,3 -o a.npy --size 10x10", "camera"),
        ("--light 1,2,3 -o a.npy --eye 1,2,3", "--mask"),
        ("--light 1,2,3 -o a.npy --camera cube", "--mask"),
        ("--light 1,2,3 -o a.npy --samples 4", "--samples"),
        ("--light 1,2,3 --mask a.npy --cube-size 4", "--cube-size"),
        ("--light 1,2,3 --mask a.npy --map-size 4", "--map-size"),
        ("--light 1,2,3 -o a.npy --map-size 4", "--cube-size"),
        ("--sun 1,2,3 -o a.npy --cube-size 4", "--map-size"),
        ("--sun 1,2,3 --compare", "--light"),
        ("--light 1,2,3 --mask a.npy --camera ortho --fov 4", "--fov"),
    ] {
        refuse(&format!("shadow floor.obj {line}"), 2, named);
    }
}

#[test]
fn numbers_out_of_range() {
    for (line, named) in [
        ("-o a.npy --cube-size 0", "--cube-size"),
        ("-o a.npy --cube-size 40000", "--cube-size"),
        ("--mask a.npy --samples 0", "--samples"),
        ("--mask a.npy --size 0x4", "--size"),
        ("--compare=0", "--compare"),
        ("--compare=4,x", "--compare"),
        ("--compare=4,,8", "--compare"),
    ] {
        refuse(&format!("shadow floor.obj --light 1,2,3 {line}"), 2, named);
    }
    refuse("shadow floor.obj --sun 1,2,3 -o a.npy --map-size 0", 2, "--map-size");
}

#[test]
fn limits_stop_before_the_start() {
    refuse("shadow floor.obj --light 1,2,3 -o a.npy --max-memory 1M", 4, "--cube-size");
    refuse("shadow floor.obj --light 1,2,3 --mask a.npy --max-memory 1M", 4, "--size");
    refuse("shadow floor.obj --sun 1,2,3 -o a.npy --max-memory 1M", 4, "--map-size");
    refuse("shadow floor.obj --light 1,2,3 -o a.npy --cube-size 32768 --max-memory 8G", 4, "--max-memory");
    // A picture takes more than its scene.
    refuse("render floor.obj --light 1,2,3 -o a.png --size 1000x1000 --max-memory 20M", 4, "--size");
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.quiet_run("render floor.obj -o a.png --size 120x120 --max-memory 16M");
}
