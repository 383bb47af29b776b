//! Scenes far from the origin keep their shape, and everything is given back where the file has it.

use common::place;
use serde_json::Value;

use super::{assert_warned, read};

const MIDDLE: [f64; 3] = [532811.25, 4649776.5, 112.0];

/// A ball of radius 1/2 around a point, with decimals as exporters write them.
fn ball(middle: [f64; 3]) -> String {
    let (rings, columns) = (12, 24);
    let mut text = String::new();
    let mut put = |u: f64, r: f64| {
        let at = [u.sin() * r.cos(), u.sin() * r.sin(), u.cos()];
        let [x, y, z] = std::array::from_fn(|k| middle[k] + at[k] / 2.0);
        text += &format!("v {x:.4} {y:.4} {z:.4}\n");
    };
    put(0.0, 0.0);
    for ring in 1..rings {
        for column in 0..columns {
            let turn = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            put(std::f64::consts::PI * f64::from(ring) / f64::from(rings), turn);
        }
    }
    put(std::f64::consts::PI, 0.0);
    let at = |ring: i32, column: i32| 2 + (ring - 1) * columns + column % columns;
    let last = 2 + (rings - 1) * columns;
    for c in 0..columns {
        text += &format!("f 1 {} {}\nf {} {} {last}\n", at(1, c), at(1, c + 1), at(11, c + 1), at(11, c));
        for r in 1..rings - 1 {
            text += &format!("f {} {} {} {}\n", at(r, c), at(r + 1, c), at(r + 1, c + 1), at(r, c + 1));
        }
    }
    text
}

#[test]
fn a_ball_at_the_coordinates_of_a_map_keeps_its_shape() {
    let (near, far) = (read(ball([0.0; 3])), read(ball(MIDDLE)));
    assert_eq!(near.offset.to_array(), [0.0; 3]);
    assert_eq!(near.warnings, [""; 0]);
    assert!(far.triangles == near.triangles, "polygons are cut otherwise");
    assert_warned(&far, &["far from the origin"]);
    assert!(!far.warnings.iter().any(|warning| warning.contains("lose their shape")));
    let offset = far.offset;
    for (near, far) in near.positions.iter().zip(&far.positions) {
        for k in 0..3 {
            let place = f64::from(far[k]) + offset.to_array()[k] - MIDDLE[k];
            assert!((place - f64::from(near[k])).abs() < 1e-4, "{near:?} {far:?}");
        }
    }
}

#[test]
fn what_f32_holds_stays_to_the_bit() {
    // Far away, but exact.
    let scene = read("v 8000000 0 0\nv 8000001 0 0\nv 8000000 1 0\nf 1 2 3\n");
    assert_eq!((scene.offset.x, scene.positions[1][0]), (0.0, 8000001.0));
    assert_eq!(scene.warnings, [""; 0]);
    // Not far away.
    let scene = read("v 10.1 0 0\nv 13.1 0 0\nv 10.1 1.7 0\nf 1 2 3\n");
    assert_eq!((scene.offset.x, scene.positions[1][0]), (0.0, 13.1));
}

#[test]
fn what_no_offset_can_keep_is_counted() {
    let small = ball(MIDDLE);
    let large = "v 0 0 0\nv 1e7 0 0\nv 0 1e7 0\nf -1 -2 -3\n";
    let scene = read(format!("{small}{large}"));
    let warning = scene.warnings.iter().find(|warning| warning.contains("lose their shape")).unwrap();
    let count: u32 = warning.split_once(": ").unwrap().1.split_once(',').unwrap().0.parse().unwrap();
    assert!((100..=528).contains(&count), "{warning}");
    assert!(warning.contains("longest edge"));
    // Small triangles near the origin are no news, nor are ones that the file has without area.
    assert!(
        read("v 0.1 0 0\nv 1.1 0 0\nv 0.1 1.3 0\nv 0.1 0 0\nv 0.1 0 0\nf 1 2 3\nf 1 4 5\n")
            .warnings
            .is_empty()
    );
}

#[test]
fn options_and_outputs_are_in_the_frame_of_the_file() {
    let place = place!();
    place.put("far.obj", ball(MIDDLE));
    place.put("near.obj", ball([0.0; 3]));
    let value: Value = serde_json::from_str(&place.run("info far.obj --json").stdout).expect("JSON");
    let bound = |end: &str, k: usize| value["bounds"][end][k].as_f64().unwrap() - MIDDLE[k];
    for k in 0..3 {
        assert!((bound("lo", k) + 0.5).abs() < 1e-3 && (bound("hi", k) - 0.5).abs() < 1e-3, "{value}");
    }
    assert_eq!(value["degenerate"], 0);
    // A little beside the axis: pixels on its diagonals would lie on edges.
    let view = |[x, y, z]: [f64; 3]| {
        let (x, y) = (x + 0.013, y + 0.007);
        format!("--eye {x},{y},{} --target {x},{y},{z} --up 0,1,0 --size 32x32", z + 3.0)
    };
    for (name, middle) in [("far", MIDDLE), ("near", [0.0; 3])] {
        let view = view(middle);
        let files =
            format!("--aov id={name}-id.npy --aov position={name}-p.npy --report {name}.json -o {name}.ply");
        assert_eq!(place.run(&format!("render {name}.obj {view} {files}")).code, Some(0));
        let light = format!("{},{},{}", middle[0] + 5.0, middle[1], middle[2]);
        let shadow = format!("shadow {name}.obj --light {light} {view} --mask {name}-mask.npy");
        assert_eq!(place.run(&shadow).code, Some(0));
        let probe = format!("probe {name}.obj --center {},{},{}", middle[0], middle[1], middle[2]);
        let run = place.run(&format!("{probe} --size 32x16 --aov distance={name}-d.npy"));
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        let bake = format!("bake {name}.obj --vertices --rays 64 -o {name}-open.npy");
        assert_eq!(place.run(&bake).code, Some(0));
    }
    let (far, near) = (place.npy("far-id.npy").u32(), place.npy("near-id.npy").u32());
    // A pixel's centre may lie on an edge, up to rounding.
    let other = far.iter().zip(&near).filter(|(far, near)| far != near).count();
    assert!(other <= 8 && near.iter().any(|id| *id < 528), "{other} pixels differ");
    let lit = |name: &str| place.npy(&format!("{name}-mask.npy")).f32().iter().filter(|x| **x == 1.0).count();
    assert!(lit("near") > 20 && lit("near").abs_diff(lit("far")) <= 4, "{} {}", lit("near"), lit("far"));
    assert!(place.npy("far-d.npy").f32().iter().all(|distance| (0.45..0.51).contains(distance)));
    assert!(place.npy("far-open.npy").f32().iter().all(|open| *open > 0.9));
    let positions = place.npy("far-p.npy").f32();
    let seen = positions.chunks(3).find(|p| p[0].is_finite()).unwrap();
    assert!((0..3).all(|k| (f64::from(seen[k]) - MIDDLE[k]).abs() < 1.0), "{seen:?}");
    let report = place.json("far.json");
    assert!((report["scene"]["offset"][1].as_f64().unwrap() - MIDDLE[1]).abs() < 1.0);
}
