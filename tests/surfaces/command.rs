//! `umbel reyes` from outside.

use common::command::{Place, Run};
use common::place;
use umbel::files::write_png_rgb8;
use umbel::glam::DVec3;

/// A cube of quads with texture coordinates.
const CUBE: &str = "\
v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
f 1/1 3/2 4/3 2/4\nf 5/1 6/2 8/3 7/4\nf 1/1 2/2 6/3 5/4\nf 3/1 7/2 8/3 4/4\nf 1/1 5/2 7/3 3/4\nf 2/1 4/2 8/3 6/4\n";

fn place() -> Place {
    let place = place!();
    place.put("cube.obj", CUBE);
    write_png_rgb8(&place.path("map.png"), 4, 4, &[128; 48]).expect("written");
    place
}

/// All that can be asked for agrees with each other.
#[test]
fn arrays_agree() {
    let place = place();
    place.quiet_run(
        "reyes builtin:teapot --size 96x64 --aov id=id.npy --aov uv=uv.npy --aov depth=d.npy --aov distance=r.npy --aov normal=n.npy --aov position=p.npy --report r.json",
    );
    let id = place.npy("id.npy").u32();
    let (depth, distance) = (place.npy("d.npy").f32(), place.npy("r.npy").f32());
    let (uv, normal, position) =
        (place.npy("uv.npy").f32(), place.npy("n.npy").f32(), place.npy("p.npy").f32());
    let eye = DVec3::new(4.2, 4.4, 7.2);
    let mut hits = 0;
    for k in 0..96 * 64 {
        let triple = |of: &[f32]| DVec3::new(of[3 * k].into(), of[3 * k + 1].into(), of[3 * k + 2].into());
        if id[k] == u32::MAX {
            assert!(depth[k] == f32::INFINITY && distance[k] == f32::INFINITY);
            assert!(uv[2 * k].is_nan() && normal[3 * k].is_nan() && position[3 * k].is_nan());
            continue;
        }
        hits += 1;
        assert!(id[k] < 32 && depth[k] <= distance[k]);
        assert!((0.0..=1.0).contains(&uv[2 * k]) && (0.0..=1.0).contains(&uv[2 * k + 1]));
        assert!((triple(&normal).length() - 1.0).abs() < 1e-5);
        assert!(((triple(&position) - eye).length() - f64::from(distance[k])).abs() < 1e-4);
    }
    assert!(hits > 1000, "{hits}");
    let report = place.json("r.json");
    assert_eq!((report["command"].as_str(), report["rays"].as_u64()), (Some("reyes"), Some(96 * 64)));
    let count = |name: &str| report["stats"][name].as_u64().expect("a count");
    assert!(count("surfaces_split") > 0 && count("surfaces_diced") > 0 && count("micropolygons") > 1000);
}

/// The hits of a flat mesh are those of its triangles.
#[test]
fn flat_meshes_are_as_render_has_them() {
    let place = place();
    place.quiet_run("render cube.obj --size 80x60 --aov depth=a.npy --aov normal=m.npy");
    place.quiet_run("reyes cube.obj --size 80x60 --aov depth=b.npy --aov normal=n.npy --aov id=id.npy");
    let (a, b) = (place.npy("a.npy").f32(), place.npy("b.npy").f32());
    let apart = |(a, b): (&f32, &f32)| if a == b { 0.0 } else { (a - b).abs() / a };
    assert!(a.iter().zip(&b).all(|pair| apart(pair) < 1e-5));
    assert!(place.npy("id.npy").u32().iter().all(|&id| id < 6 || id == u32::MAX));
}

/// The same bytes for any number of threads.
#[test]
fn threads_change_no_byte() {
    let place = place();
    for (name, line) in [
        ("a", "reyes cube.obj --subdivide --displace noise:2,5 --height 0.2"),
        ("b", "reyes cube.obj --displace map.png --height -0.2 --shading-rate 2"),
        ("c", "reyes builtin:field --samples 2"),
    ] {
        for threads in [1, 3] {
            place.quiet_run(&format!("{line} --size 64x40 --threads {threads} -o {name}{threads}.png"));
        }
        assert!(place.bytes(&format!("{name}1.png")) == place.bytes(&format!("{name}3.png")), "{line}");
    }
}

