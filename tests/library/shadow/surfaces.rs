//! Shadows of surfaces on demand against those of their fine tessellation.

use common::command::Place;
use common::place;
use common::scenes::teapot_obj;

use super::FLOOR;

const LINE: &str = "--size 96x72 --eye 4.2,4.4,7.2 --target 0.2,1.3,0 --fov 36";

fn place() -> Place {
    let place = place!();
    place.put("teapot.obj", teapot_obj());
    place.put("floor.obj", FLOOR.replace("o triangle", "o triangle\n#").replace("f 5 6 7", ""));
    place
}

/// The part of two masks that differs, and how many pixels of both are in shadow and lit.
fn apart(one: &[f32], other: &[f32]) -> (f64, [usize; 2]) {
    assert_eq!(one.len(), other.len());
    let seen = one.iter().zip(other).filter(|(a, b)| !a.is_nan() && !b.is_nan());
    let (mut differ, mut both) = (0, [0; 2]);
    for (&a, &b) in seen {
        if a == b { both[usize::from(a == 1.0)] += 1 } else { differ += 1 }
    }
    (f64::from(differ) / one.len() as f64, both)
}

#[test]
fn masks_are_those_of_the_tessellation() {
    let place = place();
    for light in ["--light 6,9,4", "--light 0.5,0.75,0.25", "--sun -1,1,0.5", "--sun 0,1,0"] {
        place.quiet_run(&format!("shadow builtin:teapot {light} {LINE} --mask a.npy"));
        place.quiet_run(&format!("shadow teapot.obj {light} {LINE} --mask b.npy"));
        let (differ, both) = apart(&place.npy("a.npy").f32(), &place.npy("b.npy").f32());
        assert!(differ < 0.02 && both[0] > 100, "{light}: {differ} {both:?}");
    }
}

/// A surface that is not seen casts its shadow on triangles.
#[test]
fn occluders_cast_shadows() {
    let place = place();
    for light in ["--light 3,9,2", "--sun -1,1,0.5"] {
        let line = format!("shadow floor.obj {light} {LINE}");
        place.quiet_run(&format!("{line} --occluders builtin:teapot --mask a.npy"));
        place.quiet_run(&format!("{line} --occluders teapot.obj --mask b.npy"));
        place.quiet_run(&format!("{line} --mask c.npy"));
        let [a, b, c] = ["a.npy", "b.npy", "c.npy"].map(|name| place.npy(name).f32());
        let (differ, both) = apart(&a, &b);
        assert!(differ < 0.003 && both[0] > 300 && both[1] > 300, "{light}: {differ} {both:?}");
        assert!(!c.contains(&0.0), "{light}: nothing is in the way");
    }
}

#[test]
fn maps_are_those_of_the_tessellation() {
    let place = place();
    // The film of a sun holds the boxes of what it sees, and those of patches are larger.
    for (light, size, same) in
        [("--light 3,4,2", "--cube-size 32", true), ("--sun -1,1,0.5", "--map-size 64", false)]
    {
        for (name, line) in [
            ("a.npy", "shadow builtin:teapot"),
            ("b.npy", "shadow teapot.obj"),
            ("c.npy", "shadow floor.obj --occluders builtin:teapot"),
            ("d.npy", "shadow floor.obj --occluders teapot.obj"),
        ] {
            place.quiet_run(&format!("{line} {light} {size} -o {name}"));
        }
        for (one, other) in [("a.npy", "b.npy"), ("c.npy", "d.npy")] {
            let (a, b) = (place.npy(one).f32(), place.npy(other).f32());
            let close = |(a, b): (&f32, &f32)| a == b || (a - b).abs() < 0.01 * b.abs();
            let differ = a.iter().zip(&b).filter(|&pair| !close(pair)).count();
            let hits = a.iter().filter(|a| a.is_finite()).count();
            let as_many = b.iter().filter(|b| b.is_finite()).count();
            assert!(hits.abs_diff(as_many) * 5 < hits, "{light} {one}: {hits} {as_many}");
            assert!(hits > 300 && (differ * 25 < hits || !same), "{light} {one}: {differ} of {hits}");
        }
    }
}

#[test]
fn threads_and_instructions_change_no_byte() {
    let place = place!();
    place.put(
        "cage.obj",
        "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0.5 1 0.5\nf 1 2 3 4\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n",
    );
    for line in [
        "shadow cage.obj --subdivide --displace noise:9,2 --height 0.1 --size 64x48 --light 2,3,1 --samples 2 --mask",
        "shadow builtin:field --size 48x27 --sun -1,0.5,0.5 --mask",
        "reyes builtin:terrain --size 48x27 --sun 1,0.25,0.5 --samples 2 --jitter --seed 5 -o",
    ] {
        place.quiet_run(&format!("{line} a.png --threads 1"));
        for more in ["--threads 3", "--isa sse2"] {
            place.quiet_run(&format!("{line} b.png {more}"));
            assert!(place.bytes("a.png") == place.bytes("b.png"), "{line} {more}");
        }
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let place = place!();
    place.put("floor.obj", FLOOR);
    for (line, code, named) in [
        ("builtin:teapot --light 1,2,3 --compare", 2, "--compare"),
        ("floor.obj --occluders builtin:teapot --light 1,2,3 --compare", 2, "--compare"),
        ("builtin:teapot --light 1,2,3 --max-error 1% -o a.npy", 2, "--max-error"),
        ("builtin:teapot --light 1,2,3 --camera fisheye --mask a.npy", 2, "grid"),
        ("builtin:teapot --subdivide --light 1,2,3 --mask a.npy", 2, "--subdivide"),
        ("floor.obj --height 2 --light 1,2,3 --mask a.npy", 2, "--height"),
        ("floor.obj --displace noise:2 --light 1,2,3 --mask a.npy", 2, "--height"),
        ("floor.obj --displace none.png --height 1 --light 1,2,3 --mask a.npy", 3, "none.png"),
        ("floor.obj --occluders none.obj --light 1,2,3 --mask a.npy", 3, "none.obj"),
        ("floor.obj --subdivide --mask a.npy", 2, "--light"),
    ] {
        let run = place.run(&format!("shadow {line}"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{line}\n{}", run.stderr);
        assert!(run.stderr.contains(named), "{line}: {named}?\n{}", run.stderr);
        assert_eq!(place.names(), ["floor.obj"], "{line}");
    }
}
