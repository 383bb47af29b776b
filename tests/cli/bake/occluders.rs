//! What occludes: backs of triangles, a ground plane, further scenes.

use common::command::Place;
use common::place;
use common::scenes::teapot_obj;

use super::{CEILING, CUBE, FLOOR, npy_points};

const SIDES: [[f32; 6]; 3] = [
    // The middle of the cube's right side, of its top, and of its bottom.
    [1.0, 0.0, 0.1, 1.0, 0.0, 0.0],
    [0.1, 1.0, 0.2, 0.0, 1.0, 0.0],
    [0.1, -1.0, 0.2, 0.0, -1.0, 0.0],
];

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("ceiling.obj", CEILING);
    place.put("cube.obj", CUBE);
    place.put("points.npy", npy_points(&SIDES));
    place.put("below.npy", npy_points(&[[0.5, 0.0, 0.25, 0.0, 1.0, 0.0]]));
    place
}

fn bake(place: &Place, line: &str) -> Vec<f32> {
    place.quiet_run(&format!("bake {line} -o a.npy"));
    place.npy("a.npy").f32()
}

#[test]
fn backs_of_triangles() {
    let place = place();
    let below = |more: &str| bake(&place, &format!("ceiling.obj --points below.npy --rays 200 {more}"))[0];
    assert!(below("") < 1e-3);
    assert_eq!(below("--ignore-back-faces"), 1.0);
    assert_eq!(below("--two-sided"), below(""));
    // The later one counts.
    assert_eq!(below("--two-sided --ignore-back-faces"), 1.0);
    assert!(below("--ignore-back-faces --two-sided") < 1e-3);
    // From above, where its front is, it occludes all the same.
    place.put("above.npy", npy_points(&[[0.5, 2.0, 0.25, 0.0, -1.0, 0.0]]));
    assert!(bake(&place, "ceiling.obj --points above.npy --ignore-back-faces")[0] < 1e-3);
}

/// A cube on the ground: its sides see half, its bottom nothing, its top all.
#[test]
fn a_ground_plane() {
    let place = place();
    let bake = |more: &str| bake(&place, &format!("cube.obj --points points.npy --rays 4000 {more}"));
    assert_eq!(bake(""), [1.0; 3]);
    let [side, top, bottom] = bake("--ground-plane")[..] else { panic!("three values") };
    assert!((side - 0.5).abs() < 0.005, "{side}");
    assert_eq!([top, bottom], [1.0, 0.0]);
    // The ground's front is up.
    let fronts = bake("--ground-plane --ignore-back-faces");
    assert!((fronts[0] - 0.5).abs() < 0.005 && fronts[1..] == [1.0, 0.0], "{fronts:?}");
    // Up is the other way, of any length: the top stands on the ground.
    let [side, top, bottom] = bake("--ground-plane --up 0,-1e-30,0")[..] else { panic!("three values") };
    assert!((side - 0.5).abs() < 0.005, "{side}");
    assert_eq!([top, bottom], [0.0, 1.0]);
    // Standing on an edge: nothing reaches through the ground.
    let slanted = bake("--ground-plane --up 1,1,0");
    assert!((slanted[1] - 0.854).abs() < 0.01, "(1 + cos 45°)/2: {slanted:?}");
    assert!((slanted[2] - 0.146).abs() < 0.01, "(1 − cos 45°)/2: {slanted:?}");
}

/// The normals of a cube's vertices are its diagonals. Of the half space above one the ground hides what points down: upper
/// corners see (1 + 1/√3)/2 of it, lower ones (1 − 1/√3)/2; that some faces lie in the ground changes nothing.
#[test]
fn vertices_on_the_ground() {
    let place = place();
    let values = bake(&place, "cube.obj --vertices --ground-plane --rays 4000");
    for (k, value) in values.iter().enumerate() {
        let is_low = [0, 1, 4, 5].contains(&k);
        let expected = if is_low { 0.211_32 } else { 0.788_68 };
        assert!((value - expected).abs() < 0.01, "{k}: {value}");
    }
}