/// A map of one height moves the faces of a cube outwards by as much.
#[test]
fn maps_displace() {
    let place = place();
    let line = "reyes cube.obj --eye 0.1,0.2,5 --target 0.1,0.2,0 --size 9x9 --fov 5 --aov depth=";
    place.quiet_run(&format!("{line}flat.npy"));
    // All normals at the corners of a cube lean outwards: in the middle of a face they are its own.
    place.quiet_run(&format!("{line}high.npy --displace map.png --height 1"));
    let middle = |name: &str| place.npy(name).f32()[40];
    assert!((middle("flat.npy") - 4.0).abs() < 1e-5);
    let moved = middle("flat.npy") - middle("high.npy");
    assert!((0.4..0.51).contains(&moved), "{moved}");
}

fn refused(run: &Run, code: i32, words: &[&str], line: &str) {
    assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{line}\n{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{line}\n{word} in {}", run.stderr);
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let place = place();
    place.put("plain.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let bytes = place.bytes("map.png");
    place.put("cut.png", &bytes[..bytes.len() / 2]);
    place.put("bad.bpt", "1\n3 3\n0 0\n");
    let cases: [(i32, &[&str], &str); 17] = [
        (2, &["--height"], "reyes cube.obj --displace map.png"),
        (2, &["--displace", "ortho"], "reyes cube.obj --height 2"),
        (2, &["noise:FREQUENCY"], "reyes cube.obj --displace noise:0 --height 1"),
        (2, &["noise:FREQUENCY"], "reyes cube.obj --displace noise:1,2,99 --height 1"),
        (2, &["noise:FREQUENCY"], "reyes cube.obj --displace noise:1,2,3,4 --height 1"),
        (2, &["finite"], "reyes cube.obj --displace map.png --height inf"),
        (2, &["texture coordinates", "noise:"], "reyes plain.obj --displace map.png --height 1"),
        (2, &["--subdivide"], "reyes builtin:teapot --subdivide"),
        (2, &["bary"], "reyes cube.obj --aov bary=b.npy"),
        (2, &["grid"], "reyes cube.obj --camera fisheye"),
        (2, &["shading rate"], "reyes cube.obj --shading-rate 0"),
        (2, &["--film-height"], "reyes cube.obj --film-height 3"),
        (2, &["builtin:umbel"], "reyes builtin:kettle"),
        (3, &["cut.png", "PNG"], "reyes cube.obj --displace cut.png --height 1"),
        (3, &["none.png", "PNG"], "reyes cube.obj --displace none.png --height 1"),
        (3, &["bad.bpt:3", "three coordinates"], "reyes bad.bpt"),
        (4, &["--max-memory"], "reyes builtin:teapot --max-memory 1k"),
    ];
    let before = place.names();
    for (code, words, line) in cases {
        refused(&place.run(line), code, words, line);
    }
    assert_eq!(place.names(), before);
}

#[test]
fn shading_rates_at_their_extremes() {
    let place = place();
    for rate in ["0.05", "1000"] {
        place.quiet_run(&format!(
            "reyes builtin:teapot --size 24x16 --shading-rate {rate} --aov id={rate}.npy"
        ));
    }
    let hits = |name: &str| place.npy(name).u32().iter().filter(|&&id| id != u32::MAX).count();
    let (fine, coarse) = (hits("0.05.npy"), hits("1000.npy"));
    assert!(fine > 80 && coarse > 40, "{fine} {coarse}");
}

#[test]
fn ortho_pictures_and_cubes() {
    let place = place();
    place.quiet_run(
        "reyes cube.obj --camera ortho --height 4 --eye 0,0,5 --target 0,0,0 --size 40x40 --aov depth=d.npy",
    );
    let depth = place.npy("d.npy").f32();
    assert_eq!(depth.iter().filter(|d| d.is_finite()).count(), 400);
    place.quiet_run(
        "reyes cube.obj --camera ortho --film-height 4 --displace map.png --height 0 --eye 0,0,5 --target 0,0,0 --size 40x40 --aov depth=e.npy",
    );
    assert_eq!(place.npy("e.npy").f32(), depth);
    place.quiet_run("reyes cube.obj --subdivide --camera cube --cube-size 8 --eye 0,0,0 --aov depth=c.npy");
    let cube = place.npy("c.npy");
    assert_eq!(cube.shape, [6, 8, 8]);
    // From inside a closed surface there is no way out.
    assert!(cube.f32().iter().all(|d| d.is_finite()));
}

/// Jittered samples follow their seed, and converge to the picture that the regular ones converge to.
#[test]
fn jitter() {
    let place = place();
    let line = "reyes cube.obj --subdivide --size 40x30 --shading-rate 2";
    let picture = |more: &str| {
        place.quiet_run(&format!("{line} {more} -o a.npy"));
        place.npy("a.npy").f32()
    };
    let (one, same) = (picture("--samples 4 --jitter --seed 3"), picture("--samples 4 --jitter --seed 3"));
    assert_eq!(one, same);
    assert_ne!(one, picture("--samples 4 --jitter --seed 4"));
    assert_eq!(picture("--samples 4 --jitter"), picture("--samples 4 --jitter --seed 0"));
    let reference = picture("--samples 256");
    let error = |picture: &[f32]| {
        let squares = picture.iter().zip(&reference).map(|(a, b)| f64::from(a - b) * f64::from(a - b));
        (squares.sum::<f64>() / reference.len() as f64).sqrt()
    };
    let errors = [1, 4, 16, 64].map(|n| error(&picture(&format!("--samples {n} --jitter --seed 1"))));
    assert!(errors.windows(2).all(|pair| pair[1] < 0.8 * pair[0]), "{errors:?}");
    assert!(errors[3] < 0.01, "{errors:?}");
    refused(&place.run(&format!("{line} --seed 3")), 2, &["--jitter"], "a seed alone");
}

/// A cage with creases for ever on all its edges is its own surface.
#[test]
fn creases_of_an_obj() {
    let place = place();
    let edges =
        [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];
    let tags: String = edges.iter().map(|[a, b]| format!("t crease 2/1/0 {a} {b} 10\n")).collect();
    place.put("sharp.obj", format!("{CUBE}{tags}t interpolateboundary 1/0/0 2\n"));
    place.put("corners.obj", format!("{CUBE}t corner 8/1/0 0 1 2 3 4 5 6 7 10\n"));
    let depth = |line: &str| {
        place.quiet_run(&format!("reyes {line} --size 60x45 --aov depth=d.npy"));
        place.npy("d.npy").f32()
    };
    let (flat, sharp) = (depth("cube.obj"), depth("sharp.obj --subdivide --eye 4,3,5"));
    assert!(depth("cube.obj --eye 4,3,5").iter().zip(&sharp).all(|(a, b)| a == b || (a - b).abs() < 1e-5));
    assert_eq!(flat.len(), sharp.len());
    // The corners stay where they are, and the edges are round.
    let round = depth("cube.obj --subdivide --eye 4,3,5");
    let cornered = depth("corners.obj --subdivide --eye 4,3,5");
    let hits = |depth: &[f32]| depth.iter().filter(|d| d.is_finite()).count();
    assert!(hits(&round) < hits(&cornered) && hits(&cornered) < hits(&sharp));
    for (tag, named) in [
        ("t crease 2/1/0 0 8 2", "no vertex 8"),
        ("t crease 2/1/0 0 1 -2", "sharpness -2"),
        ("t crease 2/1/0 0 1", "t crease 2/1/0 4 7 2.5"),
        ("t crease", "t crease 2/1/0 4 7 2.5"),
        ("t corner 1/1/0 x 2", "vertices counted from 0"),
    ] {
        place.put("bad.obj", format!("{CUBE}{tag}\n"));
        refused(&place.run("reyes bad.obj --subdivide"), 3, &["bad.obj:19", named], tag);
    }
}

/// The pairs of each ray are those of the counters, by either path, and more where there is a surface.
#[test]
fn work_is_where_the_surface_is() {
    let place = place();
    for path in ["pencil", "general"] {
        let line = "reyes builtin:teapot --size 320x240 --aov id=id.npy --aov work=work.npy --report r.json";
        place.quiet_run(&format!("{line} --path {path}"));
        let (ids, work) = (place.npy("id.npy").u32(), place.npy("work.npy").f32());
        let mean = |hit: bool| {
            let of_pixels = || ids.iter().zip(&work).filter(|(id, _)| (**id != u32::MAX) == hit);
            of_pixels().map(|(_, work)| f64::from(*work)).sum::<f64>() / of_pixels().count() as f64
        };
        assert!(mean(true) > 1.5 * mean(false), "{path}: {} {}", mean(true), mean(false));
        let sum: f64 = work.iter().map(|work| f64::from(*work)).sum();
        let tested = place.json("r.json")["stats"]["samples_tested"].as_f64().expect("a count");
        assert!((sum - tested).abs() <= 1e-6 * tested, "{path}: {sum} of {tested}");
    }
}