/// Further scenes occlude and have no values; the result is that of one scene with all triangles.
#[test]
fn further_scenes() {
    let place = place();
    let alone = bake(&place, "floor.obj --vertices");
    assert_eq!(alone, [1.0; 5]);
    let beneath = bake(&place, "floor.obj --vertices --occluders ceiling.obj");
    assert_eq!(beneath.len(), 5);
    assert!(beneath.iter().all(|&value| value < 0.01), "{beneath:?}");
    let far = bake(&place, "floor.obj --vertices --occluders ceiling.obj --max-distance 0.5");
    assert_eq!(far, [1.0; 5]);
    let moved = CUBE.replace("v -1 ", "v 3 ").replace("v 1 ", "v 5 ");
    place.put("moved.obj", &moved);
    let two =
        bake(&place, "floor.obj --vertices --occluders ceiling.obj --occluders moved.obj --set independent");
    let count = |text: &str| text.lines().filter(|line| line.starts_with("v ")).count();
    let shifted = |text: &str, first: usize| -> String {
        let line = |line: &str| match line.strip_prefix("f ") {
            Some(corners) => {
                let corner = |corner: &str| (corner.parse::<usize>().expect("an index") + first).to_string();
                format!("f {}\n", corners.split(' ').map(corner).collect::<Vec<_>>().join(" "))
            }
            None => format!("{line}\n"),
        };
        text.lines().map(line).collect()
    };
    let first = count(FLOOR);
    let all = [FLOOR, &shifted(CEILING, first), &shifted(&moved, first + count(CEILING))].concat();
    place.put("all.obj", all);
    assert_eq!(two, bake(&place, "all.obj --vertices --set independent")[..5]);
    place.quiet_run("bake floor.obj --vertices --occluders builtin:cornell -o a.npy");
}

/// Surfaces on demand occlude as their fine tessellation does, for any way to share directions.
#[test]
fn surfaces_on_demand() {
    let place = place();
    place.put("teapot.obj", teapot_obj());
    let mut grid = String::new();
    for k in 0..81 {
        grid += &format!("v {} -0.01 {}\n", k % 9 - 4, k / 9 - 4);
    }
    for k in (1..72).filter(|k| k % 9 != 0) {
        grid += &format!("f {} {} {} {}\n", k, k + 9, k + 10, k + 1);
    }
    place.put("grid.obj", grid);
    for more in ["", "--max-distance 1.5", "--set interleaved", "--set independent", "--ignore-back-faces"] {
        let line = format!("grid.obj --vertices --rays 96 {more} --occluders");
        let (got, expected) =
            (bake(&place, &format!("{line} builtin:teapot")), bake(&place, &format!("{line} teapot.obj")));
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        assert!(mean(&expected) < 0.98, "{more}: {}", mean(&expected));
        assert!((mean(&got) - mean(&expected)).abs() < 0.002, "{more}");
        for (k, (got, expected)) in got.iter().zip(&expected).enumerate() {
            assert!((got - expected).abs() < 0.04, "{more} {k}: {got} for {expected}");
        }
    }
    let line = "bake grid.obj --vertices --rays 64 --occluders teapot.obj --displace noise:3 --height 0.1";
    place.quiet_run(&format!("{line} -o 1.npy --threads 1"));
    // How receivers are cut into pieces changes nothing.
    for more in ["--threads 3", "--isa sse2", "--path general"] {
        place.quiet_run(&format!("{line} -o 2.npy {more}"));
        assert!(place.bytes("1.npy") == place.bytes("2.npy"), "{more}");
    }
    for (line, named) in [
        ("--displace noise:3 --height 1", "--occluders"),
        ("--occluders cube.obj --displace noise:3", "--height"),
        ("--occluders builtin:teapot --max-error 1%", "--max-error"),
        ("--occluders builtin:kettle", "builtin:kettle"),
    ] {
        let run = place.run(&format!("bake grid.obj --vertices {line} -o no.npy"));
        assert_eq!(run.code, Some(2), "{line}: {}", run.stderr);
        assert!(run.stderr.contains(named), "{line}: {}", run.stderr);
    }
}
